"""Figures of a simulation, each once: what a result, a study, a limit, a map, a rig and the manual know of it.

They stand apart from compiled code so that a command can check a name without it.
"""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Literal

import numpy as np

from rbdyn import losses
from rbdyn.base.arrays import Array
from rbdyn.base.records import Record
from rbdyn.base.words import quantity
from rbdyn.clearances import REPORTED
from rbdyn.dynamics.forces import state
from rbdyn.dynamics.statistics.extremes import FEWEST_WINDOWS, RETURN_FORCE, RETURN_WINDOWS, is_fitted, least_windows
from rbdyn.dynamics.statistics.replicate import Replicate, Statistic, mean, timed, windowed
from rbdyn.result import START_FIGURES, TEMPERATURES
from rbdyn.scene.laws import SLOWEST_CAGE

if TYPE_CHECKING:
    from rbdyn.scene import Scene


class Figure(Record, eq=False):
    """A figure by the key of its JSON, which ends with its unit; ``meaning``: in a sentence of the manual and of a rig's table.

    - ``statistic``: how it follows from batches; None for what follows from the scene, the largest loads or the heat balance.
      ``scale``: factor of its unit, or that of a scene, None where the scene has no such figure
    - ``kind``: of the whole "bearing", of its "damage", of a node ("temperature"), of its "start", or of one of its parts. ``source``: of a part, the loss, clearance,
      or race and key of its report, that it is; of a temperature, its node
    - ``tested``: whether it must settle before a run ends. ``slow``: whether slow change counts in its error; ``balanced``: whether
      the gap of the power balance does
    - ``judged``: by "notes" on large errors and in ranges of doe uncertainty, by a "target" too, or not
    - ``words``: its row in the table of a run, where the key does not say it; ``window`` is that of impacts. ``repeats``: figure that
      it is left out next to where both are equal
    - ``panel``: place on a map from 1, and its heading in tables of points, "[%]" where these show it in percent
    - ``worst``: which value is the worst one over a duty
    - ``needs``: what a scene without it lacks, in words
    - ``switch``: key of the scene that leaves it out where it is false
    - ``is_defined``: whether runs bear it, where it needs more than its scene
    - ``response``: whether a study may name it. ``harmonic``: whether its mean over time is that of its inverse
    - ``accuracy``: of a rig's sensor [%] where its table states none, 0 where no rig measures the figure
    """

    key: str
    meaning: str
    statistic: Statistic | None = None
    scale: "float | Callable[[Scene], float | None]" = 1.0
    kind: Literal["bearing", "damage", "temperature", "power", "start", "clearance", "life", "stiffness", "contact"] = (
        "bearing"
    )
    source: tuple[str, ...] = ()
    tested: bool = False
    slow: bool = True
    balanced: bool = False
    judged: Literal["", "notes", "target"] = ""
    words: str = ""
    repeats: str = ""
    panel: tuple[int, str] | None = None
    worst: Literal["largest", "least", "farthest from 0", "none"] = "largest"
    is_defined: Callable[[Sequence[Replicate]], bool] = lambda runs: True
    needs: str = ""
    switch: Literal["", "damage.impacts", "damage.races", "numerics.stiffness"] = ""
    response: bool = True
    harmonic: bool = False
    accuracy: float = 0.0

    def scale_in(self, scene: "Scene") -> float | None:
        """Factor of the statistic in a scene; None where the scene has no such figure."""
        if self.is_off(scene):
            return None
        return self.scale(scene) if callable(self.scale) else self.scale

    def is_off(self, scene: "Scene") -> bool:
        """Whether its ``switch`` leaves it out."""
        table, _, key = self.switch.partition(".")
        return bool(table) and not getattr(getattr(scene, table), key)

    @property
    def percent(self) -> float:
        """100 where maps and tables of points show it in percent, else 1."""
        return 100.0 if self.panel and "%" in self.panel[1] else 1.0


def deviation_ratio(sums: Array) -> Array:
    """Standard deviation over mean (Ghaisas et al. 2004); 0 for a cage at rest."""
    samples, total, squares = np.moveaxis(sums, -1, 0)
    defined = (samples > 1.5) & (total > 0.0)
    samples, total = np.where(defined, samples, 2.0), np.where(defined, total, 1.0)
    mean = total / samples
    variance = np.maximum(squares / samples - mean**2, 0.0) * samples / (samples - 1.0)
    return np.where(defined, np.sqrt(variance) / mean, 0.0)


