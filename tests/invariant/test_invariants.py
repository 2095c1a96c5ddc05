"""What holds for any state and any path: symmetries, momentum, power. Scenes of every make are tried interpreted."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.forces.equations import mechanical_energy
from rbdyn.dynamics.forces.races import unequal_rollers
from rbdyn.dynamics.forces.schedule import ClockedDrive, SmoothRamps
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import layout_of
from rbdyn.dynamics.run import Run
from rbdyn.losses import LOAD, SHAFT

HELPERS = Path(__file__).parents[1] / "helpers"
INTERPRETED = (HELPERS / "interpreted_invariants.py", HELPERS / "interpreted_leave_out.py")
SCENES = pytest.mark.parametrize("fixture", ["outer", "inner", "everything"])


def test_invariant_over_scenes_of_every_make():
    """Invariant, agreement: ``interpreted_invariants`` and ``interpreted_leave_out``, in a process where nothing is compiled."""
    found = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *INTERPRETED],
        cwd=HELPERS.parents[1],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert found.returncode == 0, found.stdout + found.stderr


KNOWN: dict[str, Any] = {}


def built(scene):
    """The bearing of a scene, built once: a traction table takes most of a second."""
    key = scene.model_dump_json()
    if key not in KNOWN:
        KNOWN[key] = roller_bearing(scene)
    return KNOWN[key]


def equal(scene, mine, theirs):
    """Equal derivatives, to the round-off of positions (3e-18 m) over approaches (1e-8 m), relative to each block.

    Torques on the cage can cancel. Its spin is as exact as the forces on the pitch circle, so its scale is theirs too.
    """
    z, parts = scene.bearing.rollers, layout_of(scene)
    cage, spin = slice(5 * z + 3, 5 * z + 5), slice(5 * z + 5, 5 * z + 6)
    pitch_radius = 0.5e-3 * scene.bearing.pitch_diameter_mm
    blocks = [slice(2 * z, 4 * z), slice(4 * z, 5 * z), cage, spin, slice(5 * z + 8, 5 * z + 10)]
    if parts.support is not None:
        blocks.append(slice(parts.support + 2, parts.support + 4))
    for block in blocks:
        scale = np.abs(theirs[block]).max()
        if block == spin:
            scale = max(scale, np.abs(theirs[cage]).max() / pitch_radius)
        assert np.abs(mine[block] - theirs[block]).max() < 1e-8 * scale + 1e-9, block


def pairs_of(scene):
    """Indices of the x and y components of every vector in the state."""
    z, parts = scene.bearing.rollers, layout_of(scene)
    x = [*range(z), *range(2 * z, 3 * z), *(5 * z + np.array([0, 3, 6, 8]))]
    y = [*range(z, 2 * z), *range(3 * z, 4 * z), *(5 * z + np.array([1, 4, 7, 9]))]
    if parts.support is not None:
        x += [parts.support, parts.support + 2]
        y += [parts.support + 1, parts.support + 3]
    return np.array(x), np.array(y)


def without_load(drive):
    """The same drive, whose standing load, fixed along x, is taken away; a load that turns with the shaft stays."""
    if isinstance(drive, ClockedDrive):
        return drive._replace(load=SmoothRamps(drive.load.time, 0.0 * drive.load.value))
    return drive._replace(load_x=0.0)


@SCENES
@given(angle=st.floats(-3.0, 3.0), seed=st.integers(0, 10**6))
@settings(max_examples=40, deadline=None)
def test_invariant_rotation(fixture, angle, seed, request, evaluate, random_state):
    """Invariant: a turned state, with tilt and weight turned, has the turned derivative and the same powers."""
    scene = request.getfixturevalue(fixture)
    bearing = built(scene)
    bearing = turned_bearing = bearing._replace(drive=without_load(bearing.drive))
    (x, y), parts, c, s = pairs_of(scene), layout_of(scene), np.cos(angle), np.sin(angle)
    if fixture == "everything":
        gravity = bearing.gravity
        turned_bearing = bearing._replace(
            gravity=gravity._replace(x=c * gravity.x - s * gravity.y, y=s * gravity.x + c * gravity.y),
            outer=turned_race(bearing.outer, c, s),
            inner=turned_race(bearing.inner, c, s),
        )

    def turn(vector, moved):
        result = vector.copy()
        result[x], result[y] = c * vector[x] - s * vector[y], s * vector[x] + c * vector[y]
        result[5 * scene.bearing.rollers + 2] += moved
        if parts.clock is not None:
            result[parts.clock + 1 :] += moved
        return result

    state = random_state(scene, seed)
    original, image = evaluate(bearing, state), evaluate(turned_bearing, turn(state, angle))
    equal(scene, image.dy, turn(original.dy, 0.0))
    assert image.power == pytest.approx(original.power, rel=1e-8, abs=1e-6)
    assert image.loads == pytest.approx(original.loads, rel=1e-8)


def turned_race(race, c, s):
    """A race whose tilt points elsewhere."""
    x, y = race.contact.direction_x, race.contact.direction_y
    return race._replace(contact=race.contact._replace(direction_x=c * x - s * y, direction_y=s * x + c * y))


@SCENES
@given(seed=st.integers(0, 10**6))
@settings(max_examples=30, deadline=None)
def test_invariant_mirror(fixture, seed, request, make_scene, evaluate, random_state):
    """Invariant: reflected in the load axis, with every speed and angle reversed, nothing else changes."""
    scene = request.getfixturevalue(fixture)
    z, parts = scene.bearing.rollers, layout_of(scene)
    mirrored = mirror(scene)
    sign = np.ones(parts.size)
    sign[pairs_of(scene)[1]] = sign[4 * z : 5 * z] = -1.0
    sign[5 * z + np.array([2, 5])] = -1.0
    if parts.clock is not None:
        sign[parts.clock + 1 :] = -1.0
    # Roller j, at the cage angle plus 2 pi j/Z, goes to minus that: it is roller -j of the mirrored cage.
    order = np.arange(parts.size)
    for part in range(5):
        order[part * z : (part + 1) * z] = part * z + (-np.arange(z)) % z
    y = random_state(scene, seed)
    original = evaluate(built(scene), y)
    image = evaluate(built(mirrored), (sign * y)[order])
    equal(scene, image.dy, (sign * original.dy)[order])
    # Powers and loads have no handedness.
    assert image.power == pytest.approx(original.power, rel=1e-8, abs=1e-6)
    assert image.loads == pytest.approx(original.loads, rel=1e-8)


def mirror(scene):
    """The scene as seen in a mirror that holds the load axis."""
    bearing, operation = scene.bearing, scene.operation
    errors = bearing.roller_diameter_errors_um
    changes = {
        "tilt_direction_deg": -bearing.tilt_direction_deg,
        "roller_diameter_errors_um": None if errors is None else [errors[0], *errors[:0:-1]],
    }
    for key in ("outer_waviness", "inner_waviness"):
        waves = getattr(bearing, key)
        changes[key] = [wave.model_copy(update={"phase_deg": -wave.phase_deg}) for wave in waves]
    turned = {key: -getattr(operation, key) for key in ("inner_speed_rpm", "outer_speed_rpm", "gravity_direction_deg")}
    if operation.schedule is not None:
        speeds = [-speed for speed in operation.schedule.inner_speed_rpm]
        turned["schedule"] = operation.schedule.model_copy(update={"inner_speed_rpm": speeds})
    return scene.model_copy(
        update={"bearing": bearing.model_copy(update=changes), "operation": operation.model_copy(update=turned)}
    )


@SCENES
@given(seed=st.integers(0, 10**6), steps=st.integers(1, 9))
@example(seed=152076, steps=6)  # torques on the cage nearly cancel
@settings(max_examples=30, deadline=None)
def test_invariant_permutation(fixture, seed, steps, request, evaluate, random_state):
    """Invariant: rollers renamed by some pockets, with the cage so much further, change only names."""
    scene = request.getfixturevalue(fixture)
    bearing = renamed = built(scene)
    z, parts = bearing.rollers, layout_of(scene)
    swap = (np.arange(z) + steps) % z
    if fixture == "everything":
        # The centre of mass lies by the first pocket, whichever that is.
        bearing = bearing._replace(cage=bearing.cage._replace(offset=0.0))
        renamed = bearing._replace(sizes=unequal_rollers(bearing.sizes.radii[swap]))
    order = np.arange(parts.size)
    for part in range(5):
        order[part * z : (part + 1) * z] = part * z + swap
    y = random_state(scene, seed)
    image = y[order]
    image[5 * z + 2] += 2.0 * np.pi * steps / z
    original, found = evaluate(bearing, y), evaluate(renamed, image)
    equal(scene, found.dy, original.dy[order])
    assert found.power == pytest.approx(original.power, rel=1e-8, abs=1e-6)


def test_invariant_momentum_without_external_force(everything):
    """Invariant: freed from load, weight, drag and support, rollers, cage and rings keep their momentum on any path.

    A sum over the state with constant weights, which a Runge-Kutta method keeps to the round-off of its sums.
    """
    run = Run(everything, roller_bearing(everything), 0, 1e-3, Stop())
    bearing = run.bearing
    run.bearing = free = bearing._replace(
        drive=without_load(bearing.drive)._replace(rotating_load=0.0, unbalance=0.0),
        gravity=bearing.gravity._replace(x=0.0, y=0.0),
        drag=bearing.drag._replace(factor=0.0),
        outer_ring=bearing.outer_ring._replace(stiffness=0.0, damping=0.0),
        cage=bearing.cage._replace(offset=0.0),
    )
    z = free.rollers

    def momentum():
        y = run.carry.y
        sums = [y[2 * z : 3 * z].sum(), y[3 * z : 4 * z].sum()]
        total = free.roller_mass * np.array(sums) + free.cage.mass * y[5 * z + 3 : 5 * z + 5]
        return total + free.inner_ring_mass * y[5 * z + 8 : 5 * z + 10] + free.outer_ring.mass * y[62:64]

    start, speeds = momentum(), np.abs(run.carry.y[2 * z : 4 * z]).sum()
    run.to(0.5)
    assert np.abs(run.carry.y[62:64]).max() > 1e-3, "the outer ring has not moved"
    assert np.abs(momentum() - start).max() < 1e-12 * free.roller_mass * speeds * run.steps**0.5


def test_invariant_power_balance_with_every_law(everything):
    """Invariant: work of shafts and loads = losses + change of energy over a path, the better the tighter the tolerance."""
    level = everything.model_copy(update={"bearing": everything.bearing.model_copy(update={"tilt_mrad": 1e-9})})
    gaps = []
    for rtol in (1e-2, 1e-3, 1e-4):
        run = Run(level, roller_bearing(level), 0, rtol, Stop())
        start = sum(mechanical_energy(run.bearing, run.carry.y))
        run.to(1.0)
        change = sum(mechanical_energy(run.bearing, run.carry.y)) - start
        put_in = run.tally.work[SHAFT] + run.tally.work[LOAD]
        gaps.append(abs(put_in - run.tally.work[:SHAFT].sum() - change) / abs(put_in))
    assert gaps[0] < 0.005 and gaps[2] < 1e-4
    assert gaps[2] < gaps[0]
