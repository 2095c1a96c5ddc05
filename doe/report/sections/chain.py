"""Dimension chains: the parts to make, their contributions, the share of assemblies within limits, and their record."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from doe.dimension_chain import ChainResult
from doe.dimension_chain.links import ESTIMATED, size_text
from doe.dimension_chain.solution import ALLOCATED, SOURCES
from doe.report.sections.record import Record, dimension, moved, part, record_table, sizes
from doe.report.still import COLOURS, FONT, Still, name_marks
from rbdyn.base.blocks import Block, Detail, Figures, Heading, Paragraph, Section, Table
from rbdyn.base.words import counted, label, with_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Keys of a chain that have blocks of their own.
SHOWN_KEYS = {
    "closing_link", "yield", "yield_standard_errors", "exact_yield", "rejected", "contributions", "allocation", "status",
    "distribution", "linearisation", "cost", "selective_assembly", "samples", "parts", "contributions_mm", "missed", "remedy",
    "limits_mm", "resolution_mm",
}  # fmt: skip
ROW = 34.0  # height of a bar with its margin [pt]
WRITTEN = 8.0  # share of a bar from which its number fits in it [%]
# Okabe and Ito 2008, ordered so that neighbours differ in lightness too, each with the colour of letters on it. They are the
# same in light and dark, so none is a colour of the page.
FILLS = (
    ("#0072b1", "#fefefe"), ("#f0e442", "#111111"), ("#d55e00", "#fefefe"), ("#56b4e9", "#111111"),
    ("#6b3a59", "#fefefe"), ("#e69f00", "#111111"), ("#006b4f", "#fefefe"), ("#e5a9cb", "#111111"),
)  # fmt: skip
KINDS = (("variance_percent", "variance"), ("worst_case_percent", "worst case"))
NORMAL = 1.96  # half-width of a 95 % interval over its standard error


def chains(summary: Record, motion: Mapping[str, Any]) -> Section:
    """Of each chain a stacked bar of contributions, the yields by distribution and all other figures."""
    blocks: list[Block] = []
    for name, chain in (part(summary, "chains") or {}).items():
        blocks.append(Heading(label(name)))
        if shares := chain.get("contributions"):
            caption = "Contribution of each part to the scatter of the closing link."
            blocks.append(Figures([contributions(name, shares).svg], caption))
        blocks += chain_blocks(name, chain)
        rest = {key: value for key, value in chain.items() if key not in SHOWN_KEYS}
        blocks.append(record_table(f"Further figures of the chain {label(name)}", rest, folded=True))
    return Section("chains", "Dimension chains", blocks)


def chain_blocks(name: str, chain: Record) -> list[Block]:
    """Parts, contributions, closing link and yield of a dimension chain; at full detail also yields and classes.

    A refused chain shows its contributions, by how much it misses, and what would meet its limits, at any detail.
    """
    selective = chain.get("selective_assembly")
    status = str(chain.get("status") or "")
    detail = Detail.LEAST if refused(chain) else Detail.USUAL
    return [
        _parts_table(name, chain),
        replace(_shares_table(name, chain), detail=detail),
        *_distributions(chain, Detail.ALL),
        *(Paragraph(sentence, detail=detail) for sentence in _closing(chain)),
        *(_refusal(name, chain) if refused(chain) else [Paragraph(_sentence(status), detail=Detail.USUAL)]),
        *(_selective(selective) if selective else ()),
    ]


def refusal_blocks(name: str, chain: Record) -> list[Block]:
    """What each part of a refused chain takes, by how much it misses, and what would meet its limits; nothing for others."""
    return [_shares_table(name, chain), *_refusal(name, chain)] if refused(chain) else []


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def _parts_table(name: str, chain: Record) -> Table:
    """Sizes for the drawing: stated ones as they are written, allocated ones at its resolution."""
    rows = sizes(chain, "parts") or sizes(chain)
    title = f"Dimension chain {label(name)}"
    if refused(chain):
        given = all(row.get("origin") == "stated" for row in rows.values())
        title += f": {'the stated sizes' if given else 'even the narrowest tolerances'} miss the limits"
    elif chain.get("status") == "ok":
        title += ": the stated sizes meet the limits"
    return _sizes_table(title, rows)


def _sizes_table(title: str, rows: Mapping[str, Record]) -> Table:
    cells = [
        (label(name), dimension(row), grade_cell(row), moved(row), row.get("origin") or "")
        for name, row in rows.items()
    ]
    header = ("part", "size [mm]", "grade", "nominal moved [mm]", "deviations")
    return Table(title, header, cells, estimates_note(rows), text_columns=(2, 4)).without_empty_columns()


def estimates_note(rows: Mapping[str, Record]) -> str:
    """'≈ estimated: guide land 61.333 mm; state it before the part is drawn.' of parts to make; empty without an estimate."""
    names = [
        f"{label(name)} {size_text(row['nominal_mm'], 0.0, 0.0).split()[0]} mm"
        for name, row in rows.items()
        if row.get("estimated")
    ]
    state = "it before the part is drawn" if len(names) == 1 else "them before the parts are drawn"
    return f"{ESTIMATED} estimated: {', '.join(names)}; state {state}." if names else ""


def grade_cell(row: Record) -> str:
    """'IT7, m6 within' of a part: its grade, and of a seat the class of ISO 286 within its limits."""
    within = f"{row['iso_class']} within" if row.get("iso_class") else ""
    return ", ".join(word for word in (row.get("grade_words") or row.get("grade"), within) if word)


def refused(chain: Record) -> bool:
    """Whether the parts of a chain miss its limits."""
    return str(chain.get("status")).startswith("refused")


def _refusal(name: str, chain: Record) -> list[Block]:
    """By how much a chain misses its limits, why, what would meet them, and the nearest sizes that do."""
    stated, nearest = sizes(chain, "parts"), sizes(chain)
    figures = ("nominal_mm", "upper_mm", "lower_mm")
    differs = any(row[key] != stated[name][key] for name, row in nearest.items() if name in stated for key in figures)
    return [
        Paragraph(_miss(name, chain), "warning"),
        Paragraph(_sentence(str(chain["status"]))),
        Paragraph(part(chain, "remedy", "sentence") or ""),
        _sizes_table("The nearest sizes that meet the limits", nearest if differs else {}),
    ]


def _miss(name: str, chain: Record) -> str:
    """'Chain pocket misses its limits: 0.3300 mm below the lower limit.'"""
    missed = chain.get("missed") or {}
    if missed.get("yield_short"):
        return f"Chain {label(name)} misses its yield: {missed['yield_short']:.4g} of the assemblies too many are outside its limits."
    figures = [
        f"{missed[key]:.4f} mm {words}"
        for key, words in (
            ("below_mm", "below the lower limit"),
            ("above_mm", "above the upper limit"),
            ("width_mm", "more than their distance"),
        )
        if missed.get(key)
    ]
    return f"Chain {label(name)} misses its limits: {', '.join(figures) or chain['status']}."


def _shares_table(name: str, chain: Record) -> Table:
    """What each part takes of the closing link's scatter: percent, and mm."""
    shares, widths = chain.get("contributions") or {}, chain.get("contributions_mm") or {}
    rows = [
        (
            label(name),
            *(_percent(part(shares, name, kind)) for kind, _ in KINDS),
            *(_size(part(widths, name, kind)) for kind in ("six_sigma_mm", "worst_case_mm")),
        )
        for name in shares
    ]
    header = ("part", *(words for _, words in KINDS), "six sigma [mm]", "worst case [mm]")
    title = f"Contributions to the scatter of the closing link, chain {label(name)}"
    return Table(title, header, rows, _room(chain)).without_empty_columns()


