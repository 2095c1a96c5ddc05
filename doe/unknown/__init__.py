"""Unknown inputs of a scene and their effect on an answer. Methods on tables; they know no bearing.

- ``inputs``: distributions of inputs, their dependence, sets of them, and screening of those that matter
- ``propagation``: the range of an output, the part of it that is noise, and the inputs that cause it
- ``decision``: whether one design is better than another all the same, and which input is decisive
- ``posterior``: the likelihood of measurements, and samples of the inputs by it, and offsets of a sensor that it does not see
- ``width``: whether predictions are too wide or too narrow, and whether a design can show it
- ``calibration``: inputs from measurements, how far their predictions are right, and whether they may be called calibrated
"""
