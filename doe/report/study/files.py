"""What a study leaves behind in its folder: tables, summary.json, pictures."""

from pathlib import Path
from typing import Any

from doe import clearance
from doe.dimension_chain.solution import ALLOCATED
from doe.report.html import html_report
from doe.report.markdown import markdown_report
from doe.report.steps.fit import fit_tables
from doe.report.steps.front import archive_table
from doe.report.study.summary import answer_text, summary
from doe.workflow.runs import RUNS_TABLE
from doe.workflow.whole import StudyResult
from rbdyn.base.records import save_table
from rbdyn.base.storage import digest_of, sign
from rbdyn.result import write_json

# Shaft turns of the motion that is drawn.
DRAWN_TURNS = 10.0


def write(outcome: StudyResult, folder: Path) -> dict[str, Any]:
    """Write everything into ``folder``; returns the record of the study, whose ``files`` names them.

    summary.json is written last: where it is, all else is whole.
    """
    from doe.report.study import plots

    study, record = outcome.study, summary(outcome)
    (folder / "summary.json").unlink(missing_ok=True)
    tables = {
        RUNS_TABLE: _runs_table(record),
        **fit_tables(outcome.surfaces),
        "front.csv": [{**point["factors"], **point["responses"]} for point in record["front"]["front"]]
        if outcome.adaptive is None
        else archive_table(study, outcome.adaptive),
        "confirmation.csv": _confirmation_table(outcome, record),
        "part_dimensions.csv": [
            {"chain": name, "part": part.name, **{key: getattr(part, key) for key in ALLOCATED}}
            for name, chain in outcome.chains.items()
            for part in chain.allocation
        ],
    }
    if outcome.reference_values is not None:
        tables["beside_reference.csv"] = _beside_table(outcome)
    for name, rows in tables.items():
        save_table(rows, folder / name)
    pictures = []
    for surface in outcome.surfaces:
        pictures.append(f"surface_{surface.name}.png")
        plots.response_surface(study, surface, folder / pictures[-1])
    plots.pareto_front(outcome, folder / "pareto_front.png")
    if outcome.robust is not None and outcome.robust.front is not None and outcome.robust.front.confirmed:
        pictures.append("robust_front.png")
        plots.robust_front(outcome.robust.responses, outcome.robust.front, folder / pictures[-1])
    if outcome.adaptive is not None:
        pictures.append("adaptive_search.png")
        plots.adaptive_search(record, folder / pictures[-1])
    points = {"baseline": outcome.baseline.point, "pick": outcome.pick.point}
    motions = clearance.histories(study, points, DRAWN_TURNS)
    pictures += ["pareto_front.png", *clearance.draw_motion(motions, folder)]
    texts = {
        "report.html": html_report(record, clearance.motion_record(motions)),
        "report.md": markdown_report(record, pictures),
        "answer.txt": answer_text(record),
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    record["files"] = [*texts, "summary.json", *tables, *pictures]
    record["answer_sha256"] = digest_of((folder / "answer.txt").read_bytes())
    sign(record)
    write_json(folder / "summary.json", record)
    return record


def _runs_table(record: dict[str, Any]) -> list[dict[str, Any]]:
    """The runs that went well."""
    return [
        {
            **{key: run[key] for key in ("run", "kind", "block")},
            **{f"coded_{name}": x for name, x in run["coded"].items()},
            **run["factors"],
            **{name: each["value"] for name, each in run["responses"].items()},
            **{f"{name}_error": each["error"] for name, each in run["responses"].items()},
        }
        for run in record["design"]["points"]
        if run["responses"]
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


def _confirmation_table(outcome: StudyResult, record: dict[str, Any]) -> list[dict[str, Any]]:
    """A row a point and response."""
    rows = []
    for name, point in record["confirmation"].items():
        joint = outcome.confirmed[name].error
        for (response, quantity), error in zip(point["responses"].items(), joint, strict=True):
            gain, limit = point.get("gains", {}).get(response, {}), point["limits"].get(response)
            rows.append(
                {
                    "point": name,
                    **point["factors"],
                    "response": response,
                    **quantity,
                    "improvement_percent": gain.get("percent"),
                    "improvement_error_percent": gain.get("error_percent"),
                    "verdict": gain.get("verdict", ""),
                    "joint_error": error,
                    "limit": f"{limit['sense']} {limit['bound']:g}" if limit else "",
                    "limit_verdict": limit["verdict"] if limit else "",
                }
            )
    return rows
