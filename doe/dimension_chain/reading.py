"""Chains from TOML: one of its own, or several under names in one file."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from doe.dimension_chain.faults import faults
from doe.dimension_chain.links import Chain
from rbdyn.faults import Strict, read_toml, refuse, validated


class NamedChain(Chain):
    """A chain among others."""

    name: Annotated[str, Field(min_length=1)]
    """Name of the chain."""


class Chains(Strict):
    """A file of several chains."""

    chain: Annotated[list[NamedChain], Field(min_length=1)]
    """The chains."""


def chain_from(data: Mapping[str, Any], source: str) -> Chain:
    """Build a chain from a table; ``source`` names the file in the messages of InputError."""
    chain = validated(Chain, data, source)
    refuse(f"{source}: {fault}" for fault in faults(chain))
    return chain


def is_several(path: Path | str) -> bool:
    """Whether a TOML file holds several chains under names. Raises InputError where it cannot be read."""
    return "chain" in read_toml(path)


def read_chains(path: Path | str) -> dict[str, Chain]:
    """Read the chains of a TOML file by name; a file that is one chain gives it the name of the file.

    Raises InputError with the faults of all chains at once.
    """
    path = Path(path)
    data, source = read_toml(path), str(path)
    if "chain" not in data:
        return {path.stem: chain_from(data, source)}
    chains = validated(Chains, data, source).chain
    counts = Counter(chain.name for chain in chains)
    sentences = [f'chain.name = "{name}": used {n} times; name each once' for name, n in counts.items() if n > 1]
    sentences += [f'chain "{chain.name}": {fault}' for chain in chains for fault in faults(chain)]
    refuse(f"{source}: {fault}" for fault in sentences)
    return {chain.name: chain for chain in chains}
