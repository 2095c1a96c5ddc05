"""Scenes, states and runs that several tests share; compiled once a session.

Every distinct set of law types costs seconds to compile, so tests take their scenes from here: ``outer`` (all
default laws), ``inner`` (as ``outer``, but guided on the inner ring), ``conservative`` (nothing that dissipates) and
``everything`` (every law that goes with guidance on the outer ring).
"""

import gc
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from rbdyn.accuracy import fixed_step
from rbdyn.base.faults import read_toml
from rbdyn.base.streams import OBJECTS_A_COLLECTION
from rbdyn.dynamics.forces.race_lanes import scratch
from rbdyn.dynamics.forces.state import LOADS
from rbdyn.dynamics.parameters.state import layout_of
from rbdyn.losses import POWERS
from rbdyn.scene import Scene

ROOT = Path(__file__).parent.parent
EXAMPLE = ROOT / "examples" / "cylindrical_roller.toml"
SHORT = (
    "numerics.turns=4",
    "numerics.discard_turns=2",
    "numerics.replicates=2",
    "numerics.impact_window_turns=2",
    "numerics.companion=false",
    "numerics.extend=false",
)
# Of a right-hand side alone: samples of the races are not in it, and their scale is a distribution of static loads, with kernels of
# its own for each set of laws.
UNSAMPLED = "damage.races=false"
CONSERVATIVE = (
    "traction.model=off",
    "model.race_damping=off",
    "model.rolling_resistance=off",
    "model.drag=off",
    "model.pocket_friction=0.0",
    "model.pocket_damping_alpha_s_m=0.0",
    "model.guide_land=dry",
    "model.land_friction=0.0",
    "model.land_damping_alpha_s_m=0.0",
)
# Each law that a scene may have besides the default ones, as far as they go together.
EVERYTHING = (
    "support.stiffness_N_m=5e7",
    "support.damping_N_s_m=2e3",
    "support.outer_ring_mass_kg=0.4",
    "operation.outer_speed_rpm=-6000.0",
    "operation.rotating_load_N=150.0",
    "operation.unbalance_g_mm=3.0",
    "operation.gravity_m_s2=9.81",
    "operation.gravity_direction_deg=-70.0",
    "operation.schedule.time_s=[0.0, 2e-3, 6e-3]",
    "operation.schedule.inner_speed_rpm=[20000.0, 24000.0, 22000.0]",
    "operation.schedule.radial_load_N=[900.0, 1300.0, 1200.0]",
    "cage.imbalance_um=40.0",
    "bearing.roller_diameter_errors_um=[0.0, 1.0, -1.0, 0.4, 0.0, -2.0, 0.3, 0.0, 1.5, -0.2]",
    "bearing.outer_waviness=[{order=2, amplitude_um=6.0, phase_deg=20.0}, {order=21, amplitude_um=0.3}]",
    "bearing.inner_waviness=[{order=9, amplitude_um=0.4, phase_deg=70.0}]",
    "bearing.roller_profile=crowned",
    "bearing.crown_radius_mm=800.0",
    "bearing.tilt_mrad=0.6",
    "bearing.tilt_direction_deg=40.0",
    "bearing.inner_tilt_share=0.4",
    "model.line_contact=dowson_higginson",
    "model.pocket_film=true",
    "model.open_contact_film=true",
    "traction.model=thermal_newtonian",
    "traction.friction=mixed",
)


# Files that take longest begin, so that no process works on one of them while the other has nothing left; the first of them
# compiles most, the second nothing.
DEAREST = (
    "test_accuracy_of_new_scenes", "test_own_bearing", "test_study_heat", "test_accuracy", "test_adaptive", "test_duty_starts",
    "test_uncertainty", "test_streams", "test_hot_balls", "test_start",
    "test_map_and_options", "test_equations", "test_rolling_resistance", "test_study_survival", "test_study_adaptive",
    "test_golden", "test_rosenbrock", "test_surroundings", "test_runge_kutta", "test_study", "test_calibrate",
    "test_unknown_calibration", "test_unknown_worth", "test_ball_sweep", "test_ball_solvers", "test_manual",
    "test_unknown_spread", "test_leave_out", "test_study_status", "test_invariants", "test_ball_command",
    "test_doe_command_line", "test_search_report", "test_filtered_whirl", "test_show", "test_line_contact", "test_examples",
)  # fmt: skip


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--fuzz-cases N``: how many cases each fuzz test draws."""
    parser.addoption("--fuzz-cases", type=int, default=100, help="cases that each fuzz test draws (100)")


@pytest.fixture(scope="session")
def fuzz_cases(request: pytest.FixtureRequest) -> int:
    """How many cases a fuzz test draws."""
    return int(request.config.getoption("--fuzz-cases"))


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> None:
    """Two processes where pytest-xdist is installed and nothing else is asked for; a file's tests stay in one, but for slow
    ones, which share nothing and go where there is room."""
    # Hundreds of processes import the same modules, and the next session too: the first keeps what it compiles of them.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    # As a command has it: the tests are many objects that stay.
    gc.set_threshold(OBJECTS_A_COLLECTION)
    if hasattr(config, "workerinput"):
        # One process collects from the first folder, the other from the last: each compiles half of the files of a fresh checkout.
        if config.workerinput["workerid"] == "gw1" and config.args == config.getini("testpaths"):
            config.args = sorted(map(str, ROOT.glob("tests/[a-z]*/")), reverse=True)
        return
    if not config.pluginmanager.hasplugin("xdist"):
        return
    # Two processes whose linear algebra spins on two threads each wait for each other. Before any of them loads numpy.
    for library in ("OPENBLAS", "OMP", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    option = config.option
    if option.numprocesses is None and option.dist == "no" and not option.usepdb:
        option.numprocesses = 2
    if option.numprocesses and option.dist == "no":
        option.dist = "worksteal" if option.markexpr == "slow" else "loadfile"
        option.loadscopereorder = False  # as they are collected, not by the number of a file's tests


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The dearest files first, all others by their paths."""
    place = {name: number for number, name in enumerate(DEAREST)}
    items.sort(key=lambda item: (place.get(item.path.stem, len(place)), item.path))


