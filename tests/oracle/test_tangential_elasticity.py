"""Tangential elasticity: how coefficients follow, its limits, and bearings that run with it as without."""

import math
from itertools import pairwise

import numpy as np
import pytest
from conftest import ROOT
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy_twin import twin
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from rbdyn.base.faults import InputError, read_toml
from rbdyn.contact.tangential import ElasticContact, SteadyTraction, response, steady_traction
from rbdyn.contact.traction import traction
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.forces import state
from rbdyn.dynamics.integrators.advance import ACCEPTED, NOW
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import contact_approach, layout_of
from rbdyn.dynamics.run import Run
from rbdyn.dynamics.simulate import simulate
from rbdyn.scene import Scene

ELASTIC = "traction.elasticity=true"


# A contact of n = 1 has the slope of its secant; a flat one none.
def following(law, steady, coefficient, load, slip, stiffness, slope=None):
    slope = steady / slip if slope is None else slope
    return response(law, SteadyTraction(steady, slope * abs(slip)), coefficient, load, slip, stiffness)


def test_unit_relaxation_is_creep_over_stiffness():
    """Unit: on the straight part of the law the time is its slope over the stiffness, whatever the slip; without load the
    coefficient dies away in the shortest time, and numbers stay finite.
    """
    law, load, stiffness, slope = ElasticContact(0, 1e-9, 0.0, 1e3), 2000.0, 4e8, 3.8e4
    for slip in (1e-6, -1e-3):
        rate = following(law, slope * slip / load, 0.0, load, slip, stiffness).rate
        assert rate * load == pytest.approx(stiffness * slip, rel=1e-12)
    # Half-way up, half the spring's rate is left; opposite to the slip, it is one and a half times that.
    for share in (0.5, -0.5):
        rate = following(law, 0.05, share * 0.05, load, 0.1, stiffness).rate
        assert rate * load == pytest.approx((1.0 - share) * stiffness * 0.1, rel=1e-12)
    floor = ElasticContact(0, 3e-6, 0.0, 1e3)
    assert following(floor, 0.05, 0.01, 0.0, 0.1, stiffness).rate == pytest.approx(-0.01 / 3e-6)
    assert math.isfinite(response(floor, SteadyTraction(0.0, 0.0), 0.01, load, 0.0, stiffness).rate)


def test_unit_rate_by_the_exponent():
    """Unit: T' = k s (1 - r/(1 + (n - 1)(1 - r))), r = T/T_s, below the steady traction, with n of the curve's slope; above it, as
    after a fall of the slip or the load, and beyond a reversal, along the tangent. A curve without slope acts as a spring, until
    the shortest time bounds the rate.
    """
    law, steady, load, slip, stiffness = ElasticContact(0, 1e-9, 0.0, 1e3), 0.04, 1500.0, 0.02, 4e8
    spring = stiffness * slip / load
    for exponent in (1.0, 2.5, 40.0):
        slope = steady / slip / exponent
        for share in (0.0, 0.3, -0.3, 0.9, -1.0, 1.0):
            rate = following(law, steady, share * steady, load, slip, stiffness, slope).rate
            size = abs(share) / (1.0 + (exponent - 1.0) * (1.0 - abs(share)))
            assert rate == pytest.approx(spring * (1.0 - math.copysign(size, share)), abs=1e-10 * spring)
        for share in (1.5, -1.5, 40.0):
            seen = math.copysign(1.0 + exponent * (abs(share) - 1.0), share)
            rate = following(law, steady, share * steady, load, slip, stiffness, slope).rate
            assert rate == pytest.approx(spring * (1.0 - seen), rel=1e-9)
            back = following(law, -steady, -share * steady, load, -slip, stiffness, slope).rate
            assert back == pytest.approx(-rate, rel=1e-12)
    for slope in (0.0, -3.0):
        assert following(law, steady, 0.9 * steady, load, slip, stiffness, slope).rate == pytest.approx(
            spring, rel=1e-3
        )
        above = following(law, steady, 1.5 * steady, load, slip, stiffness, slope).rate
        assert above == pytest.approx(-0.5 * steady / law.shortest_time, rel=1e-5)


