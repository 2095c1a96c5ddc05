"""What a study asked for and what its design was, as plain numbers."""

from string import ascii_uppercase
from typing import Any

from doe import clearance
from doe.designs import to_actual
from doe.report.steps.confirmation import or_none
from doe.report.steps.design import runs_record
from doe.running.failure import grouped
from doe.study.design import evaluation
from doe.study.goals import known_tolerances, region_of
from doe.study.whole import StudyResult
from doe.study_file import Study


def asked_record(study: Study) -> dict[str, Any]:
    """Scene, factors with their ranges, responses with their goals."""
    reach, known = region_of(study), known_tolerances(study)
    low, high = (to_actual(side * reach, study.centre, study.step) for side in (-1.0, 1.0))
    scene = clearance.design_scenes(study, study.baseline[None])[0]
    return {
        "study_file": study.path.name,
        "scene_file": study.file.scene.file,
        "scene": scene.model_dump(mode="json", exclude_none=True),
        "factors": [
            {
                "letter": letter,
                **factor.model_dump(include={"name", "key", "centre", "step", "resolution"}),
                "low": float(low[index]),
                "high": float(high[index]),
                "tolerance": known.get(factor.name),
            }
            for index, (letter, factor) in enumerate(zip(ascii_uppercase, study.file.factor, strict=False))
        ],
        "responses": [response.model_dump() for response in study.file.response],
        "replicates": scene.numerics.replicates,
        "turns": scene.numerics.turns,
        "confirmation_replicates": study.file.confirmation.replicates,
    }


def design_record(outcome: StudyResult) -> dict[str, Any]:
    """Points with what they gave, what the design can tell, and which runs failed."""
    study, design, runs = outcome.study, outcome.design, outcome.runs
    rows = {place: row for row, place in enumerate(runs.places)}
    return {
        "kind": study.file.design.kind,
        "runs": len(design.coded),
        "factors": study.factors,
        "responses": study.responses,
        "points": [
            {**run, "responses": _responses(outcome, rows.get(place))}
            for place, run in enumerate(runs_record(study, design))
        ],
        "evaluation": evaluation(study, design),
        "failures": grouped(runs.failures),
    }


def _responses(outcome: StudyResult, row: int | None) -> dict[str, Any]:
    """What a run gave, by response; nothing of one that failed."""
    if row is None:
        return {}
    runs = outcome.runs
    return {
        name: {"value": float(value), "error": or_none(error)}
        for name, value, error in zip(outcome.study.responses, runs.values[row], runs.errors[row], strict=True)
    }
