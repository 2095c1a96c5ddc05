"""Power loss by cause, and the motion of the bearing, at baseline and pick."""

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from doe.clearance import DrawnMotion
from doe.report.still import COLOURS, FONT, GUIDE, SMALL, Still, name_marks
from doe.report.summary import Summary
from doe.workflow.confirmation import ConfirmedPoint
from rbdyn.base.blocks import Block, Figures, Section, Table, Widget

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROW = 34.0  # height of the bars of a term [pt]


def power(summary: Summary, motion: Mapping[str, Any]) -> Section:
    """Power by term at the confirmed points, baseline and pick as bars."""
    confirmed = {name.replace("_", " "): point for name, point in summary.confirmation.items()}
    points = {name: point.power_terms_W for name, point in confirmed.items() if point.power_terms_W}
    every = list(dict.fromkeys(term for terms in points.values() for term in terms))
    # Terms of laws that the scene leaves out are zero everywhere.
    terms = [term for term in every if any(watts.get(term) for watts in points.values())]
    terms.sort(key=lambda term: -abs(next(iter(points.values())).get(term, 0.0)))
    rows = [[term.replace("_", " "), *(_watts(terms_of.get(term)) for terms_of in points.values())] for term in terms]
    notes = ["Terms that are zero everywhere are left out."] if len(terms) < len(every) else []
    notes += _maker(confirmed)
    bars: dict[str, dict[str, float]] = {name: points[name] for name in ("baseline", "pick") if name in points}
    blocks: list[Block] = [
        *([Figures([power_bars(terms, bars).svg], "Power loss by cause.")] if bars else []),
        Table("Power loss by term", ["term", *(f"{name} [W]" for name in points)], rows, " ".join(notes)),
    ]
    return Section("power", "Power by term", blocks)


def _maker(confirmed: Mapping[str, ConfirmedPoint]) -> list[str]:
    """A sentence on the friction by the maker's model, where the scene states a designation."""
    checks = {name: point.friction_check or {} for name, point in confirmed.items()}
    shares = [f"{name} {ratio:.2f}" for name, check in checks.items() if (ratio := check.get("ratio"))]
    if not shares:
        return []
    power = next(check["skf_power_W"] for check in checks.values() if check)
    return [f"Power loss over the {power:.3g} W of SKF's friction model: {', '.join(shares)}."]


def _watts(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}" if abs(value) < 100.0 else f"{value:.1f}"


def motion(summary: Summary, motion: Mapping[str, DrawnMotion]) -> Section | None:
    """Orbits of the cage centre, and the moving bearing."""
    if not motion:
        return None
    path = "Path of the cage centre about that of its guide, and enlarged; triangle start, square end."
    caption = f"{path} The radius of the dashed circle is half of the diametral guide clearance."
    pictures = [orbit(name, run, whole).svg for whole in (True, False) for name, run in motion.items()]
    return Section("motion", "Motion of the bearing", [Figures(pictures, caption), Widget("bearing")])


def orbit(name: str, motion: DrawnMotion, whole: bool) -> Still:
    """Cage centre along and across the load: in the whole guide clearance, or enlarged."""
    title = f"{name}{'' if whole else ', enlarged'}"
    radius = motion.guide_radius_um if whole else None
    return Still(f"Cage orbit at the {title}", partial(_orbit, title, *motion.orbit_um, radius), height=326.0)


def _orbit(title: str, x: Sequence[float], y: Sequence[float], radius: float | None, axis: "Axes") -> None:
    if radius:
        angles = [math.radians(step) for step in range(0, 361, 3)]
        axis.plot(
            [radius * math.cos(angle) for angle in angles], [radius * math.sin(angle) for angle in angles], **GUIDE
        )
    axis.plot(x, y, linewidth=0.5)
    for place, mark, colour, words in ((0, "^", "orange", "start"), (-1, "s", "vermilion", "end")):
        (point,) = axis.plot(
            x[place], y[place], mark, color=COLOURS[colour], markeredgecolor=COLOURS["paper"], markersize=9
        )
        name_marks(point, words, [words])
    axis.set_aspect("equal", adjustable="datalim")
    axis.set(xlabel=f"{title}: along the load [µm]", ylabel="across [µm]")


def power_bars(terms: Sequence[str], points: Mapping[str, Mapping[str, float]]) -> Still:
    """A row of bars a term, one for each point."""
    words = f"Power loss by term, {' and '.join(points)}"
    return Still(
        words, partial(_power_bars, terms, points), width=640.0, height=56.0 + ROW * len(terms), left_margin=110.0
    )  # fmt: skip


def _power_bars(terms: Sequence[str], points: Mapping[str, Mapping[str, float]], axis: "Axes") -> None:
    thick = 0.8 / len(points)
    looks = (("steel", "edge"), ("blue", "blue"))
    for place, ((name, watts), (fill, edge)) in enumerate(zip(points.items(), looks, strict=False)):
        values = [watts.get(term) or 0.0 for term in terms]
        rows = [row + thick * (place - 0.5 * (len(points) - 1)) for row in range(len(terms))]
        bars = axis.barh(rows, values, thick, color=COLOURS[fill], edgecolor=COLOURS[edge], linewidth=0.8, label=name)
        axis.bar_label(bars, [f"{value:.4g}" for value in values], padding=3, fontsize=SMALL, color=COLOURS["quiet"])
    axis.set_yticks(range(len(terms)), [term.replace("_", " ") for term in terms])
    axis.margins(x=0.12)
    axis.set(ylim=(len(terms) - 0.5, -0.5), xlabel="power loss [W]")
    axis.grid(axis="y", visible=False)
    axis.spines[:].set_visible(False)
    axis.legend(loc="lower right", fontsize=FONT)
