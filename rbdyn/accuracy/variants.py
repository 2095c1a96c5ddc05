"""Variants of a scene by its options, and what each option costs.

A variant is a few assignments to the scene (``variants.toml``). An option costs nanoseconds a right-hand side, with it and
without it, and time to compile. Runs with it alternate with runs of the plain scene, so that both see the same machine. The
cost is the median over replicates of the processor time per right-hand side, the work of the integrator included.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from rbdyn.accuracy.report import Progress, Report, Reporter, records, reported
from rbdyn.base.blocks import Sheet, columns_of
from rbdyn.base.faults import InputError, read_toml, set_key
from rbdyn.base.records import Record, shown
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.recording import run_replicate
from rbdyn.dynamics.run import prepare
from rbdyn.scene import Scene

COST_TURNS, COST_DISCARDED = 10, 2
REPEATS = 3
OPTIONS: dict[str, list[str]] = read_toml(Path(__file__).with_name("variants.toml"))["options"]


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
