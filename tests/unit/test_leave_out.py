"""What a scene does not need is not there: not computed, not compiled, not stored, not imported, with the same result."""

import gc
import importlib
import json
import math
import os
import pkgutil
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from conftest import law_types
from footprint import added_modules, parameter_bytes

import rbdyn.contact
import rbdyn.dynamics
from rbdyn.accuracy.variants import OPTIONS, with_options
from rbdyn.contact.cage_film import journal_film_force, wall_film
from rbdyn.contact.hertz_line import loaded_slices, slice_terms
from rbdyn.contact.rolling_resistance import film_forces
from rbdyn.contact.traction import asperity_load_share, cubic
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.forces.cage import dry_walls, film_on_wall, journal_wrench
from rbdyn.dynamics.forces.race_lanes import open_contact
from rbdyn.dynamics.forces.races import turned_multiple
from rbdyn.dynamics.forces.schedule import segment
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import layout_of
from rbdyn.dynamics.recording import run_replicate
from rbdyn.dynamics.run import Run

TESTS = Path(__file__).parents[1]
ROOT, HELPERS = TESTS.parent, TESTS / "helpers"
# Every law that can be switched off, off.
BARE = (
    "traction.model=off",
    "model.race_damping=off",
    "model.rolling_resistance=off",
    "model.pocket=off",
    "model.guide_land=off",
    "model.drag=off",
)
# Where the law of each option stands in the bearing, and its type with the option.
LAWS = {
    "contact law of ISO/TS 16281": ("outer.contact", "LineContact"),
    "contact law of Houpert": ("inner.contact", "PowerLineContact"),
    "contact law of Dowson and Higginson": ("outer.contact", "LogarithmicLineContact"),
    "logarithmic profile, 31 slices": ("outer.contact", "SlicedLineContact"),
    "tilt, 31 slices": ("inner.contact", "TiltedLineContact"),
    "unequal rollers": ("sizes", "UnequalRollers"),
    "two-lobed outer race": ("outer.form", "WavyRace"),
    "wavy inner race, with clock": ("inner.form", "WavyRace"),
    "traction by pressure and temperature": ("outer.traction", "TractionSurface"),
    "mixed friction": ("outer.traction", "MixedTraction"),
    "dry traction": ("outer.traction", "CoulombTraction"),
    "without traction": ("inner.traction", "NoTraction"),
    "without race damping": ("outer.damping", "NoDamping"),
    "without rolling resistance": ("outer.rolling", "NoRollingResistance"),
    "starved inlets": ("outer.rolling", "StarvedRollingResistance"),
    "films at open inner contacts": ("open_film", "OpenFilm"),
    "tangential elasticity": ("inner.tangential", "ElasticContact"),
    "pocket film": ("pocket", "LubricatedPocket"),
    "rigid pocket bars": ("pocket.contact", "LineContact"),
    "without pockets": ("pocket", "NoPocket"),
    "guidance on the inner ring": ("guide", "InnerGuide"),
    "guidance by the rollers": ("guide", "NoGuide"),
    "dry land": ("guide.film", "NoFilm"),
    "without land": ("guide", "NoGuide"),
    "cage imbalance": ("cage", "UnbalancedCage"),
    "outer ring turns": ("drive", "TwoSpeedDrive"),
    "outer ring on a support": ("outer_ring", "SupportedRing"),
    "rotating load, with clock": ("drive", "ClockedDrive"),
    "speed and load by schedule": ("drive.load", "SmoothRamps"),
    "gravity": ("gravity", "Gravity"),
    "without drag": ("drag", "NoDrag"),
}
# Kernels that only these options call.
KERNELS_OF_OPTIONS = (
    loaded_slices, slice_terms, turned_multiple, cubic, asperity_load_share, film_forces, open_contact, wall_film, film_on_wall,
    segment,
)  # fmt: skip
# Numbers that an option adds to the state: a ring's place and velocity, or time and two angles, or two coefficients a roller.
STATE = {
    "tangential elasticity": 20, "outer ring on a support": 4, "wavy inner race, with clock": 3,
    "rotating load, with clock": 3, "speed and load by schedule": 3,
}  # fmt: skip
# Modules that an option loads and the plain scene does not.
CLOCK = ("rbdyn.dynamics.forces.schedule",)
SLICES = ("rbdyn.contact.profile", "rbdyn.dynamics.forces.observe")
MODULES = {
    "logarithmic profile, 31 slices": SLICES,
    "tilt, 31 slices": SLICES,
    "traction by pressure and temperature": ("rbdyn.contact.rheology",),
    "wavy inner race, with clock": CLOCK,
    "rotating load, with clock": CLOCK,
    "speed and load by schedule": CLOCK,
}
# Packages and modules that a simulation of the plain scene has no use for.
NOT_NEEDED = (
    "pandas", "matplotlib", "pymoo", "sklearn", "doe", "rich",
    "scipy.special", "scipy.linalg", "scipy.interpolate", "scipy.signal", "scipy.stats", "scipy.optimize",
    "rbdyn.accuracy", "rbdyn.accuracy.variants", "rbdyn.dynamics.slip_map", "rbdyn.cli.show",
    "rbdyn.plots", "rbdyn.scene.fits", "rbdyn.mounting.rings", "rbdyn.dynamics.motion", "rbdyn.dynamics.forces.observe",
    *(module for modules in MODULES.values() for module in modules),
)  # fmt: skip