def _room(chain: Record) -> str:
    """'The parts take 0.0350 mm in worst case of the 0.0300 mm between the limits.'"""
    closing, limits = chain.get("closing_link") or {}, chain.get("limits_mm")
    if limits is None or not {"worst_case_mm", "rss_mm"} <= set(closing):
        return ""
    lower, upper = limits
    worst, root, room = (high - low for low, high in (closing["worst_case_mm"], closing["rss_mm"], limits))
    return (
        f"The parts take {worst:.4f} mm in worst case and {root:.4f} mm by root sum square, of the {room:.4f} mm from "
        f"{lower:.4f} to {upper:.4f} mm."
    )


def _size(value: float | None) -> str:
    return "" if value is None else f"{value:.4f}"


def _percent(value: float | None) -> str:
    return "" if value is None else f"{value:.1f} %"


def _closing(chain: Record) -> list[str]:
    """The range of the closing link, the errors of a linear chain, and the cost of the tolerances."""
    sentences = []
    closing = chain.get("closing_link") or {}
    if {"worst_case_mm", "rss_mm"} <= set(closing):
        (low, high), (least, most) = closing["worst_case_mm"], closing["rss_mm"]
        place = f"{low:.4f} to {high:.4f} mm in worst case, {least:.4f} to {most:.4f} mm by root sum square"
        start = "With these sizes the" if refused(chain) else "The"
        sentences.append(f"{start} closing link is {place}{_yield(chain)}.")
    if errors := chain.get("linearisation"):
        worst = (
            f"the worst case by {errors['worst_case_error_mm']:.4f} mm, the mean by {errors['mean_shift_mm']:+z.4f} mm"
        )
        spread = f"the standard deviation by {errors.get('deviation_error_percent') or 0.0:+z.1f} %"
        sentences.append(f"A linear chain would be off: {worst} and {spread}.")
    if chain.get("cost") is not None:
        sentences.append(f"The allocated tolerances cost {chain['cost']:.4g}.")
    return sentences


