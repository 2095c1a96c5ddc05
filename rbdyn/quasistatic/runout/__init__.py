"""Runout of a turning ring.

- ``race_errors``: form errors of grooves and balls as each ball meets them
- ``walk``: equilibrium step by step, compiled; ``turn``: the path that comes of it; ``model``: both from a scene
- ``measures``: measures of the path, and their limits by tolerance class
- ``lots``: small errors in proportion, many bearings at once, and race errors that meet a class
"""
