"""Bias of the statistics by method: whether a method that is cheap on a trajectory is so where it counts.

The methods of fixed step run the same seeded replicates as ours does, discard and count the same turns and keep the
same tally; the reference is ours at a tight tolerance.

``python examples/benchmarks/method_bias.py [SCENE.toml]``
"""

import sys
from collections.abc import Callable, Sequence

import numpy as np
from studies import main

from rbdyn.accuracy.methods import OURS, RUNGE_KUTTA_4, VELOCITY_VERLET, FixedStepRun, Method, fixed_step
from rbdyn.accuracy.report import Progress, Report, Reporter, flat, records, reported
from rbdyn.accuracy.tolerances import (
    MARGIN,
    NEGLIGIBLE,
    Bias,
    bias_columns,
    bias_of,
    check_replicates,
    percent,
    undecided,
)
from rbdyn.base.blocks import Sheet, Table, columns_of
from rbdyn.base.faults import RunError
from rbdyn.base.records import Record, shown
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.recording import record
from rbdyn.dynamics.run import Run, prepare
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.scene import Scene

REFERENCE_RTOL = 1e-4
SETTINGS = ((OURS, (1e-1, 1e-2, 1e-3)), (RUNGE_KUTTA_4, (2.0, 1.0, 0.5)), (VELOCITY_VERLET, (1.0, 0.5, 0.25, 0.125)))


class Row(Record):
    """One method at one setting: processor time a shaft turn [ms], largest relative power gap, bias of the outputs.

    Where a replicate could not go on, ``status`` says why and the rest is None.
    """

    method: str = shown("method")
    setting: str = shown("setting")
    status: str = shown("status")
    turn_ms: float | None = shown("ms a turn", ".2f")
    power_gap: float | None = shown("power gap", ".2g %")
    found: Bias | None


def bias_rows(
    scene: Scene, settings: Sequence[tuple[Method, Sequence[float]]] = SETTINGS, progress: Reporter = None
) -> list[Row]:
    """A row a setting. Raises InputError for a single replicate, RunError where the reference fails, KeyboardInterrupt."""
    check_replicates(scene)
    bearing = roller_bearing(scene)
    prepare(scene, bearing)
    counting = Progress(progress, 1 + sum(len(values) for _, values in settings))
    reference = _replicates(scene, lambda index: Run(scene, bearing, index, REFERENCE_RTOL, Stop()))
    counting.step()
    rows = []
    for method, values in settings:
        for setting in values:

            def start(index: int, method: Method = method, setting: float = setting) -> Run:
                if method.adaptive:
                    return Run(scene, bearing, index, setting, Stop())
                step = fixed_step(scene, setting)
                return FixedStepRun(scene, bearing, index, step, method.name == VELOCITY_VERLET.name)

            steps = f"{scene.turn_s / fixed_step(scene, setting):.0f} steps a turn"
            label = f"rtol {setting:g}" if method.adaptive else steps
            try:
                rows.append(_row(scene, method.name, label, _replicates(scene, start), reference))
            except RunError as error:
                rows.append(Row(method.name, label, f"failed: {error}", None, None, None))
            counting.step()
    return rows


def conclusion(rows: Sequence[Row], scene: Scene, sought: float = MARGIN) -> str:
    """The cheapest setting of each method shown to be without bias, and what errors hide of the rest."""
    best: dict[str, Row] = {}
    hidden = []
    for row in rows:
        if row.found is None or row.power_gap is None or row.turn_ms is None or row.power_gap > NEGLIGIBLE:
            continue
        verdict = row.found.verdict(sought)
        if verdict == "within" and (row.method not in best or row.turn_ms < (best[row.method].turn_ms or 0.0)):
            best[row.method] = row
        if verdict == "undecided":
            hidden += row.found.hidden(f"{row.method}, {row.setting}", sought)
    rest = undecided(hidden, scene, sought) if hidden else ""
    limits = f"biases of at most {percent(sought)} and a power balance closed to {percent(NEGLIGIBLE)}"
    if not best:
        return f"Which method keeps its statistics is {rest}." if rest else f"No method shows {limits}."
    cheapest = ", ".join(
        f"{row.method} {row.turn_ms:.2f} ms ({row.setting}, errors at most {percent(row.found.known_to)})"
        for row in best.values()
        if row.found is not None
    )
    return f"Measured {limits}, a turn: {cheapest}." + (f" Other settings are {rest}." if rest else "")


def table(rows: Sequence[Row], sought: float = MARGIN) -> Table:
    """Table for the terminal, failures in their places."""
    title = f"bias of the statistics against rtol {REFERENCE_RTOL:g}, 95 % errors"
    return Sheet(title, (*columns_of(Row), *bias_columns(sought, lambda row: row.found)), rows).block


def _replicates(scene: Scene, start: Callable[[int], Run]) -> list[Replicate]:
    return [record(start(index)) for index in range(scene.numerics.replicates)]


def _row(scene: Scene, method: str, setting: str, runs: Sequence[Replicate], reference: Sequence[Replicate]) -> Row:
    turns = scene.numerics.turns + scene.numerics.warm_up_turns
    return Row(
        method=method,
        setting=setting,
        status="ok",
        turn_ms=float(np.median([run.cpu_s for run in runs])) / turns * 1e3,
        power_gap=max(run.power_gap for run in runs),
        found=bias_of(runs, reference),
    )


def study(scene: Scene, progress: Reporter = None, sought: float = MARGIN) -> Report:
    """Bias of every method at every setting, judged to ``sought``. Raises as ``bias_rows``."""
    rows = bias_rows(scene, progress=progress)
    sentence, written = conclusion(rows, scene, sought), records(rows)
    sheet = [flat(row, "found") for row in written]
    return reported("method_bias", (table(rows, sought),), (sentence,), sheet, rows=written, conclusion=sentence)


if __name__ == "__main__":
    sys.exit(main(study, __doc__))