def test_oracle_curve_of_a_hyperbola():
    """Oracle: where the steady curve is a hyperbola, T_s = T_m x/(1 + x), the rate is that of its inverse, k (s - s_c(T))."""
    law, load, stiffness, scale = ElasticContact(0, 1e-9, 0.0, 1e3), 1500.0, 4e8, 0.003
    for x in (1e-3, 0.4, 3.0, 20.0):
        steady = 0.05 * x / (1.0 + x)
        for share in (0.1, 0.6, 0.99):
            saturation = share * x / (1.0 + x)
            creep = scale * saturation / (1.0 - saturation)
            rate = following(
                law, steady, share * steady, load, scale * x, stiffness, steady / (scale * x * (1.0 + x))
            ).rate
            assert rate * load == pytest.approx(stiffness * (scale * x - creep), rel=1e-8)


@given(first=st.floats(0.0, 1.0), second=st.floats(0.0, 1.0), end=st.floats(0.0, 1.0), slip=st.floats(1e-4, 10.0))
@settings(max_examples=300, deadline=None)
def test_invariant_rate_falls_with_the_state(first, second, end, slip):
    """Invariant: the rate falls as the state rises, nowhere faster than the shortest time has it, however flat the curve."""
    law, steady, load, stiffness = ElasticContact(0, 3e-6, 2e-7, 1e3), 0.04, 2000.0, 4e8
    low, high = sorted((steady * first, steady * second))
    rates = [following(law, steady, each, load, slip, stiffness, end * steady / slip).rate for each in (low, high)]
    scale = steady / 3.2e-6
    assert -1e-12 * scale <= rates[0] - rates[1] <= (high - low) / 3.2e-6 + 1e-12 * scale


def test_oracle_sudden_slip_on_a_flat_curve():
    """Oracle: a sudden slip raises traction as the spring does, T = k x, up to the limit of the law, as a spring in series with a
    dry slider has it (Jenkins): within 1 % at four fifths of the way."""
    load, stiffness, slip, limit = 2000.0, 4e8, 0.2, 0.05
    law, mu, step = ElasticContact(0, 1e-9, 0.0, 1e3), 0.0, 1e-10
    reaching = limit * load / (stiffness * slip)
    for _ in range(round(0.8 * reaching / step)):
        mu += step * following(law, limit, mu, load, slip, stiffness, 0.0).rate
    assert mu == pytest.approx(0.8 * limit, rel=0.01)
    for _ in range(round(1.2 * reaching / step)):
        mu += step * following(law, limit, mu, load, slip, stiffness, 0.0).rate
    assert mu == pytest.approx(limit, rel=1e-3)


def test_unit_material_damping():
    """Unit: creep, spring and damper in series and parallel, T = C s (1 + beta p)/(1 + (beta + tau) p) of a slip's change:
    of a step the share beta/(tau + beta) acts at once, the rest in the time tau + beta; undamped nothing does.
    """
    beta, steady, at = 4e-6, 0.03, (2000.0, 0.01, 4e8)
    undamped, damped = (ElasticContact(0, 1e-6, each, 1e3) for each in (0.0, beta))
    tau = 0.03 * 2000.0 / (0.01 * 4e8)
    assert following(undamped, steady, 0.0, *at).rate == pytest.approx(steady / tau, rel=1e-12)
    assert following(undamped, steady, 0.0, *at).coefficient == pytest.approx(0.0, abs=1e-15)
    answer = following(damped, steady, 0.0, *at)
    assert answer.coefficient == pytest.approx(steady * beta / (tau + beta), rel=1e-9)
    assert answer.rate == pytest.approx(steady / (tau + beta), rel=1e-12)
    assert following(damped, steady, steady, *at).coefficient == pytest.approx(steady, rel=1e-12)


