"""Pictures of load, sliding and heat around the bearing, and of where the power goes."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from rbdyn.dynamics.motion import orbit
from rbdyn.plots.style import BLUE, INNER, OUTER, plain, plt, save

if TYPE_CHECKING:
    from rbdyn.dynamics.motion.history import History

# Losses below this share of the whole are left out of the bars.
SMALLEST_SHARE = 1e-4


def _around(axis: Axes, history: "History", values: np.ndarray, factor: float, colour: str, label: str) -> None:
    profile = orbit.against_azimuth(history, values)
    degrees = np.degrees(profile.azimuth)
    axis.fill_between(degrees, factor * profile.low, factor * profile.high, color=colour, alpha=0.2, linewidth=0)
    axis.plot(degrees, factor * profile.mean, color=colour, linewidth=1.4, label=label)
    axis.set(xlim=(-180.0, 180.0), xticks=range(-180, 181, 60))
    plain(axis)


def roller_loads(history: "History", path: Path) -> None:
    """Load of a roller on both races against azimuth: mean, and the band that holds nine tenths."""
    figure, axis = plt.subplots(figsize=(7.0, 4.2))
    _around(axis, history, history.outer_load, 1.0, OUTER, "outer race")
    _around(axis, history, history.inner_load, 1.0, INNER, "inner race")
    axis.set_ylim(bottom=0.0)
    axis.set(xlabel="azimuth of the roller from the load [°]", ylabel="roller load [N]\nmean, and 5 % to 95 %")
    axis.legend(fontsize=9)
    save(figure, path)


def sliding(history: "History", path: Path) -> None:
    """Slip, pressure times sliding speed, and heat at both races against azimuth."""
    figure, axes = plt.subplots(3, 1, figsize=(7.0, 8.4), sharex=True)
    pressed = orbit.pressure_velocity(history, "outer"), orbit.pressure_velocity(history, "inner")
    panels = (
        ("slip: ring less\nroller surface [m/s]", 1.0, history.outer_slip, history.inner_slip),
        ("Hertz pressure ×\nsliding speed [MPa·m/s]", 1e-6, pressed[0], pressed[1]),
        ("heat of a contact [W]", 1.0, history.outer_heat, history.inner_heat),
    )
    for axis, (label, factor, outer, inner) in zip(axes, panels, strict=True):
        _around(axis, history, outer, factor, OUTER, "outer race")
        _around(axis, history, inner, factor, INNER, "inner race")
        axis.set_ylabel(label)
    axes[0].legend(fontsize=9)
    axes[0].set_title("mean, and 5 % to 95 % of the samples", fontsize=10)
    axes[-1].set_xlabel("azimuth of the roller from the load [°]")
    save(figure, path)


def power_by_loss(terms: Mapping[str, float], path: Path) -> None:
    """Mean power [W] of each loss, largest on top; what is less than a ten-thousandth of all is left out."""
    whole = sum(abs(power) for power in terms.values())
    shown = {term: power for term, power in terms.items() if abs(power) > SMALLEST_SHARE * whole}
    names = sorted(shown, key=lambda term: shown[term])
    figure, axis = plt.subplots(figsize=(7.0, 1.2 + 0.38 * max(len(names), 1)))
    bars = axis.barh([name.replace("_", " ") for name in names], [shown[name] for name in names], color=BLUE)
    axis.bar_label(bars, fmt="%.3g", padding=3, fontsize=9)
    axis.set_xlabel(f"mean power lost [W], {sum(terms.values()):.4g} W in all")
    axis.margins(x=0.12)
    plain(axis)
    axis.grid(axis="y", visible=False)
    save(figure, path)
