"""Variants of a scene: what each option costs, and how extreme variants end.

A variant is a few assignments to the scene (``variants.toml``). An option costs nanoseconds a right-hand side, with it and
without it, and time to compile. Runs with it alternate with runs of the plain scene, so that both see the same machine. The
cost is the median over replicates of the processor time per right-hand side, the work of the integrator included.

An extreme variant ends with a finite answer whose power balance closes, or with the reason why not. Each runs one replicate
over few turns. Where the balance stays open, it runs once more at a tenth of the tolerance, to see whether that fixes it.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from rbdyn.accuracy.report import Progress, Report, Reporter, records, reported
from rbdyn.base.blocks import Sheet, columns_of
from rbdyn.base.faults import InputError, RunError, read_toml, set_key
from rbdyn.base.records import Record, finite, shown
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.figures import IMPACT_FORCE, POWER_LOSS, WHIRL_DEVIATION_RATIO
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.recording import run_replicate
from rbdyn.dynamics.run import held_by_stability, largest_eigenvalue, prepare
from rbdyn.scene import Scene

COST_TURNS, COST_DISCARDED = 10, 2
REPEATS = 3
VARIANTS = Path(__file__).with_name("variants.toml")
OPTIONS: dict[str, list[str]] = read_toml(VARIANTS)["options"]


class OptionCost(Record):
    """Median processor time per right-hand side [ns] with the option, without it, and their difference.

    Also the largest relative power gap, and the seconds to compile (or to load from disk).
    """

    option: str = shown("option")
    with_ns: float = shown("with", ".0f")
    without_ns: float = shown("without", ".0f")
    difference_ns: float = shown("difference", "+.0f")
    power_gap: float = shown("power gap", ".2g %")
    compile_s: float = shown("s to compile or load", ".1f")


def option_costs(
    scene: Scene, options: Mapping[str, Sequence[str]] = OPTIONS, progress: Reporter = None
) -> list[OptionCost]:
    """Costs of the options that the scene allows, a row each. Raises RunError, KeyboardInterrupt."""
    plain = with_options(scene, (f"numerics.turns={COST_TURNS}", f"numerics.discard_turns={COST_DISCARDED}"))
    plain_bearing = roller_bearing(plain)
    prepare(plain, plain_bearing)
    variants = lawful(plain, options)
    rows, counted = [], Progress(progress, len(variants))
    for name, option in counted.over(variants.items()):
        bearing = roller_bearing(option)
        compile_s = prepare(option, bearing)
        times: tuple[list[float], list[float]] = ([], [])
        gap = 0.0
        for replicate in range(REPEATS):
            for case, (run_scene, parameters) in enumerate(((option, bearing), (plain, plain_bearing))):
                run = run_replicate(run_scene, parameters, replicate, run_scene.numerics.rtol, Stop())
                times[case].append(run.cpu_s / run.derivatives * 1e9)
                gap = run.power_gap if case == 0 else gap
        with_ns, without_ns = (float(np.median(series)) for series in times)
        rows.append(OptionCost(name, with_ns, without_ns, with_ns - without_ns, gap, compile_s))
    return rows


def lawful(scene: Scene, options: Mapping[str, Sequence[str]]) -> dict[str, Scene]:
    """The scene with each option that does not contradict it."""
    allowed = {}
    for name, assignments in options.items():
        with suppress(InputError):
            allowed[name] = with_options(scene, assignments)
    return allowed


def with_options(scene: Scene, assignments: Sequence[str]) -> Scene:
    """The scene with ``key.path=value`` assignments. Raises InputError where they contradict it."""
    data = scene.model_dump(mode="json", exclude_none=True)
    for assignment in assignments:
        set_key(data, assignment)
    return Scene.from_dict(data, " ".join(assignments))


def study_options(scene: Scene, progress: Reporter = None, options: Mapping[str, Sequence[str]] = OPTIONS) -> Report:
    """``rbdyn accuracy SCENE options``. Raises RunError, KeyboardInterrupt."""
    costs = option_costs(scene, options, progress)
    sheet, rows = Sheet("nanoseconds a right-hand side", columns_of(OptionCost), costs), records(costs)
    return reported("options", (sheet.block,), (), rows, options=rows)


LARGEST_GAP = 0.01
TURNS, DISCARDED = 5, 2
# How a case may end. All but "open" say what to do; "refused" and "stopped" do so in their reason.
CLOSED, TIGHTENED, OPEN, STOPPED, REFUSED = "closed", "closed, tightened", "open", "stopped", "refused"


class Ending(Record):
    """How a case ended; figures are None where it did not run.

    ``held``: share of the explicit steps that stability limited, not accuracy; ``stiffness_ratio``: |eigenvalue| of the motion
    that limited them times the duration of a shaft turn, zero where none was limited.
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
        """Whether the case failed without a diagnosis."""
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
    return {name: tuple(Template(text).substitute(figures) for text in texts) for name, texts in listed.items()}


def battery(
    scene: Scene, selection: Mapping[str, Sequence[str]] | None = None, progress: Reporter = None
) -> list[Ending]:
    """A row a case, of all cases unless there is a ``selection``. Raises KeyboardInterrupt."""
    listed = cases(scene) if selection is None else selection
    counted = Progress(progress, len(listed))
    return [ending(scene, name, assignments) for name, assignments in counted.over(listed.items())]


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
    figures = {
        "power_gap": run.power_gap,
        "impact_force_N": IMPACT_FORCE.value(run),
        "whirl_deviation_ratio": WHIRL_DEVIATION_RATIO.value(run),
        "power_loss_W": POWER_LOSS.value(run),
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
        held=held_by_stability(run.stiffness),
        stiffness_ratio=largest_eigenvalue(run.stiffness) * varied.turn_s,
        **{name: finite(value) for name, value in figures.items()},
    )


def _judge(figures: Mapping[str, float], rtol: float, tightened: bool) -> tuple[str, str]:
    if not all(math.isfinite(figure) for figure in figures.values()):
        return OPEN, "a result is not finite"
    if (gap := figures["power_gap"]) > LARGEST_GAP:
        return OPEN, f"power balance closes only to {100.0 * gap:.2g} %, even at rtol {rtol:g}"
    if tightened:
        return TIGHTENED, f"the power balance closes only with numerics.rtol = {rtol:g}; set it"
    return CLOSED, ""


def study_stability(scene: Scene, progress: Reporter = None) -> Report:
    """``rbdyn accuracy SCENE stability``. Raises KeyboardInterrupt."""
    return report(battery(scene, progress=progress))


def report(rows: Sequence[Ending]) -> Report:
    """Table of the endings, and every reason."""
    unexplained = sum(row.unexplained for row in rows)
    written = records(rows)
    failures = f"{unexplained} of {len(rows)} cases failed without a diagnosis"
    status: dict[str, Any] = {"status": failures} if unexplained else {}
    title = f"extreme scenes; closed: power balance within {100.0 * LARGEST_GAP:g} %"
    sentences = [f"{row.case}: {row.reason}" for row in rows if row.reason]
    sheet = [row | {"assignments": " ".join(row["assignments"])} for row in written]
    outcome = reported(
        "stability",
        (Sheet(title, columns_of(Ending), rows).block,),
        sentences,
        sheet,
        **status,
        largest_gap=LARGEST_GAP,
        cases=written,
    )
    return replace(outcome, failed=unexplained > 0)
