"""What goes into the table [mounting] of a catalogue bearing: the fits of its seats, its housing, its temperatures."""

from typing import Any

from rbdyn.properties.catalogue import Envelope
from rbdyn.properties.tolerances import Interference, housing_interference, shaft_interference

# Classes for a load that stands still on an inner ring that turns, where only the other seat is stated.
USUAL_SHAFT, USUAL_HOUSING = "k5", "H7"
# Outer diameter of the housing over that of the bearing; rise of inner ring and rollers above the outer ring [K] (NTN, NSK).
HOUSING_SHARE, INNER_RISE = 1.5, 7.5
# By how much of the inner ring's rise above its drawing, at 20 C, the shaft stays below it: 0.10 to 0.15 (NSK).
SHAFT_LAG, DRAWING = 0.125, 20.0
NONE = dict.fromkeys(
    ("shaft_by", "housing_by", "mounted_bore", "mounted_outside", "housing_diameter", "inner_temperature", "shaft_temperature",
     "outer_temperature", "inner_interference", "inner_fit_by", "outer_interference", "outer_fit_by", "inner_law", "outer_law")
)  # fmt: skip


def mounting_values(sizes: Envelope, shaft: str | None, housing: str | None, temperature: float) -> dict[str, Any]:
    """Values of the templates for the classes of shaft and housing, and the temperature of the oil [C].

    None of them where neither class is stated. Raises MethodError as ``shaft_interference``.
    """
    loose: dict[str, Any] = {"loose_bore": sizes.bore, "loose_outside": sizes.outside, "estimated_mounting": ""}
    if shaft is None and housing is None:
        return {**NONE, **loose}
    inner = shaft_interference(sizes.bore, shaft or USUAL_SHAFT)
    outer = housing_interference(sizes.outside, housing or USUAL_HOUSING)
    warm = temperature + INNER_RISE
    return {
        **dict.fromkeys(loose),
        "estimated_mounting": ',\n    "mounting.inner_ring_temperature_C"',
        "shaft_by": f"shaft {shaft or f'{USUAL_SHAFT} (not stated, usual)'}",
        "housing_by": f"housing {housing or f'{USUAL_HOUSING} (not stated, usual)'}",
        "mounted_bore": sizes.bore,
        "mounted_outside": sizes.outside,
        "housing_diameter": round(HOUSING_SHARE * sizes.outside, 1),
        "outer_temperature": temperature,
        "inner_temperature": warm,
        "shaft_temperature": round(warm - SHAFT_LAG * (warm - DRAWING), 1),
        "inner_interference": round(inner.mean, 2) + 0.0,
        "inner_fit_by": _reason(inner),
        "inner_law": _law(inner),
        "outer_interference": round(outer.mean, 2) + 0.0,
        "outer_fit_by": _reason(outer),
        "outer_law": _law(outer),
    }


def _reason(fit: Interference) -> str:
    less = f", less {fit.smoothing:.3g} of smoothing" if fit.smoothing else ""
    return f"mean of {fit.low + fit.smoothing:.3g} to {fit.high + fit.smoothing:.3g}{less}; negative is loose"


def _law(fit: Interference) -> str | None:
    """Law of an interference; None where all of the fits are loose and none has any effect."""
    if fit.high <= 0.0:
        return None
    numbers = f"mean = {fit.mean + 0.0:.2f}, sd = {fit.sd:.2f}, low = {fit.low:.2f}, high = {fit.high:.2f}"
    return f'{{ law = "normal", {numbers}, kind = "varies" }}'
