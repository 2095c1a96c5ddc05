"""Where points run and how they are kept; knows no bearing.

``store`` (finished runs and failures), ``lock`` (one process at a time, which study runs where), ``runner`` (threads, the stages of a
command and what is left of them costs), ``cluster`` (dask), ``keeper`` (the stages of a live process).
"""
