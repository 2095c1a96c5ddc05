"""Figures of a scene with their error bars, and what is to be said about these."""

import math

from rbdyn.dynamics.statistics import metrics
from rbdyn.dynamics.statistics.drift import TESTED, Start, drifting, slow_change, start_of_counting
from rbdyn.dynamics.statistics.metrics import Replicate, Runs, quantity
from rbdyn.result import Quantity
from rbdyn.scene import Scene

FIGURES = {
    "impact_force_N": (metrics.IMPACT_FORCE, 1.0),
    "impact_contact_force_N": (metrics.IMPACT_CONTACT_FORCE, 1.0),
    "whirl_deviation_ratio": (metrics.WHIRL_DEVIATION_RATIO, 1.0),
    "power_loss_W": (metrics.POWER_LOSS, 1.0),
    "cage_speed_rpm": (metrics.CAGE_SPEED, 30.0 / math.pi),
    "cage_slip": (metrics.CAGE_SLIP, 1.0),
}
# A slip near nothing has no relative error worth a word; the cage speed tells of it.
JUDGED = {
    "impact_force_N": "impact force",
    "whirl_deviation_ratio": "whirl deviation ratio",
    "power_loss_W": "power loss",
    "cage_speed_rpm": "cage speed",
}
# Fewer effective samples leave the half-width itself uncertain by a quarter and more.
FEW_SAMPLES = 10.0
# Numerical errors that are said: beyond a twentieth of the value, or beyond a hundredth where they rule the sum.
LARGE, NOTICEABLE = 0.05, 0.01
# Companions tighter than the run let scatter alone make the numerical error up to two and a half times the statistical one.
RULES = 3.0


def after_transient(scene: Scene, runs: Runs, companions: Runs) -> tuple[list[Replicate], list[Replicate], Start]:
    """Replicates and companions counted from where the scene asks, and where that is."""
    start = start_of_counting(scene, runs)
    ours, theirs = ([run.counted_from(start.first) for run in series] for series in (runs, companions))
    return ours, theirs, start


def quantities(
    scene: Scene, runs: Runs, companions: Runs, share: float, since: int | None = None
) -> dict[str, Quantity]:
    """Every figure with its errors, by the name it has in a record.

    ``share`` of the difference from the companions is the bias of the runs. ``since``: batch from which the replicates show what regimes there are, that from which they count unless given.
    """
    steady = scene.operation.schedule is None
    since = runs[0].first if since is None else since
    figures, moving = {}, steady and drifting(runs)
    for name, (figure, unit) in FIGURES.items():
        slow = slow_change(figure, TESTED.get(name, figure), runs, since, moving=moving) if steady else 0.0
        figures[name] = quantity(figure, runs, companions, share, slow, unit)
    return figures


def error_notes(
    scene: Scene, figures: dict[str, Quantity], fault: str | None, tighter: float | None = None
) -> list[str]:
    """Sentences on errors that are large or themselves uncertain, each with its fix.

    ``tighter``: the tolerance that removes a numerical error; a tenth of the scene's unless given.
    """
    notes = [] if fault is None else [f"numerical error: not estimated; {fault}"]
    few = {name: figures[name].effective_samples for name in JUDGED if not _enough(figures[name])}
    if few:
        listed = ", ".join(f"{JUDGED[name]} {count:.1f}" for name, count in few.items())
        what = f"statistical error: uncertain where fewer than {FEW_SAMPLES:.0f} effective samples"
        notes.append(f"{what} stand behind it ({listed}); raise numerics.turns or numerics.replicates")
    return notes + [note for name in JUDGED if (note := _numerical_note(scene, JUDGED[name], figures[name], tighter))]


def _enough(figure: Quantity) -> bool:
    return figure.effective_samples >= FEW_SAMPLES or figure.statistical_error == 0.0


def _numerical_note(scene: Scene, name: str, figure: Quantity, tighter: float | None) -> str | None:
    error, size = figure.numerical_error, abs(figure.value)
    if error is None or size == 0.0:
        return None
    biased = error > RULES * (figure.statistical_error or 0.0)
    if error <= (NOTICEABLE if biased else LARGE) * size:
        return None
    rtol = scene.numerics.rtol
    longer = "it is mostly scatter, so raise numerics.turns or numerics.replicates"
    mend = f"tighten numerics.rtol = {rtol:g} to {tighter or 0.1 * rtol:.1g}" if biased else longer
    return f"numerical error: {name} may be off by {100.0 * error / size:.2g} %; {mend}"
