"""Motion of one replicate over time, on request: its history, and what that shows of cage and contacts.

A history has every motion, and load, slip and heat of every contact, at uniform samples; SI throughout. It gives the rating
life of the bearing by the loads of every roller (ISO/TS 16281) instead of static ones.

Whirl, sections, spectra, loads and sliding are functions of a history. They work on its samples and show nothing faster
than half the sampling rate. Their largest forces are those of this replicate at the samples; a result keeps those of every
step.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array, Whole
from rbdyn.base.blocks import Column, Sheet, frame_of
from rbdyn.base.faults import LONGEST_NAME, one_line, refuse
from rbdyn.base.records import Record
from rbdyn.base.words import Brief, Figure, Notice
from rbdyn.contact.film_thickness import hertz_pressure
from rbdyn.dynamics.ensemble import Pace, Stop, log
from rbdyn.dynamics.forces.observe import OBSERVED, observe, slice_loads
from rbdyn.dynamics.parameters.model import race_contact_law, roller_bearing, rolling_contacts
from rbdyn.dynamics.parameters.state import layout_of
from rbdyn.dynamics.part_figures import rated_life
from rbdyn.dynamics.run import Run
from rbdyn.life.rollers import ReferenceLife
from rbdyn.scene import Scene, rollers_only

if TYPE_CHECKING:
    import pandas as pd


# Numbers of a history, 0.8 GB: with its table and pictures 2 GB. 1000 turns of 10 rollers at 512 samples are 0.7e8.
MOST_NUMBERS = 1e8
# Fields that are columns of cage and inner ring in the state, and those that are rows of ``observe``, in their order.
BODY_COLUMNS = ("cage_x", "cage_y", "cage_angle", "cage_vx", "cage_vy", "cage_speed", "ring_x", "ring_y")
CONTACT_COLUMNS = ("outer_load", "inner_load", "pocket_load", "outer_slip", "inner_slip", "outer_heat", "inner_heat")


@dataclass(frozen=True, repr=False)
class History(Brief):
    """Samples at equal intervals after the discarded turns. Arrays over (samples,) or (samples, rollers); SI.

    - ``azimuth``: of the rollers from the load direction [rad], without jumps at full turns
    - ``pocket_load``: contact and film on the more loaded wall, positive on the front one, where the roller drives the cage
    - slips: ring surface less roller surface; heats: of traction and rolling
    """

    scene: Scene
    time: Array
    inner_angle: Array
    cage_x: Array
    cage_y: Array
    cage_vx: Array
    cage_vy: Array
    cage_angle: Array
    cage_speed: Array
    ring_x: Array
    ring_y: Array
    outer_x: Array
    outer_y: Array
    roller_x: Array
    roller_y: Array
    roller_spin: Array
    azimuth: Array
    outer_load: Array
    inner_load: Array
    pocket_load: Array
    outer_slip: Array
    inner_slip: Array
    outer_heat: Array
    inner_heat: Array
    land_load: Array

    @property
    def guide_eccentricity(self) -> tuple[Array, Array]:
        """Cage centre less that of the ring that guides it, x and y [m]."""
        if self.scene.cage.guidance == "inner":
            return self.cage_x - self.ring_x, self.cage_y - self.ring_y
        return self.cage_x - self.outer_x, self.cage_y - self.outer_y

    def brief(self) -> tuple[str, list[Figure]]:
        """Samples and turns; extremes of forces and of the cage's place, and its mean speed."""
        x, y = self.guide_eccentricity
        figures = [
            Figure("largest pocket force", float(np.abs(self.pocket_load).max(initial=0.0)), None, "N"),
            Figure("largest raceway load", float(self.inner_load.max(initial=0.0)), None, "N"),
            Figure("largest cage eccentricity", 1e6 * float(np.hypot(x, y).max(initial=0.0)), None, "µm"),
            Figure("mean cage speed", float(self.cage_speed.mean()) * 30.0 / np.pi, None, "rpm"),
        ]
        turns = np.ptp(self.time) / self.scene.turn_s
        return f"{len(self.time)} samples over {turns:.3g} shaft turns of one replicate", figures

    def life(self) -> ReferenceLife:
        """Reference rating life of ISO/TS 16281 from the loads of this history."""

        return rating_life(self.scene, self.azimuth, self.inner_load, self.outer_load)

    def table(self) -> "pd.DataFrame":
        """A row a sample, units in the column names."""
        return frame_of(history_sheet(map(str, range(1, self.scene.bearing.rollers + 1))).columns, self)


