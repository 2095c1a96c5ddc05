"""Forces on rollers, cage and rings, and the power that each takes; compiled.

- ``state``: layout of the state vector and units of its components
- ``races``: contact of a roller with its races, and their form; ``race_lanes``: the same over vectors of rollers, and open contacts
- ``cage``: contacts of the cage with rollers and guiding ring
- ``impacts``: contacts in the pockets followed one by one; ``race_samples``: heat of race contacts, and entries into the load zone
- ``bodies``: motion of cage and rings, steady drive, drag and gravity; ``schedule``: speeds and loads over time
- ``equations``: forces gathered into accelerations and powers, energy, and static load; ``observe``: contacts in recorded states
"""
