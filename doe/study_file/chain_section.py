"""Dimension chains of STUDY.toml."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from rbdyn.faults import Consistent, InputError, read_toml


class StudyChain(Consistent):
    """Dimension chain whose closing link is the picked value of a factor. Its links stand here or in a file."""

    name: Annotated[str, Field(min_length=1)]
    """Name of the chain."""
    factor: str
    """The factor whose picked value the chain must close."""
    half_width_mm: Annotated[float, Field(gt=0.0)] | None = None
    """Half width of the closing link about the pick; the tolerance that the study derives for the factor where left
    out."""
    file: str | None = None
    """CHAIN.toml beside the study, which has the links under the chain's name."""
    link: list[dict[str, Any]] = []
    """Links, as in a CHAIN.toml."""
    allocate: dict[str, Any] = {}
    """How tolerances are shared, as in a CHAIN.toml."""
    monte_carlo: dict[str, Any] = {}
    """Monte Carlo of the assemblies, as in a CHAIN.toml."""
    selective: dict[str, Any] | None = None
    """Selective assembly, as in a CHAIN.toml."""

    def faults(self) -> Iterator[str]:
        if self.file is None and not self.link:
            yield "link: missing; give the links, or the file that has them"
        if self.file is not None and (self.link or self.allocate or self.monte_carlo or self.selective):
            yield f"file = {self.file!r}: has the links and all about them; leave out one or the other"


def chain_table(chain: StudyChain, folder: Path, value: float, half_width: float | None = None) -> Mapping[str, Any]:
    """CHAIN.toml contents of a study's chain at a picked value [mm]; ``folder`` is where the study lies.

    ``half_width`` [mm] stands in where the chain gives none. Raises InputError where neither is there, or the chain is
    not in its file.
    """
    half = chain.half_width_mm if chain.half_width_mm is not None else half_width
    if half is None:
        why = f"missing, and no tolerance of {chain.factor} is known; add it"
        raise InputError([f"chain {chain.name}: half_width_mm: {why}"])
    limits = {"lower_mm": value - half, "upper_mm": value + half}
    if chain.file is not None:
        named = _of_file(chain.name, folder / chain.file)
        return {**{key: each for key, each in named.items() if key != "name"}, "closing_link": limits}
    table = {"closing_link": limits, "link": chain.link, "allocate": chain.allocate, "monte_carlo": chain.monte_carlo}
    return table if chain.selective is None else table | {"selective": chain.selective}


def _of_file(name: str, path: Path) -> Mapping[str, Any]:
    """Table of the chain of that name in a file of chains."""
    chains = read_toml(path).get("chain", [])
    for chain in chains if isinstance(chains, list) else []:
        if isinstance(chain, dict) and chain.get("name") == name:
            return chain
    raise InputError([f"{path}: no chain is named {name}; name it [[chain]] name = {name!r}"])