def test_unit_quick_contact_is_a_rigid_one():
    """Unit: where the steady traction is reached far sooner than the shortest time, it acts at once; the integral of the lag
    after a step of the slip is that of the law without a shortest time, tau (1 + 1/n)/2.
    """
    for tau, exponent in ((1e-7, 1.0), (3e-7, 4.0), (1e-6, 12.0)):
        at = (1000.0, 0.1, 0.04 * 1000.0 / (0.1 * tau))
        lags = []
        for shortest in (1e-8, 3e-6):
            law, mu, lag, step = ElasticContact(0, shortest, 0.0, 1e3), 0.0, 0.0, min(tau, shortest) / 50.0
            for _ in range(round(12.0 * max(tau, shortest) / step)):
                answer = following(law, 0.04, mu, *at, 0.4 / exponent)
                lag += step * (1.0 - answer.coefficient / 0.04)
                mu += step * answer.rate
            lags.append(lag / tau)
        assert lags[0] == pytest.approx(0.5 + 0.5 / exponent, rel=0.1)
        assert lags[1] == pytest.approx(0.5 + 0.5 / exponent, rel=0.02)


def test_unit_nothing_jumps_at_touch():
    """Unit: as its load vanishes, a contact lets the state die away as an open one does, while its steady traction acts."""
    law, steady = ElasticContact(0, 3e-6, 2e-7, 0.1), SteadyTraction(0.04, 0.04)
    rates = [response(law, steady, 0.01, load, 0.1, 4e8).rate for load in (0.0, 1e-9, 1e-3, 1e-2)]
    assert rates[0] == pytest.approx(-0.01 / 3.2e-6, rel=1e-12)
    jumps = np.abs(np.subtract(rates[1:], rates[0]))
    assert jumps[0] < 1e-12 * abs(rates[0]) and jumps[1] < 1e-6 * abs(rates[0]) and jumps[2] < 1e-4 * abs(rates[0])
    assert response(law, steady, 0.01, 1e-9, 0.1, 4e8).coefficient == pytest.approx(0.04, rel=1e-6)


def test_unit_tightest_tolerance_passes_touch():
    """Unit: at the tolerance of a reference, contacts that open and close leave the steps far above their limit."""
    data = read_toml(ROOT / "tests" / "helpers" / "stiff_catalogue_bearing.toml")
    # With the films of scenes by `rbdyn new`, which other tests compile.
    scene = Scene.from_dict(data, "scene", (ELASTIC, "lubricant.inlet_distance=5.0", "numerics.method=rk45"))
    run = Run(scene, roller_bearing(scene), 0, 1e-12, Stop())
    run.to(0.1)
    steps = run.carry.counts[ACCEPTED]
    assert run.carry.clock[NOW] == pytest.approx(0.1 * scene.turn_s) and 1000 < steps < 50_000


@given(
    steady=st.floats(1e-6, 0.1), share=st.floats(-20.0, 20.0), slip=st.floats(1e-6, 10.0), load=st.floats(0.01, 5000.0),
    part=st.floats(-1.0, 2.0), damping=st.floats(0.0, 1e-6),
)  # fmt: skip
@settings(max_examples=300, deadline=None)
def test_invariant_acting_traction_is_bounded_and_takes_work(steady, share, slip, load, part, damping):
    """Invariant: what acts lies between state and steady law; rates stay below the bound; at a constant load the work on the
    slip is never less than what the spring stores.
    """
    law, stiffness, shortest = ElasticContact(0, 3e-6, damping, 1e3), 4e8, 3e-6
    coefficient = share * steady
    acting, rate = following(law, steady, coefficient, load, slip, stiffness, part * steady / slip)
    ends = sorted((coefficient, steady))
    assert ends[0] - 1e-12 <= acting <= ends[1] + 1e-12
    assert abs(rate) <= 2.000001 * abs(steady - coefficient) / (shortest + damping)
    stored = coefficient * load * rate * load / stiffness
    assert acting * load * slip - stored >= -1e-9 * abs(stored) - 1e-15 * steady * load * slip


def test_invariant_coefficients_end_on_the_steady_ones():
    """Invariant: under any history of slip the coefficient stays within the extremes of the steady law and ends on it."""
    law, draw, mu, step = ElasticContact(0, 2e-6, 1e-7, 1e3), np.random.default_rng(3), 0.0, 1e-7
    steady = draw.uniform(-0.05, 0.05, 4000)
    for target in steady:
        mu += step * following(law, target, mu, draw.uniform(1.0, 3000.0), target, 4e8, draw.uniform(0.0, 1.0)).rate
        assert abs(mu) <= np.abs(steady).max()
    for _ in range(4000):
        mu += step * following(law, 0.02, mu, 2000.0, 0.02, 4e8).rate
    assert mu == pytest.approx(0.02, rel=1e-6)