def yield_words(chain: Record) -> str:
    """'yield 0.9975 ± 0.0010' of the parts as stated; empty where it is unknown."""
    share = part(chain, "yield", "as_given")
    if share is None:
        return ""
    error = part(chain, "yield_standard_errors", "as_given") or part(chain, "yield", "standard_error")
    return f"yield {with_error(share, None if error is None else NORMAL * error)}"


def _yield(chain: Record) -> str:
    """', yield 0.9975 ± 0.0010 (120 ppm below, 80 ppm above), Cp 1.20, Cpk 1.10' of the parts as stated."""
    if not (words := yield_words(chain)):
        return ""
    words = f", {words}"
    if rejected := part(chain, "rejected", "as_given"):
        words += f" ({rejected['low_ppm']:.0f} ppm below, {rejected['high_ppm']:.0f} ppm above)"
    if (capability := chain.get("distribution") or {}).get("cp") is not None:
        words += f", Cp {capability['cp']:.2f}, Cpk {capability['cpk']:.2f}"
    return f"{words}, with exact laws of the parts"


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
    samples = f" by {counted(chain['samples'], 'sample')} (95 % intervals)" if chain.get("samples") else ""
    quantiles = [
        (f"{100 * float(share):g} %", f"{size:.4f}")
        for share, size in (part(chain, "distribution", "quantiles_mm") or {}).items()
    ]
    return [
        Table(f"Yield{samples}", header, rows, detail=detail).without_empty_columns(),
        Table("Quantiles of the closing link", ("share below", "size [mm]"), quantiles, detail=detail),
    ]


def _ppm(rejected: Record | None, side: str) -> str:
    return (
        "" if rejected is None else with_error(rejected[f"{side}_ppm"], NORMAL * rejected[f"{side}_standard_error_ppm"])
    )


