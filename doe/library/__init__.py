"""The functions of ``doe`` for Python, which its commands call, and the answers that they return.

- ``answer``: arguments and folders of the functions; what an answer shows, tabulates and saves
- ``steps``: design, fit, front and chain alone; ``studies``: study, uncertainty and calibrate; ``scene_runs``: a table of scenes
"""
