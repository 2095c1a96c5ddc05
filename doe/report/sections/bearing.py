"""Where the power goes, and how the bearing moves, at baseline and pick."""

from collections.abc import Mapping
from typing import Any

from doe.report.sections import plots_of_motion as plots
from doe.report.sections.blocks import Block, Figures, Section, Table, Widget
from doe.report.sections.record import Record, part


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
    note = "Terms that are nil everywhere are left out." if len(terms) < len(every) else ""
    blocks: list[Block] = []
    compared = {name: found[name] for name in ("baseline", "pick") if name in found}
    if compared:
        blocks.append(Figures([plots.power_bars(terms, compared)], "Power loss by where it arises."))
    blocks.append(Table("Power loss by term", ["term", *(f"{name} [W]" for name in found)], rows, note))
    return Section("power", "Power by term", blocks)


def _watts(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}" if abs(value) < 100.0 else f"{value:.1f}"


def motion(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Orbits of the cage centre, and the moving bearing."""
    blocks: list[Block] = []
    orbits = {name: each for name, each in motion.items() if part(each, "cage_orbit_um", "x")}
    if orbits:
        caption = "Path of the cage centre about that of its guide, in the guide clearance (dashed) and enlarged; triangle start, square end."
        drawn = [plots.orbit(name, each, whole) for whole in (True, False) for name, each in orbits.items()]
        blocks.append(Figures(drawn, caption))
    if any(part(each, "moving") for each in motion.values()):
        blocks.append(Widget("bearing"))
    return Section("motion", "Motion of the bearing", blocks)