def law_types(parameters: Any) -> set[type]:
    """Types of all NamedTuples within the parameters of a bearing: they choose what is compiled."""
    if not isinstance(parameters, tuple):
        return set()
    return {type(parameters)}.union(*map(law_types, parameters))


class Outcome(NamedTuple):
    """What one call of the right-hand side fills."""

    dy: NDArray[np.float64]
    power: NDArray[np.float64]
    loads: NDArray[np.float64]


def make(*assignments: str) -> Scene:
    """The example, short, with ``key.path=value`` assignments."""
    return Scene.from_dict(read_toml(EXAMPLE), "scene", (*SHORT, *assignments))


def right_hand_side(bearing: Any, y: NDArray[np.float64]) -> Outcome:
    """The right-hand side under test; the work space is poisoned so that nothing stale can pass for a result."""
    dy, power, loads = (np.full((1, size), np.nan) for size in (y.size, POWERS, LOADS))
    work = scratch(bearing.rollers)
    work.lanes[:] = work.gap[:] = np.nan
    fixed_step.right_hand_side(bearing, y, dy, power, loads, work)
    return Outcome(dy[0], power[0], loads[0])


def state_near_contact(scene: Scene, seed: int) -> NDArray[np.float64]:
    """A seeded state in which races, pocket walls and land are partly open, partly closed, and all slide."""
    draw = np.random.default_rng(seed)
    z, parts = scene.bearing.rollers, layout_of(scene)
    outer, _ = scene.geometry.raceways
    motion = scene.geometry.motion
    roller = 0.5e-3 * scene.bearing.roller_diameter_mm
    radii = scene.geometry.roller_radii
    larger = 0.0 if radii is None else radii - roller
    half_pocket = 0.5e-3 * scene.cage.pocket_clearance_mm - larger
    cage_direction, cage_size = draw.uniform(0.0, 2.0 * np.pi), draw.choice([0.3, 0.9, 1.0])
    cage = cage_size * 0.5e-3 * scene.cage.guide_clearance_mm + draw.uniform(-2e-6, 2e-6)
    cage_xy = cage * np.array([np.cos(cage_direction), np.sin(cage_direction)])
    ring_xy = draw.uniform(-20e-6, 20e-6, 2)
    if scene.cage.guidance == "inner":
        cage_xy += ring_xy
    cage_angle = draw.uniform(0.0, 2.0 * np.pi)
    angles = cage_angle + 2.0 * np.pi * np.arange(z) / z
    radial, ahead = (np.array([np.cos(angles), np.sin(angles)]), np.array([-np.sin(angles), np.cos(angles)]))
    # Distance ahead of the pocket's middle, measured from the cage: half way to a wall, or 0.2 to 4 um into it.
    wall = draw.choice([-1.0, 1.0], z)
    into = np.where(draw.random(z) < 0.6, draw.uniform(0.2e-6, 4e-6, z), -0.5 * half_pocket)
    offset = wall * (half_pocket + into)
    along = offset + cage_xy @ ahead
    orbit = outer - roller + draw.uniform(-15e-6, 5e-6, z)
    place = radial * np.sqrt(orbit**2 - along**2) + ahead * along
    speed = motion.cage_speed * orbit * draw.uniform(0.9, 1.05, z)
    velocity = np.array([-place[1], place[0]]) / orbit * speed + draw.uniform(-0.2, 0.2, (2, z))
    y = np.zeros(parts.size)
    cage_motion = (*draw.uniform(-0.5, 0.5, 2), motion.cage_speed * draw.uniform(0.9, 1.05))
    ring_motion = draw.uniform(-0.2, 0.2, 2)
    if parts.support is not None:
        # The outer ring goes a little off its place and takes all else along.
        support = draw.uniform(-20e-6, 20e-6, 2)
        y[parts.support : parts.support + 4] = (*support, *draw.uniform(-0.1, 0.1, 2))
        place, cage_xy, ring_xy = place + support[:, np.newaxis], cage_xy + support, ring_xy + support
    if parts.clock is not None:
        y[parts.clock : parts.clock + 3] = (draw.uniform(0.0, 4.0) * scene.turn_s, *draw.uniform(-20.0, 20.0, 2))
    y[: 5 * z] = np.concatenate((*place, *velocity, motion.roller_spin * draw.uniform(0.8, 1.1, z)))
    y[5 * z : 5 * z + 10] = (*cage_xy, cage_angle, *cage_motion, *ring_xy, *ring_motion)
    if parts.coefficients is not None:
        y[parts.coefficients :] = draw.uniform(-0.05, 0.05, 2 * z)
    return y


