"""From a scene with form errors to the path of its turning ring."""

import math

import numpy as np

from rbdyn.base.faults import InputError
from rbdyn.quasistatic.row.model import given_of, load_of, row_of
from rbdyn.quasistatic.runout import race_errors
from rbdyn.quasistatic.runout.lots import Bench
from rbdyn.quasistatic.runout.race_errors import PERFECT, RaceErrors, Waviness, waviness
from rbdyn.quasistatic.runout.turn import Followed, follow
from rbdyn.scene.ball import GROOVES, BallScene, FormErrors, RandomWaviness, SingleRowScene
from rbdyn.scene.bearing import Harmonic

# Steps times balls of a path: 1.4 kB each while it is made.
MOST_PLACES = 1_000_000


def follow_ring(scene: BallScene) -> Followed:
    """Follow the inner ring of a scene over its form errors, as many turns and steps as they say.

    Raises InputError for a scene without form errors or of two rows, and RunError where an equilibrium is missing.
    """
    row = single_row(scene)
    if row.errors is None:
        raise InputError(["errors: missing; a bearing without form errors has no runout, add the table"])
    steps, turns, balls = row.errors.steps, row.errors.turns, row.bearing.balls
    if (places := steps * turns * balls) > MOST_PLACES:
        many = f"errors.steps = {steps}, errors.turns = {turns}: of {balls} balls these make {places} places"
        raise InputError([f"{many}, more than the {MOST_PLACES} that memory has room for; take fewer steps or turns"])
    test = bench_of(row)
    path = race_errors.ball_path(errors_of(row.errors, balls), test.turning, steps, turns)
    return follow(test.row, test.control, test.load, path, turns, test.given)


def bench_of(scene: BallScene, face_radius: float | None = None, steps: int = 120, turns: int = 2) -> Bench:
    """The nominal bearing of a scene under its load, and where its runout is read.

    ``face_radius``: where an axial indicator touches the inner ring [m]; the radius of its groove bottom where left out.
    Raises InputError for two rows.
    """
    row = single_row(scene)
    model, bearing, (inner, outer) = row_of(row), row.bearing, row.operation.speeds
    sizes = bearing.ball_diameter, bearing.pitch_diameter, bearing.contact_angle
    # Turns are those of the inner ring against the outer, which stands where neither turns.
    turning = race_errors.rolling(*sizes, outer / (inner - outer) if inner != outer else 0.0)
    radius = model.row.lever - model.row.inner_groove_radius if face_radius is None else face_radius
    return Bench(model.row, model.control, load_of(row), turning, radius, steps, turns, given_of(row))


def single_row(scene: BallScene) -> SingleRowScene:
    """The scene, if of one row. Raises InputError."""
    if not isinstance(scene, SingleRowScene):
        raise InputError(["bearing.kind = 'double_decker_ball': runout is followed for one row of balls only"])
    return scene


def errors_of(errors: FormErrors, balls: int) -> RaceErrors:
    """Form errors of a scene in SI, with what its seed draws.

    Each kind of error draws from a stream of its own, so that adding one leaves the others as they were.
    """
    streams = [np.random.default_rng(child) for child in np.random.SeedSequence(errors.seed).spawn(8)]
    forms = {
        key.replace("side_", ""): _form(getattr(errors, key), getattr(errors, f"{key}_random"), draw)
        for key, draw in zip(GROOVES, streams, strict=False)
    }
    larger = errors.ball_diameter_errors(streams[6].standard_normal(balls))
    sphericity = [PERFECT] * balls
    for harmonic in errors.ball_sphericity:
        drawn = streams[7].uniform(0.0, 2.0 * math.pi, balls)
        for ball in range(balls) if harmonic.balls is None else [number - 1 for number in harmonic.balls]:
            phase = drawn[ball] if harmonic.phase is None else harmonic.phase
            wave = waviness((harmonic.order, harmonic.amplitude, phase))
            sphericity[ball] = sphericity[ball].plus(wave)
    return RaceErrors(larger, tuple(sphericity), **forms)


def _form(given: list[Harmonic], drawn: RandomWaviness | None, draw: np.random.Generator) -> Waviness:
    form = waviness(*((wave.order, wave.amplitude, wave.phase) for wave in given))
    if drawn is None:
        return form
    return form.plus(
        race_errors.random_waviness(drawn.lowest_order, drawn.highest_order, drawn.height, drawn.decay, draw)
    )
