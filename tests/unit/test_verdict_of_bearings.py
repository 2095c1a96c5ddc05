"""Verdict on cages of bearings by `rbdyn simulate`: known answers of the example at 24 000 rpm."""

import json
from functools import cache

import numpy as np
import pytest
from conftest import ROOT
from in_process import in_process

import rbdyn
from rbdyn.dynamics.cage_verdict import forced_orders, passing_orders
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.motion import history, mean_cage_speed, orbit_spectrum
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.recording import recording_of
from rbdyn.result import SimulationResult
from rbdyn.scene import Scene

EXAMPLE = ROOT / "examples" / "cylindrical_roller.toml"
LENGTH = ("numerics.turns=40", "numerics.extend=false", "numerics.companion=false", "numerics.replicates=6")
ON_ROLLERS = ("cage.guidance=roller", "bearing.radial_clearance_mm=-0.01", "operation.radial_load_N=0")


@cache
def answer(*overrides: str) -> dict:
    """JSON of the command."""
    options = [word for override in (*LENGTH, *overrides) for word in ("--set", override)]
    ran = in_process("rbdyn", "simulate", EXAMPLE, "--json", *options)
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


def verdict(*overrides: str) -> dict:
    return answer(*overrides)["verdict"]


@pytest.mark.parametrize(
    ("overrides", "offset", "rate", "name"),
    [
        ((), (0.86, 0.88), None, "held"),
        (("cage.imbalance_um=100",), (0.78, 0.80), (0.99, 1.01), "held"),
        (("operation.radial_load_N=0", "numerics.turns=240"), (0, 0.06), (0.435, 0.505), "not judged"),
    ],
)
def test_the_cage_of_the_example_has_its_known_class(overrides, offset, rate, name):
    """A load holds it, with an imbalance too; without a load its film turns it at half its speed, which is only noted."""
    found = verdict(*overrides)
    assert offset[0] < found["measures"]["offset"][0] < offset[1]
    assert rate is None or rate[0] < found["measures"]["rate"][0] < rate[1]
    assert found["class"] == name
    assert found["rule"] == ("circling" if rate and rate[1] < 0.6 else "held")
    assert found["replicates"] == {found["rule"]: 6} and found["shares"][found["rule"]][0] == pytest.approx(
        0.867, abs=1e-3
    )


@pytest.mark.parametrize(
    ("friction", "rates", "classes"),
    [
        (0.1, (0.9, 1.02), {"circling": 6}),
        (0.2, (1.9, 2.05), {"circling": 3, "fast whirl": 3}),
        (0.3, (3.5, 3.9), {"circling": 2, "fast whirl": 4}),
    ],
)
def test_friction_of_pockets_turns_a_cage_on_its_rollers_to_fast_whirl(friction, rates, classes):
    """The known instability of cages by friction: between 0.1 and 0.2 the whirl outruns the cage.

    Replicates that start at the guide stay on their circle, at the speed of the cage, and the verdict is open.
    """
    found = verdict(*ON_ROLLERS, f"model.pocket_friction={friction}", "numerics.turns=80")
    assert found["replicates"] == classes
    circling = classes["circling"]
    rate = (6 * found["measures"]["rate"][0] - circling * (len(classes) > 1)) / (6 - circling * (len(classes) > 1))
    assert rates[0] < rate < rates[1]
    assert found["class"] == ("undecided" if len(classes) > 1 else "circling")
    assert found.get("reason") == ("two regimes last, and the start decides which" if len(classes) > 1 else None)


@pytest.mark.parametrize("friction", [0.02, 0.4])
def test_friction_never_turns_the_guided_cage_of_the_example(friction):
    assert verdict(f"model.pocket_friction={friction}")["class"] == "held"


def test_a_cage_that_a_rotating_load_drives_circles_at_its_order():
    """Its rate of 2.57 would be fast whirl, were the order of the shaft not known."""
    load = ("operation.radial_load_N=0", "operation.rotating_load_N=1300")
    found = verdict(*load, "model.land_friction=0.3", "model.guide_land=dry")
    assert found["measures"]["rate"][0] == pytest.approx(2.57, rel=0.01)
    assert found["distances"]["highest_rate"] > 10 and found["distances"]["forced_band"] < -10
    assert found["class"] == "circling"


