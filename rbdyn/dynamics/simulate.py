"""Replicates of a scene, gathered with error bars."""

import time
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.files import versions
from rbdyn.base.notes import Note, Notes
from rbdyn.base.words import Notice
from rbdyn.compiled.kernel import COMPILING
from rbdyn.dynamics.cage_verdict import verdict_of
from rbdyn.dynamics.ensemble import Pace, Reporter, Stop, in_turn, keys_of, log, threads_of
from rbdyn.dynamics.figures import BEARING, DAMAGE, pocket_impacts
from rbdyn.dynamics.forces.equations import RollerBearing
from rbdyn.dynamics.forces.state import INNER_LOAD, LAND_LOAD, OUTER_LOAD
from rbdyn.dynamics.parameters import validity
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.part_figures import part_figures, races_of
from rbdyn.dynamics.recording import Ensemble, recording_of, run_until_settled, whole_windows
from rbdyn.dynamics.run import explicit_method, prepare, stiffness_cost, stiffness_notes
from rbdyn.dynamics.statistics.error_bars import error_notes, quantities
from rbdyn.dynamics.statistics.extremes import return_force_notes
from rbdyn.dynamics.statistics.metrics import TIGHT, whirl_notes, work_done
from rbdyn.losses import POWER_TERMS
from rbdyn.mounting.cage import OperatingClearance
from rbdyn.result import LargestLoads, PowerBalance, SimulationResult
from rbdyn.scene import Scene, rollers_only
from rbdyn.scene.thermal import point_before

# Above this relative gap of the power balance a note asks for a tighter tolerance.
LARGEST_POWER_GAP = 0.005

# Method and types of the laws that this process has compiled or loaded, which other scenes with them need not wait for.
_prepared: set[Any] = set()


def _types(parameters: Any) -> Any:
    """Types of parameters and of those inside, by which laws are compiled."""
    if isinstance(parameters, tuple):
        return type(parameters), *map(_types, parameters)
    return type(parameters)


def simulate(
    scene: Scene | Path | str,
    workers: int | None = None,
    progress: Reporter = None,
    stop: Stop | None = None,
    target: float | None = None,
    notice: Notice = log,
    overrides: Iterable[str] = (),
    only_steady: bool = False,
) -> SimulationResult:
    """Simulate all replicates of a scene, which may be the path of its file.

    - ``workers``: threads, all processors by default; the result does not depend on it
    - ``progress(done, total)`` is called after every run
    - ``target``: relative error to reach, which chooses tolerance, turns and replicates (``rbdyn.dynamics.target``)
    - ``notice(sentence)`` is called once with the time that the runs still take; by default it is a warning of the logger
      "rbdyn", None for silence
    - ``overrides``: keys of the scene with other values, such as ``["cage.mass_g=50"]``
    - ``only_steady``: raise RunError once the short runs of a heat balance show no steady state, instead of a run of its last state

    Raises InputError for a faulty scene or override, another kind of bearing, and an impossible target or number of workers.
    Raises RunError when a replicate cannot go on, KeyboardInterrupt on Ctrl-C.
    """
    scene = rollers_only(scene, overrides)
    if target is not None:
        from rbdyn.dynamics.target import reach

        return reach(scene, target, partial(simulate, notice=notice), workers, progress, stop, notice)
    run = partial(_ensemble, workers=workers, stop=stop, pace=_pace(scene, notice, threads_of(workers)))
    if scene.thermal is not None:
        from rbdyn.dynamics.temperatures import with_temperatures

        point_before(scene)  # A faulty one is refused before anything runs.
        balanced = with_temperatures(scene, run, _gather, progress, only_steady)
        if scene.thermal.start is None:
            return balanced.result
        from rbdyn.dynamics.start import with_start

        return with_start(balanced)
    return _gather(scene, *run(scene, roller_bearing(scene), progress))


