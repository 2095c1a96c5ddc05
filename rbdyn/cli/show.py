"""What ``rbdyn show`` prints and writes: pictures and films of a saved result.

A saved result has no motion, but scene and seed, and equal scenes give equal bits. So the history is computed again; pictures,
a table of samples and the figures of the motion are written.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from rbdyn.base.blocks import Block, Detail, Paragraph, Table, with_notes
from rbdyn.base.faults import MethodError, refuse
from rbdyn.base.files import versions, write_json
from rbdyn.base.notes import DANGER, Note, Notes, of_level
from rbdyn.base.records import Record, plain, save_table
from rbdyn.base.words import counted, quantity, shown, with_error
from rbdyn.result import SimulationResult
from rbdyn.scene import Scene
from rbdyn.scene.thermal import simulated_scene
from rbdyn.verdict.orbits import CageVerdict

if TYPE_CHECKING:
    from rbdyn.base.words import Notice
    from rbdyn.dynamics.motion import History, Largest, Race, Spectrum

FORMAT = "rbdyn.orbit/2"
SHOWN_TURNS = 20.0
# Fewer samples show no motion.
FEWEST_SAMPLES = 32
PEAKS = 5
# Loads of which the largest is reported.
LOADS = {"pocket": "pocket_load", "dry_land": "land_load", "outer_race": "outer_load", "inner_race": "inner_load"}


class Request(Record):
    """What to show: the result, its file, its scene, and how many turns of which replicate, from 0."""

    result: SimulationResult
    path: Path
    scene: Scene
    turns: float
    replicate: int

    @property
    def notes(self) -> Notes:
        """Dangers of the result, and a note where the motion may differ from its own."""
        dangers = tuple(of_level(self.result.notes, DANGER))
        now = versions()
        then = self.result.versions
        other = [name for name in now if then.get(name) != now[name]]
        if not other:
            return dangers
        change = ", ".join(f"{name} {then.get(name, 'unknown')} then and {now[name]} now" for name in other)
        sentence = f"this motion may differ from the result's motion, which was computed with other versions: {change}"
        return *dangers, Note("versions", sentence)


def request_of(path: Path, turns: float | None, replicate: int) -> Request:
    """Read a result.json, or that of a folder. Raises InputError with every fault."""
    if path.is_dir():
        path = path / "result.json"
    from rbdyn.dynamics.motion import most_turns

    result = SimulationResult.load(path)
    scene = simulated_scene(result, f"{path}: scene")
    numerics, faults = scene.numerics, []
    fewest = min(FEWEST_SAMPLES / numerics.samples_per_turn, numerics.turns)
    most = min(most_turns(scene), numerics.turns)
    counted_turns = min(SHOWN_TURNS, most) if turns is None else turns
    if turns is not None and not fewest <= turns <= numerics.turns:
        faults.append(
            f"--turns {turns:g}: the result counted {counted(numerics.turns, 'turn')}; choose from {fewest:g} to that"
        )
    elif counted_turns > most:
        faults.append(f"--turns {turns:g}: memory has room for {most:.4g} turns of this scene; show no more")
    if not 1 <= replicate <= numerics.replicates:
        faults.append(f"--replicate {replicate}: the result has {numerics.replicates}; count from 1 to that")
    refuse(faults)
    return Request(result, path, scene, counted_turns, replicate - 1)


def write(
    request: Request, folder: Path, animate: bool, progress: Callable[[int, int], None], notice: "Notice" = None
) -> dict[str, Any]:
    """Compute the motion, write everything into ``folder``; returns the record that is also in orbit.json."""
    from rbdyn.dynamics.motion import history

    motion = history(request.scene, request.turns, request.replicate, notice=notice)
    tasks: dict[str, Callable[[Path], object]] = {
        "history.csv": partial(save_table, motion.table(), float_format="%.6g"),
        **_pictures(request, motion),
    }
    steps = 1 + len(tasks) + animate
    files: list[str] = []
    for step, (name, make) in enumerate(tasks.items(), 1):
        progress(step, steps)
        make(folder / name)
        files.append(name)
    if animate:
        progress(len(tasks) + 1, steps)
        from rbdyn.plots.drawing import player_html
        from rbdyn.plots.roller import moving_bearing

        files += [moving_bearing(motion, folder / "bearing").name, "bearing.html"]
        (folder / "bearing.html").write_text(player_html(motion, _cage(request)), encoding="utf-8")
    record = {**_record(request, motion), "notes": plain(request.notes), "versions": versions()}
    record["files"] = ["orbit.json", *files]
    write_json(folder / "orbit.json", record)
    progress(steps, steps)
    return record


def _cage(request: Request) -> str:
    """Class of the cage with its replicates; empty where the result has none."""
    return "" if request.result.verdict is None else request.result.verdict.short_words


def _pictures(request: Request, motion: "History") -> dict[str, Callable[[Path], object]]:
    from rbdyn import plots

    title = f"{request.turns:g} counted shaft turns, replicate {request.replicate + 1}"
    classes = {} if request.result.verdict is None else {title: request.result.verdict.name}
    return {
        "cage_orbit.png": partial(plots.cage_orbit, {title: motion}, classes=classes),
        "forces.png": partial(plots.forces, motion),
        "whirl.png": partial(plots.whirl, motion),
        "poincare.png": partial(plots.section, motion),
        "spectra.png": partial(plots.spectra, motion),
        "roller_loads.png": partial(plots.roller_loads, motion),
        "sliding.png": partial(plots.sliding, motion),
        "power.png": partial(plots.power_by_loss, request.result.power_terms_W),
    }


def _record(request: Request, motion: "History") -> dict[str, Any]:
    import numpy as np

    from rbdyn.dynamics import motion as orbit

    eccentricity = orbit.eccentricity(motion)
    clearance = motion.scene.guide_clearance_m
    quantiles = orbit.whirl_quantiles(motion)
    return {
        "format": FORMAT,
        "status": "ok",
        "turns": request.turns,
        "replicate": request.replicate + 1,
        "seed": motion.scene.numerics.seed,
        "verdict": None if request.result.verdict is None else request.result.verdict.as_dict(),
        "cage_speed_rpm": orbit.mean_cage_speed(motion) * 30.0 / np.pi,
        "whirl_ratio": orbit.whirl_ratio(motion),
        "whirl_ratio_quantiles": {f"{100.0 * share:g}%": value for share, value in quantiles.items()},
        "eccentricity_um": {
            "mean": float(eccentricity.mean()) * 1e6,
            "standard_deviation": float(eccentricity.std()) * 1e6,
            "guide_clearance": None if clearance is None else clearance * 1e6,
        },
        "pocket_bar_stiffness_N_m": motion.scene.model.pocket_bar_stiffness_N_m,
        "largest": {name: _largest(orbit.largest(motion, getattr(motion, loads))) for name, loads in LOADS.items()},
        "races": {race: _race(motion, race) for race in get_args(orbit.Race)},
        "life": _life(motion),
        "spectra": {
            "cage_orbit_um": _peaks(orbit.orbit_spectrum(motion), 1e6),
            "eccentricity_um": _peaks(orbit.spectrum(motion, eccentricity), 1e6),
            "cage_speed_rpm": _peaks(orbit.spectrum(motion, motion.cage_speed), 30.0 / np.pi),
        },
    }


def _race(motion: "History", race: "Race") -> dict[str, float]:
    from rbdyn.dynamics import motion as orbit

    return {
        "pressure_GPa": float(orbit.contact_pressure(motion, race).max()) * 1e-9,
        "pressure_velocity_MPa_m_s": float(orbit.pressure_velocity(motion, race).max()) * 1e-6,
        "slip_m_s": float(abs(getattr(motion, f"{race}_slip")).max()),
        "mean_heat_W": float(getattr(motion, f"{race}_heat").sum(axis=1).mean()),
    }


def _life(motion: "History") -> dict[str, float | str | None]:
    """Of the contact loads shown; None where nothing is loaded, nothing turns, or rollers were not seen all around."""
    method = "ISO/TS 16281 reference life from the contact loads over time"
    try:
        life = motion.life()
    except MethodError as error:
        return {"L10_Mrev": None, "L10_h": None, "equivalent_load_N": None, "method": f"none: {error}"}
    figures = life.figures(*motion.scene.operation.speeds)
    turns, hours = figures.L10_Mrev, figures.L10_h
    return {"L10_Mrev": turns, "L10_h": hours, "equivalent_load_N": life.equivalent_load, "method": method}


def _largest(hit: "Largest") -> dict[str, float | int | None]:
    """Where nothing ever touched there is no time and no roller."""
    touched = hit.force > 0.0
    roller = hit.roller + 1 if touched and hit.roller is not None else None
    return {"force_N": hit.force, "time_ms": hit.time * 1e3 if touched else None, "roller": roller}


def _peaks(spectrum: "Spectrum", unit: float) -> list[dict[str, float]]:
    return [{"frequency_Hz": f, "amplitude": unit * amplitude} for f, amplitude in spectrum.peaks(PEAKS)]


def blocks(record: dict[str, Any]) -> list[Block]:
    """Class of the cage, the main figures; in full detail also the peaks of the spectra; notes."""
    title = f"{record['turns']:g} shaft turns of replicate {record['replicate']}, seed {record['seed']}"
    figures = Table(title, ("figure", "value"), _figures(record))
    cage = [] if record["verdict"] is None else [Paragraph(CageVerdict.from_dict(record["verdict"]).words)]
    return with_notes(record["notes"], [*cage, figures, *_spectra(record["spectra"])])


def _figures(record: dict[str, Any]) -> list[tuple[str, str]]:
    quantiles, away = record["whirl_ratio_quantiles"], record["eccentricity_um"]
    stiff = record["pocket_bar_stiffness_N_m"]
    clearance = "" if away["guide_clearance"] is None else f" of {away['guide_clearance']:.4g}"
    rows = [
        ("whirl speed over cage speed, mean", f"{record['whirl_ratio']:.4g}"),
        ("  median, and 5 % to 95 %", f"{quantiles['50%']:.3g}, {quantiles['5%']:.3g} to {quantiles['95%']:.3g}"),
        ("eccentricity of the cage [µm]", f"{with_error(away['mean'], away['standard_deviation'])}{clearance}"),
        ("stiffness of the cage's bars [N/m]", stiff if isinstance(stiff, str) else f"{stiff:.3g}"),
    ]
    for name, hit in record["largest"].items():
        where = "" if hit["roller"] is None else f", roller {hit['roller']}"
        when = "never touched" if hit["time_ms"] is None else f"{hit['force_N']:.4g} at {hit['time_ms']:.4g} ms{where}"
        rows.append((f"largest load, {name.replace('_', ' ')} [N]", when))
    for name, race in record["races"].items():
        worst = f"{race['pressure_GPa']:.3g} GPa, {race['slip_m_s']:.3g} m/s, {race['pressure_velocity_MPa_m_s']:.3g} MPa m/s"
        rows.append((f"largest pressure, slip, their product, {name} raceway", worst))
    life = record["life"]
    if life["L10_h"] is not None:
        hours = f"{shown(life['L10_h'], 3)} h, {shown(life['L10_Mrev'], 3)} million turns"
        rows.append(("reference life L10 of these loads", hours))
    return rows


def _spectra(spectra: dict[str, list[dict[str, float]]]) -> list[Block]:
    return [
        Table(
            f"Peaks of the spectrum of {quantity(name)[0]}",
            ("frequency [Hz]", f"amplitude [{quantity(name)[1]}]"),
            [(f"{peak['frequency_Hz']:.0f}", f"{peak['amplitude']:.3g}") for peak in peaks],
            detail=Detail.ALL,
        )
        for name, peaks in spectra.items()
    ]
