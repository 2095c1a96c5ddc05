"""The right-hand side: against its numpy twin, compiled against interpreted, and what each switch silences."""

import json
import os
import subprocess
import sys
from dataclasses import dataclass

import numpy as np
import pytest
from conftest import EVERYTHING, ROOT, UNSAMPLED
from numpy_twin import POWERS, twin

from rbdyn.dynamics.forces.equations import pocket_loads
from rbdyn.dynamics.forces.race_lanes import scratch
from rbdyn.dynamics.forces.state import LOADS, POCKET_CONTACT_LOAD, POCKET_LOAD
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import needs_clock
from rbdyn.losses import POWER_TERMS, SHAFT

# Position round-off of 3e-18 m over the smallest approaches of the random states (some 1e-8 m) is 3e-10 of that
# contact's load, and 1e-10 of the largest force on a body.
TWIN = 1e-10
# A traction table misses the rheology by some 1e-6 within its range of loads. Below it, at less than ten newtons, its
# coefficient stays constant: in a state whose outer contacts are all so light, their small powers are off by a
# hundredth.
TABLE = {
    "roller acceleration": 1e-5, "roller spin rate": 2e-4, "ring acceleration": 1e-5, "support acceleration": 1e-5,
    "outer_race_traction": 2e-2, "inner_race_traction": 2e-4, "shaft": 2e-4,
}  # fmt: skip
# The film's polynomials are within 2e-5 of its push, 9e-5 of its rolling force and 3e-3 of its shear.
FILM = {
    "roller acceleration": 1e-5, "roller spin rate": 1e-3, "cage acceleration": 1e-3, "cage spin rate": 1e-3,
    "pocket_film": 5e-3, "wall": 5e-5, "pocket_force": 5e-5, "pocket_squeeze": 5e-5,
}  # fmt: skip
# The polynomials of a film that a layer feeds are within 1e-5 of the flooded one; its layer within the round-off of static loads.
LAYER = {
    "roller acceleration": 1e-7, "roller spin rate": 1e-5, "ring acceleration": 1e-9, "inner_race_traction": 1e-5,
    "rolling_resistance": 1e-5, "inner_rolling": 1e-4, "shaft": 1e-5,
}  # fmt: skip
SEEDS = range(60)

# Compiled: between them every body of every law that the race contacts hold.
VARIANTS = {
    "default, outer": (),
    "inner": ("cage.guidance=inner",),
    "dry, profiled, Coulomb": (
        "bearing.roller_profile=logarithmic",
        "model.line_contact=iso16281",
        "model.race_damping=hunt_crossley",
        "traction.model=coulomb",
        "model.pocket_bar_stiffness_N_m=rigid",
        "model.guide_land=dry",
        UNSAMPLED,
    ),
    "lips, blended, undamped, both rings turn": (
        "cage.guidance=roller",
        "cage.pocket_radial_clearance_mm=0.06",
        "operation.outer_speed_rpm=9000.0",
        "model.line_contact=houpert",
        "traction.mu_0=0.01",
        "model.race_damping=off",
        "model.pocket_damping_alpha_s_m=0.0",
        "model.rolling_resistance=off",
        "model.drag=off",
        UNSAMPLED,
    ),
    "one race wavy": (UNSAMPLED, "bearing.outer_waviness=[{order=2, amplitude_um=10.0, phase_deg=30.0}]"),
    "everything": EVERYTHING,
}
SUPPORT = ("support.stiffness_N_m=2e7", "support.damping_N_s_m=5e3")
WAVY = ("bearing.outer_waviness=[{order=11, amplitude_um=1.0, phase_deg=15.0}]",)
# Interpreted: the other ways in which laws meet.
MEETINGS = {
    "everything, exact traction": (*EVERYTHING, "traction.model=four_constant"),
    "inner guide on a support, held steps": (
        "cage.guidance=inner",
        *SUPPORT,
        "operation.outer_speed_rpm=-20000.0",
        "operation.schedule.time_s=[0.001, 0.004]",
        "operation.schedule.inner_speed_rpm=[24000.0, 18000.0]",
        "operation.schedule.shape=step",
        "cage.imbalance_um=80.0",
        "bearing.roller_diameter_spread_um=0.7",
    ),
    "lips with film and restitution": (
        "cage.guidance=roller",
        "cage.pocket_radial_clearance_mm=0.08",
        "model.pocket_film=true",
        "model.pocket_fill=0.3",
        "cage.pocket_contact_length_mm=2.5",
        "model.pocket_restitution=0.6",
        "operation.gravity_m_s2=9.81",
    ),
    "profile table on a tilt, straight ramps": (
        "bearing.roller_profile=table",
        "bearing.profile_table_mm_um=[[0.5, 0.0], [1.2, 0.8], [1.75, 3.0]]",
        "bearing.tilt_mrad=-1.5",
        "model.slices=17",
        "model.line_contact=houpert",
        "operation.schedule.time_s=[0.0, 0.002, 0.008]",
        "operation.schedule.radial_load_N=[500.0, 1500.0, 800.0]",
        "operation.schedule.shape=linear",
        "model.land_restitution=0.4",
    ),
    "Lundberg profile, standing wavy race": (
        "bearing.roller_profile=lundberg",
        "bearing.lundberg_load_N=900.0",
        "model.line_contact=iso16281",
        "model.race_damping=hunt_crossley",
        *WAVY,
    ),
    "constants, mounting, mixed": (
        "traction.constants=[-0.03, 0.2, 1.1, 0.04]",
        "traction.friction=mixed",
        "lubricant.roller_roughness_um=0.2",
        "lubricant.viscosity_mPas=4.0",
        "mounting.bore_mm=27.0",
        "mounting.outside_diameter_mm=60.0",
        "mounting.housing_diameter_mm=90.0",
        "mounting.inner_interference_um=12.0",
        "model.land_fill=0.4",
    ),
    "starved inlets, open films": ("lubricant.inlet_distance=3.0", "model.rolling_resistance_factor=0.8", "model.open_contact_film=true"),
    "tangential elasticity, clock": (
        "traction.elasticity=true",
        "model.open_contact_film=true",
        "bearing.roller_diameter_spread_um=0.7",
        "operation.rotating_load_N=300.0",
        *SUPPORT,
    ),
    "rotating load": ("operation.rotating_load_N=700.0", "operation.radial_load_N=100.0"),
}  # fmt: skip
TABLES = {
    "Eyring": ("traction.model=eyring", "lubricant.pressure_coefficient_1_GPa=9.0"),
    "limiting shear, starved": ("traction.model=limiting_shear", "lubricant.inlet_distance=10.0"),
}