def slip(sums: Array) -> Array:
    """1 - angle of the cage over its kinematic angle; 0 where counter-rotation leaves no kinematic speed."""
    duration, rolling, turned = np.moveaxis(sums, -1, 0)
    defined = np.abs(rolling) > SLOWEST_CAGE * duration
    return np.where(defined, 1.0 - turned / np.where(defined, rolling, 1.0), 0.0)


def orbit(run: Replicate) -> Array:
    """Samples of the cage's centre in each batch, and the sum of their squared distances from its mean place in the run."""
    samples, x, y, squares = run.orbit[run.first :].T
    mean_x, mean_y = (place.sum() / max(samples.sum(), 1.0) for place in (x, y))
    about = squares - 2.0 * (mean_x * x + mean_y * y) + samples * (mean_x**2 + mean_y**2)
    return np.column_stack((samples, np.maximum(about, 0.0)))


IMPACT_FORCE = windowed(state.POCKET_LOAD)
WHIRL_DEVIATION_RATIO = Statistic(lambda run: run.whirl[run.first :], deviation_ratio)
POWER_LOSS = timed(lambda run: run.work[:, : losses.SHAFT].sum(axis=1))
CAGE_SPEED = timed(lambda run: run.cage_angle)
CAGE_SLIP = timed(lambda run: np.column_stack((run.kinematic_angle, run.cage_angle)), slip)
# Root mean square distance of the cage's centre from its mean place in a replicate [m].
ORBIT_RADIUS = Statistic(orbit, lambda sums: np.sqrt(sums[..., 1] / np.maximum(sums[..., 0], 1.0)))
# Shows a change of regime first.
WHIRL_SPEED = Statistic(lambda run: run.whirl[run.first :, :2], mean)


def _work(place: int, run: Replicate) -> Array:
    return run.work[:, place]


BEARING = (
    Figure(
        "impact_force_N",
        "largest force between a roller and the cage, mean over windows of shaft turns",
        IMPACT_FORCE,
        tested=True,
        judged="target",
        words="largest roller/cage force in {window} [N]",
        panel=(3, "impact [N]"),
        accuracy=10.0,  # of a force sensor with its mounting
    ),
    Figure(
        "impact_contact_force_N",
        "impact force by contact alone, without the oil film of the pocket",
        windowed(state.POCKET_CONTACT_LOAD),
        tested=True,
        words="largest of it by contact alone, without the film [N]",
        repeats="impact_force_N",
        response=False,
        accuracy=10.0,
    ),
    Figure(
        "whirl_deviation_ratio",
        "whirl deviation ratio of the cage's centre",
        WHIRL_DEVIATION_RATIO,
        tested=True,
        judged="target",
        panel=(4, "whirl"),
        accuracy=5.0,  # of eddy-current probes (API 670)
    ),
    Figure(
        "power_loss_W",
        "power loss of the bearing",
        POWER_LOSS,
        tested=True,
        balanced=True,
        judged="target",
        panel=(2, "loss [W]"),
        accuracy=3.0,  # of a torque sensor
    ),
    Figure(
        "cage_speed_rpm",
        "mean speed of the cage",
        CAGE_SPEED,
        30.0 / math.pi,
        tested=True,
        judged="notes",
        worst="none",
        accuracy=0.1,  # of pulses of a wheel
    ),
    # A slip near zero has no useful relative error; the cage speed shows it.
    Figure(
        "cage_slip",
        "1 less cage speed over the speed of rolling without slip",
        CAGE_SLIP,
        panel=(1, "slip [%]"),
        worst="farthest from 0",
    ),
    Figure(
        "cage_orbit_radius_share",
        "root mean square distance of the cage's centre from its mean place over the cage's radial clearance",
        ORBIT_RADIUS,
        lambda scene: scene.cage_play_m and 1.0 / scene.cage_play_m,
        slow=False,
        words="radius of the cage's orbit over its radial clearance",
        response=False,
    ),
)