def history_sheet(rollers: Iterable[str]) -> Sheet[History]:
    """Columns of a history, of ``rollers`` by their numbers from 1."""
    columns: tuple[Column[History], ...] = (
        Column("time_s", at="time", meaning="time after the turns that are not counted"),
        Column("cage_x_um", at=lambda motion: motion.cage_x * 1e6,
               meaning="centre of the cage: along the load, and 90 degrees ahead of it"),
        Column("cage_y_um", at=lambda motion: motion.cage_y * 1e6),
        Column("cage_speed_rpm", at=lambda motion: motion.cage_speed * 30.0 / np.pi, meaning="speed of the cage"),
        Column("inner_ring_x_um", at=lambda motion: motion.ring_x * 1e6, meaning="centre of the inner ring"),
        Column("inner_ring_y_um", at=lambda motion: motion.ring_y * 1e6),
        Column("land_N", at="land_load", meaning="force of the guide land on the cage"),
    )  # fmt: skip

    def column(series: str, key: str, roller: str, meaning: str) -> Column[History]:
        return Column(
            key.format(roller), at=lambda motion: getattr(motion, series)[:, int(roller) - 1], meaning=meaning
        )

    of_rollers = (
        ("pocket_load", "pocket_{}_N", "force of roller j on its pocket: positive ahead, negative behind"),
        ("outer_load", "outer_{}_N", "load of roller j on the outer and the inner raceway"),
        ("inner_load", "inner_{}_N", ""),
        ("outer_slip", "outer_slip_{}_m_s", "surface speed of the raceway minus the surface speed of roller j"),
        ("inner_slip", "inner_slip_{}_m_s", ""),
    )
    numbers = tuple(rollers)
    columns += tuple(column(series, key, j, meaning) for series, key, meaning in of_rollers for j in numbers)
    content = "One row per sample of the motion, of `rbdyn simulate` and `rbdyn show`."
    return Sheet("", columns, file="history.csv", content=content)


def most_turns(scene: Scene) -> float:
    """Shaft turns of the longest history that memory allows."""
    sample = layout_of(scene).size + OBSERVED * scene.bearing.rollers
    return MOST_NUMBERS / (sample * scene.numerics.samples_per_turn)


def _request_faults(scene: Scene, turns: Any, replicate: Any, per_turn: Any) -> Iterator[str]:
    """Reasons why such a history is impossible."""
    counts = {"replicate": (replicate, 0), "samples_per_turn": (per_turn, 1)}
    for name, (value, least) in counts.items():
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
            yield f"{name} = {one_line(repr(value), LONGEST_NAME)}: must be a whole number from {least}"
    if (
        isinstance(turns, bool)
        or not isinstance(turns, int | float | np.integer | np.floating)
        or not math.isfinite(turns)
    ):
        yield f"turns = {one_line(repr(turns), LONGEST_NAME)}: must be a number of shaft turns"
    elif isinstance(per_turn, int | np.integer) and per_turn >= 1:
        most = most_turns(scene) * scene.numerics.samples_per_turn / float(per_turn)
        if turns * per_turn < 1.0:
            yield f"turns = {turns:g}: shorter than one of {per_turn} samples a turn; take more turns"
        elif turns > most:
            yield f"turns = {turns:g}: there is memory for {most:.4g} turns; take fewer turns or samples_per_turn"


