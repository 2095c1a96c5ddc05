"""STUDY.toml: ``study`` is the whole file, ``sections`` its tables. Checked before anything runs.

``table`` reads runs made elsewhere.
"""

from doe.study_file.study import Study, StudyFile
