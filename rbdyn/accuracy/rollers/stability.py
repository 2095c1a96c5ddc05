"""How extreme variants of a scene end: with a finite answer whose power balance closes, or with the reason why not.

A case is a few assignments to the scene. Each runs one replicate over few turns. Where the balance stays open, the case
runs once more at a tenth of the tolerance, to see whether tightening mends it.
"""

import math
from collections.abc import Mapping, Sequence

from rbdyn.accuracy.report import Progress, Report, Reporter, columns_of, record, records, tabled
from rbdyn.accuracy.rollers.option_cost import with_options
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.integrators.method import held_by_stability, largest_eigenvalue
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.recording import run_replicate
from rbdyn.dynamics.run import prepare
from rbdyn.faults import InputError, RunError
from rbdyn.records.record import Record, finite, shown
from rbdyn.scene import Scene

FORMAT = "rbdyn.stability/1"
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
        """Whether the case neither closes nor tells why."""
        return self.status == OPEN


def cases(scene: Scene) -> dict[str, tuple[str, ...]]:
    """Extreme variants of a scene, by name."""
    operation, bearing = scene.operation, scene.bearing
    rpm = operation.inner_speed_rpm or operation.outer_speed_rpm
    run_s = (TURNS + DISCARDED) * scene.turn_s
    pitch = bearing.pitch_diameter_mm * max(100.0 / bearing.rollers, 1.0)

    def speeds(first: float) -> str:
        return f"operation.schedule={{time_s=[0.0,{run_s!r}],inner_speed_rpm=[{first!r},{rpm!r}]}}"

    return {
        "as given": (),
        "100 000 rpm": ("operation.inner_speed_rpm=100000.0",),
        "10 rpm": ("operation.inner_speed_rpm=10.0", "numerics.turns=2", "numerics.discard_turns=1"),
        "no load": ("operation.radial_load_N=0.0",),
        "20 times the load": (f"operation.radial_load_N={20.0 * operation.radial_load_N!r}",),
        "no clearance": ("bearing.radial_clearance_mm=0.0",),
        "preload of 20 um": ("bearing.radial_clearance_mm=-0.02",),
        "pocket clearance of 1 um": ("cage.pocket_clearance_mm=0.001",),
        "pocket clearance of 2 mm": ("cage.pocket_clearance_mm=2.0",),
        "guide clearance of 1 um": ("cage.guide_clearance_mm=0.001", "model.land_film_floor_um=0.1"),
        "guide clearance of 2 mm": ("cage.guide_clearance_mm=2.0",),
        "cage of 0.1 g": ("cage.mass_g=0.1",),
        "cage of 5 kg": ("cage.mass_g=5000.0",),
        "ceramic rollers": ('materials.roller="silicon_nitride"',),
        "traction slope of 10 s/m": ('traction.model="four_constant"', "traction.constants=[-0.05,5.0,100.0,0.05]"),
        "dry friction": ('traction.model="coulomb"',),
        "2 rollers": ("bearing.rollers=2",),
        "100 rollers": ("bearing.rollers=100", f"bearing.pitch_diameter_mm={pitch!r}"),
        "reversal": (speeds(-rpm),),
        "start from rest": (speeds(0.0),),
        "oil at -20 C": ("lubricant.temperature_C=-20.0",),
        "oil at 300 C": ("lubricant.temperature_C=300.0",),
        "films down to 1 nm": (
            "model.pocket_film=true",
            "model.pocket_film_floor_um=0.001",
            "model.land_film_floor_um=0.001",
        ),
        "undamped contacts": (
            'model.race_damping="off"',
            "model.pocket_damping_alpha_s_m=0.0",
            "model.land_damping_alpha_s_m=0.0",
        ),
        "rtol 1e-12": ("numerics.rtol=1e-12", "numerics.turns=2", "numerics.discard_turns=1"),
        "1000 turns": ("numerics.turns=1000",),
    }


def battery(
    scene: Scene, chosen: Mapping[str, Sequence[str]] | None = None, progress: Reporter | None = None
) -> list[Ending]:
    """A row a case; all cases unless some are ``chosen``. Raises KeyboardInterrupt."""
    listed = cases(scene) if chosen is None else chosen
    counted, rows = Progress(progress, len(listed)), []
    for name, assignments in listed.items():
        rows.append(ending(scene, name, assignments))
        counted.step()
    return rows


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


def study(scene: Scene, progress: Reporter | None = None) -> Report:
    """``rbdyn accuracy --stability``. Raises KeyboardInterrupt."""
    return report(battery(scene, progress=progress))


def report(rows: Sequence[Ending]) -> Report:
    """Table of the endings, and every reason."""
    unexplained = sum(row.unexplained for row in rows)
    written = record(FORMAT, largest_gap=LARGEST_GAP, cases=records(rows))
    if unexplained:
        written["status"] = f"{unexplained} of {len(rows)} cases neither close nor tell why"
    title = f"extreme scenes; closed: power balance within {100.0 * LARGEST_GAP:g} %"
    return Report(
        stem="stability",
        record=written,
        tables=(tabled(title, rows, columns_of(Ending)),),
        sentences=[f"{row.case}: {row.reason}" for row in rows if row.reason],
        sheets={"stability": [row | {"assignments": " ".join(row["assignments"])} for row in records(rows)]},
        failed=unexplained > 0,
    )