def history(
    scene: Scene | Path | str,
    turns: float,
    replicate: int = 0,
    samples_per_turn: int | None = None,
    stop: Stop | None = None,
    notice: Notice = log,
    overrides: Iterable[str] = (),
) -> History:
    """History of one replicate, counted from 0, over the first ``turns`` counted turns, with [thermal] at steady temperatures.

    ``scene``: also the path of its file; ``overrides`` of its keys, such as ``["cage.mass_g=50"]``. ``samples_per_turn``: by
    default that of the scene. ``notice``: called with a sentence on a long run, as in ``simulate``. Raises RunError, and
    InputError for a faulty scene, another kind of bearing and for impossible turns, replicates or samples.
    """
    scene = rollers_only(scene, overrides)
    if scene.thermal is not None:
        from rbdyn.dynamics.simulate import steady_scene

        scene = steady_scene(scene, stop=stop)
    per_turn = scene.numerics.samples_per_turn if samples_per_turn is None else samples_per_turn
    refuse(_request_faults(scene, turns, replicate, per_turn))
    bearing = roller_bearing(scene)
    z = bearing.rollers
    length = scene.numerics.warm_up_turns + turns
    run = Run(scene, bearing, replicate, scene.numerics.rtol, stop or Stop(), Pace(notice, length, length, 1))
    run.to(scene.numerics.warm_up_turns)
    run.forget()
    states = np.empty((int(turns * per_turn), run.carry.y.size))
    clock = np.empty((len(states), 2))
    for sample, state in enumerate(states):
        # Steps end at the samples, so the record has integrated states, no interpolated ones.
        run.to(scene.numerics.warm_up_turns + sample / per_turn)
        state[:] = run.carry.y
        clock[sample] = run.clock_angles()
    contacts = np.empty((OBSERVED, len(states), z))
    land = np.empty(len(states))
    observe(bearing, states, contacts, land)
    body, support = run.layout.first_body, run.layout.support
    x, y = states[:, :z], states[:, z : 2 * z]
    still = np.zeros(len(states))
    return History(
        scene=scene,
        time=np.arange(len(states)) * scene.turn_s / per_turn,
        inner_angle=clock[:, 0],
        **{name: states[:, body + place] for place, name in enumerate(BODY_COLUMNS)},
        outer_x=still if support is None else states[:, support],
        outer_y=still if support is None else states[:, support + 1],
        roller_x=x,
        roller_y=y,
        roller_spin=states[:, 4 * z : body],
        azimuth=np.unwrap(np.arctan2(y, x), axis=0),
        **dict(zip(CONTACT_COLUMNS, contacts, strict=True)),
        land_load=land,
    )


def rating_life(scene: Scene, azimuth: Array, inner_load: Array, outer_load: Array) -> ReferenceLife:
    """Reference life from loads [N] of every roller over time at azimuths [rad], (rows, rollers) each, over whole cage turns.

    Loads spread over the slices as at rest. Edge stresses count where the roller has a profile; the ends of a plain cylinder
    would need a half-space solution. A ring that turns bears the mean over all rollers, a ring at rest that of each place.
    """
    radius = 0.5 * scene.bearing.roller_diameter
    nx, ny = np.cos(azimuth), np.sin(azimuth)
    inner, outer = (
        slice_loads(race_contact_law(scene, race), scene.slices, radius, loads, nx, ny)
        for race, loads in (("inner", inner_load), ("outer", outer_load))
    )
    return rated_life(scene, inner, outer, np.mod(azimuth, 2.0 * math.pi))


Race = Literal["outer", "inner"]

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
SPREAD = (0.05, 0.95)
# Share of the samples outside a histogram at either end: the whirl speed has no bound near the centre.
TAIL = 0.01
# Halves of the record that overlap by half: the mean of three periodograms, frequencies two over the record apart.
SEGMENT_SHARE = 0.5


def eccentricity(history: History) -> Array:
    """Distance of the cage centre from that of its guide [m], (samples,)."""
    return np.hypot(*history.guide_eccentricity)


def whirl_speed(history: History) -> Array:
    """Instantaneous whirl speed psi' = (x vy - y vx)/(x^2 + y^2) of the cage centre about its guide [rad/s], (samples,).

    Zero where the centres coincide. It grows without bound close to the centre: use quantiles, not moments.
    """
    x, y = history.guide_eccentricity
    inner = history.scene.cage.guidance == "inner"
    guide = (history.ring_x, history.ring_y) if inner else (history.outer_x, history.outer_y)
    # The samples lack them, so by central differences.
    guide_vx, guide_vy = (np.gradient(place, history.time) for place in guide)
    moment = x * (history.cage_vy - guide_vy) - y * (history.cage_vx - guide_vx)
    square = x * x + y * y
    return np.divide(moment, square, out=np.zeros_like(square), where=square > 0.0)


