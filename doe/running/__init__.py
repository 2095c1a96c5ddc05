"""Runs and their store; knows no bearing.

- ``store``: finished runs and failures on disk, the lock of a store, and which study runs where
- ``runner``: points on an engine, threads or a dask cluster, the agenda of a command with its stages, and the time of its
  runs; parts of a table or a study that jobs of a queue run, each into a store of its own, and their gathering
"""
