"""Where points run and how they are kept; knows no bearing.

``store`` (on ``database``), ``lock`` (one process at a time, which study runs where), ``runner``,
``cluster`` (dask), ``failure``, ``agenda`` (the stages of a command that are left).
"""
