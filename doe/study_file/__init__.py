"""STUDY.toml: ``study`` is the whole file, each ``*_section`` a table of it. Checked before anything runs.

``table`` reads runs made elsewhere; ``of_table`` makes a study of such a table alone.
"""

from doe.study_file.study import Study, StudyFile
