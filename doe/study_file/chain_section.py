"""Dimension chains of STUDY.toml."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from rbdyn.faults import Strict


class StudyChain(Strict):
    """Dimension chain whose closing link is the picked value of ``factor``, within +- ``half_width_mm``."""

    name: Annotated[str, Field(min_length=1)]
    factor: str
    half_width_mm: Annotated[float, Field(gt=0.0)]
    link: Annotated[list[dict[str, Any]], Field(min_length=1)]
    allocate: dict[str, Any] = {}


def chain_table(chain: StudyChain, value: float) -> Mapping[str, Any]:
    """CHAIN.toml contents of a study's chain at a picked value [mm]."""
    limits = {"lower_mm": value - chain.half_width_mm, "upper_mm": value + chain.half_width_mm}
    return {"closing_link": limits, "link": chain.link, "allocate": chain.allocate}
