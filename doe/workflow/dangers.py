"""Dangers of a choice: limits that it breaks, responses that it makes worse, chains that miss, figures beyond their runs."""

from collections.abc import Mapping, Sequence

import numpy as np

from doe.response_surface import Surface
from doe.workflow.confirmation import Gain, Verdict
from rbdyn.base.arrays import Array
from rbdyn.base.notes import Note, Notes
from rbdyn.base.words import quantity


def choice_notes(gains: Sequence[Gain], verdict: Verdict, limits_sentence: str, missed: Mapping[str, str]) -> Notes:
    """Notes on a pick that was simulated: its ``gains`` over the baseline, the ``verdict`` on its limits, ``missed`` chains."""
    worse = [
        f"{quantity(gain.response)[0]} by {-gain.percent:.3g} ± {gain.error:.2g} %"
        for gain in gains
        if gain.verdict == "worse"
    ]
    codes = {"broken": "broken-limit", "undecided": "open-limit"}
    return (
        *((Note(codes[verdict], limits_sentence),) if verdict in codes else ()),
        *((Note("worse", f"the pick is worse than the baseline: {', '.join(worse)}"),) if worse else ()),
        *(Note("missed-chain", f"chain {name}: {why}") for name, why in missed.items()),
    )


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