@dataclass(frozen=True)
class Blocks:
    """Slices of the state vector by body and kind."""

    rollers: int
    supported: bool = False
    clocked: bool = False

    def __getitem__(self, name: str) -> slice:
        z, end = self.rollers, 5 * self.rollers + 10
        clock = end + 4 * self.supported
        ends = {
            "roller velocity": (0, 2 * z),
            "roller acceleration": (2 * z, 4 * z),
            "roller spin rate": (4 * z, 5 * z),
            "cage velocity": (5 * z, 5 * z + 3),
            "cage acceleration": (5 * z + 3, 5 * z + 5),
            "cage spin rate": (5 * z + 5, 5 * z + 6),
            "ring velocity": (5 * z + 6, 5 * z + 8),
            "ring acceleration": (5 * z + 8, 5 * z + 10),
            "support velocity": (end, clock - 2 * self.supported),
            "support acceleration": (clock - 2 * self.supported, clock),
            "clock": (clock, clock + 3 * self.clocked),
            "coefficients": (clock + 3 * self.clocked, None),
        }
        return slice(*ends[name])


def twin_errors(scene, bearing, y, outcome):
    """Largest difference of each block from the twin, over the size of the block.

    A body's net force may be a small difference of large ones, so a block is measured by the largest of its entries
    and of the single forces that act on that body.
    """
    expected = twin(scene, y)
    blocks, (wall, at_outer, at_inner, land, _) = (
        Blocks(bearing.rollers, scene.support is not None, needs_clock(scene)),
        expected.loads,
    )
    lever = np.hypot(y[0], y[bearing.rollers])
    support = scene.support.outer_ring_mass_kg if scene.support else np.inf
    acting = {
        "roller velocity": 0.0,
        "roller acceleration": 0.0,
        "roller spin rate": 0.0,
        "cage velocity": 0.0,
        "cage acceleration": max(wall, land) / bearing.cage.mass,
        "cage spin rate": lever * wall / bearing.cage.inertia,
        "ring velocity": 0.0,
        "ring acceleration": max(scene.operation.radial_load_N, at_inner) / bearing.inner_ring_mass,
        "support velocity": 0.0,
        "support acceleration": at_outer / support,
        "clock": 0.0,
        "coefficients": 0.0,
    }
    errors = {}
    for name, size in acting.items():
        mine, theirs = outcome.dy[blocks[name]], expected.dy[blocks[name]]
        errors[name] = np.abs(mine - theirs).max(initial=0.0) / max(size, np.abs(theirs).max(initial=0.0), 1e-300)
    for kind, names in (("power", POWERS), ("loads", ("wall", "outer", "inner", "land", "contact"))):
        mine, theirs = getattr(outcome, kind), getattr(expected, kind)
        for name, a, b in zip(names, mine, theirs, strict=True):
            errors[name] = 0.0 if a == b else abs(a - b) / max(abs(b), 1e-300)
    # The net shaft power may be a small difference of what is lost and what is stored.
    errors["shaft"] *= abs(expected.power[SHAFT]) / np.abs(expected.power).max()
    return errors


