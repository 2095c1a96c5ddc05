"""The stages of what runs input sets: a robust judgement, ``doe uncertainty``, ``doe calibrate``."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from doe.clearance import work_of
from doe.running.runner import ANSWER, ANSWER_S, Stage
from doe.study_file import Study
from doe.unknown import inputs
from doe.unknown.calibration import TRIED, sets_a_wave
from doe.workflow import uncertainty
from doe.workflow.calibration import Question, cases_of
from doe.workflow.input_sets import Case, read_case
from doe.workflow.robust import CONFIRMED, POINTS, case_of_study, fresh_rows
from rbdyn.scene import Scene

# Wall time [s] that the emulators of a robust judgement take about.
ROBUST_S = 10.0


def robust_stage(study: Study) -> Stage:
    """Input sets of the baseline and the pick, further replicates, a robust front and the simulations of its points."""
    settings, case = study.file.robust, case_of_study(study)
    fewest, runs = 2 * settings.points, round(2 * settings.points * (1.0 + settings.settle))
    if settings.front != "none":
        more = int((fresh_rows(settings.points) >= settings.points).sum())
        fewest += settings.points
        runs += settings.points + POINTS * CONFIRMED + 2 * more
    titles = "input sets", "runs of the robust front"
    stage = Stage.of("robust", runs, _work_of_a_set(case), *titles, fewest=fewest)
    return replace(stage, besides_s=ROBUST_S)


def uncertainty_stages(path: Path, overrides: Sequence[str], points: int | None) -> list[Stage]:
    """Stages of ``doe uncertainty`` with so many input sets, as the scene says where left out; they and their replicates may be
    doubled later.

    Raises InputError.
    """
    case = read_case(path, uncertainty.OUTPUTS, overrides)
    count = case.uncertain.points if points is None else points
    return [
        Stage.of("as the scene says", 1, work_of(case.scene)),
        Stage.of(
            "input sets", count, _work_of_a_set(case), most=uncertainty.MOST_EFFORT * max(count, uncertainty.MOST)
        ),
        Stage(ANSWER, besides_s=ANSWER_S),
    ]


def calibration_stages(question: Question) -> list[Stage]:
    """Stages of ``doe calibrate``; fewer waves may do. Raises InputError."""
    case, sought = question.case, question.sought
    conditions, one = len(cases_of(case, question.rig)), _work_of_a_set(case)
    screened = _screening_runs(replace(case, every=sought))
    waves, sets = case.scene.calibrate.waves, sets_a_wave(min(len(sought), case.uncertain.inputs)) * conditions
    return [
        *([Stage.of("screening", screened, one)] if screened else []),
        Stage.of("as the scene says", conditions, one),
        Stage.of("waves", waves * sets, one, "wave", fewest=sets),
        # Where emulators miss the posterior, it is tried once more.
        Stage.of("posterior", TRIED * conditions, one, most=2 * TRIED * conditions),
        Stage(ANSWER, besides_s=ANSWER_S),
    ]


def _work_of_a_set(case: Case) -> float:
    return work_of(Scene.from_dict(case.data, case.source, case.uncertain.set))


def _screening_runs(case: Case) -> int:
    """Runs of a screening, which only too many inputs need."""
    sought = [each for each in case.every if each.key not in case.sample]
    if len(case.every) <= case.uncertain.inputs or not sought:
        return 0
    return len(inputs.screening_design(len(sought)))
