"""Dimension chains in short, for the tests."""

from doe.dimension_chain import Chain, chain_from
from rbdyn.base.faults import read_toml


def chain(links, limits=(0.0, 1.0), **allocate):
    """A chain of (coefficient, nominal, upper, lower, extra keys), named a, b, c; unrounded unless a resolution is given."""
    tables = []
    for name, (coefficient, nominal, *rest) in zip("abcdefgh", links, strict=False):
        extra = rest.pop() if rest and isinstance(rest[-1], dict) else {}
        deviations = dict(zip(("upper_mm", "lower_mm"), rest, strict=False))
        tables.append({"name": name, "coefficient": coefficient, "nominal_mm": nominal} | deviations | extra)
    closing = {"lower_mm": limits[0], "upper_mm": limits[1]}
    return Chain.model_validate(
        {"closing_link": closing, "link": tables, "allocate": {"resolution_mm": 0.0} | allocate}
    )


def read_chain(path):
    """The chain of a TOML file that is one chain."""
    return chain_from(read_toml(path), str(path))


def with_functions(plain, *functions, **tables):
    """The same chain with links that are functions behind it, and other tables of it replaced."""
    data = plain.model_dump()
    return Chain.model_validate(data | {"link": [*data["link"], *functions]} | tables)


def by_name(result):
    """Allocated parts by name."""
    return {part.name: part for part in result.allocation}
