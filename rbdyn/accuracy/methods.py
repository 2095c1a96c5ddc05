"""Methods compared on one compiled right-hand side: error of the motion against time, at equal error.

A stretch of motion starts where a replicate has settled; two references agree on its end. The motion is chaotic: two runs
separate about 500-fold a shaft turn. So methods differ only over part of a turn, and each span has a floor below which the
reference itself is uncertain.

The integrators are ours, fixed steps, SciPy's and CVODE. ``method.ready(stretch, setting)`` sets up and returns a call that
integrates once; only that call is timed. All adaptive methods get the same absolute tolerance, a fraction ``setting`` of the
scale of each component, and no relative one. Their norms differ, so compare them at equal error, never at equal setting.
"""

import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from typing import Any, NamedTuple

import numpy as np

from rbdyn.accuracy.fixed_step import BudgetSpent, RightHandSide, runge_kutta_4, steps_of, velocity_of, velocity_verlet
from rbdyn.accuracy.report import Progress, Report, Reporter, records, reported
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.blocks import Column, Sheet, Table, columns_of, within
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.records import Record, shown
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.forces.equations import RollerBearing
from rbdyn.dynamics.integrators.advance import ACCEPTED, DERIVATIVES, NOW
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import absolute_tolerance, layout_of, scales
from rbdyn.dynamics.run import Run, prepare, with_numerics
from rbdyn.scene import Scene

# Right-hand sides a turn past which a method counts as failed.
BUDGET_PER_TURN = 4_000_000
# The least relative tolerance that SciPy takes: next to the absolute ones it is round-off.
NO_RELATIVE_TOLERANCE = 2.3e-14


class Stretch(Record):
    """From the state ``start`` (n,) over so many shaft turns; ``scale`` (n,): scale of the errors of each component."""

    scene: Scene
    bearing: RollerBearing
    start: Array
    turns: float
    scale: Array

    @property
    def duration(self) -> float:
        """Its length [s]."""
        return self.turns * self.scene.turn_s


class NotInstalledError(RunError):
    """A method whose package is missing."""


class Arrived(NamedTuple):
    """State at the end, right-hand sides it took."""

    y: Array
    derivatives: int


class Method(NamedTuple):
    """``ready(stretch, setting)`` gives the timed call, which raises RunError. Settings, loosest first: tolerances of
    an ``adaptive`` method, else steps in contact times (approach over speed of a race contact)."""

    name: str
    adaptive: bool
    settings: tuple[float, ...]
    ready: Callable[[Stretch, float], Callable[[], Arrived]]

    def label(self, stretch: Stretch, setting: float) -> str:
        """A setting in words."""
        if self.adaptive:
            return f"rtol {setting:g}"
        return f"{steps_of(stretch.duration, fixed_step(stretch.scene, setting)) / stretch.turns:.0f} steps a turn"


def by_simulation(method: str) -> Callable[..., Callable[[], Arrived]]:
    """``ready`` of a method as in a simulation, with its tally: works, largest loads, whirl."""

    def ready(stretch: Stretch, rtol: float) -> Callable[[], Arrived]:
        limits = {"turns": stretch.turns, "discard_turns": 0.0, "step_budget_per_turn": BUDGET_PER_TURN}
        scene = with_numerics(stretch.scene, method=method, **limits)
        return _over(stretch, Run(scene, stretch.bearing, 0, rtol, Stop()))

    return ready


def _over(stretch: Stretch, run: Run) -> Callable[[], Arrived]:
    """The call that takes a run over a stretch."""
    run.carry.y[:] = stretch.start

    def go() -> Arrived:
        run.to(stretch.turns)
        return Arrived(run.carry.y, int(run.carry.counts[DERIVATIVES]))

    return go


def fixed_step(scene: Scene, contact_times: float) -> float:
    """A step given in contact times [s]."""
    scale = scales(scene)
    return contact_times * scale.length / scale.speed


