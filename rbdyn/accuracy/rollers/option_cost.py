"""What each option of a scene costs: nanoseconds a right-hand side with it and without it, the time to compile it, and
what it adds to state, parameters, compiled code and loaded modules.

An option is a few assignments to the scene (``variants.toml``). Each is run in turn with the scene as it is, so that both
see the same machine; a median over replicates is taken of the processor time per right-hand side, the integrator's own
work included.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

import numpy as np

from rbdyn.accuracy.report import Columns, Progress, Report, Reporter, reported, tabled
from rbdyn.accuracy.rollers.footprint import Footprint, added_modules, footprint
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.recording import run_replicate
from rbdyn.dynamics.run import prepare
from rbdyn.faults import InputError, read_toml, set_key
from rbdyn.records.record import Record, derived, outside_json
from rbdyn.scene import Scene

TURNS, DISCARDED = 10, 2
REPEATS = 3
VARIANTS = Path(__file__).with_name("variants.toml")
OPTIONS: dict[str, list[str]] = read_toml(VARIANTS)["options"]


class OptionCost(Record):
    """Median processor time per right-hand side [ns] with the option, of the scene beside it and their difference, the
    largest relative power gap, the seconds it took to compile (or to load from disk), what the program holds with the
    option and without it, and the modules that only the option loads."""

    option: str
    with_ns: float
    without_ns: float
    difference_ns: float = derived(lambda self: self.with_ns - self.without_ns)
    power_gap: float
    compile_s: float
    sizes: dict[str, int] = derived(
        lambda self: {
            f"{which}_{name}": size
            for which, held in (("with", self.holds), ("without", self.plain_holds))
            for name, size in asdict(held).items()
        },
        spread=True,
    )
    modules: tuple[str, ...]
    holds: Footprint = outside_json()
    plain_holds: Footprint = outside_json()


def _added(size: str) -> Callable[[OptionCost], str]:
    return lambda cost: f"{getattr(cost.holds, size) - getattr(cost.plain_holds, size):+d}"


COLUMNS: Columns = {
    "option": ("option", ""),
    "with": ("with_ns", ".0f"),
    "without": ("without_ns", ".0f"),
    "difference": ("difference_ns", "+.0f"),
    "power gap": ("power_gap", ".2g %"),
    "s to compile or load": ("compile_s", ".1f"),
    "state": _added("state"),
    "parameters [B]": _added("parameter_bytes"),
    "instructions": _added("instructions"),
    "modules": lambda cost: " ".join(module.rpartition(".")[2] for module in cost.modules),
}


def option_costs(
    scene: Scene, options: Mapping[str, Sequence[str]] = OPTIONS, progress: Reporter = None
) -> list[OptionCost]:
    """A row an option that the scene allows. Raises RunError, KeyboardInterrupt."""
    plain = with_options(scene, (f"numerics.turns={TURNS}", f"numerics.discard_turns={DISCARDED}"))
    plain_bearing = roller_bearing(plain)
    prepare(plain, plain_bearing)
    plain_holds = footprint(plain, plain_bearing)
    chosen = _allowed(plain, options)
    bearings = [roller_bearing(option) for option in chosen.values()]
    modules = added_modules(plain, list(chosen.values()))
    rows, counted = [], Progress(progress, len(chosen))
    for (name, option), bearing, needed in counted.over(zip(chosen.items(), bearings, modules, strict=True)):
        compile_s = prepare(option, bearing)
        times: tuple[list[float], list[float]] = ([], [])
        gap = 0.0
        for replicate in range(REPEATS):
            for which, (one, parameters) in enumerate(((option, bearing), (plain, plain_bearing))):
                run = run_replicate(one, parameters, replicate, one.numerics.rtol, Stop())
                times[which].append(run.cpu_s / run.derivatives * 1e9)
                gap = run.power_gap if which == 0 else gap
        with_ns, without_ns = (float(np.median(series)) for series in times)
        holds = footprint(option, bearing)
        rows.append(OptionCost(name, with_ns, without_ns, gap, compile_s, needed, holds, plain_holds))
    return rows


def _allowed(scene: Scene, options: Mapping[str, Sequence[str]]) -> dict[str, Scene]:
    """The scene with each option, but for options that contradict something it has."""
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


def study(scene: Scene, progress: Reporter = None, options: Mapping[str, Sequence[str]] = OPTIONS) -> Report:
    """``rbdyn accuracy --options``. Raises RunError, KeyboardInterrupt."""
    costs = option_costs(scene, options, progress)
    rows = [cost.as_dict() for cost in costs]
    plain = [
        f"without any: {row['without_state']} numbers of state, {row['without_parameter_bytes']} B of parameters, "
        f"{row['without_instructions']} instructions compiled (LLVM)"
        for row in rows[:1]
    ]
    table = tabled("nanoseconds a right-hand side; what the option adds to the program", costs, COLUMNS)
    sheet = [row | {"modules": " ".join(row["modules"])} for row in rows]
    return reported("options", (table,), plain, sheet, options=rows)