def refused(scene, outcomes, random_state, tolerances):
    """Blocks of outcomes of seeds 0, 1, ... that differ from the twin by more than they may."""
    bearing, worst = roller_bearing(scene), {}
    for seed, outcome in enumerate(outcomes):
        for name, error in twin_errors(scene, bearing, random_state(scene, seed), outcome).items():
            worst[name] = max(worst.get(name, 0.0), error)
    return {name: error for name, error in worst.items() if not error < tolerances.get(name, TWIN)}


def fed(scene):
    """Whether a layer feeds the films at open contacts."""
    return scene.model.open_contact_film and scene.lubricant.inlet_distance is not None


def test_unit_twin_names_the_powers():
    """Unit: the twin's own list of powers is that of the equations."""
    assert (*POWER_TERMS, "shaft", "load", "inner_rolling", "pocket_force", "pocket_squeeze") == tuple(POWERS)


@pytest.mark.parametrize("variant", VARIANTS)
def test_oracle_twin(variant, make_scene, evaluate, random_state):
    """Oracle: derivative, every power and every load agree with plain numpy, block by block."""
    scene = make_scene(*VARIANTS[variant])
    bearing = roller_bearing(scene)
    outcomes = (evaluate(bearing, random_state(scene, seed)) for seed in SEEDS)
    tolerances = FILM | TABLE if variant == "everything" else {}
    assert refused(scene, outcomes, random_state, tolerances) == {}


@pytest.mark.parametrize("rollers", [2, 7, 8, 9, 16, 17, 33])
def test_oracle_twin_for_any_number_of_rollers(rollers, make_scene, evaluate, random_state):
    """Oracle: contacts are all there however they fill vectors: less than one, whole ones, several blocks."""
    pitch = max(43.5, 4.5 * rollers)
    scene = make_scene(f"bearing.rollers={rollers}", f"bearing.pitch_diameter_mm={pitch}")
    bearing = roller_bearing(scene)
    outcomes = (evaluate(bearing, random_state(scene, seed)) for seed in range(20))
    assert refused(scene, outcomes, random_state, {}) == {}


def test_oracle_twin_interpreted(interpreted, make_scene, random_state):
    """Oracle: the same for further meetings of laws, which are worth no compilation."""
    for name, assignments in (MEETINGS | TABLES).items():
        scene = make_scene(*assignments, UNSAMPLED)
        outcomes = interpreted[tuple(assignments)]
        tolerances = TABLE if name in TABLES else FILM if scene.model.pocket_film else LAYER if fed(scene) else {}
        assert refused(scene, outcomes, random_state, tolerances) == {}, name


@pytest.mark.parametrize("fixture", ["outer", "everything"])
def test_oracle_states_cover_every_contact(fixture, request, evaluate, random_state):
    """Unit: the random states do open and close each kind of contact, the film alone and the dry land included."""
    scene = request.getfixturevalue(fixture)
    bearing = roller_bearing(scene)
    closed = np.array([evaluate(bearing, random_state(scene, seed)).loads > 0.0 for seed in SEEDS])
    assert closed.any(axis=0).all()
    assert (~closed[:, [3]]).any(), "the land is dry in every state"