# A cage on its elastic bar hits a roller that both races hold: bar [N/m], mass of the cage [kg], Hunt and Crossley's damping [s/m].
BAR, CAGE_MASS, ALPHA = 6e7, 0.055, 0.5
APPROACHES = (0.03, 0.06, 0.1, 0.15, 0.25)


def impact_peak(mass, speed, contact):
    """Largest force of an impact; ``contact(traction, slip)`` gives the traction of a race that acts and the rate of its state."""

    def wall(way, closing):
        return max(BAR * way * (1.0 + 1.5 * ALPHA * closing), 0.0)

    def rates(t, y):
        way, cage, roller, state = y
        force = wall(way, cage - roller)
        acting, rate = contact(state, roller)
        return [cage - roller, -force / CAGE_MASS, (force - 2.0 * acting) / mass, rate]

    def parting(t, y):
        return y[1] - y[2]

    parting.terminal = True
    tolerances = {"rtol": 1e-6, "atol": [1e-12, 1e-8, 1e-8, 1e-5], "max_step": 5e-7}
    run = solve_ivp(rates, (0.0, 3e-4), [0.0, speed, 0.0, 0.0], method="LSODA", events=parting, **tolerances)
    assert run.status == 1
    return max(wall(way, cage - roller) for way, cage, roller, _ in run.y.T)


@pytest.mark.parametrize("limit", [216.0, 80.0, 18.0])
def test_oracle_impacts_of_johnson_and_tevaarwerk(limit):
    """Oracle: the peak of an impact differs by less than 1.5 % of it from that with the steady curve inverted,
    T' = k (s - s_c(T)), at twice a limit of traction of so many newtons at 0.1 m/s; printed over that of the steady law.
    """
    data = read_toml(ROOT / "tests" / "helpers" / "stiff_catalogue_bearing.toml")
    scene = Scene.from_dict(data, "scene", ("traction.elasticity=true",))
    race, mass = roller_bearing(scene).inner, scene.geometry.roller_mass
    law, model = race.tangential, race.traction
    load = brentq(lambda load: 2.0 * load * traction(model, 0.1, load) - limit, 10.0, 1e4)
    stiffness = 10.0 / 9.0 * load / contact_approach(scene, load)
    slips = np.geomspace(1e-9, 2.0, 3000)
    forces = load * np.array([traction(model, slip, load) for slip in slips])
    assert np.all(np.diff(forces) > 0.0)

    def steady(_, slip):
        return np.sign(slip) * np.interp(abs(slip), slips, forces, left=0.0), 0.0

    def inverted(state, slip):
        there = np.sign(state) * np.interp(abs(state), forces, slips, left=0.0, right=1e3)
        return state, stiffness * (slip - there)

    def ours(state, slip):
        curve = steady_traction(law, model, slip, load)
        acting, rate = response(law, curve, state / load, load, slip, stiffness)
        return acting * load, rate * load

    rows = []
    for speed in APPROACHES:
        rigid, exact, found = (impact_peak(mass, speed, contact) for contact in (steady, inverted, ours))
        rows.append((speed, 100.0 * (exact / rigid - 1.0), 100.0 * (found / rigid - 1.0)))
    print(f"2 mu Q = {limit:g} N:", *(f"{speed:g} m/s {exact:+.1f} {found:+.1f} %" for speed, exact, found in rows))
    assert all(abs(found - exact) < 1.5 for _, exact, found in rows)


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
    assert elastic.power_balance.relative_gap < 1e-4
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
        assert abs(one.value - other.value) <= 2.0 * math.hypot(one.error, other.error) + 1e-3 * abs(other.value), name
    for term, power in with_.power_terms_W.items():
        assert power == pytest.approx(without.power_terms_W[term], rel=0.1, abs=0.2), term
    gaps = [with_.power_balance.relative_gap, 1e-4, 1.0]
    assert all(a < b for a, b in pairwise(gaps))
