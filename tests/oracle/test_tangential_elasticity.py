"""Tangential elasticity: how coefficients follow, its limits, and bearings that run with it as without."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from conftest import ROOT
from numpy_twin import twin

from rbdyn.base.faults import InputError
from rbdyn.contact.traction import ElasticContact, acting_coefficient, coefficient_rate, traction
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.forces import state
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import layout_of
from rbdyn.dynamics.run import Run
from rbdyn.dynamics.simulate import simulate
from rbdyn.scene import Scene

ELASTIC = "traction.elasticity=true"


def test_unit_relaxation_is_creep_over_stiffness():
    """Unit: on the straight part of the law the time is its slope over the stiffness, whatever the slip; past its peak the spring
    alone acts, k s of force a time; without load the coefficient dies away in the shortest time.
    """
    law, load, stiffness, slope = ElasticContact(0, 0.0, 0.0), 2000.0, 4e8, 3.8e4
    for slip in (1e-6, -1e-3):
        rate = coefficient_rate(law, slope * slip / load, 0.0, load, slip, stiffness)
        assert rate * load == pytest.approx(stiffness * slip, rel=1e-12)
    # Half-way up, half the spring's rate is left.
    assert coefficient_rate(law, 0.05, 0.025, load, 0.1, stiffness) * load == pytest.approx(
        0.5 * stiffness * 0.1, rel=1e-12
    )
    assert coefficient_rate(ElasticContact(0, 3e-6, 0.0), 0.05, 0.01, 0.0, 0.1, stiffness) == pytest.approx(
        -0.01 / 3e-6
    )
    assert math.isfinite(coefficient_rate(ElasticContact(0, 3e-6, 0.0), 0.0, 0.01, load, 0.0, stiffness))


def test_oracle_impact_on_a_rolling_contact():
    """Oracle: a sudden slip raises traction as the spring does, T = k x, up to the limit of the law, as a spring in series with a
    dry slider has it (Jenkins), within the tenth that the exponential way to the limit takes."""
    load, stiffness, slip, limit = 2000.0, 4e8, 0.2, 0.05
    law, mu, step = ElasticContact(0, 0.0, 0.0), 0.0, 1e-9
    reaching = limit * load / (stiffness * slip)
    for _ in range(round(0.2 * reaching / step)):
        mu += step * coefficient_rate(law, limit, mu, load, slip, stiffness)
    assert mu * load == pytest.approx(0.2 * limit * load, rel=0.1)
    for _ in range(round(8.0 * reaching / step)):
        mu += step * coefficient_rate(law, limit, mu, load, slip, stiffness)
    assert mu == pytest.approx(limit, rel=1e-3)


def test_unit_material_damping():
    """Unit: creep, spring and damper in series and parallel, T = C s (1 + beta p)/(1 + (beta + tau) p) of a slip's change:
    of a step the share beta/(tau + beta) acts at once, the rest in the time tau + beta; undamped nothing does.
    """
    beta, steady, at = 4e-6, 0.03, (2000.0, 0.01, 4e8)
    undamped, damped = (ElasticContact(0, 1e-6, each) for each in (0.0, beta))
    tau = steady / coefficient_rate(undamped, steady, 0.0, *at)
    assert tau == pytest.approx(0.03 * 2000.0 / (0.01 * 4e8) + 1e-6, rel=1e-12)
    assert acting_coefficient(undamped, steady, 0.0, *at) == 0.0
    assert acting_coefficient(damped, steady, 0.0, *at) == pytest.approx(steady * beta / (tau + beta), rel=1e-12)
    assert coefficient_rate(damped, steady, 0.0, *at) == pytest.approx(steady / (tau + beta), rel=1e-12)
    assert acting_coefficient(damped, steady, steady, *at) == steady


def test_invariant_coefficients_stay_within_the_steady_ones():
    """Invariant: under any history of slip the coefficient stays within the extremes of the steady law and ends on it."""
    law, draw, mu, step = ElasticContact(0, 2e-6, 1e-7), np.random.default_rng(3), 0.0, 1e-7
    steady = draw.uniform(-0.05, 0.05, 4000)
    for target in steady:
        mu += step * coefficient_rate(law, target, mu, draw.uniform(1.0, 3000.0), target, 4e8)
        assert abs(mu) <= np.abs(steady).max()
    for _ in range(4000):
        mu += step * coefficient_rate(law, 0.02, mu, 2000.0, 0.02, 4e8)
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


@pytest.mark.slow
def test_invariant_run_with_elastic_contacts(make_scene):
    """Invariant: power balances to 1e-4, coefficients stay below the peak of the curve, and the figures of a bearing whose
    traction curve is flat are those of rigid contacts within their noise.
    """
    scene = make_scene(ELASTIC, "numerics.turns=12", "numerics.discard_turns=4")
    elastic, rigid = (
        simulate(each, workers=1) for each in (scene, make_scene("numerics.turns=12", "numerics.discard_turns=4"))
    )
    assert elastic.power_balance["relative_gap"] < 1e-4
    assert elastic.power_loss_W.value == pytest.approx(rigid.power_loss_W.value, rel=5e-3)
    run = Run(scene, roller_bearing(scene), 0, scene.numerics.rtol, Stop())
    run.to(2.0)
    coefficients = run.carry.y[layout_of(scene).coefficients :]
    assert 0.0 < np.abs(coefficients).max() < scene.traction.mu_m


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
    from rbdyn.base.faults import read_toml

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
    for term, power in with_.power_terms_W.items():
        assert power == pytest.approx(without.power_terms_W[term], rel=0.1, abs=0.2), term
    gaps = [with_.power_balance["relative_gap"], 1e-4, 1.0]
    assert all(a < b for a, b in pairwise(gaps))
