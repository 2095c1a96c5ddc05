"""What is built once a scene, in SI, for compiled code to read.

- ``model``: the parameters of every law; ``race_traction``: those of traction
- ``scales``: layout of the state, the sizes by which errors are measured
- ``start``: kinematic speeds, seeded places in the pockets, and the static load share (``static_load``)
- ``race_report``: pressure, half-width and film of each race; ``left_out``: what the model leaves out, with estimates
"""
