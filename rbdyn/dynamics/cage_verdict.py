"""Verdict on the cage of a bearing, from the orbits that its replicates trace."""

import math
from collections.abc import Sequence

from rbdyn.base.arrays import Complex
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.losses import LAND_DAMPING, LAND_FRICTION, POCKET_DAMPING, POCKET_FRICTION
from rbdyn.scene import Scene
from rbdyn.verdict.orbits import BLOCK_TURNS, CageVerdict, Forcing, Trial, cage_verdict, mean_measures

RUBBING = [POCKET_FRICTION, POCKET_DAMPING, LAND_FRICTION, LAND_DAMPING]
# Share of the samples with a loaded contact of the inner race, below which films alone drive the rollers.
DRIVEN = 0.5


def verdict_of(scene: Scene, runs: Sequence[Replicate]) -> CageVerdict | None:
    """Verdict by the counted turns of runs; None where the scene leaves it out."""
    if scene.cage_sample_s is None:
        return None
    turns = min(_cage_turns(run) for run in runs)
    if turns < BLOCK_TURNS:
        reason = f"runs of {turns:.3g} cage turns are shorter than {BLOCK_TURNS}; raise numerics.turns"
        return CageVerdict("not judged", {}, {}, "not judged", {}, {}, scene.verdict.least_share, reason)
    samples, loaded = sum(run.traced[run.first :].sum(axis=0) for run in runs)
    films = "films alone drive the rollers" if loaded < DRIVEN * samples else None
    return cage_verdict([_trial(scene, run) for run in runs], scene.verdict.limits, films)


def counted_path(run: Replicate) -> tuple[Complex, float]:
    """Path of the cage's centre [m] over the counted turns, as the cage turns, and its samples a cage turn."""
    samples = int(run.traced[run.first :, 0].sum())
    path = run.cage_path[-samples:]
    forward = run.cage_angle[run.first :].sum() > 0.0
    return path if forward else path.conj(), samples / _cage_turns(run)


def _cage_turns(run: Replicate) -> float:
    return abs(float(run.cage_angle[run.first :].sum())) / (2.0 * math.pi)


def forced_orders(scene: Scene, speed: float) -> dict[str, float]:
    """Orders of forces on a cage of this speed [rad/s], over that speed: 1 of its imbalance, and of each ring that turns, with its load."""
    inner, outer = (ring / speed for ring in scene.operation.speeds)
    name = "shaft and its load" if scene.operation.rotating_load_N or scene.operation.unbalance else "shaft"
    return {"cage": 1.0, **{key: order for key, order in ((name, inner), ("outer ring", outer)) if order}}


def passing_orders(scene: Scene, speed: float) -> tuple[float, float]:
    """Orders at which rollers pass the load, forwards and backwards: load + Z (1 - load), the order of a load that stands still being 0."""
    rotates = scene.operation.rotating_load_N > scene.operation.radial_load_N
    load = scene.operation.speeds[0] / speed if rotates else 0.0
    passing = scene.bearing.rollers * (1.0 - load)
    return load + passing, load - passing


def _trial(scene: Scene, run: Replicate) -> Trial:
    """Orbit of a replicate and its forcing. A film between ring and cage drives an orbit at half the sum of their speeds at most."""
    path, samples_per_turn = counted_path(run)
    turns = _cage_turns(run)
    speed = float(run.cage_angle[run.first :].sum()) / run.duration
    rings = dict(zip(("inner", "outer"), scene.operation.speeds, strict=True))
    guide = rings.get(scene.cage.guidance, 0.0) / speed if scene.model.guide_land == "film" else 0.0
    energy = 0.5 * scene.geometry.cage_inertia * speed**2
    work = float(run.work[run.first :, RUBBING].sum())
    forcing = Forcing(tuple(forced_orders(scene, speed).values()), 0.5 * (1.0 + guide), work / (turns * energy))
    return Trial(mean_measures(path, scene.orbit_play_m, samples_per_turn), forcing)