def mean_cage_speed(history: History) -> float:
    """Angle that the cage turned over the time [rad/s]."""
    return float((history.cage_angle[-1] - history.cage_angle[0]) / (history.time[-1] - history.time[0]))


def whirl_ratio(history: History) -> float:
    """Mean whirl speed over mean cage speed: 1 when the cage centre goes round with the cage, 0 when it does not move.

    The mean of psi' over time is the angle round the guide's centre over the time; that form has no pole.
    """
    x, y = history.guide_eccentricity
    angle = np.unwrap(np.arctan2(y, x))
    turned = (angle[-1] - angle[0]) / (history.time[-1] - history.time[0])
    return float(turned) / mean_cage_speed(history)


def whirl_ratios(history: History) -> Array:
    """Instantaneous whirl speed over mean cage speed, (samples,)."""
    return whirl_speed(history) / mean_cage_speed(history)


def whirl_quantiles(history: History) -> dict[float, float]:
    """Quantiles of the instantaneous whirl ratio."""
    return dict(zip(QUANTILES, np.quantile(whirl_ratios(history), QUANTILES).tolist(), strict=True))


def whirl_histogram(history: History, bins: int = 60) -> tuple[Array, Array]:
    """Probability density of the instantaneous whirl ratio: bin edges (bins + 1,), density (bins,).

    The bins hold all but one in a hundred samples at either end; the density is that of all samples.
    """
    values = whirl_ratios(history)
    low, high = np.quantile(values, (TAIL, 1.0 - TAIL))
    if high - low <= 1e-9 * max(abs(low), abs(high), 1.0):
        low, high = low - 0.5, high + 0.5
    count, edges = np.histogram(values, bins, (float(low), float(high)))
    return edges, count / (values.size * np.diff(edges))


def poincare(history: History, turn_of: Literal["shaft", "cage"]) -> tuple[Array, Array]:
    """Poincare section: cage centre about its guide [m] once a turn of shaft or cage, x and y, each (turns,).

    A periodic orbit is a point, a quasi-periodic one a closed curve, a chaotic one a cloud. The section lies at the
    angle of the first sample, with a cubic spline between samples. The time of a crossing is interpolated linearly, since
    speeds hardly change within a sample. The shaft is the ring that turns, the inner one where both do.
    """
    from scipy.interpolate import CubicSpline

    if turn_of == "cage":
        angle = history.cage_angle
    elif np.ptp(history.inner_angle) > 0.0:
        angle = history.inner_angle
    else:
        angle = 2.0 * np.pi * history.time / history.scene.turn_s
    # Forward in either sense of rotation, and never back, so that each angle has one time.
    turned = np.maximum.accumulate(np.abs(angle - angle[0]))
    crossings = 2.0 * np.pi * np.arange(math.floor(turned[-1] / (2.0 * np.pi) + 1e-9) + 1)
    when = np.interp(crossings, turned, history.time)
    place = CubicSpline(history.time, np.array(history.guide_eccentricity), axis=1)(when)
    return place[0], place[1]


class Spectrum(NamedTuple):
    """Frequencies [Hz] and the amplitude of a sine of each, in units of the signal. Arrays (frequencies,)."""

    frequency: Array
    amplitude: Array

    def peaks(self, count: int) -> list[tuple[float, float]]:
        """The ``count`` highest local maxima: frequency [Hz] and amplitude, largest first."""
        from scipy.signal import find_peaks

        places = find_peaks(self.amplitude)[0]
        highest = places[np.argsort(-self.amplitude[places])][:count]
        return [(float(self.frequency[i]), float(self.amplitude[i])) for i in highest]


