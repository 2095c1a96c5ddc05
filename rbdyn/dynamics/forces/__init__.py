"""Forces on rollers, cage and rings, and the power that each takes; compiled.

- ``state``: the layout of the state vector and its units
- ``races``, ``race_form``: contact of a roller with its races, their form; ``race_lanes``: the same over vectors of rollers
- ``pocket``, ``guide_land``, ``drag``, ``gravity``: one interaction each
- ``cage_body``, ``ring_motion``, ``support``: how the cage and a supported outer ring move
- ``drive``, ``clock``, ``schedule``: speeds and loads, steady or by the clock
- ``equations``: forces gathered into accelerations and powers; ``energy``: what balances them; ``observe``: all of them
  written out on request; ``slice_loads``: loads of slices
"""