def _selective(assembly: Record) -> list[Block]:
    """Selective assembly: two parts matched in classes."""
    low, high = assembly["worst_case_mm"]
    needed = assembly.get("classes_needed")
    enough = "no number of classes keeps the limits" if needed is None else f"{needed} classes keep the limits"
    enough = "random assemblies keep the limits" if needed == 1 else enough
    classes = counted(assembly["classes"], "class")
    good = with_error(assembly["good_of_matched"], NORMAL * assembly["standard_error"])
    rows = [
        (label(name), "  ".join(f"{edge:.4f}" for edge in edges)) for name, edges in assembly["class_limits_mm"].items()
    ]
    return [
        Paragraph(
            f"Matched in {classes}, the closing link is {low:.4f} to {high:.4f} mm in worst case ({enough}). "
            f"{100 * assembly['matched']:.2f} % of the parts can be paired. A share of {good} of the pairs is within the limits "
            f"({assembly['random']:.6f} at random).",
            detail=Detail.USUAL,
        ),
        Table("Classes", ("part", "limits of the classes [mm]"), rows, text_columns=(1,), detail=Detail.ALL),
    ]


def contributions(name: str, shares: Record) -> Still:
    """Stacked bars, by variance and in worst case; a part is identified by its number, colour and title."""
    sizes = [(words, [part(share, kind) or 0.0 for share in shares.values()]) for kind, words in KINDS]
    sizes = [(words, values) for words, values in sizes if sum(values) > 0.0]
    below = 12.0 + 18.0 * len(shares)
    return Still(
        f"Contributions to the chain {label(name)}",
        partial(_contributions, [label(name) for name in shares], sizes),
        width=640.0, height=16.0 + ROW * len(sizes) + below, left_margin=92.0, bottom_margin=below,
    )  # fmt: skip


def _contributions(names: Sequence[str], sizes: Sequence[tuple[str, Sequence[float]]], axis: "Axes") -> None:
    bars: list[Any] = []
    for row, (words, values) in enumerate(sizes):
        start = 0.0
        for number, value in enumerate(values):
            share, (colour, ink) = 100.0 * value / sum(values), FILLS[number % len(FILLS)]
            (bar,) = axis.barh(row, share, 0.7, start, color=colour, edgecolor=COLOURS["paper"])
            name_marks(bar, "share", [f"{names[number]}: {value:.1f} % of the {words}"])
            if share > WRITTEN:
                axis.text(start + 0.5 * share, row, f"{number + 1}: {value:.0f} %", color=ink, ha="center", va="center")
            bars += [bar] if row == 0 else []
            start += share
    axis.set(xlim=(0.0, 100.0), ylim=(len(sizes) - 0.5, -0.5), xticks=[])
    axis.set_yticks(range(len(sizes)), [words for words, _ in sizes])
    axis.grid(visible=False)
    axis.spines[:].set_visible(False)
    entries = [f"{number}: {name}" for number, name in enumerate(names, 1)]
    axis.legend(bars, entries, loc="upper left", bbox_to_anchor=(0.0, 0.0), borderaxespad=0.4, borderpad=0.0,
                handlelength=1.1, handleheight=1.1, labelspacing=0.5, fontsize=FONT)  # fmt: skip


def chain_tables(results: Mapping[str, ChainResult]) -> dict[str, list[dict[str, Any]]]:
    """Rows of part_dimensions.csv, the parts of all chains, and of contributions.csv, their shares in the scatter."""
    return {
        "part_dimensions.csv": [
            {"chain": name, "part": part.name, **{key: getattr(part, key) for key in (*ALLOCATED, *SOURCES)}}
            for name, chain in results.items()
            for part in chain.parts
            if part.origin != "temperature"
        ],
        "contributions.csv": [
            {"chain": name, "part": part, **shares}
            for name, chain in results.items()
            for part, shares in chain.contributions.items()
        ],
    }


def chains_record(results: Mapping[str, ChainResult]) -> dict[str, Any]:
    """JSON of ``doe chain`` for a file of several chains."""
    refused = [name for name, result in results.items() if result.refused]
    status = f"refused: {', '.join(refused)}" if refused else "ok"
    return {"chains": {name: result.as_dict() for name, result in results.items()}, "status": status}
