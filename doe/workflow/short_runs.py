"""Short runs of a baseline before its study is written: the class of the cage, and the turns that runs need to discard."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from doe.duty import OPERATION, DutyResult, DutyScenes, Run, Simulated, cages_of, main_scene, scene_at, scenes_of
from doe.running.store import Failure
from doe.workflow.effort import Effort
from doe.workflow.problem import Problem
from doe.workflow.whole import check_study
from rbdyn.base.words import counted
from rbdyn.dynamics.figures import why_missing
from rbdyn.result import Quantity
from rbdyn.scene import Scene
from rbdyn.scene.thermal import Temperatures, at_temperatures
from rbdyn.verdict.orbits import CageVerdict

IMPACT_POWER = "pocket_impact_power_W"
# Turns that design runs discard, and those that they discard where a bearing forgets its start as fast as most do.
DISCARDED, FEWER = 20, 7
# Settings of short runs of the baseline beside what the study's runs set: of one as it is, whose replicates are as few as name a
# class of the cage, and of one that counts the turns between. Impacts have windows that fit both.
SHORT_RUN = ("numerics.extend=false", "numerics.impact_window_turns=4")
BETWEEN = (*SHORT_RUN, f"numerics.discard_turns={FEWER}", f"numerics.turns={(DISCARDED - FEWER) // 4 * 4}")
# Largest bias by fewer turns, over the error of six replicates: half of the error of the four of a design run; and over the figure,
# up to which it decides nothing.
SLIGHT_BIAS, NEGLIGIBLE_BIAS = 0.75, 1e-3


def baseline_cages(study: Problem, folder: Path, effort: Effort) -> dict[str, CageVerdict]:
    """Class of the cage at the baseline by point of the duty, by a short run; empty where none traces it, or the run fails.

    Raises InputError before it for a study that cannot run.
    """
    check_study(study)
    run = _short_run(study, SHORT_RUN)
    if any(scene.cage_sample_s is None or why_missing(scene, IMPACT_POWER) for scene in scenes_of(run)):
        return {}
    (result,) = _baseline_results(study, [run], "the class of the cage", folder, effort)
    return {} if isinstance(result, Failure) else cages_of(result)


def slow_points(study: Problem, folder: Path, effort: Effort) -> list[str]:
    """Points of the duty, or OPERATION, where fewer discarded turns bias a response with a goal, by short runs of the baseline.

    They are all points where a run fails. A heat balance is made once: the turns between are at its temperatures.
    """
    (usual,) = _baseline_results(study, [_short_run(study, SHORT_RUN)], "", folder, effort)
    if not isinstance(usual, Failure):
        between = _at_temperatures_of(usual, _short_run(study, BETWEEN, more=2))
        (early,) = _baseline_results(study, [between], "the turns to discard", folder, effort)
        if not isinstance(early, Failure):
            names, sooner = [study.responses[place] for place in study.goals.objectives], _figures_at(early)
            turns = main_scene(study.usual_run).numerics.turns
            return [
                point
                for point, figures in _figures_at(usual).items()
                if any(_biased(figures[name], sooner[point][name], turns) for name in names)
            ]
    return [*study.shares] or [OPERATION]


def _biased(figure: Quantity, early: Quantity, turns: float) -> bool:
    """Whether a run that counts the ``early`` figure too, of so many turns, is biased by much of its error."""
    bias = (DISCARDED - FEWER) / turns * abs(early.value - figure.value)
    return bias > max(SLIGHT_BIAS * (figure.statistical_error or 0.0), NEGLIGIBLE_BIAS * abs(figure.value))


def _figures_at(result: Simulated) -> Mapping[str, Mapping[str, Quantity]]:
    """Figures by point of the duty, or under OPERATION."""
    return result.at_points if isinstance(result, DutyResult) else {OPERATION: result.responses}


def _at_temperatures_of(result: Simulated, run: Run) -> Run:
    """The run at the temperatures that the heat balances of a result have."""
    results = result.points if isinstance(result, DutyResult) else {OPERATION: result}
    hot = {
        name: at_temperatures(scene_at(run, name), Temperatures(**{node: it.value for node, it in nodes.items()}))
        for name, found in results.items()
        if (nodes := found.temperatures_C) is not None
    }
    return replace(run, scenes={**run.scenes, **hot}) if isinstance(run, DutyScenes) else hot.get(OPERATION, run)


def _short_run(study: Problem, settings: Sequence[str], more: int = 1) -> Run:
    """A run of the baseline with as few replicates as name a class of the cage, or ``more`` times as many."""

    def scene(sets: Sequence[str]) -> Scene:
        bare = study.scene_at(study.baseline, study.file.design.seed, sets, confirms=True)
        effort = [f"numerics.replicates={more * bare.verdict.limits.fewest_replicates}", *settings]
        return study.scene_at(study.baseline, study.file.design.seed, [*sets, *effort], confirms=True)

    return study.over_duty(scene)


def _baseline_results(
    study: Problem, runs: Sequence[Run], purpose: str, folder: Path, effort: Effort
) -> list[Simulated | Failure]:
    """Results of short runs of the baseline; the notice hears of their ``purpose``, if they have one."""
    if effort.notice is not None and purpose:
        scenes = scenes_of(runs[-1])
        numerics = scenes[0].numerics
        turns = numerics.replicates * (numerics.turns + numerics.warm_up_turns)
        effort.notice(f"{counted(len(scenes), 'short run')} of {turns:g} shaft turns for {purpose}")
    with effort.simulations(folder, study.path) as simulations:
        return simulations.run(runs, ["baseline"] * len(runs), simulations.progress("baseline"))
