"""How run time grows with rollers and slices, and memory with the turns.

More rollers stand on a pitch circle larger in proportion; load, cage and inner ring grow with them, so that each roller
bears the same, and the speed falls so that surface speeds stay; a turn then takes longer, in proportion. More slices
cut the same roller finer. Times are the least of several of a single-threaded run, taken in turns over the sizes,
after everything was compiled.

``python examples/benchmarks/scaling.py [SCENE.toml]``
"""

import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from studies import main, printed

from rbdyn.accuracy.report import Progress, Report, Reporter, records, reported
from rbdyn.accuracy.variants import with_options
from rbdyn.base.blocks import Column, Sheet
from rbdyn.base.faults import InputError
from rbdyn.base.records import Record
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.recording import run_replicate
from rbdyn.dynamics.run import prepare
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.scene import Scene

ROLLERS = (10, 20, 30, 50, 70, 100)
SLICES = (1, 11, 31, 61, 101, 201)
MEMORY_TURNS = (40, 4000)
TURNS, DISCARDED = 4, 1
REPEATS = 5


class Point(Record):
    """One size: least processor time per right-hand side [ns], per shaft turn [ms] and over the time simulated [-],
    right-hand sides per turn."""

    size: int
    rhs_ns: float
    turn_ms: float
    of_real_time: float
    rhs_per_turn: float


COLUMNS = (
    Column[Point]("rhs_ns", ".0f", "ns a right-hand side"),
    Column[Point]("rhs_per_turn", ".0f", "right-hand sides a turn"),
    Column[Point]("turn_ms", ".2f", "ms a turn"),
    Column[Point]("of_real_time", ".2f", "s a simulated s"),
)


class Line(Record):
    """Time of a right-hand side over the size n: straight line [ns], its r2, and p of the power law n^p."""

    fixed_ns: float
    each_ns: float
    r2: float
    exponent: float


class Memory(Record):
    """Largest memory [MiB] of a process that simulates so many counted turns and keeps no history."""

    turns: int
    peak_MiB: float  # noqa: N815


class Scaling(Record):
    """Times over "rollers" and "slices" with their fits, and memory over turns."""

    points: dict[str, list[Point]]
    memory: list[Memory]

    @property
    def lines(self) -> dict[str, Line]:
        """Fits of the time of a right-hand side."""
        return {kind: fit(points) for kind, points in self.points.items()}


def scaling(
    scene: Scene,
    rollers: Sequence[int] = ROLLERS,
    slices: Sequence[int] = SLICES,
    memory_turns: Sequence[int] = MEMORY_TURNS,
    progress: Reporter = None,
) -> Scaling:
    """Measure a scene. Raises InputError where it cannot be enlarged or cut, RunError, KeyboardInterrupt."""
    scenes = {
        "rollers": {count: with_rollers(scene, count) for count in rollers},
        "slices": {count: with_slices(scene, count) for count in slices},
    }
    counted = Progress(progress, len(rollers) + len(slices) + len(memory_turns))
    points = {kind: _times(sizes, counted.step) for kind, sizes in scenes.items()}
    prepare(scene, roller_bearing(scene))  # so that no process compiles, which takes memory too
    return Scaling(points, [Memory(turns, peak_memory(scene, turns)) for turns in counted.over(memory_turns)])


