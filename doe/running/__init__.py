"""Where points run and how they are kept; knows no bearing.

``store`` (on ``database``), ``lock`` (one process at a time, which study runs where), ``runner`` (threads),
``cluster`` (dask), ``failure``, ``agenda`` (the stages of a command), ``outlook`` (what is left of them costs), ``keeper`` (the
agenda of a live process).
"""
