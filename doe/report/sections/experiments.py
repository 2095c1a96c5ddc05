"""The design: its points with what they gave, how good it is, what failed."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

from doe.report.sections.fits import evaluation_plots
from doe.report.sections.record import Record, factors, part, record_table, responses
from rbdyn.base.blocks import Block, Figures, Paragraph, Section, Table
from rbdyn.base.words import label, shown, with_error

# Longer tables are opened on demand.
LONG = 40


def design(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Points table and evaluation."""
    record = part(summary, "design")
    if not record:
        return None
    kind = str(record.get("kind") or "design").replace("_", " ")
    blocks: list[Block] = [Paragraph(f"{kind[0].upper()}{kind[1:]}, {shown(record.get('runs'))} runs.")]
    if points := record.get("points"):
        blocks.append(_points(summary, points))
    if evaluation := record.get("evaluation"):
        blocks += _evaluation(evaluation)
    blocks.append(failure_table(record.get("failures") or []))
    return Section("design", "Design", blocks)


def _points(summary: Record, points: Sequence[Record]) -> Table:
    given = factors(summary)
    names = [each["name"] for each in responses(summary)]
    blocked = len({point.get("block") for point in points}) > 1
    header = ["run", "kind", *(["block"] if blocked else []), *(label(each.name) for each in given), *map(label, names)]
    rows = [
        [
            shown(point.get("run")),
            str(point.get("kind") or ""),
            *([shown(point.get("block"))] if blocked else []),
            *(each.text(part(point, "factors", each.name), 2) for each in given),
            *(_response(part(point, "responses", name)) for name in names),
        ]
        for point in points
    ]
    note = "± are 95 % half-widths of the mean of the replicates."
    folded = len(rows) > LONG
    return Table("Runs and responses", header, rows, note, folded, text_columns=(1,), sortable=True)


def _response(value: Record | None) -> str:
    return "failed" if value is None or value.get("value") is None else with_error(value["value"], value.get("error"))


def _evaluation(evaluation: Record) -> list[Block]:
    """Single figures in one table; figures by term in another."""
    tables = {key: value for key, value in evaluation.items() if isinstance(value, Mapping)}
    by_term = {key: value for key, value in tables.items() if {"A", "B"} <= set(value)}
    rest = {key: value for key, value in evaluation.items() if key not in by_term and not isinstance(value, list)}
    blocks: list[Block] = [record_table("How good the design is for the models asked", rest), _by_term(by_term)]
    if pictures := evaluation_plots(evaluation):
        what = "Scaled prediction variance: least, mean and largest by radius"
        caption = f"{what}; and what a share of the region stays below."
        blocks.append(Figures([each.svg for each in pictures], caption))
    return blocks


def _by_term(columns: Mapping[str, Record]) -> Table:
    """A column for each figure; a figure that has several kinds has a column for each."""
    flat: dict[str, dict[str, Any]] = defaultdict(dict)
    for key, terms in columns.items():
        for term, value in terms.items():
            kinds = value if isinstance(value, Mapping) else {"": value}
            for kind, each in kinds.items():
                flat[label(f"{key}" if not kind else f"{kind}_{key}")][term] = each
    terms = next(iter(flat.values()), {})
    rows = [[term, *(shown(column.get(term), 3) for column in flat.values())] for term in terms]
    return Table("By term", ["term", *flat], rows)


def failure_table(failures: Sequence[Record]) -> Table:
    """Failures as they are grouped, by their cause."""
    rows = [(str(each.get("cause") or "unknown"), shown(each.get("labels") or each.get("runs"))) for each in failures]
    return Table("What failed, by cause", ("cause", "runs"), rows, text_columns=(1,))
