"""Tangential elasticity: how coefficients follow, its limits, and bearings that run with it as without."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from conftest import ROOT
from numpy_twin import twin

from rbdyn.contact.tangential_elasticity import acting_coefficient, coefficient_rate, elastic_contact
from rbdyn.contact.traction import traction
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.forces import state
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.scales import layout_of
from rbdyn.dynamics.relaxation import Linearised
from rbdyn.dynamics.run import Run
from rbdyn.dynamics.simulate import simulate
from rbdyn.faults import InputError
from rbdyn.scene import Scene

ELASTIC = "traction.elasticity=true"


def test_unit_relaxation_is_creep_over_stiffness():
    """Unit: the time is Carter's slope 2 R Q/(a u) over 10/9 Q/x, at the load of the scale and as its root elsewhere."""
    radius, load, approach, half_width, speed = 4.6e-3, 2000.0, 6e-6, 90e-6, 5.0
    law = elastic_contact(0, radius, half_width / math.sqrt(load), load, approach, 10.0, 0.1, 0.0)
    time = 2.0 * radius * load / (half_width * speed) / (10.0 / 9.0 * load / approach)
    assert coefficient_rate(law, 0.03, 0.01, load, speed) == pytest.approx(0.02 / time, rel=1e-12)
    assert coefficient_rate(law, 0.03, 0.01, 0.25 * load, speed) == pytest.approx(0.04 / time, rel=1e-12)
    # Without load the coefficient dies away whatever the slip, at the rate of the smallest load and speed.
    alone = coefficient_rate(law, 0.03, 0.01, 0.0, speed)
    assert alone == pytest.approx(-0.01 / time * 0.1 / speed * math.sqrt(load / 10.0), rel=1e-12)


def test_unit_material_damping():
    """Unit: creep, spring and damper in series and parallel, T = C s (1 + beta p)/(1 + (beta + tau) p) of a slip's change:
    of a step the share beta/(tau + beta) acts at once, the rest in the time tau + beta; undamped nothing does.
    """
    beta, steady, speed = 4e-6, 0.03, 5.0
    undamped, damped = (elastic_contact(0, 4.6e-3, 2e-6, 2000.0, 6e-6, 10.0, 0.1, each) for each in (0.0, beta))
    tau = steady / coefficient_rate(undamped, steady, 0.0, 2000.0, speed)
    assert acting_coefficient(undamped, steady, 0.0, 2000.0, speed) == 0.0
    assert acting_coefficient(damped, steady, 0.0, 2000.0, speed) == pytest.approx(
        steady * beta / (tau + beta), rel=1e-12
    )
    assert coefficient_rate(damped, steady, 0.0, 2000.0, speed) == pytest.approx(steady / (tau + beta), rel=1e-12)
    assert acting_coefficient(damped, steady, steady, 2000.0, speed) == steady


def test_invariant_coefficients_stay_within_the_steady_ones():
    """Invariant: under any history of slip the coefficient stays within the extremes of the steady law and ends on it."""
    law, draw = elastic_contact(0, 4.6e-3, 2e-6, 2000.0, 6e-6, 10.0, 0.1, 0.0), np.random.default_rng(3)
    steady, mu, step = draw.uniform(-0.05, 0.05, 4000), 0.0, 1e-6
    for target in steady:
        mu += step * coefficient_rate(law, target, mu, draw.uniform(1.0, 3000.0), 5.0)
        assert abs(mu) <= np.abs(steady).max()
    for _ in range(2000):
        mu += step * coefficient_rate(law, 0.02, mu, 2000.0, 5.0)
    assert mu == pytest.approx(0.02, rel=1e-6)


def test_oracle_twin_and_limit(make_scene, outer, evaluate, random_state):
    """Oracle: compiled, vectors and all, as plain numpy; with the steady law's coefficients as the rigid contacts."""
    scene = make_scene(ELASTIC)
    bearing, rigid, z = roller_bearing(scene), roller_bearing(outer), scene.bearing.rollers
    for seed in range(8):
        y = random_state(scene, seed)
        mine, theirs = evaluate(bearing, y), twin(scene, y)
        for part in (slice(2 * z, 4 * z), slice(4 * z, 5 * z), slice(-2 * z, None)):
            assert np.abs(mine.dy[part] - theirs.dy[part]).max() < 1e-8 * np.abs(theirs.dy[part]).max()
        assert mine.power == pytest.approx(theirs.power, rel=1e-7, abs=1e-9)
        # The steady coefficients by the slip of each contact, put into the state, give the forces of rigid contacts.
        y[-2 * z :] = steady_coefficients(scene, bearing, y).ravel()
        elastic, plain = evaluate(bearing, y), evaluate(rigid, y[: -2 * z])
        assert np.abs(elastic.dy[: -2 * z] - plain.dy).max() < 1e-9 * np.abs(plain.dy).max()
        assert elastic.power == pytest.approx(plain.power, rel=1e-9, abs=1e-9)
        loaded = np.abs(y[-2 * z :]) > 0.0
        assert np.abs(elastic.dy[-2 * z :][loaded]).max() < 1e-9 * np.abs(mine.dy[-2 * z :]).max()


