"""Dimension chains: the parts to make, their contributions, the share of assemblies within limits, and their record."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from doe.dimension_chain import ChainResult
from doe.dimension_chain.links import ESTIMATED, size_text
from doe.dimension_chain.solution import AllocatedSize, PartSize
from doe.dimension_chain.yields import SelectiveAssembly
from doe.report.still import COLOURS, FONT, Still, name_marks
from doe.report.summary import Summary
from rbdyn.base.blocks import (
    Block,
    Column,
    Detail,
    Figures,
    Heading,
    Paragraph,
    Section,
    Sheet,
    Table,
    columns_of,
    within,
)
from rbdyn.base.words import NORMAL, counted, label, with_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROW = 34.0  # height of a bar with its margin [pt]
WRITTEN = 8.0  # share of a bar from which its number fits in it [%]
# Okabe and Ito 2008, ordered so that neighbours differ in lightness too, each with the colour of letters on it. They are the
# same in light and dark, so none is a colour of the page.
FILLS = (
    ("#0072b1", "#fefefe"), ("#f0e442", "#111111"), ("#d55e00", "#fefefe"), ("#56b4e9", "#111111"),
    ("#6b3a59", "#fefefe"), ("#e69f00", "#111111"), ("#006b4f", "#fefefe"), ("#e5a9cb", "#111111"),
)  # fmt: skip
KINDS = (("variance_percent", "variance"), ("worst_case_percent", "worst case"))
# A part of a chain: the names of both, and its size.
SizeRow = tuple[str, str, AllocatedSize]
NAMES: tuple[Column[Any], ...] = (Column("chain", label, at=0, meaning="names"), Column("part", label, at=1))
DRAWN: Column[SizeRow] = Column("", words="size [mm]", cell=lambda row: row[2].drawn)


def chains(summary: Summary) -> Section:
    """Of each chain a stacked bar of contributions, and all its figures."""
    blocks: list[Block] = []
    for name, chain in summary.chains.items():
        caption = "Contribution of each part to the scatter of the closing link."
        blocks += [Heading(label(name)), Figures([contributions(name, chain.contributions).svg], caption)]
        blocks += chain_blocks(name, chain)
    return Section("chains", "Dimension chains", blocks)


def chain_blocks(name: str, chain: ChainResult) -> list[Block]:
    """Parts, contributions, closing link and yield of a dimension chain; at full detail also yields and classes.

    A refused chain shows its contributions, by how much it misses, and what would meet its limits, at any detail.
    """
    detail = Detail.LEAST if chain.refused else Detail.USUAL
    status = [Paragraph(_sentence(chain.status), detail=Detail.USUAL)]
    return [
        _parts_table(name, chain),
        replace(_shares_table(name, chain), detail=detail),
        *_distributions(chain),
        *(Paragraph(sentence, detail=detail) for sentence in _closing(chain)),
        *(_refusal(name, chain) if chain.refused else status),
        *(_selective(chain.selective) if chain.selective else ()),
    ]


def refusal_blocks(name: str, chain: ChainResult) -> list[Block]:
    """What each part of a refused chain takes, by how much it misses, and what would meet its limits; nothing for others."""
    return [_shares_table(name, chain), *_refusal(name, chain)] if chain.refused else []


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def _parts_table(name: str, chain: ChainResult) -> Table:
    """Sizes for the drawing: stated ones as they are written, allocated ones at its resolution."""
    title = f"Dimension chain {label(name)}"
    if chain.refused:
        stated = all(size.origin == "stated" for size in chain.drawn_sizes.values())
        title += f": {'the stated sizes' if stated else 'even the narrowest tolerances'} violate the limits"
    elif chain.status == "ok":
        title += ": the stated sizes meet the limits"
    return _sizes_table(title, name, chain.drawn_sizes, estimates_note(chain.drawn_sizes))


def _sizes_table(title: str, chain: str, sizes: Mapping[str, AllocatedSize], note: str = "") -> Table:
    columns = (NAMES[1], DRAWN, *within(2, columns_of(PartSize)))
    rows = [(chain, name, size) for name, size in sizes.items()]
    return Sheet(title, columns, rows, note).block.without_empty_columns()


def part_sheet(chains: Mapping[str, ChainResult]) -> Sheet[SizeRow]:
    """part_dimensions.csv: the parts of all chains."""
    rows = [(name, part, size) for name, chain in chains.items() for part, size in chain.drawn_sizes.items()]
    columns = (*NAMES, *within(2, columns_of(PartSize)))
    return Sheet(
        "", columns, rows, file="part_dimensions.csv", content="One row per part of each chain, in millimetres."
    )


def allocation_sheet(chains: Mapping[str, ChainResult]) -> Sheet[SizeRow]:
    """The allocated size of every part of all chains."""
    rows = [(name, part, size) for name, chain in chains.items() for part, size in chain.allocated.items()]
    return Sheet("", (*NAMES, *within(2, columns_of(AllocatedSize))), rows)


def closing_sheet(chains: Mapping[str, ChainResult]) -> Sheet[tuple[str, ChainResult]]:
    """The closing link of every chain: nominal and ends [mm], the yield of the parts as stated, and the status."""
    columns: tuple[Column[tuple[str, ChainResult]], ...] = (
        Column("chain", at=0),
        Column("nominal_mm", at=(1, "nominal_mm")),
        *(
            Column(f"{kind}_{end}_mm", at=(1, f"{kind}_mm", place))
            for kind in ("worst_case", "rss")
            for place, end in enumerate(("low", "high"))
        ),
        Column("yield", at=(1, "yields", "as_given")),
        Column("status", at=(1, "status")),
    )
    return Sheet("", columns, list(chains.items()))


def share_sheet(chains: Mapping[str, ChainResult]) -> Sheet[Any]:
    """contributions.csv: what each part takes of the scatter."""
    rows = [(name, part, shares) for name, chain in chains.items() for part, shares in chain.contributions.items()]
    meaning = "share in the variance of the closing link, and in its worst case"
    shares = Column[Any]("{}", at=(2, "{}"), meaning=meaning).of(key for key, _ in KINDS)
    return Sheet("", (*NAMES, *shares), rows, file="contributions.csv", content="One row per part of each chain.")


def estimates_note(sizes: Mapping[str, PartSize]) -> str:
    """'≈ estimated: guide land 61.333 mm; state it before the part is drawn.' of parts to make; empty without an estimate."""
    names = [
        f"{label(name)} {size_text(size.nominal_mm, 0.0, 0.0).split()[0]} mm"
        for name, size in sizes.items()
        if size.estimated
    ]
    state = "it before the part is drawn" if len(names) == 1 else "them before the parts are drawn"
    return f"{ESTIMATED} estimated: {', '.join(names)}; state {state}." if names else ""


def _refusal(name: str, chain: ChainResult) -> list[Block]:
    """By how much a chain misses its limits, why, what would meet them, and the nearest sizes that do."""
    stated, nearest = chain.drawn_sizes, chain.allocated
    figures = attrgetter("nominal_mm", "upper_mm", "lower_mm")
    differs = any(figures(size) != figures(stated[part]) for part, size in nearest.items() if part in stated)
    return [
        Paragraph(_miss(name, chain), "warning"),
        Paragraph(_sentence(chain.status)),
        Paragraph(chain.remedy.sentence if chain.remedy else ""),
        _sizes_table("The nearest sizes that meet the limits", name, nearest if differs else {}),
    ]


def _miss(name: str, chain: ChainResult) -> str:
    """'Chain pocket violates its limits: 0.3300 mm below the lower limit.'"""
    missed = chain.missed
    if missed and missed.yield_short:
        return f"Chain {label(name)} does not reach its yield: {missed.yield_short:.4g} of the assemblies too many are outside its limits."
    sizes = () if missed is None else (missed.below_mm, missed.above_mm, missed.width_mm)
    ends = "below the lower limit", "above the upper limit", "more than their distance"
    figures = [f"{size:.4f} mm {words}" for size, words in zip(sizes, ends, strict=False) if size]
    return f"Chain {label(name)} violates its limits: {', '.join(figures) or chain.status}."


def _shares_table(name: str, chain: ChainResult) -> Table:
    """What each part takes of the closing link's scatter: percent, and mm."""
    columns = (
        NAMES[1],
        *(Column[Any](key, lambda share: f"{share:.1f} %", words, at=(2, key)) for key, words in KINDS),
        Column[Any]("six_sigma_mm", ".4f", "six sigma [mm]", at=(2, "six_sigma_mm")),
        Column[Any]("worst_case_mm", ".4f", "worst case [mm]", at=(2, "worst_case_mm")),
    )
    rows = [(name, part, shares | chain.contributions_mm[part]) for part, shares in chain.contributions.items()]
    title = f"Contributions to the scatter of the closing link, chain {label(name)}"
    return Sheet(title, columns, rows, _room(chain)).block.without_empty_columns()