def steady_scene(scene: Scene, workers: int | None = None, stop: Stop | None = None, pace: Pace | None = None) -> Scene:
    """The scene at its steady temperatures where it has [thermal], else the scene itself.

    Raises RunError where it has none or is above a ceiling there, and InputError where it is impossible even at the temperature of its surroundings.
    """
    if scene.thermal is None:
        return scene
    from rbdyn.dynamics import temperatures

    return temperatures.steady_scene(scene, partial(_ensemble, workers=workers, stop=stop, pace=pace))


def _pace(scene: Scene, notice: Notice, threads: int) -> Pace:
    """The time of a simulation, stated after its first run; the short runs of a heat balance come first."""
    length = first = scene.numerics.warm_up_turns + (whole_windows(scene) if scene.extends else scene.numerics.turns)
    turns = in_turn(scene, threads, length)
    if scene.thermal is not None:
        from rbdyn.dynamics.temperatures import short_turns

        heat, first = short_turns(scene, threads)
        turns += heat
    return Pace(notice, turns, first, threads, keys_of(scene))


def _ensemble(
    scene: Scene,
    bearing: RollerBearing,
    progress: Reporter,
    starts: Sequence[Array] = (),
    *,
    workers: int | None,
    stop: Stop | None,
    pace: Pace | None,
) -> tuple[Ensemble, dict[str, float]]:
    """Replicates of a scene with its parameters, from ``starts`` where these are given, and the time [s] that they took."""
    compile_s = 0.0
    method = scene.numerics.method, explicit_method(scene)
    if (laws := (method, _types(bearing))) not in _prepared:
        compile_s = prepare(scene, bearing)
        _prepared.add(laws)
    started, compiled_s = time.perf_counter(), COMPILING.seconds
    # A replicate that fails stops those of its own scene alone.
    ending = Stop(outer=stop)
    begin = partial(recording_of, scene, bearing, pace, starts=starts)
    ensemble = run_until_settled(scene, begin, workers, progress, ending, pace)
    # A method that a run tries, and this run first, is compiled then.
    more_s = COMPILING.seconds - compiled_s
    return ensemble, {"wall_s": time.perf_counter() - started - more_s, "compile_s": compile_s + more_s}


def _gather(scene: Scene, ensemble: Ensemble, clock: dict[str, float]) -> SimulationResult:
    runs, companions = ensemble.runs, ensemble.companions
    everything = [*runs, *companions]
    figures = quantities(scene, runs, companions, ensemble.plan.share, ensemble.since)
    power_gap = max(run.power_gap for run in runs)
    loads = (max(run.largest_load(place) for run in runs) for place in (INNER_LOAD, OUTER_LOAD, LAND_LOAD))
    races = races_of(scene, runs)
    weights = [run.duration for run in runs]
    terms = {term: float(np.average([run.power(term) for run in runs], weights=weights)) for term in POWER_TERMS}
    inner_rolling = float(np.average([run.inner_rolling_resistance for run in runs], weights=weights))
    maker = validity.friction_check(scene, figures["power_loss_W"].value)
    # The first concern the input, the next the figures of this run, the last what the model leaves out.
    notes: Notes = (
        *validity.limit_notes(scene),
        *scene.unit_notes,
        *scene.catalogue_notes,
        *_balance_notes(scene, power_gap),
        *ensemble.notes,
        *error_notes(
            scene, figures, ensemble.fault, TIGHT * scene.numerics.rtol if ensemble.plan.resolve_more else None
        ),
        *whirl_notes(scene, figures.get("cage_orbit_radius_share")),
        *return_force_notes(runs),
        *validity.heat_notes(scene, figures["power_loss_W"].value),
        *validity.friction_notes(maker),
        *validity.race_notes(scene, races),
        *validity.slip_notes(scene, figures["cage_slip"].value),
        *_model_notes(scene),
        *validity.left_out_notes(scene, figures["power_loss_W"].value),
        *scene.section_notes,
        *scene.lubricant.estimates,
        *stiffness_notes(scene, runs),
    )
    return SimulationResult(
        status=validity.status(scene, notes),
        figures={figure.key: figures[figure.key] for figure in BEARING if figure.key in figures},
        power_balance=PowerBalance(power_gap),
        power_terms_W=terms,
        rolling_resistance_W={"outer": terms["rolling_resistance"] - inner_rolling, "inner": inner_rolling},
        loads=LargestLoads(*loads),
        races=races,
        clearance_um=clearance_report(scene),
        friction_check=maker,
        impact_window_turns=scene.impact_window_turns,
        transient_turns=ensemble.transient_turns,
        counted_turns=runs[0].duration / scene.turn_s,
        target=None,
        cost={
            **clock,
            **work_done(everything),
            "turns": sum(float(run.durations.sum()) for run in everything) / scene.turn_s,
            **stiffness_cost(runs),
        },
        replicates=scene.numerics.replicates,
        seed=scene.numerics.seed,
        notes=notes,
        versions=versions(),
        scene=scene.model_dump(mode="json"),
        part_figures=part_figures(scene, runs, figures),
        damage={figure.key: figures[figure.key] for figure in DAMAGE if figure.key in figures},
        pocket_impacts=pocket_impacts(scene, runs),
        verdict=verdict_of(scene, runs),
    )


