"""Dimension chains: the parts to make, what each contributes, how many assemblies pass."""

from collections.abc import Mapping
from html import escape
from typing import Any

from doe.report.sections.plot import wide_svg
from doe.report.sections.record import Record, allocation, part, record_table
from doe.report.words import dimension, moved
from rbdyn.base.blocks import Block, Detail, Figures, Heading, Paragraph, Section, Table
from rbdyn.base.words import counted, label, with_error

# Keys of a chain that have a place of their own.
SHOWN_KEYS = {
    "closing_link", "yield", "yield_standard_errors", "exact_yield", "rejected", "contributions", "allocation", "status",
    "distribution", "linearisation", "cost", "selective_assembly", "samples",
}  # fmt: skip
WIDE, ROW, LEFT, COLOURS = 640.0, 34.0, 92.0, 8
KINDS = (("variance_percent", "variance"), ("worst_case_percent", "worst case"))
NORMAL = 1.96  # half-width of a 95 % interval over its standard error


def chains(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Of each chain a stacked bar of contributions, the yields by distribution and all other figures."""
    blocks: list[Block] = []
    for name, chain in (part(summary, "chains") or {}).items():
        blocks.append(Heading(label(name)))
        if shares := chain.get("contributions"):
            caption = "What each part contributes to the scatter of the closing link."
            blocks.append(Figures([contributions(name, shares)], caption))
        blocks += _distributions(chain)
        rest = {key: value for key, value in chain.items() if key not in SHOWN_KEYS}
        blocks.append(record_table(f"Further figures of the chain {label(name)}", rest, folded=True))
    return Section("chains", "Dimension chains", blocks)


def chain_blocks(name: str, chain: Record) -> list[Block]:
    """Parts, contributions, closing link and yield of a dimension chain; for who asks for all also yields and classes."""
    selective = chain.get("selective_assembly")
    status = str(chain.get("status") or "")
    return [
        _parts_table(name, chain),
        _shares_table(name, chain),
        *_distributions(chain, Detail.ALL),
        *(Paragraph(sentence, detail=Detail.USUAL) for sentence in _closing(chain)),
        Paragraph(f"{status[:1].upper()}{status[1:]}." if status else "", detail=Detail.USUAL),
        *(_selective(selective) if selective else ()),
    ]


def _parts_table(name: str, chain: Record) -> Table:
    title = f"Dimension chain {label(name)}"
    if refused(chain):
        title += ": the nearest parts that meet the limits"
    elif chain.get("status") == "ok":
        title += ": the given tolerances meet the limits; shown are the widest that still do"
    rows = [
        (label(each), dimension(dimensions), dimensions.get("grade") or "", moved(dimensions))
        for each, dimensions in allocation(chain).items()
    ]
    header = ("part", "dimension [mm]", "grade", "nominal moved [mm]")
    return Table(title, header, rows, text_columns=(2,)).without_empty_columns()


def refused(chain: Record) -> bool:
    """Whether the given deviations of a chain miss its limits."""
    return str(chain.get("status")).startswith("refused")


def _shares_table(name: str, chain: Record) -> Table:
    shares = chain.get("contributions") or {}
    rows = [(label(each), *(_percent(part(shares, each, kind)) for kind, _ in KINDS)) for each in shares]
    header = ("part", *(words for _, words in KINDS))
    return Table(
        f"Contributions to the scatter of the closing link, chain {label(name)}", header, rows, detail=Detail.USUAL
    )


def _percent(value: float | None) -> str:
    return "" if value is None else f"{value:.1f} %"


def _closing(chain: Record) -> list[str]:
    """Where the closing link lies, what a linear chain would miss, what the tolerances cost."""
    sentences = []
    closing = chain.get("closing_link") or {}
    if {"worst_case_mm", "rss_mm"} <= set(closing):
        (low, high), (least, most) = closing["worst_case_mm"], closing["rss_mm"]
        place = f"{low:.4f} to {high:.4f} mm in worst case, {least:.4f} to {most:.4f} mm by root sum square"
        given = "With the given tolerances the" if refused(chain) else "The"
        sentences.append(f"{given} closing link is {place}{_yield(chain)}.")
    if bent := chain.get("linearisation"):
        worst = f"the worst case by {bent['worst_case_error_mm']:.4f} mm, the mean by {bent['mean_shift_mm']:+z.4f} mm"
        spread = f"the standard deviation by {bent.get('deviation_error_percent') or 0.0:+z.1f} %"
        sentences.append(f"A linear chain would miss {worst} and {spread}.")
    if chain.get("cost") is not None:
        sentences.append(f"The allocated tolerances cost {chain['cost']:.4g}.")
    return sentences


def _yield(chain: Record) -> str:
    """', yield 0.9975 ± 0.0010 (120 ppm below, 80 ppm above), Cp 1.20, Cpk 1.10' of the parts as given."""
    share = part(chain, "yield", "as_given")
    if share is None:
        return ""
    error = part(chain, "yield_standard_errors", "as_given") or part(chain, "yield", "standard_error")
    words = f", yield {with_error(share, None if error is None else NORMAL * error)}"
    if out := part(chain, "rejected", "as_given"):
        words += f" ({out['low_ppm']:.0f} ppm below, {out['high_ppm']:.0f} ppm above)"
    if (able := chain.get("distribution") or {}).get("cp") is not None:
        words += f", Cp {able['cp']:.2f}, Cpk {able['cpk']:.2f}"
    return f"{words}; the laws of the parts count as exact"


def _distributions(chain: Record, detail: Detail = Detail.LEAST) -> list[Block]:
    """Yields by the distribution of the parts, and quantiles of the closing link."""
    yields, exact = chain.get("yield") or {}, chain.get("exact_yield") or {}
    errors, rejected = chain.get("yield_standard_errors") or {}, chain.get("rejected") or {}
    rows = [
        (
            kind.replace("_", " "),
            with_error(share, NORMAL * errors[kind] if kind in errors else None),
            f"{exact[kind]:.6f}" if kind in exact else "",
            *(_ppm(rejected.get(kind), side) for side in ("low", "high")),
        )
        for kind, share in yields.items()
        if kind != "standard_error"
    ]
    header = ("distribution of the parts", "yield", "without sampling", "ppm below", "ppm above")
    sampled = f" by {counted(chain['samples'], 'sample')} (95 % intervals)" if chain.get("samples") else ""
    quantiles = [
        (f"{100 * float(share):g} %", f"{size:.4f}")
        for share, size in (part(chain, "distribution", "quantiles_mm") or {}).items()
    ]
    return [
        Table(f"Yield{sampled}", header, rows, detail=detail).without_empty_columns(),
        Table("Quantiles of the closing link", ("share below", "size [mm]"), quantiles, detail=detail),
    ]


def _ppm(rejected: Record | None, side: str) -> str:
    return (
        "" if rejected is None else with_error(rejected[f"{side}_ppm"], NORMAL * rejected[f"{side}_standard_error_ppm"])
    )


def _selective(found: Record) -> list[Block]:
    """What matching of two parts in classes gives."""
    low, high = found["worst_case_mm"]
    needed = found.get("classes_needed")
    enough = "no number of classes keeps" if needed is None else f"{needed} would keep"
    classes = counted(found["classes"], "class")
    good = with_error(found["good_of_matched"], NORMAL * found["standard_error"])
    rows = [
        (label(name), "  ".join(f"{edge:.4f}" for edge in edges)) for name, edges in found["class_limits_mm"].items()
    ]
    return [
        Paragraph(
            f"Matched in {classes}: closing link {low:.4f} to {high:.4f} mm in worst case ({enough} the limits), "
            f"{100 * found['matched']:.2f} % of the parts can be paired, {good} of the pairs are within the limits "
            f"({found['random']:.6f} at random).",
            detail=Detail.USUAL,
        ),
        Table("Classes", ("part", "limits of the classes [mm]"), rows, text_columns=(1,), detail=Detail.ALL),
    ]


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