class FixedStepRun(Run):
    """A run whose steps are fixed: about ``step`` [s], cut so that a whole number of them fits each leg."""

    def __init__(self, scene: Scene, bearing: RollerBearing, replicate: int, step: float, verlet: bool) -> None:
        super().__init__(scene, bearing, replicate, 1.0, Stop())
        self.step, self.verlet, self.pairs = step, verlet, velocity_of(self.layout)

    def to(self, turns: float) -> None:
        """Advance to a time given in shaft turns since the start. Raises RunError where the state explodes."""
        carry, turn_s = self.carry, self.scene.turn_s
        duration = turns * turn_s - carry.clock[NOW]
        if duration <= 0.0:
            return
        steps = steps_of(duration, self.step)
        task = (carry.y, duration / steps, steps, carry.scratch, self.tally)
        steps_made = (
            velocity_verlet(self.bearing, self.pairs, *task) if self.verlet else runge_kutta_4(self.bearing, *task)
        )
        carry.clock[NOW] += duration * steps_made / steps
        carry.counts[ACCEPTED] += steps_made
        carry.counts[DERIVATIVES] += steps_made if self.verlet else 4 * steps_made
        if steps_made < steps:
            raise RunError(f"not finite after {carry.clock[NOW] / turn_s:.2g} turns")


def by_fixed_step(verlet: bool) -> Callable[..., Callable[[], Arrived]]:
    """``ready`` of velocity Verlet, or else of the classical Runge-Kutta method."""

    def ready(stretch: Stretch, contact_times: float) -> Callable[[], Arrived]:
        step = fixed_step(stretch.scene, contact_times)
        return _over(stretch, FixedStepRun(stretch.scene, stretch.bearing, 0, step, verlet))

    return ready


def compiled(stretch: Stretch) -> RightHandSide:
    """The compiled right-hand side with the budget of a stretch."""
    return RightHandSide(stretch.bearing, stretch.start.size, int(BUDGET_PER_TURN * stretch.turns))


def by_scipy(name: str, function: Callable[[Stretch], Any] = compiled) -> Callable[..., Callable[[], Arrived]]:
    """``ready`` of a method of scipy.integrate.solve_ivp, on the right-hand side that ``function(stretch)`` gives."""

    def ready(stretch: Stretch, rtol: float) -> Callable[[], Arrived]:
        from scipy.integrate import solve_ivp

        right_hand_side = function(stretch)
        options = {"method": name, "rtol": NO_RELATIVE_TOLERANCE, "atol": rtol * stretch.scale}

        def go() -> Arrived:
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("ignore")
                try:
                    solution = solve_ivp(right_hand_side, (0.0, stretch.duration), stretch.start, **options)
                except (BudgetSpent, ValueError) as error:  # its LU refuses a Jacobian that is not finite
                    raise RunError(_why(error)) from None
            if not solution.success:
                raise RunError(str(solution.message))
            return Arrived(solution.y[:, -1], right_hand_side.calls)

        return go

    return ready


def by_cvode(name: str) -> Callable[..., Callable[[], Arrived]]:
    """``ready`` of CVODE (SUNDIALS) by scikit-sundae, with "Adams" or "BDF" formulas; raises NotInstalledError."""

    def ready(stretch: Stretch, rtol: float) -> Callable[[], Arrived]:
        try:
            from sksundae.cvode import CVODE
        except ImportError:
            raise NotInstalledError("not installed: pip install 'rbdyn[bench]'") from None
        right_hand_side = compiled(stretch)
        spent: list[BudgetSpent] = []

        def fill(t: float, y: Array, dy: Array) -> None:
            try:
                right_hand_side.fill(y, dy.reshape(1, -1))
            except BudgetSpent as error:
                # No exception gets through its C code: a derivative that is not finite ends the run.
                spent.append(error)
                dy[:] = np.nan

        steps = int(BUDGET_PER_TURN * stretch.turns) + 1
        solver = CVODE(fill, method=name, rtol=NO_RELATIVE_TOLERANCE, atol=rtol * stretch.scale, max_num_steps=steps)

        def go() -> Arrived:
            solver.init_step(0.0, stretch.start)
            solution = solver.step(stretch.duration, tstop=stretch.duration)
            if spent:
                raise RunError(_why(spent[0]))
            if not solution.success:
                raise RunError(str(solution.message))
            return Arrived(solution.y, right_hand_side.calls)

        return go

    return ready


def _why(error: Exception) -> str:
    return f"over {BUDGET_PER_TURN} right-hand sides a turn" if isinstance(error, BudgetSpent) else str(error)


