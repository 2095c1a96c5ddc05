"""One function of each kind that ``rbdyn.compiled`` makes, and what they answer."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled import elementary
from rbdyn.compiled.kernel import either, entry, kernel, law, routine

VALUES = np.linspace(0.3, 2.9, 37)


class Plain(NamedTuple):
    """A law's parameters."""

    slope: float


class Bent(NamedTuple):
    """Another law's parameters."""

    slope: float
    terms: NDArray[np.float64]


@law
def force(parameters: Any, x: Any) -> Any:
    """A law of two bodies."""


@force.body(Plain)
def _(parameters: Any, x: Any) -> Any:
    return parameters.slope * elementary.fast_exp(x)


@force.body(Bent)
def _(parameters: Any, x: Any) -> Any:
    return parameters.slope * total(parameters.terms) * elementary.tenth_root(x)


@kernel
def total(terms: Any) -> Any:
    """A sum over an array."""
    found = 0.0
    for term in terms:
        found += term
    return found


@routine
def pair(x: Any) -> Any:
    """Several values at once."""
    cosine, sine = elementary.fast_cos_sin(x)
    return Plain(cosine), Plain(sine * elementary.fast_log(x))


@kernel
def chosen(x: Any) -> Any:
    """One of two records."""
    one, other = pair(x)
    return either(x > 1.5, one, other)


@entry
def fill(plain: Any, bent: Any, values: Any, found: Any) -> None:
    """A row of answers for every value."""
    for n in range(len(values)):
        x = values[n]
        found[n, 0] = force(plain, x)
        found[n, 1] = force(bent, x)
        found[n, 2] = chosen(x).slope
        found[n, 3] = elementary.fast_tanh(x) + elementary.fast_expm1(x)
        found[n, 4] = elementary.eighteenth_root(x) - total(found[n, :4])


def answers() -> list[list[float]]:
    """All rows."""
    found = np.zeros((len(VALUES), 5))
    fill(Plain(0.7), Bent(1.3, VALUES * np.pi), VALUES, found)
    return found.tolist()