@pytest.fixture(scope="session")
def make_scene() -> Callable[..., Scene]:
    """``make_scene(*assignments)``: the example, short, with changes."""
    return make


@pytest.fixture(scope="session")
def evaluate() -> Callable[..., Outcome]:
    """``evaluate(bearing, y)``: derivative, powers and loads."""
    return right_hand_side


@pytest.fixture(scope="session")
def random_state() -> Callable[..., NDArray[np.float64]]:
    """``random_state(scene, seed)``: contacts open, closed and sliding."""
    return state_near_contact


@pytest.fixture(scope="session")
def outer() -> Scene:
    """All default laws, guided on the outer ring."""
    return make()


@pytest.fixture(scope="session")
def inner() -> Scene:
    """All default laws, guided on the inner ring."""
    return make("cage.guidance=inner")


@pytest.fixture(scope="session")
def conservative() -> Scene:
    """Elastic contacts everywhere and nothing that dissipates."""
    return make(*CONSERVATIVE)


@pytest.fixture(scope="session")
def everything() -> Scene:
    """Every law that goes with guidance on the outer ring."""
    return make(*EVERYTHING)


@pytest.fixture(scope="session")
def outer_result(outer: Scene) -> Any:
    """One simulation of the ``outer`` scene with a single worker."""
    from rbdyn.dynamics.simulate import simulate

    return simulate(outer, workers=1)


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> dict[str, NDArray[np.float64]]:
    """Every number that pictures show, by the name of their file: of lines, points, bars, cells and whiskers."""
    from matplotlib.figure import Figure

    shown: dict[str, NDArray[np.float64]] = {}
    save = Figure.savefig

    def kept(figure: Figure, path: Any, **options: Any) -> None:
        parts = [np.zeros(0)]
        for axis in figure.axes:
            parts += [np.ravel(line.get_xydata()) for line in axis.lines]
            parts += [
                np.ravel(each.get_array()) for each in (*axis.images, *axis.collections) if each.get_array() is not None
            ]
            parts += [np.ravel(each.get_offsets()) for each in axis.collections]
            parts += [
                np.ravel(segment) for each in axis.collections for segment in getattr(each, "get_segments", list)()
            ]
            parts += [np.ravel(each.get_xy()) for each in axis.patches]
        shown[Path(path).name] = np.ma.filled(np.ma.concatenate(parts), np.nan).astype(float)
        save(figure, path, **options)

    monkeypatch.setattr(Figure, "savefig", kept)
    return shown


def lacking(shown: NDArray[np.float64], wanted: Any) -> list[float]:
    """Numbers that a picture should show and does not."""
    return [value for value in np.ravel(wanted) if not np.isclose(shown, value, rtol=1e-12, atol=0.0).any()]


@pytest.fixture(scope="session")
def command() -> Callable[..., subprocess.CompletedProcess[str]]:
    """``command(*arguments, **environment)``: run ``rbdyn``; in a process of its own where it has an environment of its own."""
    from in_process import in_process

    def run(*arguments: Any, **environment: str) -> subprocess.CompletedProcess[str]:
        if not environment:
            return in_process("rbdyn", *arguments)
        program = "from rbdyn.cli import run; run()"
        return subprocess.run(
            [sys.executable, "-c", program, *map(str, arguments)],
            capture_output=True,
            text=True,
            env={**os.environ, "NO_COLOR": "1", **environment},
            check=False,
        )

    return run


@pytest.fixture(autouse=True)
def untried_cages(monkeypatch: pytest.MonkeyPatch) -> None:
    """``doe new`` within this process runs no scene for the class of its cage, which takes seconds; its own tests replace that."""
    monkeypatch.setattr("doe.workflow.region.baseline_cages", lambda *study: {})