def _decades(first: int, last: int) -> tuple[float, ...]:
    return tuple(10.0**-power for power in range(first, last + 1))


def _halved(first: float, count: int) -> tuple[float, ...]:
    return tuple(first * 0.5**k for k in range(count))


OURS = Method("rbdyn RK45", True, (1e-1, 3e-2, 1e-2, *_decades(3, 10)), by_simulation("rk45"))
OUR_VERLET = Method("rbdyn Verlet", True, (1e-1, 3e-2, 1e-2, *_decades(3, 7)), by_simulation("verlet"))
RUNGE_KUTTA_4 = Method("RK4, fixed step", False, _halved(4.0, 9), by_fixed_step(verlet=False))
VELOCITY_VERLET = Method("Verlet, fixed step", False, _halved(4.0, 11), by_fixed_step(verlet=True))
SCIPY_RK45 = Method("SciPy RK45", True, _decades(0, 9), by_scipy("RK45"))
DOP853 = Method("SciPy DOP853", True, _decades(0, 10), by_scipy("DOP853"))
COMPILED = (OURS, OUR_VERLET, RUNGE_KUTTA_4, VELOCITY_VERLET)
METHODS = (
    *COMPILED,
    SCIPY_RK45,
    DOP853,
    Method("SciPy LSODA", True, _decades(0, 8), by_scipy("LSODA")),
    Method("SciPy Radau", True, _decades(0, 5), by_scipy("Radau")),
    Method("SciPy BDF", True, _decades(0, 5), by_scipy("BDF")),
    Method("CVODE Adams", True, _decades(0, 8), by_cvode("Adams")),
    Method("CVODE BDF", True, _decades(0, 6), by_cvode("BDF")),
)

DEFAULT_TURNS, LONGEST_TURNS = 0.25, 1.0
SPANS = (0.25, 0.5, 1.0)  # shaft turns after which the two references are compared
SETTLE_TURNS = 5.0
STARTS = 3
# Below this the round-off of overlaps, times the stiffness of loaded contacts, holds the error of a step above its tolerance.
OUR_REFERENCE_RTOL, THEIR_REFERENCE_RTOL = 1e-12, 1e-12
# An error below this many times what the references differ by says nothing.
RESOLVED = 10.0


class Error(Record):
    """Largest difference of two states: of any position of roller, cage or ring [m], and of any component over its
    scale (the approach or speed of a race contact)."""

    position_m: float = shown("positions apart [m]", ".2g")
    scaled: float = shown("worst component over its scale", ".2g")


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
        raise InputError(f"turns = {turns:g}: past a turn no reference holds; give more than 0 and at most 1")
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


def agreement_table(references: Reference) -> Table:
    """How far the references are apart after each span."""
    title = f"the two references: {OURS.name} at {OUR_REFERENCE_RTOL:g}, {DOP853.name} at {THEIR_REFERENCE_RTOL:g}"
    columns = Column[tuple[float, Error]]("turns", "g", at=0), *within(1, columns_of(Error))
    return Sheet(title, columns, tuple(references.agreement.items())).block


OK = "ok"
# A run is timed at most so often and, after the first time, for at most so long [s].
REPEATS, TIMED_S = 5, 0.1
# Points over the common range of errors, evenly spaced in the logarithm.
POINTS = 41

Curve = Sequence[tuple[float, float]]  # (error, time) pairs, all positive


class Speedup(Record):
    """Ratio of times: geometric mean, least and greatest over the errors from ``low`` to ``high``."""

    low: float
    high: float
    mean: float
    least: float
    greatest: float


