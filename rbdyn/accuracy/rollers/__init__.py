"""Studies of roller bearings in time.

- ``work_precision``: ``tolerances``, the bias of the statistics at each tolerance, and ``trajectory``, the error of the
  motion over part of a turn
- ``comparison``: our method beside others on one right-hand side; ``method_bias``: their statistics
- ``slicing``, ``replication``, ``coverage``: slices, replicates, and how often stated intervals hold the truth
- ``option_cost``, ``stability``, ``scaling``: what options cost, how extremes end, time and memory by size
- beneath: ``right_hand_side``, ``fixed_step``, ``methods``, ``footprint``, ``pictures``
"""
