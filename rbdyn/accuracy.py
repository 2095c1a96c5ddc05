"""Error against run time: what each tolerance costs and how far its statistics are from converged ones.

Every tolerance runs the same seeded replicates. The reference is the tightest tolerance; a difference counts as bias
only beyond the 95 % half-width of the difference of the two means. Times are those of single-threaded runs, taken
after everything was compiled.
"""

from __future__ import annotations

import math
import platform
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rbdyn.dynamics.batch_means import student_half_width
from rbdyn.dynamics.metrics import Replicate
from rbdyn.dynamics.model import roller_bearing
from rbdyn.dynamics.simulate import Stop, prepare, run_series
from rbdyn.result import versions
from rbdyn.scene import Scene

FORMAT = "rbdyn.accuracy/1"
TOLERANCES = (1e-1, 5e-2, 2e-2, 1e-2, 5e-3, 1e-3, 1e-4)
OUTPUTS: dict[str, Callable[[Replicate], float]] = {
    "impact_force_N": lambda run: run.impact_force,
    "whirl_deviation_ratio": lambda run: run.whirl_deviation_ratio,
    "power_loss_W": lambda run: run.power_loss,
}


@dataclass(frozen=True)
class Row:
    """One tolerance: processor time per shaft turn [ms] and per right-hand side [ns] (medians over replicates),
    steps per turn, largest relative power gap; per output its mean, its relative bias and the 95 % error of that."""

    rtol: float
    turn_ms: float
    rhs_ns: float
    steps_per_turn: float
    power_gap: float
    value: dict[str, float]
    bias: dict[str, float]
    bias_error: dict[str, float]

    def as_dict(self) -> dict[str, Any]:
        """JSON form."""
        return dict(self.__dict__)


def work_precision(
    scene: Scene, tolerances: Sequence[float] = TOLERANCES, progress: Callable[[int, int], None] | None = None
) -> list[Row]:
    """A row a tolerance, loosest first. Runs one replicate at a time. Raises RunError, KeyboardInterrupt."""
    bearing = roller_bearing(scene)
    prepare(scene, bearing)
    ordered = sorted(tolerances, reverse=True)
    series = run_series(scene, bearing, ordered, 1, progress, Stop())
    return [_row(scene, rtol, runs, series[-1]) for rtol, runs in zip(ordered, series, strict=True)]


def conclusion(rows: Sequence[Row], scene: Scene) -> str:
    """Which tolerance to take: the loosest that biases no output beyond error or 0.5 %, and closes in power."""
    for row in rows:
        unbiased = all(abs(row.bias[name]) <= max(row.bias_error[name], 0.005) for name in OUTPUTS)
        if unbiased and row.power_gap <= 0.005:
            return (
                f"rtol {row.rtol:g} is the loosest at which no output is off by more than its error (or 0.5 %) and the "
                f"power balance closes within 0.5 %: {row.turn_ms:.2f} ms a shaft turn. The scene has "
                f"{scene.numerics.rtol:g}."
            )
    return f"no tolerance down to {rows[-1].rtol:g} is good enough; tighten further"


def record(rows: Sequence[Row], scene: Scene) -> dict[str, Any]:
    """JSON of ``rbdyn accuracy``."""
    return {
        "format": FORMAT,
        "status": "ok",
        "rows": [row.as_dict() for row in rows],
        "conclusion": conclusion(rows, scene),
        "turns": scene.numerics.turns,
        "replicates": scene.numerics.replicates,
        "machine": processor(),
        "versions": versions(),
    }


def write(rows: Sequence[Row], scene: Scene, folder: Path) -> list[str]:
    """Write accuracy.json, accuracy.csv and the work-precision diagram; returns the file names."""
    import pandas as pd

    from rbdyn import plots
    from rbdyn.result import write_json

    write_json(folder / "accuracy.json", record(rows, scene))
    table = [
        {key: value for key, value in row.as_dict().items() if not isinstance(value, dict)}
        | {
            f"{name}_{kind}": row.as_dict()[kind][name]
            for kind in ("value", "bias", "bias_error")
            for name in OUTPUTS
        }
        for row in rows
    ]
    pd.DataFrame(table).to_csv(folder / "accuracy.csv", index=False)
    plots.work_precision(rows, folder / "accuracy.png")
    return ["accuracy.json", "accuracy.csv", "accuracy.png"]


def processor() -> str:
    """Name of the processor, as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def _row(scene: Scene, rtol: float, runs: list[Replicate], reference: list[Replicate]) -> Row:
    turns = scene.numerics.turns + scene.numerics.warm_up_turns
    value, bias, bias_error = {}, {}, {}
    for name, figure in OUTPUTS.items():
        ours, theirs = (np.array([figure(run) for run in series]) for series in (runs, reference))
        value[name] = float(ours.mean())
        scale = abs(float(theirs.mean())) or 1.0
        bias[name] = float(ours.mean() - theirs.mean()) / scale
        bias_error[name] = math.hypot(*(student_half_width(x) or 0.0 for x in (ours, theirs))) / scale
    return Row(
        rtol=rtol,
        turn_ms=float(np.median([run.cpu_s for run in runs])) / turns * 1e3,
        rhs_ns=float(np.median([run.cpu_s / run.derivatives for run in runs])) * 1e9,
        steps_per_turn=float(np.mean([run.accepted_steps + run.rejected_steps for run in runs])) / turns,
        power_gap=max(run.power_gap for run in runs),
        value=value,
        bias=bias,
        bias_error=bias_error,
    )
