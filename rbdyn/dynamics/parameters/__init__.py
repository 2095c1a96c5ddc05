"""What a scene becomes, once and in SI, for compiled code to read.

- ``model``: the parameters of every law
- ``state``: layout of the state, scales of its errors, and the start of a run
- ``heat``: conductances of its parts, and where its losses go
- ``start``: capacities, seats, clearances and course of a cold machine that warms
- ``validity``: effects left out, the maker's friction, pressure and film of each race
"""
