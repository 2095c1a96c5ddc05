"""Form errors and the path of the turning ring from a scene."""

import math

import numpy as np

from rbdyn.base.faults import InputError
from rbdyn.quasistatic.row.model import constraint_of, load_of, row_of
from rbdyn.quasistatic.runout import turn
from rbdyn.quasistatic.runout.lots import Bench
from rbdyn.quasistatic.runout.turn import PERFECT, RaceErrors, RingPath, Waviness, follow, waviness
from rbdyn.scene.ball import GROOVES, BallScene, FormErrors, RandomWaviness, SingleRowScene
from rbdyn.scene.bearing import Harmonic

# Largest number of steps times balls of a path; each needs 1.4 kB.
MOST_PLACES = 1_000_000


def follow_ring(scene: BallScene) -> RingPath:
    """Path of the inner ring of a scene over its form errors, with the turns and steps that they state.

    Raises InputError for a scene without form errors or of two rows, and RunError where an equilibrium is missing.
    """
    row = single_row(scene)
    if row.errors is None:
        raise InputError(["errors: missing; a bearing without form errors has no runout, add the table"])
    steps, turns, balls = row.errors.steps, row.errors.turns, row.bearing.balls
    if (places := steps * turns * balls) > MOST_PLACES:
        raise InputError(
            [
                f"errors.steps = {steps}, errors.turns = {turns}: with {balls} balls these are {places} places, more than the "
                f"{MOST_PLACES} that memory has room for; take fewer steps or turns"
            ]
        )
    bench = bench_of(row)
    path = turn.ball_path(errors_of(row.errors, balls), bench.turning, steps, turns)
    return follow(bench.row, bench.control, bench.load, path, turns, bench.constraint)


def bench_of(scene: BallScene, face_radius: float | None = None, steps: int = 120, turns: int = 2) -> Bench:
    """The nominal bearing of a scene under its load, with its runout measurement.

    ``face_radius``: radius at which an axial indicator touches the inner ring [m], by default that of its groove bottom.
    Raises InputError for two rows.
    """
    row = single_row(scene)
    model, bearing, (inner, outer) = row_of(row), row.bearing, row.operation.speeds
    sizes = bearing.ball_diameter, bearing.pitch_diameter, bearing.contact_angle
    # Turns are those of the inner ring relative to the outer ring, which stands if neither turns.
    turning = turn.rolling(*sizes, outer / (inner - outer) if inner != outer else 0.0)
    radius = model.row.lever - model.row.inner_groove_radius if face_radius is None else face_radius
    return Bench(model.row, model.control, load_of(row), turning, radius, steps, turns, constraint_of(row))


def single_row(scene: BallScene) -> SingleRowScene:
    """The scene, if of one row. Raises InputError."""
    if not isinstance(scene, SingleRowScene):
        raise InputError(
            ["bearing.kind = 'double_decker_ball': runout is for one row of balls only; choose such a bearing"]
        )
    return scene


def errors_of(errors: FormErrors, balls: int) -> RaceErrors:
    """Form errors of a scene in SI, with those drawn by its seed.

    Each kind of error has its own random stream, so that adding one does not change the others.
    """
    streams = [np.random.default_rng(child) for child in np.random.SeedSequence(errors.seed).spawn(8)]
    forms = {
        key.replace("side_", ""): _form(getattr(errors, key), getattr(errors, f"{key}_random"), draw)
        for key, draw in zip(GROOVES, streams, strict=False)
    }
    larger = errors.ball_diameter_errors(streams[6].standard_normal(balls))
    sphericity = [PERFECT] * balls
    for harmonic in errors.ball_sphericity:
        phases = streams[7].uniform(0.0, 2.0 * math.pi, balls)
        for ball in range(balls) if harmonic.balls is None else [number - 1 for number in harmonic.balls]:
            phase = phases[ball] if harmonic.phase is None else harmonic.phase
            wave = waviness((harmonic.order, harmonic.amplitude, phase))
            sphericity[ball] = sphericity[ball].plus(wave)
    return RaceErrors(larger, tuple(sphericity), **forms)


def _form(harmonics: list[Harmonic], random: RandomWaviness | None, draw: np.random.Generator) -> Waviness:
    form = waviness(*((wave.order, wave.amplitude, wave.phase) for wave in harmonics))
    if random is None:
        return form
    return form.plus(turn.random_waviness(random.lowest_order, random.highest_order, random.height, random.decay, draw))
