"""Our method compared with others on one compiled right-hand side: error of the motion against time, at equal error.

A stretch of motion starts where a replicate has settled; its end is what two references agree on. The motion is chaotic: two
runs part about 500-fold a shaft turn, so a method can be distinguished from another over part of a turn only, and every span has
its own floor below which the reference itself is not known.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from rbdyn.accuracy.integrators import DOP853, METHODS, OURS, Method, NotInstalledError, Stretch, compiled
from rbdyn.accuracy.report import Progress, Report, Reporter, columns_of, records, reported, tabled
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.blocks import Table
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.records import Record, shown
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import absolute_tolerance, layout_of
from rbdyn.dynamics.run import Run, prepare
from rbdyn.scene import Scene

DEFAULT_TURNS, LONGEST_TURNS = 0.25, 1.0
SPANS = (0.25, 0.5, 1.0)  # shaft turns after which the two references are compared
SETTLE_TURNS = 5.0
STARTS = 3
OUR_REFERENCE_RTOL, THEIR_REFERENCE_RTOL = 1e-12, 1e-13
# An error below this many times what the references differ by says nothing.
RESOLVED = 10.0


class Error(Record):
    """Largest difference of two states: of any position of roller, cage or ring [m], and of any component over its
    scale (the approach or speed of a race contact)."""

    position_m: float
    scaled: float


class Reference(Record):
    """Ends of the stretches by our method, and how far DOP853 is off them after spans of turns."""

    ends: Sequence[Array]
    agreement: dict[float, Error]

    def as_dict(self) -> dict[str, Any]:
        """JSON form: the methods, and how far they are apart."""
        agreement = [{"turns": span, **error.as_dict()} for span, error in self.agreement.items()]
        return {"methods": {OURS.name: OUR_REFERENCE_RTOL, DOP853.name: THEIR_REFERENCE_RTOL}, "agreement": agreement}

    def floor(self, turns: float) -> float:
        """Position error [m] below which a stretch of ``turns`` resolves nothing: that of the next longer span."""
        return RESOLVED * next(e.position_m for span, e in self.agreement.items() if span >= turns)


def starts_after_transient(scene: Scene, turns: float = DEFAULT_TURNS, starts: int = STARTS) -> list[Stretch]:
    """Stretches of so many shaft turns, each from where a replicate of its own has settled.

    Raises InputError for turns outside (0, 1], RunError.
    """
    if not 0.0 < turns <= LONGEST_TURNS:
        raise InputError([f"turns = {turns:g}: past a turn no reference holds; give more than 0 and at most 1"])
    bearing = roller_bearing(scene)
    scale = absolute_tolerance(scene, bearing, 1.0)
    # The clock runs exactly in every method; its scale only has to be a number.
    scale[~np.isfinite(scale)] = 1.0
    stretches = []
    for replicate in range(starts):
        run = Run(scene, bearing, replicate, scene.numerics.rtol, Stop())
        run.to(SETTLE_TURNS)
        stretches.append(Stretch(scene, bearing, run.carry.y.copy(), turns, scale))
    return stretches


def positions(scene: Scene) -> Whole:
    """Indices of the positions of rollers, cage and rings [m] in the state."""
    return np.flatnonzero([part.unit == "m" for part in layout_of(scene).components])


def difference(stretch: Stretch, a: Array, b: Array) -> Error:
    """How far two states are apart."""
    apart = np.abs(a - b)
    return Error(float(apart[positions(stretch.scene)].max()), float((apart / stretch.scale).max()))


def worst(errors: Sequence[Error]) -> Error:
    """The largest of each."""
    return Error(max(e.position_m for e in errors), max(e.scaled for e in errors))


def reference(stretches: Sequence[Stretch], step: Callable[[], None] = lambda: None) -> Reference:
    """Integrate every stretch by both reference methods. Raises RunError. ``step()`` is called after each."""
    ends = [end_of(OURS, stretch, OUR_REFERENCE_RTOL) for stretch in stretches]
    apart: dict[float, list[Error]] = {span: [] for span in SPANS}
    for stretch in stretches:
        ours = theirs = stretch.start
        before = 0.0
        for span in SPANS:
            ours, theirs = (
                end_of(method, replace(stretch, start=y, turns=span - before), rtol)
                for method, y, rtol in ((OURS, ours, OUR_REFERENCE_RTOL), (DOP853, theirs, THEIR_REFERENCE_RTOL))
            )
            apart[span].append(difference(stretch, ours, theirs))
            before = span
        step()
    return Reference(ends, {span: worst(errors) for span, errors in apart.items()})


def end_of(method: Method, stretch: Stretch, setting: float) -> Array:
    """State at the end of a stretch. Raises RunError."""
    return method.ready(stretch, setting)().y


def agreement_table(known: Reference) -> Table:
    """How far the references are apart after each span."""
    cells = [(f"{span:g}", f"{e.position_m:.2g}", f"{e.scaled:.2g}") for span, e in known.agreement.items()]
    return Table(
        f"the two references: {OURS.name} at {OUR_REFERENCE_RTOL:g}, {DOP853.name} at {THEIR_REFERENCE_RTOL:g}",
        ("turns", "positions apart [m]", "worst component over its scale"),
        cells,
    )


OK = "ok"
# A run is timed again and again, at most so often and, past the first time, for so long.
REPEATS, TIMED_S = 5, 0.1
# Points over the common range of errors, evenly spaced in the logarithm.
POINTS = 41

Curve = Sequence[tuple[float, float]]  # (error, time) pairs, all positive


@dataclass(frozen=True)
class Speedup:
    """Ratio of times: geometric mean, least and greatest over the errors from ``low`` to ``high``."""

    low: float
    high: float
    mean: float
    least: float
    greatest: float


class Attempt(Record):
    """One method at one setting over all stretches: worst error, processor time and right-hand sides a shaft turn.

    Where it failed, ``status`` says why, the errors are None and the time is what it took to fail.
    """

    method: str = shown("method")
    setting: str = shown("setting")
    status: str
    position_error_m: float | None = shown("position error [m]", ".2g")
    scaled_error: float | None = shown("worst over scale", ".2g")
    turn_ms: float | None = shown("ms a turn", ".3g")
    rhs_per_turn: float | None = shown("right-hand sides a turn", ".0f")


def study(
    scene: Scene, progress: Reporter = None, turns: float = DEFAULT_TURNS, methods: Sequence[Method] = METHODS
) -> Report:
    """Error and time of every method at every setting over stretches of so many shaft turns.

    Raises InputError for turns outside (0, 1], RunError where the references fail, KeyboardInterrupt.
    """
    stretches = starts_after_transient(scene, turns)
    compile_s = compiling(stretches[0], methods)
    counted = Progress(progress, STARTS + sum(len(method.settings) for method in methods))
    known = reference(stretches, counted.step)
    attempts = [each for method in methods for each in counted.over(attempts_of(method, stretches, known))]
    ratios = speedups(attempts, known.floor(turns))
    sentences = conclusion(attempts, ratios, known.floor(turns), turns)
    written = records(attempts)
    return reported(
        "methods",
        (agreement_table(known), table(attempts, turns), ratio_table(ratios)),
        (*sentences, f"{compile_s:.1f} s to load or compile, in none of the times"),
        written,
        lambda path: _draw(attempts, known.floor(turns), turns, path),
        rows=written,
        conclusion=" ".join(sentences),
        turns=turns,
        starts=STARTS,
        reference=known.as_dict(),
        resolved_m=known.floor(turns),
        times_faster={name: asdict(ratio) for name, ratio in ratios.items()},
        compile_s=compile_s,
    )


def compiling(stretch: Stretch, methods: Sequence[Method]) -> float:
    """Compile, or fetch from disk, all that the methods need; returns the seconds it took."""
    started = time.perf_counter()
    prepare(stretch.scene, stretch.bearing)
    compiled(stretch)
    for method in methods:
        if not method.adaptive:
            run(method, stretch, method.settings[0])
    return time.perf_counter() - started


def attempts_of(method: Method, stretches: Sequence[Stretch], known: Reference) -> Iterator[Attempt]:
    """An attempt a setting; a single one where the method is not installed."""
    for setting in method.settings:
        try:
            yield attempt(method, setting, stretches, known)
        except NotInstalledError as error:
            yield Attempt(method.name, "", str(error), None, None, None, None)
            return


def attempt(method: Method, setting: float, stretches: Sequence[Stretch], known: Reference) -> Attempt:
    """Error of a first run over each stretch, time of later ones. Raises NotInstalledError."""
    errors: list[Error] = []
    turns = sum(stretch.turns for stretch in stretches)
    cpu_s = derivatives = 0.0
    label = method.label(stretches[0], setting)
    for stretch, end in zip(stretches, known.ends, strict=True):
        status, y, calls, seconds = run(method, stretch, setting)
        if y is None:
            return Attempt(method.name, label, status, None, None, seconds / stretch.turns * 1e3, None)
        errors.append(difference(stretch, y, end))
        derivatives += calls
        cpu_s += timed(method, stretch, setting)
    error = worst(errors)
    return Attempt(method.name, label, OK, error.position_m, error.scaled, cpu_s / turns * 1e3, derivatives / turns)


def run(method: Method, stretch: Stretch, setting: float) -> tuple[str, Any, int, float]:
    """Status, end state (None where it failed), right-hand sides and seconds of one run."""
    go = method.ready(stretch, setting)
    started = time.thread_time()
    try:
        y, calls = go()
    except RunError as error:
        if isinstance(error, NotInstalledError):
            raise
        return f"failed: {error}", None, 0, time.thread_time() - started
    seconds = time.thread_time() - started
    if not np.isfinite(y).all():
        return "failed: the end is not finite", None, 0, seconds
    return OK, y, calls, seconds


def timed(method: Method, stretch: Stretch, setting: float) -> float:
    """Least processor time of several runs [s]."""
    times: list[float] = []
    while not times or (len(times) < REPEATS and sum(times) < TIMED_S):
        times.append(run(method, stretch, setting)[3])
    return min(times)


def curve(attempts: Sequence[Attempt], method: str, floor: float) -> list[tuple[float, float]]:
    """(position error [m], ms a turn) of what arrived with an error that the reference resolves."""
    return [
        (a.position_error_m, a.turn_ms)
        for a in attempts
        if a.method == method and a.position_error_m is not None and a.turn_ms and a.position_error_m > floor
    ]


def speedups(attempts: Sequence[Attempt], floor: float) -> dict[str, Speedup]:
    """How many times faster ours is than each other method that shares errors with it."""
    ours = curve(attempts, OURS.name, floor)
    others = dict.fromkeys(a.method for a in attempts if a.method != OURS.name)
    ratios = {name: times_faster(ours, curve(attempts, name, floor)) for name in others}
    return {name: ratio for name, ratio in ratios.items() if ratio is not None}


def conclusion(attempts: Sequence[Attempt], ratios: dict[str, Speedup], floor: float, turns: float) -> list[str]:
    """In words: who is faster at equal error, and what failed."""
    sentences = []
    if ratios:
        faster = ", ".join(
            f"{ratio.mean:.2g} ({ratio.least:.2g} to {ratio.greatest:.2g}) times that of {name}"
            for name, ratio in ratios.items()
        )
        what = f"At equal position error after {turns:g} turns the speed of {OURS.name} is {faster}"
        sentences.append(f"{what}: geometric mean, least and greatest over the errors in common.")
    failed = {a.method: sum(b.method == a.method and b.status != OK for b in attempts) for a in attempts}
    settings = ", ".join(f"{name} at {count}" for name, count in failed.items() if count)
    if settings:
        sentences.append(f"Failed settings: {settings}.")
    sentences.append(f"Errors below {floor:.1g} m are not resolved and count for nothing.")
    return sentences


def table(attempts: Sequence[Attempt], turns: float) -> Table:
    """Table for the terminal, failures in their places."""
    title = f"errors after {turns:g} shaft turns, worst of {STARTS} starts; one thread"
    return tabled(title, attempts, {**columns_of(Attempt), "status": ("status", "")})


def ratio_table(ratios: dict[str, Speedup]) -> Table:
    """How many times faster ours is."""
    cells = [
        (name, f"{r.mean:.3g}", f"{r.least:.3g}", f"{r.greatest:.3g}", f"{r.low:.1g} to {r.high:.1g}")
        for name, r in ratios.items()
    ]
    header = ("than", "mean", "least", "greatest", "position errors [m]")
    return Table(f"times that {OURS.name} is faster at equal error", header, cells)


def front(curve: Curve) -> list[tuple[float, float]]:
    """The points that no other beats in both error and time, smallest error first."""
    unbeaten: list[tuple[float, float]] = []
    for error, took in sorted(curve):
        if not unbeaten or took < unbeaten[-1][1]:
            unbeaten.append((error, took))
    return unbeaten


def times_faster(ours: Curve, theirs: Curve) -> Speedup | None:
    """Their time over ours, with log time interpolated over log error between the points of each front.

    Nothing is extrapolated: None where the two have no range of errors in common.
    """
    fronts = front(ours), front(theirs)
    if not all(fronts):
        return None
    low, high = max(points[0][0] for points in fronts), min(points[-1][0] for points in fronts)
    if not low < high:
        return None
    at = np.linspace(np.log(low), np.log(high), POINTS)
    our_time, their_time = (np.interp(at, *np.log(np.array(points)).T) for points in fronts)
    ratio = np.exp(their_time - our_time)
    return Speedup(low, high, float(np.exp((their_time - our_time).mean())), ratio.min().item(), ratio.max().item())


def _draw(attempts: Sequence[Attempt], floor: float, turns: float, path: Any) -> None:
    """Position error of each method against the time of a shaft turn; crosses at the right edge failed."""
    from rbdyn.plots.error_against_time import failed_at_the_edge, logarithmic, method_lines
    from rbdyn.plots.style import GREY, label_ends, plt, save

    figure, axis = plt.subplots(figsize=(8.6, 6.0))
    across = f"largest position error after {turns:g} shaft turns, worst of the starts [m]"
    logarithmic(axis, across, "processor time of a shaft turn [ms]")
    lines: dict[str, list[tuple[float, float]]] = {attempt.method: [] for attempt in attempts}
    for a in attempts:
        if a.position_error_m and a.turn_ms:
            lines[a.method].append((a.position_error_m, a.turn_ms))
    ends, colours = method_lines(axis, lines)
    failures: dict[str, tuple[list[float], str]] = {}
    for a in attempts:
        if not a.position_error_m and a.turn_ms and a.method in colours:
            failures.setdefault(a.method, ([], colours[a.method]))[0].append(a.turn_ms)
    axis.margins(0.08)
    left, right = axis.get_xlim()
    if floor > left:
        axis.axvspan(left, floor, color="0.93", zorder=0)
        axis.annotate("not resolved", (floor, 0.5), xycoords=axis.get_xaxis_transform(), fontsize=8,
                      color=GREY, ha="left", rotation=90, xytext=(3, 0), textcoords="offset points")  # fmt: skip
    axis.set_xlim(left, right)
    axis.set_ylim(top=axis.get_ylim()[1] * 1.6)
    failed_at_the_edge(axis, failures)
    label_ends(axis, ends)
    save(figure, path)
