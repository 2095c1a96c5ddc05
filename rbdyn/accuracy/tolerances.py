"""Error against run time of the time integration: bias of the statistics at each tolerance, and error of the motion itself.

Every tolerance runs the same seeded replicates, one at a time, after everything was compiled; the reference is the tightest.
What an error allows to say of a relative difference d with the 95 % half-width e, where a is the margin:

- within, where e <= a and |d| <= a
- beyond, where |d| > a and either e <= a, or |d| - e > a: a large difference is clear in spite of a large error
- undecided otherwise: the error exceeds it

Half-widths decrease as one over the root of the counted turns; with more replicates Student's factor decreases too. This law
gives the turns or the replicates that would decide.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any, Literal, NamedTuple, TypeVar

import numpy as np

from rbdyn.accuracy import methods
from rbdyn.accuracy.methods import COMPILED
from rbdyn.accuracy.report import Progress, Report, Reporter, flat, record, records
from rbdyn.base.blocks import Column, Sheet, Table, columns_of
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.records import Record, shown
from rbdyn.base.words import NORMAL, signed_with_error
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.figures import FIGURES
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.recording import run_series
from rbdyn.dynamics.run import prepare
from rbdyn.dynamics.statistics.batch_means import student_factor, student_half_width
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.scene import Scene

Verdict = Literal["within", "beyond", "undecided"]

# Relative differences up to this do not matter: two bearings of one lot differ by more.
MARGIN = 0.01
# From so many replicates on Student's factor equals that of the normal distribution to two digits.
MANY = 100


class Difference(NamedTuple):
    """A relative difference with its 95 % half-width; ``where`` names output and row."""

    where: str
    value: float
    error: float


def judged(value: float, error: float, margin: float = MARGIN) -> Verdict:
    """Verdict on a difference with its ``error``; all relative. An error of NaN decides nothing."""
    size = abs(value)
    if size > margin and (error <= margin or size - error > margin):
        return "beyond"
    return "within" if error <= margin and size <= margin else "undecided"


def overall(verdicts: Iterable[Verdict]) -> Verdict:
    """Verdict on several differences at once: one beyond decides it, else one undecided leaves it open."""
    kinds = set(verdicts)
    return "beyond" if "beyond" in kinds else "undecided" if "undecided" in kinds else "within"


def check_replicates(scene: Scene) -> None:
    """Raises InputError for a single replicate, whose mean has no error here."""
    if scene.numerics.replicates < 2:
        raise InputError("numerics.replicates = 1: the study compares means over replicates; give at least 2, better 8")


def turns_needed(error: float, turns: float, margin: float = MARGIN) -> float:
    """Counted turns of a replicate at which a half-width of ``error`` after ``turns`` would fall to ``margin``."""
    return turns * (error / margin) ** 2


def replicates_needed(error: float, replicates: int, margin: float = MARGIN) -> int:
    """Replicates at which a half-width of ``error`` over ``replicates`` > 1 of them would fall to ``margin``."""
    scatter = error * math.sqrt(replicates) / student_factor(replicates - 1)
    needed = max(math.ceil((NORMAL * scatter / margin) ** 2), 2)
    while needed < MANY and student_factor(needed - 1) * scatter > margin * math.sqrt(needed):
        needed += 1
    return needed


def about(count: float) -> str:
    """A count in two digits, rounded up."""
    unit = 10.0 ** max(math.floor(math.log10(count)) - 1, 0) if count > 1.0 else 1.0
    return f"{math.ceil(count / unit - 1e-9) * unit:.0f}"


def percent(value: float) -> str:
    """A relative figure in two digits."""
    return f"{100.0 * value:.2g} %"


def undecided(hidden: Iterable[Difference], scene: Scene, margin: float = MARGIN) -> str:
    """Largest error of ``hidden`` differences, and the turns or replicates that would decide."""
    worst = max(hidden, key=lambda difference: difference.error)
    numerics = scene.numerics
    turns = turns_needed(worst.error, numerics.turns, margin)
    replicates = replicates_needed(worst.error, numerics.replicates, margin)
    return (
        f"undecided: errors of {percent(worst.error)} hide differences of {percent(abs(worst.value))} ({worst.where}); to show "
        f"{percent(margin)} raise numerics.turns to about {about(turns)} or numerics.replicates to about {about(replicates)}"
    )


# Power of the tolerance by which the steps of a run shrink.
STEPS = 0.2
TOLERANCES = (1e-1, 5e-2, 2e-2, 1e-2, 5e-3, 1e-3, 1e-4)
OUTPUTS: dict[str, Callable[[Replicate], float]] = {
    figure.key: figure.statistic.value for figure in FIGURES if figure.judged == "target" and figure.statistic
}
# A gap of the power balance, or an error of a load, below this does not matter; neither of them scatters.
NEGLIGIBLE = 0.005


class Bias(Record):
    """Per output: its mean, its relative bias against a reference and the 95 % error of that."""

    value: dict[str, float]
    bias: dict[str, float]
    bias_error: dict[str, float]

    def verdict_of(self, name: str, margin: float = MARGIN) -> Verdict:
        """Whether an output is off by more than ``margin``, as far as its error shows."""
        return judged(self.bias[name], self.bias_error[name], margin)

    def verdict(self, margin: float = MARGIN) -> Verdict:
        """Verdict on all outputs together."""
        return overall(self.verdict_of(name, margin) for name in OUTPUTS)

    @property
    def known_to(self) -> float:
        """Largest 95 % error of any output."""
        return max(self.bias_error[name] for name in OUTPUTS)

    def hidden(self, row: str, margin: float = MARGIN) -> list[Difference]:
        """Undecided differences; ``row`` says where."""
        return [
            Difference(f"{name} at {row}", self.bias[name], self.bias_error[name])
            for name in OUTPUTS
            if self.verdict_of(name, margin) == "undecided"
        ]


B = TypeVar("B", bound=Bias)
R = TypeVar("R")


def first_within(rows: Iterable[B], name: Callable[[B], str], margin: float) -> tuple[B | None, list[Difference]]:
    """The first row, cheapest first, with all outputs within the margin, and the undecided differences before it."""
    hidden: list[Difference] = []
    for row in rows:
        verdict = row.verdict(margin)
        if verdict == "within":
            return row, hidden
        if verdict == "undecided":
            hidden += row.hidden(name(row), margin)
    return None, hidden


class Row(Bias):
    """One tolerance: processor time per shaft turn [ms] and per right-hand side [ns] (medians over replicates),
    steps per turn, largest relative power gap."""

    rtol: float = shown("rtol", "g")
    turn_ms: float = shown("ms a turn", ".2f")
    rhs_ns: float = shown("ns a right-hand side", ".0f")
    steps_per_turn: float = shown("steps a turn", ".0f")
    power_gap: float = shown("power gap", ".2g %")


class StatisticsBias(Record):
    """Rows, loosest tolerance first; the last is the reference. ``failures``: reasons by tolerance of runs that failed."""

    rows: Sequence[Row]
    failures: dict[float, str]


def statistics_bias(
    scene: Scene, tolerances: Sequence[float] = TOLERANCES, progress: Reporter = None
) -> StatisticsBias:
    """A row a tolerance. Runs one replicate at a time.

    Raises InputError for a single replicate, KeyboardInterrupt, RunError where the tightest fails.
    """
    check_replicates(scene)
    bearing = roller_bearing(scene)
    prepare(scene, bearing)
    ordered = sorted(tolerances)
    works = [rtol**-STEPS for rtol in ordered for _ in range(scene.numerics.replicates)]
    counted = Progress(progress, works)
    series: dict[float, list[Replicate]] = {}
    failures: dict[float, str] = {}
    for rtol in ordered:
        try:
            series[rtol] = run_series(scene, bearing, [rtol], 1, counted.step, Stop())[0]
        except RunError as error:
            if rtol == ordered[0]:
                raise
            failures[rtol] = str(error)
    rows = [_row(scene, rtol, runs, series[ordered[0]]) for rtol, runs in series.items()]
    return StatisticsBias(rows[::-1], failures)


def conclusion(rows: Sequence[Row], scene: Scene, margin: float = MARGIN) -> str:
    """Which tolerance to take: the loosest that biases no output and closes in power, or why that is undecided.

    The last row is the reference and no evidence for itself.
    """
    reference = rows[-1]
    closing = [row for row in rows[:-1] if row.power_gap <= NEGLIGIBLE]
    best, hidden = first_within(closing, lambda row: f"rtol {row.rtol:g}", margin)
    doubt = undecided(hidden, scene, margin) if hidden else ""
    if best is None:
        return doubt or (
            f"no tolerance looser than the reference, rtol {reference.rtol:g}, has biases of at most {percent(margin)} and a "
            f"power balance that closes within {percent(NEGLIGIBLE)}"
        )
    sentence = (
        f"rtol {best.rtol:g} is {'one' if hidden else 'the loosest'} whose biases measure at most {percent(margin)} (their "
        f"errors at most {percent(best.known_to)}) and whose power balance closes within {percent(NEGLIGIBLE)}: "
        f"{best.turn_ms:.2f} ms a shaft turn. The scene has {scene.numerics.rtol:g}."
    )
    return f"{sentence} Looser ones are {doubt}." if hidden else sentence


def bias_of(runs: Sequence[Replicate], reference: Sequence[Replicate]) -> Bias:
    """Bias of every output of ``runs`` against ``reference``; the error is that of two independent means."""
    value, bias, bias_error = {}, {}, {}
    for name, figure in OUTPUTS.items():
        ours, theirs = (np.array([figure(run) for run in series]) for series in (runs, reference))
        value[name] = float(ours.mean())
        scale = abs(float(theirs.mean())) or 1.0
        bias[name] = float(ours.mean() - theirs.mean()) / scale
        bias_error[name] = math.hypot(*(student_half_width(x) or 0.0 for x in (ours, theirs))) / scale
    return Bias(value, bias, bias_error)


def table(biases: StatisticsBias, margin: float = MARGIN) -> Table:
    """Table for the terminal; failed tolerances at the end."""
    reference = biases.rows[-1]
    title = f"bias against rtol {reference.rtol:g}, 95 % errors"
    ran = Sheet(title, (*columns_of(Row), *bias_columns(margin, lambda row: row, reference)), biases.rows).block
    failed = [(f"{rtol:g}", "failed", *[""] * (len(ran.header) - 2)) for rtol in biases.failures]
    return replace(ran, rows=[*ran.rows, *failed])


def bias_columns(margin: float, bias: Callable[[R], Bias | None], reference: R | None = None) -> tuple[Column[R], ...]:
    """Columns of the ``bias`` of each output with its error, and of the verdict; ``reference`` has none."""

    def column(heading: str, text: Callable[[Bias], str]) -> Column[R]:
        return Column("", words=heading, cell=lambda row: "" if (found := bias(row)) is None else text(found))

    def output(name: str) -> Callable[[Bias], str]:
        return lambda found: f"{signed_with_error(100.0 * found.bias[name], 100.0 * found.bias_error[name])} %"

    def verdict(found: Bias) -> str:
        return "reference" if found is reference else found.verdict(margin)

    return (*(column(name, output(name)) for name in OUTPUTS), column(f"within {percent(margin)}", verdict))


def _row(scene: Scene, rtol: float, runs: list[Replicate], reference: list[Replicate]) -> Row:
    turns = scene.numerics.turns + scene.numerics.warm_up_turns
    return Row(
        **bias_of(runs, reference).__dict__,
        rtol=rtol,
        turn_ms=float(np.median([run.cpu_s for run in runs])) / turns * 1e3,
        rhs_ns=float(np.median([run.cpu_s / run.derivatives for run in runs])) * 1e9,
        steps_per_turn=float(np.mean([run.accepted_steps + run.rejected_steps for run in runs])) / turns,
        power_gap=max(run.power_gap for run in runs),
    )


# Keys of the record of the trajectories that the record of the study contains.
MOTION = ("rows", "conclusion", "turns", "starts", "reference", "resolved_m", "times_faster", "compile_s")


def study(
    scene: Scene,
    progress: Reporter = None,
    turns: float = methods.DEFAULT_TURNS,
    rtols: Sequence[float] = TOLERANCES,
    margin: float = MARGIN,
) -> Report:
    """``rbdyn accuracy SCENE tolerances``: bias of the statistics against a ``margin``, and trajectories of the compiled methods.

    Where the reference of the trajectories fails, the statistics alone are compared. Raises InputError, RunError where theirs
    fails, KeyboardInterrupt.
    """
    check_replicates(scene)
    motion, why = None, ""
    try:
        motion = methods.study(scene, progress, turns, COMPILED)
    except RunError as error:
        why = f"Trajectories are not compared, because their reference failed: {str(error).rstrip('.')}."
    biases = statistics_bias(scene, rtols, progress)
    choice = conclusion(biases.rows, scene, margin)
    numerics, rows = scene.numerics, records(biases.rows)
    failures = {f"{rtol:g}": why for rtol, why in biases.failures.items()}
    content = record(
        "rbdyn.accuracy/1",
        rows=rows,
        sought=margin,
        failures=failures,
        conclusion=choice,
        turns=numerics.turns,
        replicates=numerics.replicates,
        trajectory=motion and {key: motion.record[key] for key in MOTION},
    )
    sentences = *(motion.sentences if motion else [why]), choice
    sheets = {"accuracy": [flat(row) for row in rows]}
    pictures: dict[str, Callable[[Any], None]] = {"accuracy": lambda path: _draw(biases.rows, path, margin)}
    return Report(
        "accuracy",
        content,
        (*(motion.tables[:2] if motion else []), table(biases, margin)),
        (
            *sentences,
            *(f"rtol {rtol} failed: {why}" for rtol, why in failures.items()),
            f"{numerics.replicates} replicates of {numerics.turns:g} turns",
        ),
        sheets | ({"trajectory": motion.record["rows"]} if motion else {}),
        pictures | ({"trajectory": motion.pictures["methods"]} if motion else {}),
    )


def _draw(rows: Sequence[Row], path: Any, margin: float) -> None:
    """Bias of each output and gap of the power balance against the time of a shaft turn, marked with rtol."""
    from rbdyn.plots.style import biases_at_work

    labels = "relative bias, or gap of the power balance", "processor time of a shaft turn [ms]"
    biases_at_work(rows, path, margin, labels, "turn_ms", ("gap of the power balance", "power_gap"), "rtol")
