"""The right-hand side: against its numpy twin, and the symmetries that hold for any state."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass

import numpy as np
import pytest
from numpy_twin import twin

from rbdyn.dynamics.equations import LOSSES, SHAFT
from rbdyn.dynamics.model import roller_bearing

# Position round-off of 3e-18 m over the smallest approaches of the random states (some 1e-8 m) is 3e-10 of that
# contact's load, and 1e-10 of the largest force on a body.
TWIN = 1e-10
SEEDS = range(60)

# Between them every law: both guidances, film and dry land, all dampings, tractions, profiles and bars.
VARIANTS = {
    "default, outer": (),
    "inner": ("cage.guidance=inner",),
    "dry, profiled, Coulomb": (
        "bearing.roller_profile=logarithmic",
        "model.race_damping=hunt_crossley",
        "traction.model=coulomb",
        "model.pocket_bar_stiffness_N_m=rigid",
        "model.guide_land=dry",
    ),
    "no land, blended, undamped": (
        "cage.guidance=roller",
        "traction.mu_0=0.01",
        "model.race_damping=off",
        "model.pocket_damping_alpha_s_m=0.0",
        "model.rolling_resistance=off",
        "model.drag=off",
    ),
}


@dataclass(frozen=True)
class Blocks:
    """Slices of the state vector by body and kind."""

    rollers: int

    def __getitem__(self, name: str) -> slice:
        z = self.rollers
        ends = {
            "roller velocity": (0, 2 * z),
            "roller acceleration": (2 * z, 4 * z),
            "roller spin rate": (4 * z, 5 * z),
            "cage velocity": (5 * z, 5 * z + 3),
            "cage acceleration": (5 * z + 3, 5 * z + 5),
            "cage spin rate": (5 * z + 5, 5 * z + 6),
            "ring velocity": (5 * z + 6, 5 * z + 8),
            "ring acceleration": (5 * z + 8, 5 * z + 10),
        }
        return slice(*ends[name])


def twin_errors(scene, bearing, y, outcome):
    """Largest difference of each block from the twin, over the size of the block.

    A body's net force may be a small difference of large ones, so a block is measured by the largest of its entries
    and of the single forces that act on that body.
    """
    expected = twin(scene, y)
    blocks, wall, land = Blocks(bearing.rollers), expected.loads[0], expected.loads[3]
    lever = np.hypot(y[0], y[bearing.rollers])
    acting = {
        "roller velocity": 0.0,
        "roller acceleration": 0.0,
        "roller spin rate": 0.0,
        "cage velocity": 0.0,
        "cage acceleration": max(wall, land) / bearing.cage_mass,
        "cage spin rate": lever * wall / bearing.cage_inertia,
        "ring velocity": 0.0,
        "ring acceleration": max(bearing.radial_load, expected.loads[2]) / bearing.ring_mass,
    }
    errors = {}
    for name, size in acting.items():
        mine, theirs = outcome.dy[blocks[name]], expected.dy[blocks[name]]
        errors[name] = np.abs(mine - theirs).max() / max(size, np.abs(theirs).max(), 1e-300)
    for kind, names in (("power", (*LOSSES, "shaft")), ("loads", ("wall", "outer", "inner", "land"))):
        mine, theirs = getattr(outcome, kind), getattr(expected, kind)
        for name, a, b in zip(names, mine, theirs, strict=True):
            errors[name] = 0.0 if a == b else abs(a - b) / max(abs(b), 1e-300)
    return errors


@pytest.mark.parametrize("variant", VARIANTS)
def test_oracle_twin(variant, make_scene, evaluate, random_state):
    """Oracle: derivative, every power and every load agree with plain numpy, block by block."""
    scene = make_scene(*VARIANTS[variant])
    bearing = roller_bearing(scene)
    worst: dict[str, float] = {}
    for seed in SEEDS:
        y = random_state(scene, seed)
        for name, error in twin_errors(scene, bearing, y, evaluate(bearing, y)).items():
            worst[name] = max(worst.get(name, 0.0), error)
    assert {name: error for name, error in worst.items() if not error < TWIN} == {}


def test_oracle_states_cover_every_contact(outer, evaluate, random_state):
    """Unit: the random states do open and close each kind of contact, the film alone and the dry land included."""
    bearing = roller_bearing(outer)
    closed = np.array([evaluate(bearing, random_state(outer, seed)).loads > 0.0 for seed in SEEDS])
    assert closed.any(axis=0).all()
    assert (~closed[:, [3]]).any(), "the land is dry in every state"


@pytest.mark.parametrize("fixture", ["outer", "inner"])
def test_invariant_action_equals_reaction(fixture, request, evaluate, random_state):
    """Invariant: forces and moments of all bodies together are those of load, drag, outer ring and prescribed shaft."""
    scene = request.getfixturevalue(fixture)
    bearing = roller_bearing(scene)
    blocks, z = Blocks(bearing.rollers), bearing.rollers
    for seed in range(20):
        y = random_state(scene, seed)
        with_outer = evaluate(bearing, y)
        # The fixed outer ring is the one body without equations of motion: a raceway out of reach removes it.
        still = bearing.outer._replace(radius=1.0, rolling=bearing.outer.rolling._replace(force_scale=0.0))
        away = bearing._replace(outer=still, drag=bearing.drag._replace(factor=0.0))
        if fixture == "outer":
            away = away._replace(guide=out_of_reach(bearing.guide))
        alone = evaluate(away, y)
        force = bearing.roller_mass * alone.dy[blocks["roller acceleration"]].reshape(2, z).sum(axis=1)
        force += bearing.cage_mass * alone.dy[blocks["cage acceleration"]]
        force += bearing.ring_mass * alone.dy[blocks["ring acceleration"]]
        # Round-off of a sum of some forty forces of up to a few hundred newtons.
        size = with_outer.loads.max() + bearing.radial_load
        assert force == pytest.approx((bearing.radial_load, 0.0), abs=1e-12 * size)

        position, acceleration = (
            y[: 2 * z].reshape(2, z),
            alone.dy[blocks["roller acceleration"]].reshape(2, z),
        )
        moment = bearing.roller_mass * cross(position, acceleration).sum()
        moment += bearing.roller_inertia * alone.dy[blocks["roller spin rate"]].sum()
        moment += bearing.cage_mass * cross(y[5 * z : 5 * z + 2], alone.dy[blocks["cage acceleration"]])
        moment += bearing.cage_inertia * alone.dy[5 * z + 5]
        ring = y[5 * z + 6 : 5 * z + 8]
        moment += bearing.ring_mass * cross(ring, alone.dy[blocks["ring acceleration"]])
        # The ring's spin is prescribed: the shaft must supply the moment that the contacts take from it.
        moment += -alone.power[SHAFT] / bearing.ring_speed
        assert moment == pytest.approx(cross(ring, (bearing.radial_load, 0.0)), abs=1e-12 * size)


def out_of_reach(guide):
    """The same land with neither film nor contact in reach."""
    return guide._replace(
        film=guide.film._replace(force_scale=0.0, shear_scale=0.0), dry=guide.dry._replace(play=1.0)
    )


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


@pytest.mark.parametrize("fixture", ["outer", "inner"])
def test_invariant_power_is_force_times_velocity(fixture, request, evaluate, random_state):
    """Invariant: shaft power = losses + rate of change of kinetic and elastic energy, at every instant."""
    from rbdyn.dynamics.equations import mechanical_energy

    scene = request.getfixturevalue(fixture)
    bearing = roller_bearing(scene)
    for seed in range(10):
        y = random_state(scene, seed)
        outcome = evaluate(bearing, y)
        # Central difference along the flow, in the direction of dy; 1e-12 s moves contacts by 1e-11 m of 1e-6.
        step = 1e-11
        rate = sum(mechanical_energy(bearing, y + step * outcome.dy))
        rate = (rate - sum(mechanical_energy(bearing, y - step * outcome.dy))) / (2.0 * step)
        gap = outcome.power[SHAFT] - outcome.power[:SHAFT].sum() - rate
        # Round-off of 20 J over a step of 1e-11 s is 4e-4 W; the flow's own powers are kilowatts.
        assert abs(gap) < 1e-5 * np.abs(bearing.roller_mass * outcome.dy[20:40] * y[20:40]).sum() + 1e-2


@pytest.mark.parametrize("fixture", ["outer", "inner"])
def test_invariant_no_loss_is_negative(fixture, request, evaluate, random_state):
    """Invariant: each law takes power from the motion, whatever the state."""
    scene = request.getfixturevalue(fixture)
    bearing = roller_bearing(scene)
    for seed in SEEDS:
        outcome = evaluate(bearing, random_state(scene, seed))
        assert (outcome.power[:SHAFT] >= 0.0).all()
        assert (outcome.loads >= 0.0).all()


@pytest.mark.parametrize("angle", [0.3, 2.0, -1.1])
def test_invariant_rotation(angle, outer, evaluate, random_state):
    """Invariant: a turned state has the turned derivative; the load, fixed along x, is taken away."""
    bearing = roller_bearing(outer)._replace(radial_load=0.0)
    z = bearing.rollers
    c, s = np.cos(angle), np.sin(angle)

    def turn(vector, state):
        turned = vector.copy()
        pairs = [(slice(0, z), slice(z, 2 * z)), (slice(2 * z, 3 * z), slice(3 * z, 4 * z))]
        pairs += [
            (slice(5 * z + i, 5 * z + i + 1), slice(5 * z + i + 1, 5 * z + i + 2)) for i in (0, 3, 6, 8)
        ]
        for x, y in pairs:
            turned[x], turned[y] = c * vector[x] - s * vector[y], s * vector[x] + c * vector[y]
        turned[5 * z + 2] += angle if state else 0.0
        return turned

    for seed in range(10):
        y = random_state(outer, seed)
        compare(bearing, evaluate(bearing, turn(y, True)), turn(evaluate(bearing, y).dy, False))


def test_invariant_mirror(outer, evaluate, random_state):
    """Invariant: reflected in the load axis, with every spin and the shaft reversed, nothing else changes."""
    bearing = roller_bearing(outer)
    z = bearing.rollers
    mirrored = bearing._replace(ring_speed=-bearing.ring_speed)
    sign = np.ones(5 * z + 10)
    sign[z : 2 * z] = sign[3 * z : 5 * z] = -1.0
    sign[5 * z + np.array([1, 2, 4, 5, 7, 9])] = -1.0
    order = np.arange(5 * z + 10)
    # Roller j, at the cage angle plus 2 pi j/Z, goes to minus that: it is roller -j of the mirrored cage.
    swap = (-np.arange(z)) % z
    for part in range(5):
        order[part * z : (part + 1) * z] = part * z + swap
    for seed in range(10):
        y = random_state(outer, seed)
        image, original = evaluate(mirrored, (sign * y)[order]), evaluate(bearing, y)
        compare(bearing, image, (sign * original.dy)[order])
        # Powers and loads have no handedness.
        assert image.power == pytest.approx(original.power, rel=1e-9, abs=1e-9)


def test_invariant_permutation(inner, evaluate, random_state):
    """Invariant: renaming the rollers by one pocket, with the cage a pocket further, changes only names."""
    bearing = roller_bearing(inner)
    z = bearing.rollers
    order = np.arange(5 * z + 10)
    for part in range(5):
        order[part * z : (part + 1) * z] = part * z + (np.arange(z) + 1) % z
    for seed in range(10):
        y = random_state(inner, seed)
        renamed = y[order]
        renamed[5 * z + 2] += 2.0 * np.pi / z
        compare(bearing, evaluate(bearing, renamed), evaluate(bearing, y).dy[order])


def compare(bearing, outcome, expected):
    """Equal to the round-off of positions (3e-18 m) over approaches (1e-8 m and more), relative to each block."""
    blocks = Blocks(bearing.rollers)
    for name in ("roller acceleration", "roller spin rate", "cage acceleration", "ring acceleration"):
        mine, theirs = outcome.dy[blocks[name]], expected[blocks[name]]
        assert np.abs(mine - theirs).max() < 1e-8 * np.abs(theirs).max() + 1e-9, name


INTERPRETED = """
import json, sys
sys.path.insert(0, sys.argv[1])
from conftest import make, right_hand_side, state_near_contact
from rbdyn.dynamics.model import roller_bearing
out = []
for assignments in json.loads(sys.argv[2]):
    scene = make(*assignments)
    bearing = roller_bearing(scene)
    for seed in range(6):
        found = right_hand_side(bearing, state_near_contact(scene, seed))
        out.append([list(part) for part in found])