def _pocket_sliding(scene: "Scene") -> float | None:
    """Sliding in each pocket over the friction power of all; none of pockets that are off or have no friction."""
    friction = scene.model.pocket_friction if scene.model.pocket != "off" else 0.0
    return 1.0 / (friction * scene.bearing.rollers) if friction > 0.0 else None


def _impacts(run: Replicate) -> Array:
    """Sums over the impacts of all pockets that end in each batch counted."""
    return run.impacts[run.first :].sum(axis=1)


def _pocket_track(run: Replicate) -> Array:
    """Of each batch: duration, friction work, samples and squared places of the cage, force of all pockets and width over time."""
    work, orbit, durations = run.work[run.first :], run.orbit[run.first :], run.durations[run.first :]
    return np.column_stack(
        (
            durations,
            work[:, losses.POCKET_FRICTION],
            orbit[:, 0],
            orbit[:, 3],
            work[:, losses.POCKET_FORCE],
            run.pocket_width * durations,
        )
    )


def sliding_over_track(sums: Array) -> Array:
    """Friction power over the width of the track on a pocket wall [W/m], 0 without a track; sums as in ``_pocket_track``.

    A cage off the middle by e moves radially past a roller by e cos(phi): its variance is e^2/2. The track has the Hertz width of
    the mean force, and 2 sqrt(3) standard deviations, which is the range of a uniform law.
    """
    duration, work, samples, squares, force, width = np.moveaxis(sums, -1, 0)
    hertz = width / duration * np.sqrt(np.maximum(force, 0.0) / duration)
    track = hertz + 2.0 * np.sqrt(1.5 * np.maximum(squares, 0.0) / np.maximum(samples, 1.0))
    return np.where(track > 0.0, work / duration / np.where(track > 0.0, track, 1.0), 0.0)


def fatigue_force(sums: Array) -> Array:
    """(sum F^m/n)^(1/m) from n, sum F^m and n m on the last axis; 0 of no impacts."""
    number, powers, exponents = np.moveaxis(sums, -1, 0)
    defined = (number > 0.5) & (powers > 0.0)
    number, powers, exponents = (np.where(defined, part, 1.0) for part in (number, powers, exponents))
    return np.where(defined, (powers / number) ** (number / exponents), 0.0)


def quantile(sums: Array) -> Array:
    """Value that 95 % of the samples stay below, from a histogram after two numbers on the last axis; 0 without samples."""
    counts = sums[..., 2:]
    shares = np.cumsum(counts, axis=-1) / np.maximum(sums[..., :1], 1.0)
    place = np.argmax(shares >= SAMPLE_QUANTILE - 1e-12, axis=-1)[..., None]
    step = np.maximum(np.take_along_axis(counts, place, -1) / np.maximum(sums[..., :1], 1.0), 1e-300)
    inside = 1.0 - (np.take_along_axis(shares, place, -1) - SAMPLE_QUANTILE) / step
    values = state.SAMPLE_LOWEST * 10.0 ** ((place + np.clip(inside, 0.0, 1.0)) / state.SAMPLE_STEPS)
    # The first step holds all that is smaller.
    return np.where((sums[..., 0] > 0.5) & (place[..., 0] > 0), values[..., 0], 0.0)


def _sampled(place: int, key: str, meaning: str, unit: str, level: bool, scale: float = 1.0) -> "Figure":
    """The mean of a sampled quantity, or the value that 95 % of its samples stay below."""
    columns = [state.SAMPLES_NUMBER, state.SAMPLES_TOTAL]

    def moments(run: Replicate) -> Array:
        sums = run.races[run.first :, place]
        # Their number twice: a second sum that is zero means that there is nothing to follow.
        return np.column_stack((sums[:, :1], sums[:, :1], sums[:, 2:])) if level else sums[:, columns]

    return Figure(
        key,
        meaning,
        Statistic(moments, quantile if level else _mean_or_none),
        scale,
        kind="damage",
        words=f"{meaning} [{unit}]",
        switch="damage.races",
        is_defined=lambda runs: any(
            bool(run.races[run.first :, place:, state.SAMPLES_NUMBER][:, :1].any()) for run in runs
        ),
    )


SAMPLE_QUANTILE = 0.95