def _room(chain: ChainResult) -> str:
    """'The parts take 0.0350 mm in worst case of the 0.0300 mm between the limits.'"""
    lower, upper = chain.limits_mm
    worst, root, room = (high - low for low, high in (chain.worst_case_mm, chain.rss_mm, chain.limits_mm))
    return (
        f"The parts take {worst:.4f} mm in worst case and {root:.4f} mm by root sum square, of the {room:.4f} mm from "
        f"{lower:.4f} to {upper:.4f} mm."
    )


def _closing(chain: ChainResult) -> list[str]:
    """The range of the closing link, the errors of a linear chain, and the cost of the tolerances."""
    (low, high), (least, most) = chain.worst_case_mm, chain.rss_mm
    place = f"{low:.4f} to {high:.4f} mm in worst case, {least:.4f} to {most:.4f} mm by root sum square"
    start = "With these sizes the" if chain.refused else "The"
    sentences = [f"{start} closing link is {place}{_yield(chain)}."]
    if errors := chain.linearisation:
        worst = f"the worst case by {errors.worst_case_error_mm:.4f} mm, the mean by {errors.mean_shift_mm:+z.4f} mm"
        spread = f"the standard deviation by {errors.deviation_error_percent or 0.0:+z.1f} %"
        sentences.append(f"A linear chain would be off: {worst} and {spread}.")
    if chain.cost is not None:
        sentences.append(f"The allocated tolerances cost {chain.cost:.4g}.")
    return sentences


