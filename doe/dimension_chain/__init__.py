"""Dimension chains: a closing link, its parts and their tolerances.

- ``links``: tables of a chain, the parts of its links, and their sizes on a drawing; ``reading``: chains from TOML, and their faults
- ``closing``: the closing link as a function of its parts, expressions included, and its intervals
- ``yields``: distributions of parts, yield of tolerances, selective assembly
- ``allocation``: tolerances of parts from the limits of the closing link
- ``refusal``: by how much a chain misses its limits, why, and what would meet them
- ``solution``: ``solve`` and its record
"""

from doe.dimension_chain.links import Chain, Link, Part
from doe.dimension_chain.reading import chain_from, faults, is_several, read_chains
from doe.dimension_chain.solution import ChainResult, solve
from rbdyn.properties.tolerances import fit_limits, grade_tolerances, ring_limits, tolerance_unit

__all__ = [
    "Chain",
    "ChainResult",
    "Link",
    "Part",
    "chain_from",
    "faults",
    "fit_limits",
    "grade_tolerances",
    "is_several",
    "read_chains",
    "ring_limits",
    "solve",
    "tolerance_unit",
]