@pytest.mark.parametrize("guidance", ["outer", "inner"])
def test_a_trace_is_the_path_that_a_history_shows(guidance):
    """Samples lie 64 in a kinematic cage turn on the motion of the same replicate, about the centre of what guides the cage."""
    scene = Scene.load(
        EXAMPLE, [*LENGTH, f"cage.guidance={guidance}", "numerics.turns=2", "numerics.discard_turns=0.1"]
    )
    run = recording_of(scene, roller_bearing(scene), None, 0, None, Stop()).to(0.4)
    spacing = 2 * np.pi / 64 / scene.geometry.motion.cage_speed
    assert scene.cage_sample_s == pytest.approx(spacing)
    assert len(run.cage_path) == run.traced[:, 0].sum() == int(0.5 * scene.turn_s / spacing) + 1
    motion = history(scene, 0.4, samples_per_turn=512)
    x, y = motion.guide_eccentricity
    times = np.arange(len(run.cage_path)) * spacing - 0.1 * scene.turn_s
    inside = (times > 0) & (times < motion.time[-1])
    path = np.interp(times[inside], motion.time, x) + 1j * np.interp(times[inside], motion.time, y)
    assert abs(run.cage_path[inside] - path).max() < 0.02 * abs(path).max()


def test_the_spectrum_of_an_orbit_shows_what_drives_it():
    """Rollers that pass the load, at Z cage turns both ways, and a load that turns with the shaft, at its order."""
    motion = history(Scene.load(EXAMPLE), 10)
    cage_hz = mean_cage_speed(motion) / (2 * np.pi)
    highest = [frequency / cage_hz for frequency, _ in orbit_spectrum(motion).peaks(2)]
    assert sorted(highest) == pytest.approx(passing_orders(motion.scene, 2 * np.pi * cage_hz)[::-1], abs=0.13)
    load = ("operation.radial_load_N=0", "operation.rotating_load_N=1300", "model.guide_land=dry")
    motion = history(Scene.load(EXAMPLE, [*load, "model.land_friction=0.3"]), 10)
    cage_hz = mean_cage_speed(motion) / (2 * np.pi)
    ((highest, radius),) = orbit_spectrum(motion).peaks(1)
    order = forced_orders(motion.scene, 2 * np.pi * cage_hz)["shaft and its load"]
    assert highest / cage_hz == pytest.approx(order, abs=0.13)
    assert 60e-6 < radius < 75e-6


def test_rollers_pass_a_load_that_turns_at_its_own_orders():
    """Sidebands of a push along a load of order 2.4 by ten rollers, each where it is near the load."""
    scene = Scene.load(EXAMPLE, ["operation.radial_load_N=0", "operation.rotating_load_N=1300"])
    rollers, order = scene.bearing.rollers, 2.4
    angle = 2 * np.pi * np.arange(5 * 1024) / 1024
    place = angle + 2 * np.pi / rollers * np.arange(rollers)[:, None] - order * angle
    push = np.exp(1j * order * angle) * (np.maximum(np.cos(place), 0) ** 3).sum(axis=0)
    power = abs(np.fft.fft(push))
    orders = np.fft.fftfreq(len(angle), 1 / 1024)[np.argsort(-power)[:3]]
    passing = passing_orders(scene, scene.operation.speeds[0] / order)
    assert sorted(orders) == pytest.approx(sorted([order, *passing]))
    assert passing == pytest.approx((2.4 - 14, 2.4 + 14))


def test_a_scene_may_leave_the_verdict_out():
    """Then JSON has null, nothing else changes, and a saved result keeps either."""
    with_verdict, without = answer(), answer("verdict.trace=false")
    assert without["verdict"] is None
    for key in ("impact_force_N", "whirl_deviation_ratio", "power_loss_W", "damage"):
        assert with_verdict[key] == without[key]
    for record in (with_verdict, without):
        assert json.loads(json.dumps(SimulationResult.from_dict(record).as_dict())) == record


def test_short_runs_are_not_judged():
    """The screen says how many cage turns there are and what to raise."""
    result = rbdyn.simulate(EXAMPLE, overrides=[*LENGTH, "numerics.turns=20"], notice=None)
    assert result.verdict.name == "not judged"
    assert "runs of 7.84 cage turns are shorter than 10; raise numerics.turns" in result.verdict.words
