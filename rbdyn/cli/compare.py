"""The command ``rbdyn compare``. Physics is imported inside it, so that help comes at once."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbdyn.base import command
from rbdyn.base.blocks import Block, Detail, Paragraph, Table, with_notes
from rbdyn.base.command import Console, Delivery, result_command
from rbdyn.base.html import REPORT_FILES
from rbdyn.base.identity import Identity, identity_of
from rbdyn.base.words import counted, improvement, quantity

if TYPE_CHECKING:
    from rbdyn.comparison import Comparison, Difference, Input

FILES = ("comparison.json", "inputs.csv", "differences.csv")
# Units in which a change is stated in place of a percentage: their zero is no size.
ABSOLUTE = ("°C", "µm", "mrad", "deg")


@result_command(
    "rbdyn compare",
    (*FILES, *REPORT_FILES),
    "Write comparison.json, inputs.csv and differences.csv to this folder.",
    "Add losses, clearances and contacts one by one.",
)
def compare(
    console: Console,
    a: Annotated[Path, typer.Argument(metavar="A", help="A scene file, a saved result, or a folder with one.")],
    b: Annotated[
        Path | None, typer.Argument(metavar="B", help="A second bearing of this kind.", show_default="A with --set")
    ] = None,
    assignments: Annotated[
        list[str] | None,
        command.valued(
            "KEY.PATH=VALUE", "Replace a key of B (without B: of a copy of A); repeatable.", "B as written", "--set"
        ),
    ] = None,
    turns: command.Turns = None,
    replicates: command.Replicates = None,
    seed: command.Seed = None,
    workers: command.Workers = None,
) -> Delivery:
    """Compare two bearings: inputs that differ, results, and which differences are significant."""
    console.folder.claim(a, *([] if b is None else [b]))
    from rbdyn.comparison import compare as run
    from rbdyn.comparison import file_of

    shorthand = {"turns": turns, "replicates": replicates, "seed": seed}
    both = [f"numerics.{key}={value}" for key, value in shorthand.items() if value is not None]
    with console.progress("comparing") as progress:
        found = run(a, b, assignments or [], both, workers, progress, console.notice)
    identity = _identity(found, [file_of(path) for path in (a, b) if path is not None])
    return Delivery(identity, found.as_dict, partial(blocks, found), partial(_write, found), found.failed)


def _identity(found: "Comparison", files: Sequence[Path]) -> Identity:
    """Identity of both bearings; what differs of bearing and operating point is stated of each."""
    a, b = (identity_of("rbdyn compare", side.scene, files) for side in (found.a, found.b))
    pairs = {name: (getattr(a, name), getattr(b, name)) for name in ("bearing", "drawing", "point")}
    words: dict[str, Any] = {
        name: ours if ours == theirs else f"{ours} against {theirs}" for name, (ours, theirs) in pairs.items()
    }
    return replace(a, **words)


def blocks(found: "Comparison") -> list[Block]:
    """What differs and by how much, first in a sentence; the inputs, the figures, the parts, notes."""
    sides = [f"{place}: {side.name}" for place, side in (("A", found.a), ("B", found.b))]
    failed = [] if not found.failed else [Paragraph(f"{found.status}.", "warning")]
    compared: list[Block] = [
        *map(Paragraph, sides),
        *failed,
        Paragraph(statement(found), "statement"),
        _input_table(found.inputs),
        _figure_table("Figures", found.figures if _in_common(found) else {}),
        Paragraph(_part_sentence(found.parts), detail=Detail.USUAL),
        _figure_table("Parts", found.parts, Detail.ALL),
    ]
    return with_notes(found.notes, compared, judged=False)


# Verdicts in the order in which they are said, and most figures that a sentence names of each.
ORDER = ("significant", "within error", "error unknown", "equal", "only in A", "only in B")
MOST_NAMED = 8


def statement(found: "Comparison") -> str:
    """The significant changes from A to B in words, then the other figures."""
    if not _in_common(found):
        return "No results can be compared."
    if all(figure.verdict == "equal" for figure in found.figures.values()):
        return f"No {'' if found.inputs else 'input and no '}figure differs."
    scatter = sum(bool(figure.error_together) for figure in found.figures.values())
    together = f" (intervals of 95 % that hold for all {scatter} together)" if scatter > 1 else ""
    exact = "" if scatter else " (an equilibrium has no scatter, so every difference counts)"
    groups = {verdict: _named(found.figures, verdict) for verdict in ORDER}
    said = "; ".join(f"{verdict}: {names}" for verdict, names in groups.items() if names)
    return f"{'' if found.inputs else 'No input differs. '}B against A{together or exact}: {said}."


def _in_common(found: "Comparison") -> bool:
    return any(figure.difference is not None for figure in found.figures.values())


def _named(figures: Mapping[str, "Difference"], verdict: str) -> str:
    """Figures with this verdict, of significant ones also the change."""
    names = [
        f"{quantity(name)[0]} {change(name, figure)}" if verdict == "significant" else quantity(name)[0]
        for name, figure in figures.items()
        if figure.verdict == verdict
    ]
    more = [f"{len(names) - MOST_NAMED} more"] if len(names) > MOST_NAMED else []
    return ", ".join([*names[:MOST_NAMED], *more])


def change(name: str, figure: "Difference") -> str:
    """'3.30 ± 0.62 % less', of B against A; in the figure's own unit where a percentage says nothing."""
    unit = quantity(name)[1]
    if figure.difference is None:
        return figure.verdict
    if unit in ABSOLUTE or figure.percent is None:
        return improvement(-figure.difference, figure.error_together, "min", unit)
    scale = figure.percent / figure.difference if figure.difference else 0.0
    return improvement(-figure.percent, None if figure.error_together is None else scale * figure.error_together, "min")


def _input_table(inputs: Sequence["Input"]) -> Table:
    """The inputs; of a table that only one scene has without the keys at their defaults."""
    from rbdyn.comparison import input_sheet

    listed = [entry for entry in inputs if not entry.is_left_out]
    caption = "1 input differs" if len(inputs) == 1 else f"{len(inputs)} inputs differ"
    left = len(inputs) - len(listed)
    note = f"{counted(left, 'more key')} at the default, in tables that only A or only B has" if left else ""
    return replace(input_sheet(listed).block, caption=caption, note=note)


def _figure_table(caption: str, figures: Mapping[str, "Difference"], detail: Detail = Detail.LEAST) -> Table:
    """The figures that are not zero in both."""
    from rbdyn.comparison import difference_sheet

    listed = {name: figure for name, figure in figures.items() if figure.a or figure.b}
    return replace(difference_sheet(listed).block, caption=caption, detail=detail)


def _part_sentence(parts: Mapping[str, "Difference"]) -> str:
    """The significant differences of the parts, losses last; empty where no part has figures."""
    by_kind = dict(sorted(parts.items(), key=lambda item: item[0].endswith("_power_W")))
    return f"Parts that differ: {_named(by_kind, 'significant') or 'none'} (all of them: -v)." if parts else ""


def _write(found: "Comparison", folder: Path) -> None:
    """Write comparison.json, inputs.csv and differences.csv."""
    from rbdyn.comparison import difference_sheet, input_sheet

    found.save(folder / FILES[0])
    input_sheet(found.inputs).save(folder)
    difference_sheet(found.figures | found.parts).save(folder, "%.8g")
