"""STUDY.toml and tables of runs, checked before anything runs.

- ``study``: the whole file, and the study of a table alone; ``sections``: its tables, points of operation among them
- ``table``: runs made elsewhere, in tables
"""

from doe.study_file.study import Study, StudyFile
