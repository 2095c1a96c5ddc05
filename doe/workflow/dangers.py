"""Dangers of a choice: responses that it makes worse, and figures beyond their runs."""

from collections.abc import Mapping, Sequence

import numpy as np

from doe.response_surface import Surface
from doe.workflow.confirmation import Gain
from rbdyn.base.arrays import Array
from rbdyn.base.notes import Note, Notes
from rbdyn.base.words import improvement, quantity


def worse_notes(gains: Mapping[str, Gain]) -> Notes:
    """A note on a pick that is worse than the baseline, by its simulated ``gains`` by response."""
    worse = [
        f"{quantity(name)[0]} {improvement(gain.percent, gain.error_percent, gain.goal)}"
        for name, gain in gains.items()
        if gain.verdict == "worse"
    ]
    return (Note("worse", f"the pick is worse than the baseline: {', '.join(worse)}"),) if worse else ()


def extrapolation_notes(surfaces: Sequence[Surface], coded: Array) -> Notes:
    """A note where surfaces are less sure at a ``coded`` point (k,) than at every run: there they rest on no run nearby.

    By the largest variance of the mean at a run, for hidden extrapolation in several factors (Montgomery, Peck, Vining).
    """
    beyond = [surface.name for surface in surfaces if _variance_ratio(surface, coded) > 1.0 + 1e-9]
    if not beyond:
        return ()
    names = ", ".join(quantity(name)[0] for name in beyond)
    sentence = f"extrapolation: at the pick the surfaces of {names} are less sure than at any run; simulate it, or add runs there"
    return (Note("extrapolation", sentence),)


def _variance_ratio(surface: Surface, coded: Array) -> float:
    """Variance of the mean at a point over the largest at a run; 0 for a surface without scatter."""
    errors = surface.coefficient_error(np.vstack([coded, surface.data.points]))
    largest = float(errors[1:].max())
    return float(errors[0]) / largest if largest > 0.0 else 0.0