def orbit_spectrum(history: History) -> Spectrum:
    """The circles that the cage's orbit is the sum of: their radii [m], frequencies rising, positive as the cage turns.

    Hann's window over the whole history: up to 15 % less where a frequency lies between two.
    """
    x, y = history.guide_eccentricity
    orbit = x + 1j * math.copysign(1.0, mean_cage_speed(history)) * y
    window = 1.0 - np.cos(2.0 * np.pi * np.arange(len(orbit)) / len(orbit))
    amplitude = abs(np.fft.fft((orbit - orbit.mean()) * window)) / len(orbit)
    frequency = np.fft.fftfreq(len(orbit), float(history.time[1] - history.time[0]))
    return Spectrum(np.fft.fftshift(frequency), np.fft.fftshift(amplitude))


def spectrum(history: History, values: Array) -> Spectrum:
    """Amplitude spectrum of a sampled signal without its mean, by Welch's method (Welch 1967) with Hann's window.

    A sine has its amplitude at its frequency, and up to 15 % less where that lies between two frequencies.
    """
    from scipy.signal import welch

    interval = float(history.time[1] - history.time[0])
    segment = max(int(SEGMENT_SHARE * len(values)), 2)
    frequency, power = welch(values, 1.0 / interval, "hann", segment, scaling="spectrum")
    return Spectrum(frequency, np.sqrt(2.0 * power))


class Profile(Record):
    """A quantity of all rollers against azimuth: mean, 5 % and 95 % quantile in each bin, (bins,); NaN in empty bins.

    ``azimuth``: bin centres from the load direction, in [-pi, pi).
    """

    azimuth: Array
    mean: Array
    low: Array
    high: Array
    samples: Whole


def against_azimuth(history: History, values: Array, bins: int = 72) -> Profile:
    """Bin values (samples, rollers) by the azimuth at which each roller stood."""
    share = (history.azimuth / (2.0 * np.pi) + 0.5) % 1.0
    place = np.minimum((share * bins).astype(np.int64), bins - 1).ravel()
    order = np.argsort(place, kind="stable")
    samples = np.bincount(place, minlength=bins)
    parts = np.split(values.ravel()[order], np.cumsum(samples)[:-1])
    figures = np.full((3, bins), np.nan)
    for index, part in enumerate(parts):
        if part.size:
            figures[0, index] = part.mean()
            figures[1:, index] = np.quantile(part, SPREAD)
    centres = 2.0 * np.pi * ((np.arange(bins) + 0.5) / bins - 0.5)
    return Profile(centres, figures[0], figures[1], figures[2], samples)


def contact_pressure(history: History, race: Race) -> Array:
    """Hertz pressure p = sqrt(Q E'/(2 pi l R)) in the middle of the contact of plain cylinders [Pa], (samples, rollers).

    E' = 2/((1 - nu1^2)/E1 + (1 - nu2^2)/E2), l the effective length, R the reduced radius (Johnson 1985, 4.2c). A
    profile or a tilt raises it locally.
    """
    load = history.outer_load if race == "outer" else history.inner_load
    return np.asarray(hertz_pressure(rolling_contacts(history.scene)[race], load))


def pressure_velocity(history: History, race: Race) -> Array:
    """Hertz pressure times sliding speed [W/m^2], (samples, rollers): friction over it is the heat per area."""
    slip = history.outer_slip if race == "outer" else history.inner_slip
    return contact_pressure(history, race) * np.abs(slip)


class Largest(NamedTuple):
    """A largest force [N], its time after the transient [s], and the roller, from 0; None where it is no roller's."""

    force: float
    time: float
    roller: int | None


def largest(history: History, loads: Array) -> Largest:
    """Largest absolute value of loads (samples,) or (samples, rollers).

    The vertex of the parabola through the largest sample and its neighbours, close to the maximum between samples.
    """
    size = np.abs(loads if loads.ndim == 2 else loads[:, None])
    sample, roller = np.unravel_index(int(size.argmax()), size.shape)
    force, time = float(size[sample, roller]), float(history.time[sample])
    if 0 < sample < len(size) - 1:
        before, after = float(size[sample - 1, roller]), float(size[sample + 1, roller])
        bend = before - 2.0 * force + after
        if bend < 0.0:
            shift = 0.5 * (before - after) / bend
            force -= 0.25 * (before - after) * shift
            time += shift * float(history.time[1] - history.time[0])
    return Largest(force, time, int(roller) if loads.ndim == 2 else None)
