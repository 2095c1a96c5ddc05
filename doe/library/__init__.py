"""The functions of ``doe`` for Python, which its commands call, and the answers that they return.

- ``answer``: what an answer shows, tabulates and saves; ``effort``: threads, cluster, progress and the folder of runs
- ``steps``: design, fit, front and chain alone; ``unknown``: uncertainty and calibrate; ``whole``: the study; ``scene_runs``: a table of scenes
"""