def with_rollers(scene: Scene, count: int) -> Scene:
    """The bearing with so many rollers, each as far from the next and loaded as before, at the same surface speeds.

    Raises InputError where each roller has an error of its own.
    """
    bearing, cage, operation = scene.bearing, scene.cage, scene.operation
    if bearing.roller_diameter_errors_um is not None:
        what = "bearing.roller_diameter_errors_um: holds for its own number of rollers only"
        raise InputError([f"{what}; leave it out to scale"])
    if operation.schedule is not None:
        raise InputError(["operation.schedule: would have to be scaled with the rollers; leave it out to scale"])
    ratio = count / bearing.rollers
    keys = {
        "bearing.rollers": count,
        "bearing.pitch_diameter_mm": bearing.pitch_diameter_mm * ratio,
        "bearing.inner_ring_mass_kg": bearing.inner_ring_mass_kg * ratio,
        "cage.mass_g": cage.mass_g * ratio,
        "operation.inner_speed_rpm": operation.inner_speed_rpm / ratio,
        "operation.outer_speed_rpm": operation.outer_speed_rpm / ratio,
        "operation.radial_load_N": operation.radial_load_N * ratio,
    }
    if cage.land_diameter_mm is not None:
        # As far from the pitch circle as before.
        keys["cage.land_diameter_mm"] = cage.land_diameter_mm + bearing.pitch_diameter_mm * (ratio - 1.0)
    if cage.inertia_kg_mm2 is not None:
        keys["cage.inertia_kg_mm2"] = cage.inertia_kg_mm2 * ratio**3
    return with_options(scene, _short([f"{key}={value!r}" for key, value in keys.items()]))


def with_slices(scene: Scene, count: int) -> Scene:
    """The bearing with its rollers cut into so many slices. Raises InputError where one slice cannot show a profile."""
    return with_options(scene, _short([f"model.slices={count}"]))


def _short(assignments: list[str]) -> list[str]:
    return [*assignments, f"numerics.turns={TURNS}", f"numerics.discard_turns={DISCARDED}"]


def _times(scenes: dict[int, Scene], step: Callable[[], None]) -> list[Point]:
    bearings = {size: roller_bearing(scene) for size, scene in scenes.items()}
    for size, scene in scenes.items():
        prepare(scene, bearings[size])
    runs: dict[int, list[Replicate]] = {size: [] for size in scenes}
    for repeat in range(REPEATS):
        for size, scene in scenes.items():
            runs[size].append(run_replicate(scene, bearings[size], 0, scene.numerics.rtol, Stop()))
            if repeat == REPEATS - 1:
                step()
    return [_point(size, scenes[size].turn_s, series) for size, series in runs.items()]


def _point(size: int, turn_s: float, runs: list[Replicate]) -> Point:
    turns, evaluations = TURNS + DISCARDED, runs[0].derivatives
    least = min(run.cpu_s for run in runs)
    per_turn = least / turns
    return Point(size, least / evaluations * 1e9, per_turn * 1e3, per_turn / turn_s, evaluations / turns)


def fit(points: Sequence[Point]) -> Line:
    """Least squares: the line by relative errors, so that every size counts alike; the power by logarithms.

    A size of one is left out: a whole roller runs through no slices.
    """
    size, time = np.array([(point.size, point.rhs_ns) for point in points if point.size > 1]).T
    each, fixed = np.polyfit(size, time, 1, w=1.0 / time)
    rest = time - fixed - each * size
    r2 = 1.0 - float(rest @ rest) / float(((time - time.mean()) ** 2).sum())
    exponent = np.polyfit(np.log(size), np.log(time), 1)[0]
    return Line(float(fixed), float(each), r2, float(exponent))


def peak_memory(scene: Scene, turns: int) -> float:
    """Largest memory [MiB] of a fresh process that simulates one replicate over so many counted turns; that of the
    compiler too, where the scene was not yet compiled.

    Raises RunError where that process fails.
    """
    # Figures that drift would lengthen the run.
    alone = ["numerics.replicates=1", "numerics.companion=false", "numerics.extend=false"]
    chosen = with_options(scene, [f"numerics.turns={turns}", *alone])
    fault = f"the memory of {turns} turns could not be measured"
    return float(printed(print_peak_memory, chosen.model_dump(mode="json", exclude_none=True), fault))


def print_peak_memory() -> None:
    """Simulate the scene on standard input; print the largest memory of this process [MiB]."""
    from rbdyn.dynamics.simulate import simulate

    simulate(Scene.from_dict(json.load(sys.stdin)), workers=1)
    print(_largest_memory())