def clearance_report(scene: Scene) -> dict[str, Any]:
    """Diametral clearances as drawn and in operation, and their changes [um].

    The radial one by its own parts; "radial", "guide" and "pocket" each with drawn, fit, temperature, rotation and operating.
    None for the guide of a cage that no ring guides.
    """
    drawing = scene.bearing.radial_clearance_mm * 1e3
    flat, mounted = {"operating": drawing}, scene.mounted_clearance
    if mounted is not None:
        parts = ("inner_fit", "outer_fit", "temperature", "rotation", "operating")
        flat = {part: getattr(mounted, part) * 1e6 for part in parts}
    parts_of = {name: _parts(clearance) for name, clearance in scene.clearances.items()}
    return {"drawn": drawing, **flat, **parts_of}


def _parts(clearance: OperatingClearance | None) -> dict[str, float] | None:
    if clearance is None:
        return None
    # A sum with 0 has no negative zero.
    return {
        part: 1e6 * value + 0.0 for part, value in {**clearance._asdict(), "operating": clearance.operating}.items()
    }


def _balance_notes(scene: Scene, power_gap: float) -> Notes:
    if power_gap <= LARGEST_POWER_GAP:
        return ()
    sentence = (
        f"power balance: it closes only to {100.0 * power_gap:.2g} %, because numerics.rtol = {scene.numerics.rtol:g} is too loose. "
        "Loose tolerances bias impact and whirl upward, power loss downward. Reduce it tenfold"
    )
    return (Note("power-balance", sentence),)


def _model_notes(scene: Scene) -> Iterator[Note]:
    """What the chosen laws miss."""
    if cutoff := scene.numerics.whirl_cutoff_hz:
        sentence = f"whirl deviation ratio: it counts only motion below {cutoff:g} Hz (numerics.whirl_cutoff_hz)"
        yield Note("definition", sentence)
    if scene.traction.model == "four_constant":
        sentence = (
            "traction: one curve is used for all loads. It overestimates traction on lightly loaded rollers and so underestimates "
            "skidding. Use traction.model = 'thermal_newtonian', or 'limiting_shear' for an oil without its constants"
        )
        yield Note("left-out", sentence)
    if scene.traction.model == "thermal_newtonian" and scene.lubricant.viscosity_mPas is not None:
        sentence = (
            "traction: it follows the oil and its temperature, not lubricant.viscosity_mPas, which the films use; choose "
            "traction.rheology_oil to suit it"
        )
        yield Note("remark", sentence)
