"""STUDY.toml: ``study`` is the whole file, each ``*_section`` a table of it. Checked before anything runs."""

from doe.study_file.study import Study, StudyFile
