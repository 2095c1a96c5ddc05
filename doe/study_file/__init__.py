"""STUDY.toml, tables of runs and tables of scenes, checked before anything runs.

- ``study``: the whole file, and the study of a table alone; ``sections``: its tables; ``duty``: its points of operation
- ``table``: runs made elsewhere, in tables; ``scene_table``: scenes to be run, a row each
"""

from doe.study_file.study import Study, StudyFile
