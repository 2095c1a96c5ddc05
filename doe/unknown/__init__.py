"""Unknown inputs: what is not known of a scene, and what it does to an answer. Methods on tables; knows no bearing.

- ``laws``: distributions of inputs and their dependence
- ``joint``: nested input sets, how inputs depend on each other, and sets that share some of them
- ``screening``: which of many inputs matter
- ``spread``: what an output ranges over, and how much of that is noise
- ``sensitivity``: which input makes it
- ``decision``: whether one design beats another all the same
- ``worth``: which input decides that, and what measuring it is worth
- ``cells``, ``matching``, ``discrepancy``, ``sampler``, ``calibration``: inputs from measurements
- ``posterior``, ``width``, ``verdict``: what these taught, whether predictions are as wide as they state, and whether that may be
  called calibrated
"""
