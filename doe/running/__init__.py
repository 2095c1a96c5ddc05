"""Where points run and how they are kept; knows no bearing.

``store`` (on ``database``), ``owner`` (who has claimed a point), ``runner`` (threads), ``cluster`` (dask), ``failure``.
"""
