"""Where the power goes, and how the bearing moves, at baseline and pick."""

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from doe.report.sections.plot import Plot, span, ticks, wide_svg
from doe.report.sections.record import Record, part
from rbdyn.base.blocks import Block, Figures, Section, Table, Widget


def power(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Power by term at the confirmed points, baseline and pick as bars."""
    found = {
        name.replace("_", " "): point["power_terms_W"]
        for name, point in (part(summary, "confirmation") or {}).items()
        if point.get("power_terms_W")
    }
    if not found:
        return None
    every = list(dict.fromkeys(term for terms in found.values() for term in terms))
    # What is nil everywhere belongs to laws that the scene leaves out.
    terms = [term for term in every if any(each.get(term) for each in found.values())]
    first = next(iter(found.values()))
    terms.sort(key=lambda term: -abs(first.get(term) or 0.0))
    rows = [[term.replace("_", " "), *(_watts(terms_of.get(term)) for terms_of in found.values())] for term in terms]
    notes = ["Terms that are nil everywhere are left out."] if len(terms) < len(every) else []
    notes += _maker(part(summary, "confirmation") or {})
    blocks: list[Block] = []
    compared = {name: found[name] for name in ("baseline", "pick") if name in found}
    if compared:
        blocks.append(Figures([power_bars(terms, compared)], "Power loss by where it arises."))
    blocks.append(Table("Power loss by term", ["term", *(f"{name} [W]" for name in found)], rows, " ".join(notes)))
    return Section("power", "Power by term", blocks)


def _maker(confirmed: Mapping[str, Any]) -> list[str]:
    """A sentence on the maker's friction of the points, where the scene states a designation."""
    checks = {name: point.get("friction_check") or {} for name, point in confirmed.items()}
    shares = [f"{name.replace('_', ' ')} {check['ratio']:.2f}" for name, check in checks.items() if check.get("ratio")]
    if not shares:
        return []
    power = next(check["skf_power_W"] for check in checks.values() if check)
    return [f"Power loss over the {power:.3g} W of SKF's friction model: {', '.join(shares)}."]


def _watts(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}" if abs(value) < 100.0 else f"{value:.1f}"


def motion(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Orbits of the cage centre, and the moving bearing."""
    blocks: list[Block] = []
    orbits = {name: each for name, each in motion.items() if part(each, "cage_orbit_um", "x")}
    if orbits:
        path = "Path of the cage centre about that of its guide, and enlarged; triangle start, square end."
        caption = f"{path} The radius of the dashed circle is half of the diametral guide clearance."
        drawn = [orbit(name, each, whole) for whole in (True, False) for name, each in orbits.items()]
        blocks.append(Figures(drawn, caption))
    if any(part(each, "moving") for each in motion.values()):
        blocks.append(Widget("bearing"))
    return Section("motion", "Motion of the bearing", blocks)


WIDE, ROW, LEFT, RIGHT = 640.0, 34.0, 150.0, 62.0


def orbit(name: str, motion: Record, whole: bool) -> str:
    """Cage centre along and across the load: in the whole guide clearance, or enlarged."""
    x, y = (part(motion, "cage_orbit_um", axis) for axis in "xy")
    radius = motion.get("guide_radius_um") or 0.0
    reach = 1.08 * max(radius, max(math.hypot(*place) for place in zip(x, y, strict=True)))
    labels = (f"{name}{'' if whole else ', enlarged'}: along the load [µm]", "across [µm]")
    ranges = ((-reach, reach), (-reach, reach)) if whole else (span(x), span(y))
    plot = Plot(*ranges, labels, height=326.0, equal=True)
    if radius and whole:
        angles = [math.radians(step) for step in range(0, 361, 3)]
        plot.line([(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles], "guide")
    plot.line(zip(x, y, strict=True), "orbit")
    plot.symbol((x[0], y[0]), "triangle", "knee", "start", 4.5)
    plot.symbol((x[-1], y[-1]), "square", "pick", "end", 4.5)
    return plot.svg(f"Cage orbit at the {name}{'' if whole else ', enlarged'}")


def power_bars(terms: Sequence[str], found: Mapping[str, Record]) -> str:
    """A row of bars a term, one for each point."""
    values = [each.get(term) or 0.0 for each in found.values() for term in terms]
    low, high = min(0.0, *values), max(0.0, *values) or 1.0
    bottom = ROW * len(terms) + 4.0

    def across(value: float) -> float:
        return LEFT + (WIDE - LEFT - RIGHT) * (value - low) / (high - low)

    drawn = []
    for value in ticks(low, high):
        u = across(value)
        drawn.append(f'<line class="grid" x1="{u:.1f}" x2="{u:.1f}" y1="0" y2="{bottom:g}"/>')
        drawn.append(f'<text x="{u:.1f}" y="{bottom + 14:g}" text-anchor="middle">{value:g}</text>')
    thick = (ROW - 8.0) / len(found)
    for row, term in enumerate(terms):
        drawn.append(f'<text x="{LEFT - 8}" y="{ROW * row + 0.5 * ROW + 4:g}" text-anchor="end">{escape(term.replace("_", " "))}</text>')  # fmt: skip
        for place, (name, each) in enumerate(found.items()):
            value = each.get(term) or 0.0
            u, v = across(min(value, 0.0)), ROW * row + 4.0 + thick * place
            width = abs(across(value) - across(0.0))
            drawn.append(f'<rect class="bar {escape(name)}" x="{u:.1f}" y="{v:.1f}" width="{width:.1f}" height="{thick - 1:.1f}"/>')  # fmt: skip
            drawn.append(f'<text class="small" x="{u + width + 4:.1f}" y="{v + thick - 3:.1f}">{value:.4g}</text>')
    drawn.append(f'<text class="axis" x="{across(0.5 * (low + high)):.0f}" y="{bottom + 30:g}" text-anchor="middle">power loss [W]</text>')  # fmt: skip
    for place, name in enumerate(found):
        u = WIDE - RIGHT - 150.0 + 80.0 * place
        drawn.append(f'<rect class="bar {escape(name)}" x="{u:g}" y="{bottom + 21:g}" width="11" height="11"/>')
        drawn.append(f'<text x="{u + 15:g}" y="{bottom + 31:g}">{escape(name)}</text>')
    return wide_svg(WIDE, bottom + 38, f"Power loss by term, {' and '.join(found)}", drawn)