def yield_words(chain: ChainResult) -> str:
    """'yield 0.9975 ± 0.0010' of the parts as stated."""
    return f"yield {with_error(chain.yields['as_given'], NORMAL * chain.standard_errors['as_given'])}"


def _yield(chain: ChainResult) -> str:
    """', yield 0.9975 ± 0.0010 (120 ppm below, 80 ppm above), Cp 1.20, Cpk 1.10' of the parts as stated."""
    rejected = chain.rejected["as_given"]
    words = f", {yield_words(chain)} ({rejected['low_ppm']:.0f} ppm below, {rejected['high_ppm']:.0f} ppm above)"
    if chain.cp is not None:
        words += f", Cp {chain.cp:.2f}, Cpk {chain.cpk:.2f}"
    return f"{words}, with exact laws of the parts"


def _distributions(chain: ChainResult) -> list[Block]:
    """Yields by the distribution of the parts, and quantiles of the closing link."""

    def rejected(side: str) -> Column[str]:
        def cell(law: str) -> str:
            shares = chain.rejected[law]
            return with_error(shares[f"{side}_ppm"], NORMAL * shares[f"{side}_standard_error_ppm"])

        return Column("", words=f"ppm {'below' if side == 'low' else 'above'}", cell=cell)

    exact = chain.exact_yields or {}
    columns: tuple[Column[str], ...] = (
        Column("", words="distribution of the parts", cell=lambda law: law.replace("_", " ")),
        Column("", words="yield", cell=lambda law: with_error(chain.yields[law], NORMAL * chain.standard_errors[law])),
        Column("", words="without sampling", cell=lambda law: f"{exact[law]:.6f}" if law in exact else ""),
        rejected("low"),
        rejected("high"),
    )
    samples = f" by {counted(chain.samples, 'sample')} (95 % intervals)"
    quantiles = [(f"{100 * float(share):g} %", f"{size:.4f}") for share, size in chain.quantiles_mm.items()]
    return [
        Sheet(f"Yield{samples}", columns, list(chain.standard_errors), detail=Detail.ALL).block.without_empty_columns(),
        Table("Quantiles of the closing link", ("share below", "size [mm]"), quantiles, detail=Detail.ALL),
    ]


def _selective(assembly: SelectiveAssembly) -> list[Block]:
    """Selective assembly: two parts matched in classes."""
    low, high = assembly.worst_case_mm
    needed = assembly.classes_needed
    enough = "no number of classes meets the limits" if needed is None else f"{needed} classes meet the limits"
    enough = "random assemblies meet the limits" if needed == 1 else enough
    good = with_error(assembly.good, NORMAL * assembly.standard_error)
    rows = [(label(name), "  ".join(f"{edge:.4f}" for edge in edges)) for name, edges in assembly.edges_mm.items()]
    return [
        Paragraph(
            f"Matched in {counted(assembly.classes, 'class')}, the closing link is {low:.4f} to {high:.4f} mm in worst case ({enough}). "
            f"{100 * assembly.matched:.2f} % of the parts can be paired. A share of {good} of the pairs is within the limits "
            f"({assembly.random:.6f} at random).",
            detail=Detail.USUAL,
        ),
        Table("Classes", ("part", "limits of the classes [mm]"), rows, text_columns=(1,), detail=Detail.ALL),
    ]


def contributions(name: str, shares: Mapping[str, Mapping[str, float]]) -> Still:
    """Stacked bars, by variance and in worst case; a part is identified by its number, colour and title."""
    sizes = [(words, [share[kind] for share in shares.values()]) for kind, words in KINDS]
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


def chains_record(results: Mapping[str, ChainResult]) -> dict[str, Any]:
    """JSON of ``doe chain`` for a file of several chains."""
    refused = [name for name, result in results.items() if result.refused]
    status = f"refused: {', '.join(refused)}" if refused else "ok"
    return {"chains": {name: result.as_dict() for name, result in results.items()}, "status": status}