def steady_coefficients(scene, bearing, y):
    """Traction coefficient of the steady law, (races, rollers), 0 of contacts that are open."""
    from rbdyn.dynamics.forces.equations import motions
    from rbdyn.dynamics.forces.races import race_contact

    z = scene.bearing.rollers
    _, _, inner, outer = motions(bearing, y)
    found = np.zeros((2, z))
    for place, (race, side, ring) in enumerate(((bearing.outer, 1.0, outer), (bearing.inner, -1.0, inner))):
        for j in range(z):
            places = (y[j] - ring.x, y[z + j] - ring.y, y[2 * z + j] - ring.vx, y[3 * z + j] - ring.vy, y[4 * z + j])
            wrench = race_contact.py_func(
                race, side, bearing.sizes.radius, *places, ring.speed, ring.cos, ring.sin, 0.0
            )
            found[place, j] = traction(race.traction, wrench.slip, wrench.load) if wrench.load > 0.0 else 0.0
    return found


def test_invariant_run_with_elastic_contacts(make_scene):
    """Invariant: power balances to 1e-4, coefficients stay below the peak of the curve, and the figures of a bearing whose
    traction curve is flat are those of rigid contacts within their noise.
    """
    scene = make_scene(ELASTIC, "numerics.turns=12", "numerics.discard_turns=4")
    elastic, rigid = (
        simulate(each, workers=1) for each in (scene, make_scene("numerics.turns=12", "numerics.discard_turns=4"))
    )
    assert elastic.power_gap < 1e-4
    assert elastic.power_loss.value == pytest.approx(rigid.power_loss.value, rel=5e-3)
    run = Run(scene, roller_bearing(scene), 0, scene.numerics.rtol, Stop())
    run.to(2.0)
    coefficients = run.carry.y[layout_of(scene).coefficients :]
    assert 0.0 < np.abs(coefficients).max() < scene.traction.mu_m
    rates = Linearised(run).decay_rates()
    assert np.all(np.isfinite(rates)) and rates[2] > 1e3


def test_unit_names_and_refusals(make_scene):
    """Unit: a coefficient is named by its roller and race; the implicit method and frictionless races are refused."""
    scene = make_scene(ELASTIC)
    parts = layout_of(scene)
    assert state.name(parts.coefficients, parts) == "roller 1 outer traction coefficient"
    assert state.name(parts.size - 1, parts) == "roller 10 inner traction coefficient"
    with pytest.raises(InputError, match=r"'rosenbrock' and traction.elasticity"):
        make_scene(ELASTIC, "numerics.method=rosenbrock")
    with pytest.raises(InputError, match=r"elasticity = true and traction.model = 'off'"):
        make_scene(ELASTIC, "traction.model=off")
    with pytest.raises(InputError, match="needs contacts that roll"):
        roller_bearing(make_scene(ELASTIC, "operation.outer_speed_rpm=24000.0"))


@pytest.mark.slow
def test_oracle_stiff_bearing_with_and_without(tmp_path):
    """Oracle: a catalogue bearing with steep traction runs as with rigid contacts, within the noise of both, with less than
    half of the right-hand sides.
    """
    from rbdyn.faults import read_toml

    data = read_toml(ROOT / "tests" / "helpers" / "stiff_catalogue_bearing.toml")
    numbers = ("numerics.turns=10", "numerics.discard_turns=6", "numerics.replicates=6", "numerics.companion=false")
    with_, without = (
        simulate(
            Scene.from_dict(data, "scene", (*numbers, "numerics.impact_window_turns=10", f"traction.elasticity={each}"))
        )
        for each in ("true", "false")
    )
    assert with_.cost["rhs_evaluations"] < 0.5 * without.cost["rhs_evaluations"]
    for name, one in with_.quantities.items():
        other = without.quantities[name]
        assert abs(one.value - other.value) < 2.0 * math.hypot(one.error, other.error) + 1e-3 * abs(other.value), name
    for term, power in with_.power_terms.items():
        assert power == pytest.approx(without.power_terms[term], rel=0.1, abs=0.2), term
    gaps = [with_.power_gap, 1e-4, 1.0]
    assert all(a < b for a, b in pairwise(gaps))