def _largest_memory() -> float:
    status = Path("/proc/self/status")
    if status.exists():
        # On Linux getrusage starts from the memory of the process that started this one.
        lines = status.read_text(encoding="utf-8").splitlines()
        return float(next(line.split()[1] for line in lines if line.startswith("VmHWM:"))) / 1024.0
    import resource

    per_unit = 1.0 if sys.platform == "darwin" else 1024.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * per_unit / 1024.0**2


def study(scene: Scene, progress: Reporter = None) -> Report:
    """Times, memory, fits and their picture. Raises InputError, RunError, KeyboardInterrupt."""
    return report(scaling(scene, progress=progress))


def report(measured: Scaling) -> Report:
    """Tables, fits and picture of what was measured."""
    tables = [
        Sheet("", (Column("size", words=kind), *COLUMNS), points).block for kind, points in measured.points.items()
    ]
    sentences = []
    for kind, line in measured.lines.items():
        straight = f"{line.fixed_ns:.0f} ns + {line.each_ns:.4g} ns for each of the {kind} (r2 {line.r2:.4f})"
        sentences.append(f"{straight}; as a power: n^{line.exponent:.2f}")
    for memory in measured.memory:
        most = f"at most {memory.peak_MiB:.1f} MiB in a process of its own"
        sentences.append(f"{memory.turns} counted turns: {most}")
    points: dict[str, Any] = {kind: records(sizes) for kind, sizes in measured.points.items()}
    fits = {kind: asdict(line) for kind, line in measured.lines.items()}
    sheet = [{"of": kind, **point} for kind, sizes in points.items() for point in sizes]
    told = points | {"fits": fits, "memory": records(measured.memory)}
    return reported("scaling", tables, sentences, sheet, lambda path: _draw(measured, path), **told)


def _draw(measured: Scaling, path: Path) -> None:
    """A panel a size, with the fitted line, and a panel of memory."""
    from rbdyn.plots.style import BLUE, GREY, plain, save, subplots

    figure, axes = subplots(1, 3, figsize=(12.0, 3.8), width_ratios=(1.0, 1.0, 0.6))
    for axis, (kind, line) in zip(axes, measured.lines.items(), strict=False):
        points = measured.points[kind]
        size = np.array([point.size for point in points])
        ends = np.array([0.0, size.max()])
        axis.plot(ends, 1e-3 * (line.fixed_ns + line.each_ns * ends), color=GREY, linewidth=1.0)
        axis.plot(size, [1e-3 * point.rhs_ns for point in points], "o", color=BLUE, markersize=5)
        law = f"{line.fixed_ns:.0f} ns + {line.each_ns:.3g} ns each, r² = {line.r2:.4f}"
        axis.set_title(f"{law}; power n$^{{{line.exponent:.2f}}}$", fontsize=9)
        across = kind if kind == "rollers" else "slices of a roller"
        axis.set(xlabel=across, ylabel="time of a right-hand side [µs]", xlim=(-0.03 * size.max(), 1.05 * size.max()))
        if size[0] == 1:
            whole = (1.0, 1e-3 * points[0].rhs_ns)
            axis.annotate("whole roller", whole, xytext=(8, -4), textcoords="offset points", fontsize=8)
        axis.set_ylim(bottom=0.0)
        plain(axis)
    bars = axes[-1].bar([f"{one.turns}" for one in measured.memory], [one.peak_MiB for one in measured.memory], 0.5,
                        color=BLUE)  # fmt: skip
    axes[-1].bar_label(bars, fmt="%.0f", fontsize=9)
    axes[-1].set(xlabel="counted shaft turns", ylabel="largest memory of the process [MiB]")
    axes[-1].margins(x=0.3, y=0.12)
    plain(axes[-1])
    save(figure, path)


if __name__ == "__main__":
    sys.exit(main(study, __doc__))
