"""Dimension chains: a closing link, its parts and their tolerances."""

from doe.dimension_chain.chain import (
    Chain,
    ChainResult,
    Part,
    chain_from,
    grade_tolerances,
    read_chain,
    solve,
    tolerance_unit,
)

__all__ = [
    "Chain",
    "ChainResult",
    "Part",
    "chain_from",
    "grade_tolerances",
    "read_chain",
    "solve",
    "tolerance_unit",
]