def _mean_or_none(sums: Array) -> Array:
    """Second sum over the first; 0 of no impacts."""
    return np.where(sums[..., 0] > 0.5, sums[..., 1] / np.maximum(sums[..., 0], 1.0), 0.0)


def _with_pockets(scale: "Callable[[Scene], float | None]") -> "Callable[[Scene], float | None]":
    """A ``scale`` of scenes with pockets."""
    return lambda scene: None if scene.model.pocket == "off" else scale(scene)


def _half_impact_mass(scene: "Scene") -> float:
    """Half of m_r [kg], with 1/m_r = 1/m + 1/m_c + r^2/J_c of a roller and a cage that is free to move and turn."""
    geometry, radius = scene.geometry, 0.5 * scene.bearing.pitch_diameter
    return 0.5 / (1.0 / geometry.roller_mass + 1.0 / scene.cage.mass + radius**2 / geometry.cage_inertia)


def _any_impacts(runs: Sequence[Replicate]) -> bool:
    return any(bool(_impacts(run)[:, state.NUMBER].any()) for run in runs)


def _pocket_length(scene: "Scene") -> float:
    """Length of the contact of a roller and a pocket wall [m]."""
    return float(scene.cage.pocket_contact_length or scene.bearing.effective_length)


def _land_sliding(scene: "Scene") -> float | None:
    """Sliding on the guide land over its friction power; none without a land or its friction."""
    guided = scene.cage.guidance != "roller" and scene.model.guide_land != "off"
    return 1.0 / scene.model.land_friction if guided and scene.model.land_friction > 0.0 else None


_damage = partial(Figure, kind="damage")
_pocket_damage = partial(_damage, needs="pockets")
_impact_damage = partial(_pocket_damage, switch="damage.impacts")
# Wear by Archard's law is in proportion to sliding: force times the speed of the surface on which it acts.
CAGE_DAMAGE = (
    _damage(
        "pocket_sliding_N_m_s",
        "contact force of a pocket times the speed at which its roller slides on it, mean over time and pockets",
        timed(partial(_work, losses.POCKET_FRICTION)),
        _pocket_sliding,
        words="force times sliding speed in a pocket [N m/s]",
        needs="pockets or model.pocket_friction",
    ),
    # Archard's depth is in proportion to it: of two designs of the same materials the ratio is that of their wear.
    _damage(
        "pocket_sliding_density_W_mm2",
        "force times sliding speed in a pocket over the area of its track; its ratio to a baseline equals the ratio of the wear depths",
        Statistic(_pocket_track, sliding_over_track),
        lambda scene: (sliding := _pocket_sliding(scene)) and 1e-6 * sliding / _pocket_length(scene),
        words="force times sliding speed over its track [W/mm2]",
        needs="pockets or model.pocket_friction",
    ),
    _damage(
        "land_sliding_N_m_s",
        "contact force of the guide land times the speed at which the cage slides on it, mean over time",
        timed(partial(_work, losses.LAND_FRICTION)),
        _land_sliding,
        words="force times sliding speed on the land [N m/s]",
        needs="the guide land or model.land_friction",
    ),
    _pocket_damage(
        "pocket_force_mean_N",
        "force on a pocket, mean over time and pockets; with films that on its more loaded wall",
        timed(partial(_work, losses.POCKET_FORCE)),
        _with_pockets(lambda scene: 1.0 / scene.bearing.rollers),
        words="mean force on a pocket [N]",
    ),
    _pocket_damage(
        "pocket_impact_power_W",
        "power that impacts lose in all pockets: by damping of the walls and by squeezing films",
        timed(lambda run: run.work[:, losses.POCKET_DAMPING] + run.work[:, losses.POCKET_SQUEEZE]),
        _with_pockets(lambda scene: 1.0),
        words="power that impacts lose in all pockets [W]",
    ),
    _impact_damage(
        "impacts_per_turn",
        "contacts of rollers and pocket walls in a shaft turn whose first approach exceeds damage.impact_speed_m_s",
        timed(lambda run: run.impacts[:, :, state.NUMBER].sum(axis=1)),
        _with_pockets(lambda scene: scene.turn_s),
        words="impacts in all pockets in a shaft turn",
    ),
    _impact_damage(
        "impact_energy_J",
        "energy that roller and free cage bring into an impact by their first approach, mean over impacts",
        Statistic(lambda run: _impacts(run)[:, [state.NUMBER, state.SQUARES]], _mean_or_none),
        _with_pockets(_half_impact_mass),
        words="energy of an impact, mean [J]",
        is_defined=_any_impacts,
    ),
    _impact_damage(
        "impact_fatigue_force_N",
        "equal peak force of all impacts that tires a bar as they do, by the exponent damage.fatigue_exponent",
        Statistic(lambda run: _impacts(run)[:, [state.NUMBER, state.PEAK_POWERS, state.EXPONENTS]], fatigue_force),
        _with_pockets(lambda scene: 1.0),
        words="equal peak force of impacts, for fatigue [N]",
        is_defined=_any_impacts,
    ),
    _pocket_damage(
        "impact_return_force_N",
        f"force on a pocket that one of {RETURN_WINDOWS} impact windows exceeds, by Gumbel's law (from {FEWEST_WINDOWS} windows on)",
        RETURN_FORCE,
        _with_pockets(lambda scene: 1.0),
        slow=False,
        words=f"impact force that one of {RETURN_WINDOWS} windows exceeds [N]",
        is_defined=is_fitted,
    ),
    _damage(
        "bar_stress_MPa",
        "bending stress of a clamped cage bar under the impact return force; a fatigue limit is 0.3 to 0.4 of the strength, at least",
        RETURN_FORCE,
        _with_pockets(lambda scene: scene.bar_stress_MPa_N),
        slow=False,
        words="stress of a bar under it, at least [MPa]",
        needs="pockets or the section of a bar (cage.bar_width_mm and three more)",
        is_defined=is_fitted,
    ),
)


