"""Unknown inputs: what is unknown of a scene, and what it does to an answer. Methods on tables; knows no bearing.

- ``inputs``: distributions of inputs, their dependence, sets of them, and which of many matter
- ``propagation``: what an output ranges over, how much of that is noise, which input makes it
- ``decision``: whether one design beats another all the same
- ``worth``: which input decides that, and what measuring it is worth
- ``likelihood``, ``posterior``, ``calibration``: inputs from measurements, and what these identify
- ``verdict``: whether predictions are as wide as they state, and whether that may be called calibrated
"""
