"""Dimension chains: a closing link, its parts and their tolerances.

``links`` is what a chain is made of, ``reading`` and ``faults`` its TOML, ``closing`` the closing link as a function of
its parts (``expressions`` are the links that are no sums), ``monte_carlo`` and
``yields`` what comes of given tolerances, ``allocation`` the way back from limits to tolerances,
``parts`` with fits of ISO 286 and rings of ISO 492, ``selective_assembly`` parts sorted into classes. ``solve`` answers all.
"""

from doe.dimension_chain.faults import faults
from doe.dimension_chain.links import Chain, Link, Part
from doe.dimension_chain.reading import chain_from, is_several, read_chains
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
