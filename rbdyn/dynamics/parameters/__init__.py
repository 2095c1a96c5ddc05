"""What a scene becomes, once and in SI, for compiled code to read.

- ``model``: the parameters of every law
- ``state``: layout of the state, scales of its errors, and the start of a run
- ``validity``: effects left out, the maker's friction, pressure and film of each race
"""
