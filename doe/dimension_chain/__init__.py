"""Dimension chains: a closing link, its parts and their tolerances.

- ``links``: what a chain is made of; ``reading``: its TOML and what is wrong with it
- ``closing``: the closing link as a function of its parts, of which some are expressions
- ``yields``: what comes of given tolerances; ``allocation``: the way back from limits to tolerances
- ``selective_assembly``: parts sorted into classes
- ``solution``: ``solve`` answers all
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
