"""The stages of a study: what each runs, as far as that is known before it begins. Loads nothing heavy for a plain study."""

from dataclasses import replace
from typing import get_args

from doe import clearance
from doe.clearance import work_of
from doe.running.runner import ANSWER, ANSWER_S, Stage
from doe.study.runs import ordered_runs
from doe.study_file import Study
from doe.study_file.sections import Front

# Wall time [s] that surfaces with their front take about, and the pick's tolerances with the chains.
FRONT_S, TOLERANCES_S = 6.0, 1.0
# Wall time [s] of the emulators for a batch of an adaptive search.
BATCH_S = 0.6
DESIGN, FRONT, TOLERANCES = "design runs", "front", "tolerances"


def study_stages(study: Study, adaptive: bool = False, robust: bool = False) -> list[Stage]:
    """Stages of ``doe study`` with these options, to the end. Raises InputError where the study is impossible.

    Further points, where a limit is not kept, are among the most that a stage may run: nobody knows whether they are needed.
    """
    works = {
        key: work
        for at in (study.every_level if adaptive else [study.levels])
        for key, work in design_works(study.at(at))
    }
    stages = [Stage(DESIGN, (DESIGN,), len(works), sum(works.values())), Stage(FRONT, besides_s=FRONT_S)]
    if adaptive:
        from doe.adaptive.search import FRESH

        usual = clearance.design_scenes(study, study.baseline[None])[0].numerics.replicates
        (scene,) = clearance.adaptive_scenes(study, study.baseline[None], [usual], 0)
        settings, runs = study.file.adaptive, max(study.file.adaptive.budget - len(works), 0)
        # A search that gains nothing more stops after a batch and its fresh runs.
        fewest = min(settings.batch + round(FRESH * settings.budget), runs)
        stage = Stage.of("adaptive front", runs, work_of(scene), fewest=fewest)
        stages.append(replace(stage, besides_s=BATCH_S * runs / settings.batch))
    # The baseline, the pick by each rule, the one without its tolerances, and those of the surfaces and of the search.
    rules = len(get_args(Front.model_fields["pick"].annotation))
    points = 1 + rules + (study.file.front.tolerance_aware != "none") + 2 * adaptive
    one = work_of(clearance.confirmation_scene(study, study.baseline))
    limited = any(each.lower is not None or each.upper is not None for each in study.file.response)
    tries = study.file.confirmation.tries - 1 if limited else 0
    most = points + tries + (len(study.factors) if adaptive else 0)
    # Picks by several rules may be one point of the drawing.
    stages.append(Stage.of("confirmation", points, one, "confirmation", "beyond the region", fewest=2, most=most))
    if robust or clearance.declares_unknowns(study):
        from doe.study.stages_unknown import robust_stage

        stages.append(robust_stage(study))
    if study.file.tolerances is not None or study.file.chain:
        stages.append(Stage(TOLERANCES, besides_s=TOLERANCES_S))
    return [*stages, Stage(ANSWER, besides_s=ANSWER_S)]


def design_works(study: Study) -> list[tuple[str, float]]:
    """Key and work of every design run. Raises InputError."""
    ordered = ordered_runs(study)
    points = clearance.points_of(ordered.scenes, ordered.labels, ordered.factors)
    return [(point.key, work_of(scene)) for point, scene in zip(points, ordered.scenes, strict=True)]
