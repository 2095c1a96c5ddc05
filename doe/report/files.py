"""The files of a study: summary.json, the report, answer.txt, tables and pictures; and its answer on the terminal."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from doe import clearance
from doe.report.page import html_report, notes, reference
from doe.report.sections import front
from doe.report.sections.answer import changes, first_screen, good_news
from doe.report.sections.chain import chains, part_sheet
from doe.report.sections.design import run_sheet
from doe.report.sections.duty import costs, duty_figures, gain_stills
from doe.report.sections.fit import diagnostics, fit_files
from doe.report.sections.front_pictures import search_stills
from doe.report.sections.unknown import decider_sheet, robust_input_sheet
from doe.report.still import save
from doe.report.summary import Summary, readable
from doe.response_surface import Surface
from doe.response_surface.statistics import fits_of
from doe.running.store import grouped
from doe.workflow.confirmation import ConfirmedPoint, PickLimit, point_words, statement, whirl_sentence
from doe.workflow.front_record import EstimatedPoint, SearchResult, SurfaceFront, predicted_rows
from doe.workflow.obstacles import Forecast, rivals_sentences
from doe.workflow.problem import Asked, Problem, Settings
from doe.workflow.runs import Runs, StudyDesign
from doe.workflow.status import study_identity
from doe.workflow.whole import StudyResult
from rbdyn.base import terminal
from rbdyn.base.arrays import Array
from rbdyn.base.blocks import Block, Column, Detail, Sheet, Verdict
from rbdyn.base.files import digest_of, sign, versions, write_json
from rbdyn.base.records import save_table
from rbdyn.base.words import label, quantity
from rbdyn.base.workbook import NAME as WORKBOOK
from rbdyn.base.workbook import write_workbook

FORMAT = "doe.study/2"
# A row of a table by its columns.
Row = Mapping[str, Any]
# What the name of a file should not have; a limit at a point of a duty has a name with a colon.
NO_WORD = re.compile(r"[^\w.-]+")
# Shaft turns of the motion in the pictures.
DRAWN_TURNS = 10.0


def write(outcome: StudyResult, folder: Path) -> dict[str, Any]:
    """Write everything into ``folder``; returns the record of the study, whose ``files`` names them.

    summary.json is written last: where it is, all else is whole.
    """

    study = outcome.study
    result = summary(outcome)
    record = result.as_dict()
    runs = run_sheet(study.factors, study.responses, result.design.points)
    tables = {
        runs.file: runs.records,
        **fit_files(outcome.study.surfaces),
        "front.csv": front.front_sheet(study.factors, study.responses, result.front.front).records
        if outcome.adaptive is None
        else predicted_rows(study, outcome.adaptive),
        "confirmation.csv": confirmation_sheet(study.factors, result.confirmation).records,
        "part_dimensions.csv": part_sheet(outcome.chains).records,
    }
    if outcome.duty is not None:
        tables["duty_points.csv"] = duty_figures(result).records
    if outcome.robust is not None:
        tables |= {
            sheet.file: sheet.records for sheet in (robust_input_sheet(outcome.robust), decider_sheet(outcome.robust))
        }
    if outcome.reference_values is not None:
        published = _reference_rows(study, outcome.runs, outcome.reference_values)
        tables["published_comparisons.csv"] = reference_sheet(study.factors, study.responses, published).records
    for name, rows in tables.items():
        save_table(rows, folder / name)
    pictures = []
    for surface in outcome.study.surfaces:
        pictures.append(f"surface_{NO_WORD.sub('_', surface.name)}.png")
        response_surface(study, surface, folder / pictures[-1])
    stills = {
        "robust_front.png": front.robust_stills(outcome.robust.front if outcome.robust else None),
        "adaptive_search.png": [] if result.adaptive is None else search_stills(result, result.adaptive),
        "duty_gains.png": gain_stills(result),
        "pareto_front.png": front.front_stills(result),
    }
    for name, drawn_stills in stills.items():
        if drawn_stills:
            save(drawn_stills, folder / name)
            pictures.append(name)
    motions = clearance.histories(outcome.scenes, DRAWN_TURNS)
    classes = {point_words(name): cage for name, cage in outcome.cage_classes.items()}
    pictures += clearance.draw_motion({point_words(name): motions[name] for name in motions}, folder, classes)
    drawn = {name: clearance.drawn_motion(motion) for name, motion in motions.items()}
    texts = {"report.html": html_report(result, drawn), "answer.txt": answer_text(result)}
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    write_workbook(folder / WORKBOOK, [folder / name for name in tables], result.identity)
    record["files"] = [*texts, "summary.json", *tables, WORKBOOK, *pictures]
    record["answer_sha256"] = digest_of((folder / "answer.txt").read_bytes())
    sign(record)
    write_json(folder / "summary.json", record)
    return record


def answer_text(result: Summary) -> str:
    """answer.txt, of the record of ``doe study --json``."""
    return terminal.text(blocks(result))


def blocks(result: Summary) -> list[Block]:
    """Blocks for the terminal of the record of ``doe study --json``: what an engineer acts on, then notes, then the details."""
    details = [
        *front.in_few_runs(result),
        changes(result),
        *costs(result),
        duty_figures(result).block,
        *chains(result).blocks,
        *reference(result).blocks,
        *diagnostics(result).blocks,
    ]
    return readable(
        [
            Verdict(tuple(result.notes), good=good_news(result)),
            *first_screen(result),
            *notes(result).blocks,
            *(replace(block, detail=Detail.ALL) for block in details),
        ],
        result.asked,
    )


def summary(outcome: StudyResult) -> Summary:
    """The record of ``doe study --json``."""
    study, tolerances, gains = outcome.study, outcome.tolerances, outcome.gains["pick"]
    odds = {} if outcome.robust is None else outcome.robust.odds
    forecast = Forecast(study, outcome.front, outcome.adaptive, outcome.searched_pick)
    return Summary.from_attributes(
        outcome,
        format=FORMAT,
        identity=study_identity("doe study", study),
        limits={limit.response: PickLimit(limit.nameless, odds.get(limit.response)) for limit in outcome.limits},
        tried=outcome.tries,
        asked=Settings.of_runs(study, outcome.runs.replicates_a_point),
        design=StudyDesign.of(study, outcome.design, outcome.runs),
        fit=fits_of(outcome.study.surfaces),
        front=SurfaceFront.of(study, outcome.front),
        pick_on_surfaces=EstimatedPoint.predicted(study, outcome.pick.point),
        pick=study.by_factor(outcome.pick.point),
        operating_clearances_mm=outcome.clearances.operating,
        clearance_class=outcome.clearances.class_sentence,
        confirmation={
            name: ConfirmedPoint.of(study, point, outcome.gains.get(name)) for name, point in outcome.confirmed.items()
        },
        gains=gains,
        statement=statement(gains),
        whirl_sentence=whirl_sentence(study, outcome.confirmed),
        rivals_sentences=rivals_sentences(forecast, outcome.confirmed),
        chains=dict(outcome.chains),
        notes=list(outcome.every_note),
        failures=grouped(outcome.failures),
        cost=dict(outcome.cost),
        versions=versions(),
        seeds={"design": study.file.design.seed, "front": study.file.front.seed, "adaptive": study.file.adaptive.seed},
        adaptive=_search(outcome),
        tolerances=None if tolerances is None else tolerances.by_factor,
        tolerances_gains=None if tolerances is None else tolerances.by_gain,
        tolerances_sentence=None if tolerances is None else tolerances.sentence,
        tolerances_warning=None if tolerances is None else tolerances.warning,
    )


def _search(outcome: StudyResult) -> SearchResult | None:
    """The search with what to say of it."""
    if outcome.adaptive is None or outcome.front_comparison is None:
        return None
    return SearchResult.of(
        outcome.study,
        outcome.adaptive,
        outcome.front_comparison,
        front.limiting_sentence(outcome),
        front.search_sentences(outcome),
        outcome.searched_pick,
    )


def reference_sheet(factors: Sequence[str], responses: Sequence[str], rows: Sequence[Row] = ()) -> Sheet[Row]:
    """A row a run next to that of the published table."""
    both = "simulated, and published"
    columns: tuple[Column[Row], ...] = (
        Column("run", meaning="number of the run"),
        *Column[Row]("{}", unit="of the name", meaning="its point").of(factors),
        *Column[Row]("{}_ours", unit="of the response", meaning=both).of(responses),
        *Column[Row]("{}_theirs", unit="of the response", meaning=both).of(responses),
    )
    content = "One row per run, next to the table of a publication."
    return Sheet("", columns, rows, file="published_comparisons.csv", content=content)


def _reference_rows(study: Problem, runs: Runs, published: Array) -> list[Row]:
    return [
        {
            "run": run + 1,
            **study.by_factor(runs.actual[run]),
            **{f"{name}_ours": x for name, x in zip(study.responses, runs.values[run], strict=True)},
            **{f"{name}_theirs": x for name, x in zip(study.responses, theirs, strict=True)},
        }
        for run, theirs in enumerate(published)
    ]


def confirmation_sheet(
    factors: Sequence[str], points: Mapping[str, ConfirmedPoint] = MappingProxyType({})
) -> Sheet[Row]:
    """A row for each confirmed point and response."""
    rows = [
        {
            "point": name,
            **point.factors,
            "response": response,
            **value.as_dict(),
            "joint_error": value.error,
            "gain": (point.gains or {}).get(response),
            "judged": point.limits.get(response),
        }
        for name, point in points.items()
        for response, value in point.responses.items()
    ]
    mean = "mean, and half widths of the 95 % intervals"
    its_gain = "gain on the baseline, positive where better, and its half width"
    columns: tuple[Column[Row], ...] = (
        Column("point", meaning="baseline, pick (the selected design), or the rule that chose the point"),
        *Column[Row]("{}", unit="of the name", meaning="the point").of(factors),
        Column("response", meaning="the response of this row"),
        *Column[Row]("{}", unit="of the response", meaning=mean).of(["value", "statistical_error", "numerical_error"]),
        Column("improvement_percent", at=("gain", "percent"), meaning=its_gain),
        Column("improvement_error_percent", at=("gain", "error_percent")),
        Column("verdict", at=("gain", "verdict"), meaning="better, worse or within error"),
        Column("joint_error", unit="of the response", meaning="half width of both errors together"),
        Column(
            "limit",
            at=lambda row: f"{row['judged'].sense} {row['judged'].bound:g}" if row["judged"] else "",
            meaning="the limit, and kept (met), broken (violated) or undecided",
        ),
        Column("limit_verdict", at=("judged", "verdict")),
    )
    content = "One row per response of each point that was simulated again."
    return Sheet("", columns, rows, file="confirmation.csv", content=content)


def response_surface(study: Problem, surface: Surface, path: Path) -> None:
    """Surface over the first factor and each other one, the rest at their centre, with contours below."""
    from matplotlib.ticker import MaxNLocator

    from rbdyn.plots.style import PNG, blank

    factors, response = len(study.factors), Asked.of(study).response(surface.name)
    reach = study.design.reach
    grid = np.linspace(-reach, reach, 25)
    figure = blank((6.2 * (factors - 1), 5.2))
    for panel in range(1, factors):
        coded = np.zeros((grid.size, grid.size, factors))
        coded[..., 0], coded[..., panel] = np.meshgrid(grid, grid, indexing="ij")
        actual = study.actual(coded)
        values = surface.predict(coded)
        axis = figure.add_subplot(1, factors - 1, panel, projection="3d")
        x, y = actual[..., 0], actual[..., panel]
        axis.plot_surface(x, y, values, cmap="viridis", alpha=0.9, linewidth=0)
        span = np.ptp(values) or abs(float(values.mean())) or 1.0
        floor = values.min() - 0.35 * span
        axis.contour(x, y, values, zdir="z", offset=floor, cmap="viridis", levels=10, linewidths=0.9)
        top = values.max()
        for bound in response.bounds:
            if floor < bound < top + 0.5 * span:
                corners = [np.array([[side[0, 0], side[0, -1]], [side[-1, 0], side[-1, -1]]]) for side in (x, y)]
                axis.plot_surface(*corners, np.full((2, 2), bound), color="tab:red", alpha=0.25, linewidth=0)
                top = max(top, bound)
            if values.min() < bound < values.max():
                axis.contour(x, y, values, zdir="z", offset=floor, colors="tab:red", levels=[bound], linewidths=2.0)
        axis.set_zlim(floor, top)
        axis.set_xlabel(label(study.factors[0]), labelpad=8)
        axis.set_ylabel(label(study.factors[panel]), labelpad=8)
        axis.set_zlabel(response.label)
        fixed = [place for place in range(1, factors) if place != panel]
        named = ((*quantity(study.factors[place]), study.centre[place]) for place in fixed)
        fixed_factors = [f"{words} {centre:g} {unit}".rstrip() for words, unit, centre in named]
        notes = [*fixed_factors, *(f"limit {bound:g} in red" for bound in response.bounds)]
        axis.set_title(f"({'abcdefg'[panel - 1]}) {', '.join(notes)}", fontsize=10)
        axis.tick_params(labelsize=8)
        for side in (axis.xaxis, axis.yaxis, axis.zaxis):
            side.set_major_locator(MaxNLocator(4))
        axis.view_init(elev=24, azim=-128)
    figure.subplots_adjust(left=0.02, right=0.92, bottom=0.06, top=0.94, wspace=0.12)
    figure.savefig(path, dpi=130, pil_kwargs=PNG)
