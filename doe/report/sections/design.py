"""The design: its points with their results, its quality, failed runs, and the record of ``doe design``."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from doe.designs import Design
from doe.report.sections.record import Record, factors
from doe.report.still import GUIDE, Point, Still
from doe.workflow.problem import Problem
from rbdyn.base.blocks import Block, Detail, Table
from rbdyn.base.records import quoted_cell
from rbdyn.base.words import counted, label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
from collections import defaultdict

from doe.report.sections.record import part, record_table, responses
from rbdyn.base.blocks import Figures, Paragraph, Section
from rbdyn.base.words import shown, with_error

# Rows above which a table is folded.
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
    columns = factors(summary)
    names = [response["name"] for response in responses(summary)]
    blocked = len({point.get("block") for point in points}) > 1
    header = [
        "run",
        "kind",
        *(["block"] if blocked else []),
        *(label(factor.name) for factor in columns),
        *map(label, names),
    ]
    rows = [
        [
            shown(point.get("run")),
            str(point.get("kind") or ""),
            *([shown(point.get("block"))] if blocked else []),
            *(factor.text(part(point, "factors", factor.name), 2) for factor in columns),
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
        caption = f"{what}; and the value below which a share of the region is."
        blocks.append(Figures([still.svg for still in pictures], caption))
    return blocks


def _by_term(columns: Mapping[str, Record]) -> Table:
    """A column for each figure; a figure that has several kinds has a column for each."""
    flat: dict[str, dict[str, Any]] = defaultdict(dict)
    for key, terms in columns.items():
        for term, value in terms.items():
            kinds = value if isinstance(value, Mapping) else {"": value}
            for kind, number in kinds.items():
                flat[label(f"{key}" if not kind else f"{kind}_{key}")][term] = number
    terms = next(iter(flat.values()), {})
    rows = [[term, *(shown(column.get(term), 3) for column in flat.values())] for term in terms]
    return Table("By term", ["term", *flat], rows)


def failure_table(failures: Sequence[Record]) -> Table:
    """Failures grouped by their cause."""
    rows = [
        (str(failure.get("cause") or "unknown"), shown(failure.get("labels") or failure.get("runs")))
        for failure in failures
    ]
    return Table("What failed, by cause", ("cause", "runs"), rows, text_columns=(1,))


def evaluation_plots(evaluation: Record) -> list[Still]:
    """Variance dispersion graph and fraction of design space, as far as they are there."""
    stills = []
    if shells := evaluation.get("by_radius"):
        curves = {
            key: [(float(shell["radius"]), float(shell[key])) for shell in shells] for key in ("min", "mean", "max")
        }
        words = "Scaled prediction variance by radius: least, mean, largest"
        stills.append(Still(words, partial(_variance, "coded radius", curves)))
    if shares := evaluation.get("fraction_of_design_space"):
        points = [(float(share["percent"]), float(share["variance"])) for share in shares]
        words = "Scaled prediction variance by share of the region below it"
        stills.append(Still(words, partial(_variance, "share of the region [%]", {"mean": points})))
    return stills


def _variance(across: str, curves: Mapping[str, Sequence[Point]], axis: "Axes") -> None:
    for key, curve in curves.items():
        axis.plot(*zip(*curve, strict=True), **({} if key == "mean" else GUIDE))
    axis.set(xlabel=across, ylabel="scaled prediction variance")
    axis.set_ylim(bottom=0.0)


def runs_record(study: Problem, design: Design) -> list[dict[str, Any]]:
    """Runs in their order, from 1."""
    actual = study.actual(design.coded)
    rows = zip(design.order.tolist(), design.kind, design.block_numbers, design.coded, actual, strict=True)
    return [
        {
            "run": number,
            "kind": kind,
            "block": block,
            "coded": study.by_factor(coded),
            "factors": study.by_factor(values),
            "seed": study.file.design.seed + place,
        }
        for number, (place, kind, block, coded, values) in enumerate(rows, 1)
    ]


def design_record(study: Problem, design: Design, evaluation: dict[str, Any]) -> dict[str, Any]:
    """JSON of ``doe design``: runs in their order, ``standard`` being the place in the standard order from 1."""
    runs = zip(runs_record(study, design), design.order.tolist(), strict=True)
    return {
        "kind": study.file.design.kind,
        "factors": study.factors,
        "reach": design.reach,
        "runs": [{**run, "standard": place + 1} for run, place in runs],
        "evaluation": evaluation,
    }


def design_tables(record: dict[str, Any]) -> dict[str, list[dict[str, Any]]]:
    """Rows of design.csv: the runs in their order, with coded and actual values."""
    keys = ("run", "kind", "block", "standard", "seed")
    return {
        "design.csv": [
            {
                **{key: run[key] for key in keys},
                **{f"coded_{name}": x for name, x in run["coded"].items()},
                **run["factors"],
            }
            for run in record["runs"]
        ]
    }


def print_csv(record: dict[str, Any]) -> None:
    """Run and actual factors, with the block where there are several."""
    blocked = record["evaluation"]["blocks"] is not None
    print(",".join(["run", *(["block"] if blocked else []), *map(quoted_cell, record["factors"])]))
    for run in record["runs"]:
        values = [f"{x:.9g}" for x in run["factors"].values()]
        print(",".join([str(run["run"]), *([str(run["block"])] if blocked else []), *values]))


def design_blocks(record: dict[str, Any]) -> list[Block]:
    """Runs in actual values, in coded ones, and the quality of the design; at full detail also seeds and leverages."""
    evaluation, runs = record["evaluation"], record["runs"]
    blocked = evaluation["blocks"] is not None
    actual = [
        (str(run["run"]), *([str(run["block"])] if blocked else []), *(f"{x:.6g}" for x in run["factors"].values()))
        for run in runs
    ]
    coded = [(str(run["run"]), run["kind"], *(f"{x:+.4f}" for x in run["coded"].values())) for run in runs]
    seeds = [
        (str(run["run"]), str(run["standard"]), str(run["seed"]), f"{leverage:.3f}")
        for run, leverage in zip(runs, evaluation["leverage"], strict=True)
    ]
    title = f"{record['kind'].replace('_', ' ')}, {counted(len(runs), 'run')}"
    names = [label(name) for name in record["factors"]]
    return [
        Table(title, ("run", *(["block"] if blocked else []), *names), actual),
        Table("Coded values", ("run", "point", *names), coded, text_columns=(1,), detail=Detail.USUAL),
        Table("Order, seeds and leverages", ("run", "standard", "seed", "leverage"), seeds, detail=Detail.ALL),
        *_evaluation_tables(evaluation),
    ]


def _evaluation_tables(evaluation: dict[str, Any]) -> list[Block]:
    """Quality of the design for the largest model of the study: as a whole, by term, by radius."""
    region = evaluation["region"]
    size = f"{'radius' if region['shape'] == 'ball' else 'half-width'} {region['reach']:.4g}"
    model = f"{evaluation['model'].replace('_', ' ')} model, {counted(len(evaluation['terms']), 'term')}"
    title = f"{model}, over the {region['shape']} of {size} (coded)"
    terms = [
        (term, f"{inflation:.3f}", *(_percent(evaluation["power_percent"][term][key]) for key in SIGMAS))
        for term, inflation in evaluation["vif"].items()
    ]
    header = ("term", "VIF", "power for 1 sigma [%]", "power for 2 sigma [%]")
    shells = [
        tuple(f"{shell[key]:.3f}" for key in ("radius", "min", "mean", "max")) for shell in evaluation["by_radius"]
    ]
    by_radius = "Scaled prediction variance by radius"
    return [
        Table(title, ("", "value"), _figures(evaluation), text_columns=(1,), detail=Detail.USUAL),
        Table("By term", header, terms, detail=Detail.USUAL),
        Table(by_radius, ("radius", "least", "mean", "largest"), shells, detail=Detail.ALL),
    ]


def _figures(evaluation: dict[str, Any]) -> list[tuple[str, str]]:
    freedom, variance = evaluation["degrees_of_freedom"], evaluation["scaled_prediction_variance"]
    letters = evaluation["efficiency_percent"].items()
    rows = [
        ("efficiency [%]", ", ".join(f"{letter.upper()} {value:.1f}" for letter, value in letters)),
        ("scaled prediction variance", ", ".join(f"{name} {variance[name]:.2f}" for name in ("centre", "mean", "max"))),
        ("its maximum in the box of the front", f"{variance['box_max']:.2f}"),
        ("degrees of freedom", ", ".join(f"{name.replace('_', ' ')} {n}" for name, n in freedom.items())),
        ("condition number of the model matrix", f"{evaluation['condition_number']:.2f}"),
        ("largest leverage", f"{max(evaluation['leverage']):.3f}"),
    ]
    if evaluation["blocks"] is not None:
        relation = "orthogonal" if evaluation["blocks"]["orthogonal"] else "not orthogonal"
        cosine = evaluation["blocks"]["largest_cosine"]
        rows.append(("blocks", f"{relation} to the terms (largest cosine {cosine:.3f})"))
    return rows


SIGMAS = ("one_sigma", "two_sigma")


def _percent(value: float | None) -> str:
    return "" if value is None else f"{value:.1f}"
