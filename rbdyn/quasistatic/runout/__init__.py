"""Runout of a turning ring.

- ``race_errors``: form errors of grooves and balls as each ball meets them; ``walk``, ``turn``: equilibrium step by step
- ``measures``: measures of the path; ``classes``: limits by tolerance class
- ``lots``: small errors in proportion, many bearings at once; ``tolerance_design``: race errors that meet a class
- ``model``: from a scene
"""
