"""Forces on rollers, cage and rings, and the power that each takes; compiled.

- ``state``: the layout of the state vector and its units
- ``races``: contact of a roller with its races, and their form; ``race_lanes``: the same over vectors of rollers, and open contacts
- ``pocket``, ``guide_land``, ``surroundings``: one interaction each
- ``bodies``: how the cage and a supported outer ring move
- ``drive``: steady speeds and loads; ``schedule``: those over time
- ``equations``: forces gathered into accelerations and powers, and energy; ``observe``: all of them written out on request
"""
