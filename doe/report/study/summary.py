"""The answer of a study and its summary."""

from dataclasses import replace
from typing import Any

from doe import clearance
from doe.report.sections.answer import advice, changes, verdict
from doe.report.sections.contents import notes, readable, reference
from doe.report.sections.experiments import failure_table
from doe.report.sections.fits import diagnostics
from doe.report.sections.record import known, part
from doe.report.steps.confirmation import confirmation_record, gains_record, judged_limits_record
from doe.report.steps.fit import fit_record, runs_record
from doe.report.steps.front import (
    adaptive_record,
    asked_record,
    compared_record,
    front_record,
    held_sentence,
    predicted_record,
    search_sentences,
)
from doe.report.steps.robust import robust_record
from doe.running.store import grouped
from doe.study_file import Study
from doe.workflow.adaptive import Adaptive
from doe.workflow.confirmation import statement
from doe.workflow.pick import SearchedPick
from doe.workflow.runs import evaluation
from doe.workflow.whole import StudyResult
from rbdyn.base.blocks import Block, Detail, Heading
from rbdyn.base.records import finite
from rbdyn.base.render import terminal
from rbdyn.result import versions


def answer_text(record: dict[str, Any]) -> str:
    """answer.txt, of the record of ``doe study --json``."""
    clean = known(record)
    failures = failure_table(part(clean, "failures") or [])
    return terminal.text(readable([*verdict(clean), *advice(clean), failures], clean))


def blocks(record: dict[str, Any]) -> list[Block]:
    """What the terminal shows of the record of ``doe study --json``: the verdict first, the fits only to who asks for all."""
    clean = known(record)
    fits = [replace(block, detail=Detail.ALL) for block in diagnostics(clean, {}).blocks]
    published = reference(clean, {})
    context = readable([*published.blocks, changes(clean)], clean)
    titles = (published.title if part(clean, "beside_reference") else "", "The answer" if context else "")
    before, after = (Heading(title, detail=Detail.USUAL) for title in titles)
    answer = [*advice(clean), *notes(clean, {}).blocks]
    return readable([*verdict(clean), *fits, before, *context, after, *answer], clean)


FORMAT = "doe.study/1"


def summary(outcome: StudyResult) -> dict[str, Any]:
    """JSON of ``doe study``."""
    study, gains = outcome.study, outcome.gains["pick"]
    record: dict[str, Any] = {
        "format": FORMAT,
        "status": "ok" if outcome.verdict == "kept" else outcome.verdict,
        "limits": judged_limits_record(outcome),
        "limits_sentence": outcome.limits_sentence,
        "tried": outcome.tried,
        "edge": outcome.edge.as_dict(),
        "asked": settings_record(study),
        "design": design_record(outcome),
        "fit": fit_record(outcome.surfaces),
        "front": front_record(study, outcome.surfaces, outcome.front),
        "pick_on_surfaces": predicted_record(study, outcome.surfaces, outcome.pick.point),
        "pick": study.by_factor(outcome.pick.point) | study.categories,
        "operating_clearances_mm": outcome.clearances.operating,
        "clearance_class": outcome.clearances.class_sentence,
        "confirmation": confirmation_record(outcome),
        "gains": gains_record(gains),
        "statement": statement(gains),
        "whirl_sentence": outcome.whirl_sentence,
        "chains": {name: chain.as_dict() for name, chain in outcome.chains.items()},
        "beside_reference": {row.response: row.as_dict() for row in outcome.beside},
        "notes": list(outcome.notes),
        "failures": grouped(outcome.failures),
        "cost": dict(outcome.cost),
        "versions": versions(),
        "inputs": outcome.inputs,
        "seeds": {
            "design": study.file.design.seed,
            "front": study.file.front.seed,
            "adaptive": study.file.adaptive.seed,
        },
    }
    if outcome.adaptive is not None:
        record["adaptive"] = _adaptive_record(outcome, outcome.adaptive)
    if outcome.searched_pick is not None:
        record["adaptive"]["chosen"] = _chosen_record(outcome.searched_pick)
    if outcome.robust is not None:
        record["robust"] = robust_record(outcome.robust, study.factors)
    if outcome.tolerances is not None:
        record["tolerances"] = outcome.tolerances.as_dict(study.factors)
        record["tolerances_sentence"] = outcome.tolerances.sentence
    return record


def _adaptive_record(outcome: StudyResult, adaptive: Adaptive) -> dict[str, Any]:
    """The search, its fronts compared with others, and all in ``sentences``, of which ``held`` is one."""
    sentences = search_sentences(outcome)
    told = {"held": held_sentence(outcome), "sentences": sentences, "sentence": " ".join(sentences)}
    beside = {} if outcome.compared is None else compared_record(outcome.study, adaptive, outcome.compared)
    return adaptive_record(outcome.study, adaptive) | {"compared": beside} | told


def _chosen_record(pick: SearchedPick) -> dict[str, Any]:
    """Why the pick is this point of the searched front, and the share of its parts that still dominate the baseline."""
    aware = pick.aware
    return {
        "row": pick.row,
        "reason": pick.reason,
        "survives": None if aware is None or aware.survives is None else float(aware.survives[pick.row]),
    }


def settings_record(study: Study) -> dict[str, Any]:
    """Scene, factors with their ranges, responses with their goals."""
    scene = clearance.design_scenes(study, study.baseline[None])[0]
    return {
        "study_file": study.path.name,
        "scene_file": study.scene.file,
        "scene": scene.model_dump(mode="json", exclude_none=True),
        **asked_record(study),
        "replicates": scene.numerics.replicates,
        "turns": scene.numerics.turns,
        "confirmation_replicates": study.file.confirmation.replicates,
    }


def design_record(outcome: StudyResult) -> dict[str, Any]:
    """Points with what they gave, how good the design is, and which runs failed."""
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
        name: {"value": float(value), "error": finite(error)}
        for name, value, error in zip(outcome.study.responses, runs.values[row], runs.errors[row], strict=True)
    }
