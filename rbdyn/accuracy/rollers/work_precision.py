"""Error against run time of the time integration: of the statistics at each tolerance, and of the motion itself."""

from collections.abc import Sequence
from typing import Any

from rbdyn.accuracy.judgement import SOUGHT, check_replicates
from rbdyn.accuracy.report import Report, Reporter, flat, record, records
from rbdyn.accuracy.rollers import comparison, tolerances
from rbdyn.accuracy.rollers.methods import COMPILED
from rbdyn.accuracy.rollers.trajectory import DEFAULT_TURNS
from rbdyn.scene import Scene

# Of the record of the trajectories, what stands in that of the study.
MOTION = ("rows", "conclusion", "turns", "starts", "reference", "resolved_m", "times_faster", "compile_s")


def study(
    scene: Scene,
    progress: Reporter = None,
    turns: float = DEFAULT_TURNS,
    rtols: Sequence[float] = tolerances.TOLERANCES,
    sought: float = SOUGHT,
) -> Report:
    """``rbdyn accuracy``: bias of the statistics, judged to ``sought``, and the trajectories of the compiled methods.

    Raises InputError, RunError where a reference fails, KeyboardInterrupt.
    """
    check_replicates(scene)
    motion = comparison.trajectories(scene, progress, turns, COMPILED)
    biases = tolerances.statistics_bias(scene, rtols, progress)
    chosen = tolerances.conclusion(biases.rows, scene, sought)
    numerics, rows = scene.numerics, records(biases.rows)
    agreement, trajectories, _ = motion.tables
    failures = {f"{rtol:g}": why for rtol, why in biases.failures.items()}
    told = record(
        "rbdyn.accuracy/1",
        rows=rows,
        sought=sought,
        failures=failures,
        conclusion=chosen,
        turns=numerics.turns,
        replicates=numerics.replicates,
        trajectory={key: motion.record[key] for key in MOTION},
    )
    sentences = *motion.sentences, chosen, *(f"rtol {rtol} failed: {why}" for rtol, why in failures.items())
    return Report(
        "accuracy",
        told,
        (agreement, trajectories, tolerances.table(biases, sought)),
        (*sentences, f"{numerics.replicates} replicates of {numerics.turns:g} turns"),
        {"accuracy": [flat(row) for row in rows], "trajectory": motion.record["rows"]},
        {"accuracy": lambda path: _draw(biases.rows, path, sought), "trajectory": motion.pictures["methods"]},
    )


def _draw(rows: Sequence[tolerances.Row], path: Any, sought: float) -> None:
    """Bias of each output and gap of the power balance against the time of a shaft turn, marked with rtol."""
    from rbdyn.accuracy.rollers.pictures import biases_at_work

    labels = "relative bias, or gap of the power balance", "processor time of a shaft turn [ms]"
    biases_at_work(rows, path, sought, labels, "turn_ms", ("gap of the power balance", "power_gap"), "rtol")