# What each switch must silence.
SWITCHES = {
    ("traction.model=off",): {"outer_race_traction", "inner_race_traction"},
    ("model.rolling_resistance=off",): {"rolling_resistance"},
    ("model.race_damping=off",): {"race_damping"},
    ("model.pocket_friction=0.0",): {"pocket_friction"},
    ("model.pocket_damping_alpha_s_m=0.0",): {"pocket_damping"},
    ("model.pocket=off", "model.pocket_film=false"): {"pocket_friction", "pocket_damping", "pocket_film"},
    ("model.pocket_film=false",): {"pocket_film"},
    ("support.damping_N_s_m=0.0",): {"support_damping"},
    ("model.guide_land=dry",): {"land_film"},
    ("model.guide_land=off",): {"land_film", "land_friction", "land_damping"},
    ("cage.guidance=roller",): {"land_film", "land_friction", "land_damping"},
    ("model.land_friction=0.0",): {"land_friction"},
    ("model.land_damping_alpha_s_m=0.0",): {"land_damping"},
    ("model.drag=off",): {"roller_drag"},
}


def switched(assignments):
    """A switch off, in a scene where every power is there."""
    return ("model.pocket_film=true", *SUPPORT, *assignments)


INTERPRETED = """
import json, sys
sys.path.insert(0, sys.argv[1])
from conftest import UNSAMPLED, make, right_hand_side, state_near_contact
from rbdyn.dynamics.parameters.model import roller_bearing
out = []
for assignments in json.loads(sys.argv[2]):
    scene = make(*assignments, UNSAMPLED)
    bearing = roller_bearing(scene)
    for seed in range(6):
        found = right_hand_side(bearing, state_near_contact(scene, seed))
        out.append([list(part) for part in found])
print(json.dumps(out))
"""


@pytest.fixture(scope="module")
def interpreted():
    """The same right-hand side run by the Python interpreter, in one process where nothing is compiled: outcomes in six states
    of every scene, by its assignments."""
    from conftest import Outcome

    scenes = [*map(tuple, (*VARIANTS.values(), *MEETINGS.values(), *TABLES.values())), *map(switched, SWITCHES)]
    arguments = [str(ROOT / "tests"), json.dumps(scenes)]
    found = subprocess.run(
        [sys.executable, "-c", INTERPRETED, *arguments],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    outcomes = [Outcome(*map(np.array, parts)) for parts in json.loads(found.stdout)]
    return {scene: outcomes[6 * place : 6 * place + 6] for place, scene in enumerate(scenes)}


def test_unit_compiled_equals_interpreted(interpreted, make_scene, evaluate, random_state):
    """Unit: machine code and interpreter agree; contraction and the fast elementary functions cost a few ulps.

    Differences are those of position round-off (3e-18 m) over approaches (1e-8 m and more), relative to each block.
    """
    for assignments in VARIANTS.values():
        scene = make_scene(*assignments)
        bearing, blocks = roller_bearing(scene), Blocks(scene.bearing.rollers, scene.support is not None)
        for seed, expected in enumerate(interpreted[tuple(assignments)]):
            outcome = evaluate(bearing, random_state(scene, seed))
            for name in ("roller acceleration", "roller spin rate", "cage acceleration", "ring acceleration"):
                mine, theirs = outcome.dy[blocks[name]], expected.dy[blocks[name]]
                assert np.abs(mine - theirs).max() < 1e-8 * np.abs(theirs).max() + 1e-9, name
            assert outcome.power == pytest.approx(expected.power, rel=1e-9, abs=1e-9)
            assert outcome.loads == pytest.approx(expected.loads, rel=1e-9)


@pytest.mark.parametrize("fixture", ["outer", "everything"])
def test_invariant_pocket_loads_alone_are_those_of_all_forces(fixture, request, evaluate, random_state):
    """Invariant: the same bits, and no other load is touched."""
    scene, largest = request.getfixturevalue(fixture), 0.0
    bearing = roller_bearing(scene)
    for seed in range(20):
        y, loads = random_state(scene, seed), np.full((2, LOADS), np.nan)
        pocket_loads(bearing, y, np.int64(1), loads, scratch(bearing.rollers))
        both = [POCKET_LOAD, POCKET_CONTACT_LOAD]
        assert (loads[1, both] == evaluate(bearing, y).loads[both]).all()
        assert np.isnan(loads[0]).all() and np.isfinite(loads[1]).sum() == len(both)
        largest = max(largest, loads[1, POCKET_LOAD])
    assert largest > 0.0


def test_unit_each_switch_silences_its_own_power(interpreted):
    """Unit: a law that is off loses exactly nothing, and every other power is there in some state."""
    for assignments, silent in SWITCHES.items():
        power = np.abs([outcome.power for outcome in interpreted[switched(assignments)]]).max(axis=0)[:SHAFT]
        assert {name for name, value in zip(POWER_TERMS, power, strict=True) if value == 0.0} == silent, assignments