RACE_DAMAGE = (
    *(
        _sampled(place, f"{race}_{key}", f"{words} of {race} raceway, 95 % below", unit, True, scale)
        for key, words, unit, scale, places in (
            ("power_density_W_mm2", "power density", "W/mm2", 1e-6, (state.INNER_DENSITIES, state.OUTER_DENSITIES)),
            ("flash_rise_K", "flash rise", "K", 1.0, (state.INNER_FLASHES, state.OUTER_FLASHES)),
        )
        for race, place in zip(("inner", "outer"), places, strict=True)
    ),
    _sampled(state.ENTRY_SLIPS, "entry_slip_m_s", "slip of a roller at its entry, mean", "m/s", False),
    _sampled(state.ENTRY_SLIPS, "entry_slip_95_m_s", "slip at its entry, 95 % below", "m/s", True),
    _sampled(state.ENTRY_ENERGIES, "entry_energy_J", "friction energy of its entry, mean", "J", False),
    _sampled(state.ENTRY_ENERGIES, "entry_energy_95_J", "friction energy of it, 95 % below", "J", True),
)
DAMAGE = (*CAGE_DAMAGE, *RACE_DAMAGE)


def pocket_impacts(scene: "Scene", runs: Sequence[Replicate]) -> dict[str, list[float]] | None:
    """Figures of impacts of each pocket in turn, 0 of a pocket without any; None where impacts are not followed."""
    found = {}
    for figure in (figure for figure in DAMAGE if figure.switch == "damage.impacts"):
        scale, statistic = figure.scale_in(scene), figure.statistic
        if scale is None or statistic is None:
            return None
        pockets = range(runs[0].impacts.shape[1])
        alone = [[replace(run, impacts=run.impacts[:, [pocket]]) for run in runs] for pocket in pockets]
        sums = [np.sum([statistic.moments(run).sum(axis=0) for run in each], axis=0) for each in alone]
        found[figure.key] = [scale * float(statistic.of_sums(total)) for total in sums]
    return found