class Attempt(Record):
    """One method at one setting over all stretches: worst error, processor time and right-hand sides a shaft turn.

    Where it failed, ``status`` says why, the errors are None and the time is that until it failed.
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
    references = reference(stretches, counted.step)
    attempts = [attempt for method in methods for attempt in counted.over(attempts_of(method, stretches, references))]
    ratios = speedups(attempts, references.floor(turns))
    sentences = conclusion(attempts, ratios, references.floor(turns), turns)
    written = records(attempts)
    return reported(
        "methods",
        (agreement_table(references), table(attempts, turns), ratio_table(ratios)),
        (*sentences, f"{compile_s:.1f} s to load or compile (excluded from the times)"),
        written,
        lambda path: _draw(attempts, references.floor(turns), turns, path),
        rows=written,
        conclusion=" ".join(sentences),
        turns=turns,
        starts=STARTS,
        reference=references.as_dict(),
        resolved_m=references.floor(turns),
        times_faster={name: asdict(ratio) for name, ratio in ratios.items()},
        compile_s=compile_s,
    )


def compiling(stretch: Stretch, methods: Sequence[Method]) -> float:
    """Compile, or load from disk, all that the methods need; returns the seconds that it took."""
    started = time.perf_counter()
    prepare(stretch.scene, stretch.bearing)
    compiled(stretch)
    for method in methods:
        if not method.adaptive:
            run(method, stretch, method.settings[0])
    return time.perf_counter() - started


def attempts_of(method: Method, stretches: Sequence[Stretch], references: Reference) -> Iterator[Attempt]:
    """An attempt a setting; a single one where the method is not installed."""
    for setting in method.settings:
        try:
            yield attempt(method, setting, stretches, references)
        except NotInstalledError as error:
            yield Attempt(method.name, "", str(error), None, None, None, None)
            return


def attempt(method: Method, setting: float, stretches: Sequence[Stretch], references: Reference) -> Attempt:
    """Error of a first run over each stretch, time of later ones. Raises NotInstalledError."""
    errors: list[Error] = []
    turns = sum(stretch.turns for stretch in stretches)
    cpu_s = derivatives = 0.0
    label = method.label(stretches[0], setting)
    for stretch, end in zip(stretches, references.ends, strict=True):
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
    """(position error [m], ms a turn) of attempts with an error that the reference resolves."""
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
    """Which method is faster at equal error, and what failed."""
    sentences = []
    if ratios:
        faster = ", ".join(
            f"{ratio.mean:.2g} ({ratio.least:.2g} to {ratio.greatest:.2g}) times the speed of {name}"
            for name, ratio in ratios.items()
        )
        sentences.append(
            f"At equal position error after {turns:g} turns the speed of {OURS.name} is {faster}: geometric mean, least and "
            "greatest over the errors in common."
        )
    failed = {a.method: sum(b.method == a.method and b.status != OK for b in attempts) for a in attempts}
    if settings := [f"{count} of {name}" for name, count in failed.items() if count]:
        sentences.append(f"Settings that failed: {'; '.join(settings)}.")
    sentences.append(f"Errors below {floor:.1g} m are not resolved and do not count.")
    return sentences


def table(attempts: Sequence[Attempt], turns: float) -> Table:
    """Table for the terminal, failures in their places."""
    title = f"errors after {turns:g} shaft turns, worst of {STARTS} starts; one thread"
    return Sheet(title, (*columns_of(Attempt), Column("status", files=False)), attempts).block


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
    log_error = np.linspace(np.log(low), np.log(high), POINTS)
    our_time, their_time = (np.interp(log_error, *np.log(np.array(points)).T) for points in fronts)
    ratio = np.exp(their_time - our_time)
    return Speedup(low, high, float(np.exp((their_time - our_time).mean())), ratio.min().item(), ratio.max().item())


def _draw(attempts: Sequence[Attempt], floor: float, turns: float, path: Any) -> None:
    """Position error of each method against the time of a shaft turn; crosses at the right edge failed."""
    from rbdyn.plots.style import GREY, failed_at_the_edge, label_ends, logarithmic, method_lines, save, subplots

    figure, axis = subplots(figsize=(8.6, 6.0))
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
    limits = axis.get_xlim()
    if floor > limits[0]:
        axis.axvspan(limits[0], floor, color="0.93", zorder=0)
        axis.annotate("not resolved", (floor, 0.5), xycoords=axis.get_xaxis_transform(), fontsize=8,
                      color=GREY, ha="left", rotation=90, xytext=(3, 0), textcoords="offset points")  # fmt: skip
    axis.set_xlim(limits)
    axis.set_ylim(top=axis.get_ylim()[1] * 1.6)
    failed_at_the_edge(axis, failures)
    label_ends(axis, ends)
    save(figure, path)