print(json.dumps(out))
"""


def interpreted(variants):
    """The same right-hand side run by the Python interpreter, in a process where nothing is compiled."""
    found = subprocess.run(
        [
            sys.executable,
            "-c",
            INTERPRETED,
            os.path.dirname(__file__),
            json.dumps([list(v) for v in variants]),
        ],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(found.stdout)


def test_unit_compiled_equals_interpreted(make_scene, evaluate, random_state):
    """Unit: machine code and interpreter agree; contraction and the fast elementary functions cost a few ulps."""
    found = iter(interpreted(VARIANTS.values()))
    for assignments in VARIANTS.values():
        scene = make_scene(*assignments)
        bearing = roller_bearing(scene)
        for seed in range(6):
            dy, power, loads = map(np.array, next(found))
            outcome = evaluate(bearing, random_state(scene, seed))
            compare(bearing, outcome, dy)
            # As for the twin: round-off of position over approach.
            assert outcome.power == pytest.approx(power, rel=1e-9, abs=1e-9)
            assert outcome.loads == pytest.approx(loads, rel=1e-9)


# What each switch must silence.
SWITCHES = {
    ("traction.model=off",): {"outer_race_traction", "inner_race_traction"},
    ("model.rolling_resistance=off",): {"rolling_resistance"},
    ("model.race_damping=off",): {"race_damping"},
    ("model.pocket_friction=0.0",): {"pocket_friction"},
    ("model.pocket_damping_alpha_s_m=0.0",): {"pocket_damping"},
    ("model.pocket=off",): {"pocket_friction", "pocket_damping"},
    ("model.guide_land=dry",): {"land_film"},
    ("model.guide_land=off",): {"land_film", "land_friction", "land_damping"},
    ("cage.guidance=roller",): {"land_film", "land_friction", "land_damping"},
    ("model.land_friction=0.0",): {"land_friction"},
    ("model.land_damping_alpha_s_m=0.0",): {"land_damping"},
    ("model.drag=off",): {"roller_drag"},
}


def test_unit_each_switch_silences_its_own_power():
    """Unit: a law that is off loses exactly nothing, and every other power is there in some state."""
    found = iter(interpreted(SWITCHES))
    for assignments, silent in SWITCHES.items():
        power = np.abs([next(found)[1] for _ in range(6)]).max(axis=0)[:SHAFT]
        assert {name for name, value in zip(LOSSES, power, strict=True) if value == 0.0} == silent, (
            assignments
        )