def why_missing(scene: "Scene", key: str) -> str | None:
    """Why a scene has no such figure of damage, stiffness or a start, with the fix; None where it has."""
    if key in START_FIGURES and (scene.thermal is None or scene.thermal.start is None):
        return "the scene has no [thermal.start]; add that table to its file or choose another result"
    if key in START_FIGURES and "guide" in key and scene.cage.guidance == "roller":
        return "no ring guides the cage; choose another result"
    figure = next((figure for figure in FIGURES if figure.key == key), None)
    if figure is None:
        return None
    if figure.is_off(scene):
        return f"the scene leaves it out ({figure.switch} = false); write true or choose another result"
    if (
        figure.kind == "stiffness"
        and scene.thermal is None
        and scene.operation.largest_load_N == 0.0
        and scene.geometry.clearance >= 0.0
    ):
        return "the scene has no load and no preload; raise operation.radial_load_N or choose another result"
    if figure.kind != "damage":
        return None
    if figure.scale_in(scene) is None:
        return f"the scene leaves out {figure.needs}; state it or choose another result"
    numerics = scene.numerics
    windows = least_windows(numerics.turns, numerics.impact_window_turns, numerics.replicates)
    if figure.statistic is RETURN_FORCE and windows < FEWEST_WINDOWS:
        return (
            f"numerics gives {windows} impact windows, and a return force needs {FEWEST_WINDOWS}; raise numerics.turns or "
            "numerics.replicates, or shorten numerics.impact_window_turns"
        )
    return None


def switched_off(keys: Collection[str]) -> list[str]:
    """Overrides by which a scene leaves out what none of the figures needs, by their keys."""
    needed = {"", *(figure.switch for figure in FIGURES if figure.key in keys)}
    switches = dict.fromkeys(figure.switch for figure in FIGURES)
    return [f"{switch}=false" for switch in switches if switch not in needed]


_PLACES = {"oil": "oil that leaves the bearing", "outer": "outer ring", "inner": "inner ring", "rollers": "rollers"}
HEAT = tuple(
    # The accuracy is that of a thermocouple of class 1 at 100 C (IEC 60584-1: 1.5 K).
    Figure(key, f"temperature of the {_PLACES[node]}", kind="temperature", source=(node,), accuracy=1.5)
    for key, node in TEMPERATURES.items()
)
START = tuple(
    Figure(key, figure.meaning, kind="start", source=(figure.place,), worst=figure.worst)
    for key, figure in START_FIGURES.items()
)
_CONTACTS = ("max_pressure_MPa", "central_film_um", "minimum_film_um", "lambda_ratio")
_stiffness = partial(Figure, kind="stiffness", switch="numerics.stiffness")
PARTS = (
    *(
        Figure(
            f"{loss}_power_W",
            f"power of {loss.replace('_', ' ')}",
            timed(partial(_work, place)),
            kind="power",
            source=(loss,),
        )
        for place, loss in enumerate(losses.POWER_TERMS)
    ),
    *(
        Figure(
            f"{name}_operating_clearance_um",
            f"operating {name} clearance",
            kind="clearance",
            source=(name,),
            worst="least",
        )
        for name, *_ in REPORTED
    ),
    # 1/L is damage an hour (Palmgren and Miner).
    Figure("life_h", "life L10r by static loads (ISO/TS 16281)", kind="life", harmonic=True, worst="least"),
    # x is along the load, y across it.
    *(
        _stiffness(
            f"stiffness_{axes}_N_um",
            f"stiffness {way} the load by static loads (ISO/TS 16281), mean over a pitch of the rollers",
            worst="least",
        )
        for axes, way in (("xx", "along"), ("yy", "across"))
    ),
    _stiffness(
        "variable_compliance_um",
        "travel of the shaft's centre while the rollers pass a pitch, peak to peak, along or across the load, whichever is larger",
    ),
    *(
        Figure(
            f"{race}_{key}",
            f"{quantity(key)[0]} of the {race} raceway at its largest load",
            kind="contact",
            source=(race, key),
            worst="largest" if "pressure" in key else "least",
        )
        for race in ("inner", "outer")
        for key in _CONTACTS
    ),
)
FIGURES = (*BEARING, *DAMAGE, *HEAT, *START, *PARTS)
# In the order of their places on a map.
PANELS = sorted((figure for figure in FIGURES if figure.panel), key=lambda figure: figure.panel or ())


def of_kind(kind: str) -> list[Figure]:
    """Figures of a kind."""
    return [figure for figure in FIGURES if figure.kind == kind]


def repeated(*tables: Mapping[str, object]) -> set[str]:
    """Keys of figures that only repeat another one in all of the tables by key."""
    return {
        figure.key
        for figure in BEARING
        if figure.repeats and all(table.get(figure.key) == table.get(figure.repeats) for table in tables)
    }
