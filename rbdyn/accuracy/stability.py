"""How extreme variants of a scene end: with a finite answer whose power balance closes, or with the reason why not.

A case is a few assignments to the scene. Each runs one replicate over few turns. Where the balance stays open, the case
runs once more at a tenth of the tolerance, to see whether tightening fixes it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from string import Template
from typing import Any

from rbdyn.accuracy.options import VARIANTS, with_options
from rbdyn.accuracy.report import Progress, Report, Reporter, columns_of, records, reported, tabled
from rbdyn.base.faults import InputError, RunError, read_toml
from rbdyn.base.records import Record, finite, shown
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.integrators.method import held_by_stability, largest_eigenvalue
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.recording import run_replicate
from rbdyn.dynamics.run import prepare
from rbdyn.scene import Scene

LARGEST_GAP = 0.01
TURNS, DISCARDED = 5, 2
# What a case may end with. All but "open" say what to do; "refused" and "stopped" do so in their reason.
CLOSED, TIGHTENED, OPEN, STOPPED, REFUSED = "closed", "closed, tightened", "open", "stopped", "refused"


class Ending(Record):
    """How a case ended; figures are None where it did not run.

    ``held``: share of the explicit steps that stability held, not accuracy; ``stiffness_ratio``: |eigenvalue| of the motion
    that held them times the duration of a shaft turn, zero where none was held.
    """

    case: str = shown("case")
    assignments: tuple[str, ...]
    status: str = shown("status")
    reason: str = ""
    method: str | None = shown("method", default=None)
    rtol: float | None = None
    steps_per_turn: float | None = shown("steps a turn", ".0f", default=None)
    turn_ms: float | None = shown("ms a turn", ".3g", default=None)
    power_gap: float | None = shown("power gap", ".1e", default=None)
    held: float | None = None
    stiffness_ratio: float | None = shown("stiffness ratio", ".1e", default=None)
    impact_force_N: float | None = shown("impact [N]", ".4g", default=None)  # noqa: N815
    whirl_deviation_ratio: float | None = shown("whirl ratio", ".3g", default=None)
    power_loss_W: float | None = shown("loss [W]", ".4g", default=None)  # noqa: N815

    @property
    def unexplained(self) -> bool:
        """Whether the case neither closes nor shows why."""
        return self.status == OPEN


def cases(scene: Scene) -> dict[str, tuple[str, ...]]:
    """Extreme variants of a scene, by name (``variants.toml``)."""
    operation, bearing = scene.operation, scene.bearing
    rpm = operation.inner_speed_rpm or operation.outer_speed_rpm
    figures = {
        "rpm": rpm,
        "back": -rpm,
        "run_s": (TURNS + DISCARDED) * scene.turn_s,
        "heavy": 20.0 * operation.radial_load_N,
        "pitch": bearing.pitch_diameter_mm * max(100.0 / bearing.rollers, 1.0),
    }
    listed = read_toml(VARIANTS)["extremes"]
    return {name: tuple(Template(each).substitute(figures) for each in told) for name, told in listed.items()}


def battery(scene: Scene, chosen: Mapping[str, Sequence[str]] | None = None, progress: Reporter = None) -> list[Ending]:
    """A row a case; all cases unless some are ``chosen``. Raises KeyboardInterrupt."""
    listed = cases(scene) if chosen is None else chosen
    counted = Progress(progress, len(listed))
    return [ending(scene, name, told) for name, told in counted.over(listed.items())]


def ending(scene: Scene, case: str, assignments: Sequence[str]) -> Ending:
    """Run one case."""
    short = (f"numerics.turns={TURNS}", f"numerics.discard_turns={DISCARDED}", "numerics.impact_window_turns=1e9")
    assignments = tuple(assignments)
    try:
        varied = with_options(scene, (*short, *assignments))
        bearing = roller_bearing(varied)
    except InputError as error:
        return Ending(case, assignments, REFUSED, "; ".join(error.faults))
    rtol, tightened = varied.numerics.rtol, False
    try:
        prepare(varied, bearing)
        run = run_replicate(varied, bearing, 0, rtol, Stop())
        if not run.power_gap <= LARGEST_GAP and rtol >= 1e-12:
            rtol, tightened = 0.1 * rtol, True
            run = run_replicate(varied, bearing, 0, rtol, Stop())
    except RunError as error:
        return Ending(case, assignments, STOPPED, str(error))
    turns = varied.numerics.turns + varied.numerics.warm_up_turns
    eigenvalue, held = largest_eigenvalue(run.stiffness), held_by_stability(run.stiffness)
    figures = {
        "power_gap": run.power_gap,
        "impact_force_N": run.impact_force,
        "whirl_deviation_ratio": run.whirl_deviation_ratio,
        "power_loss_W": run.power_loss,
    }
    status, reason = _judge(figures, rtol, tightened)
    return Ending(
        case,
        assignments,
        status,
        reason,
        method=run.method,
        rtol=rtol,
        steps_per_turn=(run.accepted_steps + run.rejected_steps) / turns,
        turn_ms=run.cpu_s / turns * 1e3,
        held=held,
        stiffness_ratio=eigenvalue * varied.turn_s,
        **{name: finite(value) for name, value in figures.items()},
    )


def _judge(figures: Mapping[str, float], rtol: float, tightened: bool) -> tuple[str, str]:
    if not all(math.isfinite(figure) for figure in figures.values()):
        return OPEN, "a figure is not finite"
    if (gap := figures["power_gap"]) > LARGEST_GAP:
        return OPEN, f"power balance closes only to {100.0 * gap:.2g} %, even at rtol {rtol:g}"
    if tightened:
        return TIGHTENED, f"the power balance closes only with numerics.rtol = {rtol:g}; set it"
    return CLOSED, ""


def study(scene: Scene, progress: Reporter = None) -> Report:
    """``rbdyn accuracy SCENE stability``. Raises KeyboardInterrupt."""
    return report(battery(scene, progress=progress))


def report(rows: Sequence[Ending]) -> Report:
    """Table of the endings, and every reason."""
    unexplained = sum(row.unexplained for row in rows)
    written = records(rows)
    why = f"{unexplained} of {len(rows)} cases failed without a diagnosis"
    status: dict[str, Any] = {"status": why} if unexplained else {}
    table = tabled(f"extreme scenes; closed: power balance within {100.0 * LARGEST_GAP:g} %", rows, columns_of(Ending))
    sentences = [f"{row.case}: {row.reason}" for row in rows if row.reason]
    sheet = [row | {"assignments": " ".join(row["assignments"])} for row in written]
    told = reported("stability", (table,), sentences, sheet, **status, largest_gap=LARGEST_GAP, cases=written)
    return replace(told, failed=unexplained > 0)
