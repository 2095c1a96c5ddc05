"""Dimension chains of STUDY.toml."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from rbdyn.faults import InputError, Strict


class StudyChain(Strict):
    """Dimension chain whose closing link is the picked value of ``factor``, within +- ``half_width_mm``.

    Without ``half_width_mm`` the tolerance that the study finds for the factor is taken. ``link``, ``allocate``,
    ``monte_carlo`` and ``selective`` are those of a CHAIN.toml (see `doe.dimension_chain.links`).
    """

    name: Annotated[str, Field(min_length=1)]
    factor: str
    half_width_mm: Annotated[float, Field(gt=0.0)] | None = None
    link: Annotated[list[dict[str, Any]], Field(min_length=1)]
    allocate: dict[str, Any] = {}
    monte_carlo: dict[str, Any] = {}
    selective: dict[str, Any] | None = None


def chain_table(chain: StudyChain, value: float, half_width: float | None = None) -> Mapping[str, Any]:
    """CHAIN.toml contents of a study's chain at a picked value [mm].

    ``half_width`` [mm] stands in where the chain gives none. Raises InputError where neither is there.
    """
    half = chain.half_width_mm if chain.half_width_mm is not None else half_width
    if half is None:
        raise InputError(
            [
                f"chain {chain.name}: half_width_mm: missing, and no tolerance of {chain.factor} is known; add it"
            ]
        )
    table = {
        "closing_link": {"lower_mm": value - half, "upper_mm": value + half},
        "link": chain.link,
        "allocate": chain.allocate,
        "monte_carlo": chain.monte_carlo,
    }
    return table if chain.selective is None else table | {"selective": chain.selective}
