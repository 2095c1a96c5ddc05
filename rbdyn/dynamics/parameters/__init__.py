"""What is built once a scene, in SI, for compiled code to read.

- ``model``: the parameters of every law
- ``state``: layout of the state, the sizes by which errors are measured, and the start of a run; ``static_load``: load share at rest
- ``validity``: what the model leaves out, the maker's friction, pressure and film of each race
"""
