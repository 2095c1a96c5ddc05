"""What a study leaves behind in its folder: tables, summary.json, pictures."""

from pathlib import Path
from typing import Any

from doe import clearance
from doe.dimension_chain.solution import ALLOCATED
from doe.report.html import html_report
from doe.report.markdown import markdown_report
from doe.report.steps.fit import fit_tables
from doe.report.study.answer import answer_text
from doe.report.study.summary import summary
from doe.study.limits import limits_of
from doe.study.whole import StudyResult
from rbdyn.result import write_json

# Shaft turns of the motion that is drawn.
DRAWN_TURNS = 10.0


def write(outcome: StudyResult, folder: Path) -> dict[str, Any]:
    """Write everything into ``folder``; returns the record of the study, whose ``files`` names them.

    summary.json is written last: where it is, all else is whole.
    """
    import pandas as pd

    from doe.report.study import plots

    study, record = outcome.study, summary(outcome)
    (folder / "summary.json").unlink(missing_ok=True)
    tables = {
        "design_runs.csv": _runs_table(outcome),
        **fit_tables(outcome.surfaces),
        "front.csv": [{**point["factors"], **point["responses"]} for point in record["front"]["front"]],
        "confirmation.csv": _confirmation_table(outcome),
        "part_dimensions.csv": [
            {"chain": name, "part": part.name, **{key: getattr(part, key) for key in ALLOCATED}}
            for name, chain in outcome.chains.items()
            for part in chain.allocation
        ],
    }
    if outcome.reference_values is not None:
        tables["beside_reference.csv"] = _beside_table(outcome)
    for name, rows in tables.items():
        pd.DataFrame(rows).to_csv(folder / name, index=False)
    pictures = []
    for surface in outcome.surfaces:
        pictures.append(f"surface_{surface.name}.png")
        plots.response_surface(study, surface, folder / pictures[-1])
    plots.pareto_front(outcome, folder / "pareto_front.png")
    points = {"baseline": outcome.baseline.point, "pick": outcome.pick.point}
    motions = clearance.histories(study, points, DRAWN_TURNS)
    pictures += ["pareto_front.png", *clearance.draw_motion(motions, folder)]
    texts = {
        "report.html": html_report(record, clearance.motion_record(motions)),
        "report.md": markdown_report(record, pictures),
        "answer.txt": answer_text(outcome),
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    record["files"] = [*texts, "summary.json", *tables, *pictures]
    write_json(folder / "summary.json", record)
    return record


def _runs_table(outcome: StudyResult) -> list[dict[str, Any]]:
    study, runs, design = outcome.study, outcome.runs, outcome.design
    return [
        {
            "run": place + 1,
            "kind": design.kind[place],
            "block": design.block_numbers[place],
            **{f"coded_{name}": x for name, x in zip(study.factors, runs.coded[row], strict=True)},
            **dict(zip(study.factors, runs.actual[row], strict=True)),
            **dict(zip(study.responses, runs.values[row], strict=True)),
            **{f"{name}_error": e for name, e in zip(study.responses, runs.errors[row], strict=True)},
        }
        for row, place in enumerate(runs.places)
    ]


def _beside_table(outcome: StudyResult) -> list[dict[str, Any]]:
    study, runs = outcome.study, outcome.runs
    assert outcome.reference_values is not None
    return [
        {
            "run": run + 1,
            **dict(zip(study.factors, runs.actual[run], strict=True)),
            **{f"{name}_ours": x for name, x in zip(study.responses, runs.values[run], strict=True)},
            **{f"{name}_theirs": x for name, x in zip(study.responses, theirs, strict=True)},
        }
        for run, theirs in enumerate(outcome.reference_values)
    ]


def _confirmation_table(outcome: StudyResult) -> list[dict[str, Any]]:
    study = outcome.study
    rows = []
    for name, each in outcome.confirmed.items():
        gains = {gain.response: gain for gain in outcome.gains.get(name, [])}
        limits = {limit.response: limit for limit in limits_of(study, each)}
        for index, response in enumerate(study.responses):
            gain, limit = gains.get(response), limits.get(response)
            rows.append(
                {
                    "point": name,
                    **dict(zip(study.factors, each.point, strict=True)),
                    "response": response,
                    "value": each.values[index],
                    "statistical_error": each.statistical[index],
                    "numerical_error": each.numerical[index],
                    "improvement_percent": None if gain is None else gain.percent,
                    "improvement_error_percent": None if gain is None else gain.error,
                    "verdict": "" if gain is None else gain.verdict,
                    "joint_error": each.error[index],
                    "limit": "" if limit is None else f"{limit.sense} {limit.bound:g}",
                    "limit_verdict": "" if limit is None else limit.verdict,
                }
            )
    return rows