def fresh(*arguments, interpreted=False, text=None):
    """Standard output of a Python process of its own."""
    path = os.pathsep.join((str(ROOT), str(TESTS), os.environ.get("PYTHONPATH", "")))
    environment = {**os.environ, "PYTHONPATH": path}
    if interpreted:
        environment["NUMBA_DISABLE_JIT"] = "1"
    found = subprocess.run(
        [sys.executable, *map(str, arguments)],
        input=text, env=environment, cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert found.returncode == 0, found.stdout + found.stderr
    return found.stdout


def at(bearing, place):
    """The part of a bearing at a dotted place."""
    for name in place.split("."):
        bearing = getattr(bearing, name)
    return bearing


def name_of(function):
    """Where a compiled function was written, as ``compiled_bodies`` prints it."""
    function = getattr(function, "py_func", function)
    return f"{function.__module__}:{function.__code__.co_firstlineno}"


def types_by_body():
    """Every registered body of a law, and the parameter types it stands for."""
    found = {}
    for package in (rbdyn.contact, rbdyn.dynamics):
        for info in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            for value in vars(importlib.import_module(info.name)).values():
                for kind, body in getattr(value, "bodies", {}).items() if hasattr(value, "body") else ():
                    found.setdefault(name_of(body), set()).add(kind)
    return found


# Sums and samples of every run by default, which a scene may leave out.
UNSAMPLED = {"damage.impacts": False, "damage.races": False, "verdict.trace": False}


@pytest.fixture(scope="module")
def outer(outer):
    """The scene of other tests without its sums over impacts, samples of contacts and trace of the cage."""
    return outer.changed(UNSAMPLED)


@pytest.fixture(scope="module")
def optional(outer):
    """The bearing of every option, by name."""
    return {name: roller_bearing(with_options(outer, change)) for name, change in OPTIONS.items()}


def test_unit_an_option_is_a_type_of_law(outer, optional):
    """Compile: what the machine code is made for, the types of the laws, tells with and without apart."""
    plain = roller_bearing(outer)
    assert set(LAWS) == set(OPTIONS)
    for name, (place, kind) in LAWS.items():
        assert type(at(optional[name], place)).__name__ == kind, name
        same = type(at(plain, place.split(".")[0])) is type(at(optional[name], place.split(".")[0]))
        left_out = not same or type(at(plain, place)).__name__ != kind
        assert left_out or name == "contact law of ISO/TS 16281", name


@pytest.mark.slow
def test_unit_only_the_laws_of_a_scene_are_compiled(make_scene):
    """Compile: of all bodies of all laws, only those of types in the bearing are; so for a scene with every law off."""
    scenes = [BARE, ()]
    compiled = json.loads(fresh(HELPERS / "compiled_bodies.py", text=json.dumps(scenes)))
    bodies = types_by_body()
    assert len(bodies) > 80
    counts = []
    for assignments, functions in zip(scenes, map(set, compiled), strict=True):
        types = law_types(roller_bearing(make_scene(*assignments)))
        if not assignments:
            # The second scene is compiled after the first, whose laws are among what was compiled.
            types |= law_types(roller_bearing(make_scene(*BARE)))
        needless = [name for name in functions & set(bodies) if not bodies[name] & types]
        assert needless == []
        counts.append(len(functions & set(bodies)))
        assert not functions & {name_of(kernel) for kernel in KERNELS_OF_OPTIONS}
    bare, plain = map(set, compiled)
    # The record is no empty promise: what the plain scene needs, and only it, was compiled for it alone.
    needed = {name_of(kernel) for kernel in (dry_walls, journal_wrench, journal_film_force)}
    assert needed <= plain and not needed & bare
    assert 10 < counts[0] < counts[1] < len(bodies) / 2


def arrays_of(run):
    """Every array that a run holds."""
    parts = (*run.carry, *run.carry.scratch, *run.tally, run.control.inverse_tolerance)
    return [part for part in parts if isinstance(part, np.ndarray)]


def test_unit_the_state_holds_what_moves(outer, everything):
    """Store: only a support, a clock and tangential elasticity make the state longer; work arrays are eleven states and a fixed rest."""
    for name, change in OPTIONS.items():
        assert layout_of(with_options(outer, change)).size == 60 + STATE.get(name, 0), name
    sizes = []
    for scene in (outer, everything.changed(UNSAMPLED)):
        run = Run(scene, roller_bearing(scene), 0, scene.numerics.rtol, Stop())
        sizes.append(sum(part.size for part in arrays_of(run)))
    assert sizes[1] - sizes[0] == 11 * (4 + 3)
    # How rollers and races meet, kept between loops, and what is followed of each roller.
    assert sizes[0] < 11 * 60 + 1080 + 640 + 60


def test_unit_parameters_are_few(outer, optional):
    """Store: parameters of laws left out are not there; only slices, radii, waves, tables and schedules hold arrays."""
    plain = parameter_bytes(roller_bearing(outer))
    assert plain < 600
    smaller = {name for name, bearing in optional.items() if parameter_bytes(bearing) < plain}
    assert {name for name in OPTIONS if name.startswith("without")} <= smaller
    assert parameter_bytes(optional["logarithmic profile, 31 slices"]) >= plain + 2 * 2 * 31 * 8


def test_unit_memory_does_not_grow_with_the_turns(outer):
    """Store: a run holds as much after 20 turns as after 4; of a replicate some thirty numbers a batch and its last state stay."""
    run = Run(outer, roller_bearing(outer), 0, outer.numerics.rtol, Stop())
    run.to(0.0)  # compiles
    gc.collect()
    tracemalloc.start()
    held, sizes = [], []
    # The interpreter keeps what the first hundreds of calls of compiled code used for the next ones.
    for calls in (400, 2000):
        for call in range(calls):
            run.to((call + 1) * outer.numerics.turns / 400)
        gc.collect()
        held.append(tracemalloc.get_traced_memory()[0])
        sizes.append([part.size for part in arrays_of(run)])
    tracemalloc.stop()
    assert sizes[0] == sizes[1]
    # A single float kept a step would be some 170 kB.
    assert held[1] - held[0] < 50_000
    kept = run_replicate(outer, run.bearing, 0, outer.numerics.rtol, Stop())
    arrays = [part for part in vars(kept).values() if isinstance(part, np.ndarray)]
    batches = math.ceil((outer.numerics.turns + outer.numerics.warm_up_turns) / 1.0)
    assert sum(part.size for part in arrays) - kept.end.size < 34 * batches + 10


def test_unit_an_option_loads_its_own_modules(outer):
    """Import: an option's modules are loaded with it, and not without."""
    scenes = [with_options(outer, change) for change in OPTIONS.values()]
    found = dict(zip(OPTIONS, added_modules(outer, scenes), strict=True))
    assert found == {name: MODULES.get(name, ()) for name in OPTIONS}


def test_command_line_imports_what_the_scene_needs():
    """Import: the whole command, interpreted (compiling, numba itself loads scipy.linalg)."""
    arguments = ["rbdyn", "simulate", "examples/cylindrical_roller.toml", "--turns", "0.01", "--replicates", "2"]
    arguments += ["--set", "numerics.discard_turns=0.01", "--workers", "1", "--json"]
    arguments += [word for key in UNSAMPLED for word in ("--set", f"{key}=false")]
    program = f"import sys; sys.argv = {arguments!r}\nfrom rbdyn.cli import run\ntry:\n    run()\n"
    program += "except SystemExit:\n    print(*sys.modules, file=sys.stdout)"
    output = fresh("-c", program, interpreted=True)
    loaded = set(output.splitlines()[-1].split())
    assert "rbdyn.dynamics.simulate" in loaded and '"status": "ok"' in output
    assert sorted(loaded & set(NOT_NEEDED)) == []
