"""A time history of one replicate, on request: motions, and every contact's load, slip and heat, at uniform samples; and the rating
life of the bearing by the loads that every roller saw (ISO/TS 16281) instead of static ones.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import LONGEST_NAME, one_line, refuse
from rbdyn.base.forecast import Notice
from rbdyn.base.words import Brief, Figure
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.forces.observe import OBSERVED, observe, slice_loads
from rbdyn.dynamics.parameters.model import race_contact_law, roller_bearing
from rbdyn.dynamics.parameters.state import layout_of
from rbdyn.dynamics.run import Pace, Run, log
from rbdyn.life import turning_rings
from rbdyn.life.rollers import ReferenceLife, reference_life
from rbdyn.scene import Scene, rollers_only

if TYPE_CHECKING:
    import pandas as pd


def rating_life(scene: Scene, azimuth: Array, inner_load: Array, outer_load: Array) -> ReferenceLife:
    """Reference life from loads [N] of every roller over time at azimuths [rad], (rows, rollers) each; they should span
    whole cage turns.

    Loads spread over the slices as at rest. Edge stresses count where the roller has a profile; a plain cylinder's
    ends would need a half-space solution. Rings that turn see the mean over all rollers, a ring at rest each place.
    """
    drawing, radius = scene.bearing, 0.5 * scene.bearing.roller_diameter
    nx, ny = np.cos(azimuth), np.sin(azimuth)
    inner, outer = (
        slice_loads(race_contact_law(scene, race), scene.slices, radius, loads, nx, ny)
        for race, loads in (("inner", inner_load), ("outer", outer_load))
    )
    return reference_life(
        inner,
        outer,
        capacity=drawing.rated_capacity,
        gamma=drawing.diameter_ratio,
        turning=turning_rings(*scene.operation.speeds),
        angle=np.mod(azimuth, 2.0 * math.pi),
        edges=drawing.roller_profile != "cylinder",
    )


# Numbers of a history, 0.8 GB: with its table and pictures 2 GB. 1000 turns of 10 rollers at 512 samples are 0.7e8.
MOST_NUMBERS = 1e8
# Fields that are columns of cage and inner ring in the state, and those that are rows of ``observe``, in their order.
BODIES = ("cage_x", "cage_y", "cage_angle", "cage_vx", "cage_vy", "cage_speed", "ring_x", "ring_y")
SEEN = ("outer_load", "inner_load", "pocket_load", "outer_slip", "inner_slip", "outer_heat", "inner_heat")


@dataclass(frozen=True, repr=False)
class History(Brief):
    """Samples at equal intervals after the discarded turns. Arrays over (samples,) or (samples, rollers); SI.

    ``azimuth``: of the rollers from the load direction [rad], growing without bound; ``pocket_load``: contact and
    film on the more loaded wall, positive on the front one, where the roller drives the cage; slips: ring surface less roller surface; heats: traction and rolling.
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
            Figure("largest race load", float(self.inner_load.max(initial=0.0)), None, "N"),
            Figure("largest cage eccentricity", 1e6 * float(np.hypot(x, y).max(initial=0.0)), None, "µm"),
            Figure("mean cage speed", float(self.cage_speed.mean()) * 30.0 / np.pi, None, "rpm"),
        ]
        turns = np.ptp(self.time) / self.scene.turn_s
        return f"{len(self.time)} samples over {turns:.3g} shaft turns of one replicate", figures

    def life(self) -> "ReferenceLife":
        """Reference rating life of ISO/TS 16281 from the loads of this history."""

        return rating_life(self.scene, self.azimuth, self.inner_load, self.outer_load)

    def table(self) -> "pd.DataFrame":
        """A row a sample, units in the column names."""
        import pandas as pd

        columns: dict[str, Any] = {
            "time_s": self.time,
            "cage_x_um": self.cage_x * 1e6,
            "cage_y_um": self.cage_y * 1e6,
            "cage_speed_rpm": self.cage_speed * 30.0 / np.pi,
            "inner_ring_x_um": self.ring_x * 1e6,
            "inner_ring_y_um": self.ring_y * 1e6,
            "land_N": self.land_load,
        }
        for name in ("pocket_load", "outer_load", "inner_load", "outer_slip", "inner_slip"):
            unit = "N" if name.endswith("_load") else "m_s"
            for j, values in enumerate(getattr(self, name).T):
                columns[f"{name.removesuffix('_load')}_{j + 1}_{unit}"] = values
        return pd.DataFrame(columns)


def most_turns(scene: Scene) -> float:
    """Shaft turns for whose history there is memory."""
    sample = layout_of(scene).size + OBSERVED * scene.bearing.rollers
    return MOST_NUMBERS / (sample * scene.numerics.samples_per_turn)


def _request_faults(scene: Scene, turns: Any, replicate: Any, per_turn: Any) -> Iterator[str]:
    """Why there is no such history."""
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
) -> History:
    """History of one replicate, counted from 0, over the first ``turns`` counted turns.

    ``scene``: also the path of its file; ``notice``: what to do with a sentence on a long run, as in ``simulate``. Raises
    RunError, InputError for what is no roller bearing and for turns, replicates or samples that there cannot be.
    """
    scene = rollers_only(scene)
    per_turn = scene.numerics.samples_per_turn if samples_per_turn is None else samples_per_turn
    refuse(_request_faults(scene, turns, replicate, per_turn))
    bearing = roller_bearing(scene)
    z = bearing.rollers
    pace = Pace(scene, notice, 1, scene.numerics.warm_up_turns + turns, 1)
    run = Run(scene, bearing, replicate, scene.numerics.rtol, stop or Stop(), pace)
    run.to(scene.numerics.warm_up_turns)
    run.forget()
    states = np.empty((int(turns * per_turn), run.carry.y.size))
    clock = np.empty((len(states), 2))
    for sample, state in enumerate(states):
        # Steps end at the samples: what is recorded is what was integrated.
        run.to(scene.numerics.warm_up_turns + sample / per_turn)
        state[:] = run.carry.y
        clock[sample] = run.clock_angles()
    seen = np.empty((OBSERVED, len(states), z))
    land = np.empty(len(states))
    observe(bearing, states, seen, land)
    body, support = run.layout.first_body, run.layout.support
    x, y = states[:, :z], states[:, z : 2 * z]
    still = np.zeros(len(states))
    return History(
        scene=scene,
        time=np.arange(len(states)) * scene.turn_s / per_turn,
        inner_angle=clock[:, 0],
        **{name: states[:, body + place] for place, name in enumerate(BODIES)},
        outer_x=still if support is None else states[:, support],
        outer_y=still if support is None else states[:, support + 1],
        roller_x=x,
        roller_y=y,
        roller_spin=states[:, 4 * z : body],
        azimuth=np.unwrap(np.arctan2(y, x), axis=0),
        **dict(zip(SEEN, seen, strict=True)),
        land_load=land,
    )
