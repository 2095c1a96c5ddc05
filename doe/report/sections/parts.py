"""Dimension chains: the parts to make, what each contributes, how many assemblies pass."""

from collections.abc import Mapping
from html import escape
from typing import Any

from doe.report.sections.answer import allocation, record_table
from doe.report.sections.blocks import Block, Figures, Heading, Section, Table, Words
from doe.report.sections.plot import wide_svg
from doe.report.sections.record import Record, part
from doe.report.words import dimension, moved
from rbdyn.records.words import label, shown

# Keys of a chain that have a place of their own.
SHOWN_KEYS = {"closing_link", "yield", "contributions", "allocation", "status"}
WIDE, ROW, LEFT, COLOURS = 640.0, 34.0, 92.0, 8
KINDS = (("variance_percent", "variance"), ("worst_case_percent", "worst case"))


def chains(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """A heading, the parts with a stacked bar of contributions, and the yield, of each chain."""
    blocks: list[Block] = []
    for name, chain in (part(summary, "chains") or {}).items():
        blocks.append(Heading(label(name)))
        blocks += _chain(name, chain)
    return Section("chains", "Dimension chains", blocks)


def _chain(name: str, chain: Record) -> list[Block]:
    blocks: list[Block] = []
    if status := str(chain.get("status") or ""):
        blocks.append(Words(f"{status[:1].upper()}{status[1:]}."))
    shares = chain.get("contributions") or {}
    rows = [
        (label(each), dimension(dimensions), dimensions.get("grade") or "", moved(dimensions),
         *(_percent(part(shares, each, kind)) for kind, _ in KINDS))
        for each, dimensions in allocation(chain).items()
    ]  # fmt: skip
    header = ("part", "dimension [mm]", "grade", "nominal moved [mm]", "share of variance", "share of worst case")
    blocks.append(Table(f"Parts of the chain {label(name)}", header, rows, text_columns=(2,)))
    if shares:
        caption = "What each part contributes to the scatter of the closing link."
        blocks.append(Figures([contributions(name, shares)], caption))
    if closing := chain.get("closing_link"):
        rows = [
            (words, _length(closing.get(key)))
            for key, words in (("nominal_mm", "nominal"), ("worst_case_mm", "worst case"), ("rss_mm", "root of squares"))
            if closing.get(key) is not None
        ]  # fmt: skip
        blocks.append(Table("Closing link", ("", "[mm]"), rows))
    if yields := chain.get("yield"):
        error = yields.get("standard_error")
        rows = [
            (kind.replace("_", " "), f"{share:.6f}")
            for kind, share in yields.items()
            if isinstance(share, float) and kind != "standard_error"
        ]
        note = f"Share of assemblies within the limits, standard error {shown(error, 1)}." if error else ""
        blocks.append(Table("Yield", ("distribution of the parts", "yield"), rows, note))
    rest = {key: value for key, value in chain.items() if key not in SHOWN_KEYS}
    blocks.append(record_table("Further figures of the chain", rest, folded=True))
    return blocks


def contributions(name: str, shares: Record) -> str:
    """Stacked bars, by variance and in worst case; a part is told by its number, colour and title."""
    known = [(words, [part(each, kind) or 0.0 for each in shares.values()]) for kind, words in KINDS]
    known = [(words, values) for words, values in known if sum(values) > 0.0]
    high = ROW * len(known) + 8.0 + 18.0 * len(shares)
    drawn = []
    for row, (words, values) in enumerate(known):
        v, u = ROW * row + 4.0, LEFT
        drawn.append(f'<text x="{LEFT - 8}" y="{v + 17:g}" text-anchor="end">{words}</text>')
        for number, (each, value) in enumerate(zip(shares, values, strict=True)):
            width = (WIDE - LEFT - 4.0) * value / sum(values)
            title = escape(f"{label(each)}: {value:.1f} % of the {words}")
            drawn.append(f'<rect class="share c{number % COLOURS}" x="{u:.1f}" y="{v:g}" width="{width:.1f}" height="24"><title>{title}</title></rect>')  # fmt: skip
            if width > 46.0:
                drawn.append(f'<text class="on c{number % COLOURS}" x="{u + width / 2:.1f}" y="{v + 16:g}" text-anchor="middle">{number + 1}: {value:.0f} %</text>')  # fmt: skip
            u += width
    for number, each in enumerate(shares):
        v = ROW * len(known) + 16.0 + 18.0 * number
        drawn.append(f'<rect class="share c{number % COLOURS}" x="{LEFT}" y="{v - 9:g}" width="12" height="12"/>')
        drawn.append(f'<text x="{LEFT + 18}" y="{v + 2:g}">{number + 1}: {escape(label(each))}</text>')
    return wide_svg(WIDE, high, f"Contributions to the chain {label(name)}", drawn)


def _percent(value: float | None) -> str:
    return "" if value is None else f"{value:.1f} %"


def _length(value: Any) -> str:
    return " to ".join(f"{each:.4f}" for each in value) if isinstance(value, list | tuple) else f"{value:.4f}"
