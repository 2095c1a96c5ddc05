"""Warming of six nodes: matrix exponential, heat balance, steady state, runaway at a gain of one, heavy housings, rings alike."""

import numpy as np
import pytest
from scipy.linalg import expm

from rbdyn.thermal.losses import HeatModel, Losses, no_residue
from rbdyn.thermal.network import INNER, NODES, OUTER, Boundaries, Conductances, matrix, temperatures
from rbdyn.thermal.start import (
    HOUSING,
    SHAFT,
    WARMING_NODES,
    Course,
    Moment,
    Seats,
    integrate,
    law_of,
    leasts_of,
    rows_of,
    seat,
    settled_times,
    slowest,
    warming_conductances,
    warming_network,
)

BATH = Conductances(0.0, 8.0, 5.0, 12.0, 18.0, 11.0, 2.0, 0.9, 2.0)
SEATS = Seats(60.0, 40.0)
AROUND = Boundaries(20.0, 20.0)
CAPACITIES = np.array([40.0, 110.0, 70.0, 100.0, 1200.0, 250.0])
HEAT = np.array([45.0, 30.0, 20.0, 50.0, 0.0, 0.0])
COLD = np.full(len(WARMING_NODES), 20.0)
FULL = np.log([4000.0, 4000.0])
DEGREES = np.arange(-60.0, 350.5)
# Viscosity that falls by a factor e in 30 K.
VISCOSITY = -DEGREES / 30.0


def _constant(whole, inflow, heat):
    return lambda time, nodes: heat + inflow - whole @ nodes


def test_unit_constant_heat_is_a_matrix_exponential():
    """Unit: constant heat and network have the closed form T = T_s + exp(-C^-1 G t)(T_0 - T_s), within 1e-8."""
    whole, inflow = warming_network(warming_conductances(BATH, SEATS), AROUND)
    found = integrate(CAPACITIES, _constant(whole, inflow, HEAT), COLD, 4000.0, tolerance=1e-10)
    steady = np.linalg.solve(whole, HEAT + inflow)
    for row in (1, 40, 90, -1):
        decay = expm(-whole / CAPACITIES[:, np.newaxis] * found.times[row])
        assert found.temperatures[row] == pytest.approx(steady + decay @ (COLD - steady), rel=1e-8)
    assert not found.is_hot and found.times[-1] == 4000.0


def test_unit_steady_state_is_that_of_the_network():
    """Unit: with housing and shaft as nodes the four others become as warm as in the network without them."""
    whole, inflow = warming_network(warming_conductances(BATH, SEATS), AROUND)
    end = 16.0 * slowest(CAPACITIES, whole)
    last = integrate(CAPACITIES, _constant(whole, inflow, HEAT), COLD, end).temperatures[-1]
    assert last[: len(NODES)] == pytest.approx(temperatures(BATH, AROUND, HEAT[: len(NODES)]), abs=1e-3)
    # The seat's resistance is in series with what leaves: the housing is colder by the heat that passes it over the seat.
    assert last[OUTER] - last[HOUSING] == pytest.approx(2.0 * (last[OUTER] - 20.0) / 60.0, abs=1e-3)
    assert last[INNER] - last[SHAFT] == pytest.approx(0.9 * (last[INNER] - 20.0) / 40.0, abs=1e-3)
    loose, _ = warming_network(warming_conductances(BATH, Seats(1e-3, 1e-3)), AROUND)
    assert loose[OUTER, HOUSING] == pytest.approx(-4.0)  # ISO 15312's heat passes the seat


def test_unit_network_without_ways_out():
    """Unit: housing and shaft that lose nothing only store heat, and rows and columns of their network sum to zero."""
    closed = BATH._replace(outer_ambient=0.0, inner_ambient=0.0)
    whole, inflow = warming_network(warming_conductances(closed, SEATS), AROUND)
    assert whole[[HOUSING, SHAFT]].sum(axis=1) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert np.array_equal(whole, whole.T) and inflow[HOUSING] == inflow[SHAFT] == 0.0
    assert whole.sum() == pytest.approx(matrix(closed).sum(), rel=1e-12)


def test_unit_heat_is_stored_or_leaves():
    """Unit: the integral of the heat is sum C dT plus the heat out, to 1e-6, for heat that falls as the oil warms."""
    law = _law()
    net = law.net_heat(_steady_course())
    whole, inflow = law.matrices[0], law.sources[0]

    def with_sums(time, nodes):
        heat = law.heat(nodes[:6], FULL)
        return np.concatenate((net(time, nodes[:6]), [heat.sum(), (whole @ nodes[:6] - inflow).sum()]))

    # The sums are in kilojoules, which stay below the temperature that ends a course.
    found = integrate(np.append(CAPACITIES, [1e3, 1e3]), with_sums, np.append(COLD, [0.0, 0.0]), 600.0)
    last = found.temperatures[-1] * np.append(np.ones(6), [1e3, 1e3])
    stored = CAPACITIES @ (last[:6] - COLD)
    assert last[6] == pytest.approx(stored + last[7], rel=1e-6)
    # The same from the rows alone: heat is smooth, so a spline through the rows sums it.
    from scipy.interpolate import CubicSpline

    heat = law.heat(found.temperatures[:, :6], FULL).sum(axis=1)
    assert CubicSpline(found.times, heat).integrate(0.0, 600.0) == pytest.approx(last[6], rel=1e-6)


@pytest.mark.parametrize(("share", "steady"), [(0.99, True), (1.01, False)])
def test_unit_heat_runs_away_at_a_gain_of_one(share, steady):
    """Unit: a node with heat a T over a conductance G is steady below a = G, linear in time at it, and runs away above it."""
    capacity, out = np.array([100.0]), 2.0
    gain = share * out

    def net(time, nodes):
        return 30.0 + gain * (nodes - 20.0) - out * (nodes - 20.0)

    # At the growth rate (a - G)/C the closed form is T = 20 + 30/(G - a) (1 - exp(-(G - a) t/C)).
    found = integrate(capacity, net, np.array([20.0]), 5e4, tolerance=1e-10).until_hot()
    closed = 20.0 + 30.0 / (out - gain) * -np.expm1(-(out - gain) * found.times / 100.0)
    assert found.temperatures[:, 0] == pytest.approx(closed, rel=1e-7)
    level = integrate(capacity, lambda time, nodes: np.full(1, 30.0), np.array([20.0]), 1000.0)
    assert level.temperatures[:, 0] == pytest.approx(20.0 + 0.3 * level.times, rel=1e-9)
    assert found.is_hot and found.temperatures[-1, 0] > 350.0 > found.temperatures[-2, 0]
    hot_after = -100.0 / (out - gain) * np.log1p(-330.0 * (out - gain) / 30.0)
    assert found.times[-2] < hot_after <= found.times[-1]
    # With a tenth of the heat, the one below the gain of one has a state that any oil bears.
    cool = integrate(capacity, lambda time, nodes: net(time, nodes) - 27.0, np.array([20.0]), 5e4)
    assert cool.is_hot is not steady


def _difference(capacities):
    whole, inflow = warming_network(warming_conductances(BATH, SEATS), AROUND)
    found = integrate(capacities, _constant(whole, inflow, HEAT), COLD, 8000.0).temperatures
    return found[:, INNER] - found[:, OUTER]


def test_unit_heavy_housing_holds_the_outer_ring_back():
    """Unit: the heavier the housing, the larger the lead of the inner ring, up to that of a housing that stays cold."""
    leads = []
    for factor in (0.3, 1.0, 3.0, 1e9):
        capacities = CAPACITIES.copy()
        capacities[HOUSING] *= factor
        leads.append(_difference(capacities).max())
    assert leads == sorted(leads) and leads[-1] - leads[0] > 3.0
    # A housing of infinite mass is the surroundings behind the seat.
    cold = BATH._replace(outer_ambient=60.0 * 1e6 / (60.0 + 1e6))
    whole, inflow = warming_network(warming_conductances(cold, Seats(60.0 * 1e3, SEATS.shaft)), AROUND)
    steady = np.linalg.solve(whole, HEAT + inflow)
    assert leads[-1] == pytest.approx(steady[INNER] - steady[OUTER], rel=0.02)


def test_unit_rings_alike_do_not_overshoot():
    """Unit: rings with the same capacity, heat and conductances stay as warm as each other, and their rise has no overshoot."""
    alike = Conductances(0.0, 8.0, 8.0, 12.0, 18.0, 18.0, 2.0, 2.0, 2.0)
    whole, inflow = warming_network(warming_conductances(alike, Seats(60.0, 60.0)), AROUND)
    capacities, heat = np.array([40.0, 110.0, 110.0, 100.0, 600.0, 600.0]), np.array([45.0, 25.0, 25.0, 50.0, 0.0, 0.0])
    found = integrate(capacities, _constant(whole, inflow, heat), COLD, 8000.0).temperatures
    assert found[:, INNER] == pytest.approx(found[:, OUTER], abs=1e-7)
    assert np.diff(found[:, OUTER]).min() > -1e-5
    assert not leasts_of(np.arange(len(found)), 30.0 - 0.7 * (found[:, INNER] - 20.0))[2]


def test_unit_machines_together_warm_as_alone():
    """Unit: machines of one integration that do not meet are as warm as each of them alone."""
    law, course = _law(), _steady_course()
    capacities = CAPACITIES * np.array([0.5, 1.0, 4.0])[:, np.newaxis]
    together = integrate(capacities, law.net_heat(course), np.tile(COLD, (3, 1)), 3000.0)
    for place, own in enumerate(capacities):
        alone = integrate(own, law.net_heat(course), COLD, 3000.0)
        assert together.temperatures[:, place] == pytest.approx(alone.temperatures, abs=1e-3)


def _moment(temperature, powers, course=FULL):
    nodes = np.full(len(WARMING_NODES), temperature)
    return Moment(nodes, course, np.asarray(powers), warming_network(warming_conductances(BATH, SEATS), AROUND))


FILMS = np.array([[0.0, 0.5, 0.0, 0.5, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
SHARES = np.array([[0.3, 0.35, 0.0, 0.35, 0.0, 0.0], [0.5, 0.0, 0.5, 0.0, 0.0, 0.0]])
PRIORS = np.array([[0.7, 1.7, 0.0], [0.0, 1.0, 0.0]])
LOSSES = Losses(COLD[:4], np.ones(2), PRIORS[:, 0], FILMS[:, :4], VISCOSITY)
MODEL = HeatModel(LOSSES, SHARES[:, :4], BATH, AROUND, no_residue())
REACH = np.vstack((FILMS / 15.0, np.array([[0.0, 0.3, -0.3, -0.2, 0.0, 0.0]]))), np.array([0.35, 0.35])


def _true_powers(temperature, course=FULL):
    """Powers of laws that moments show: eta^0.6 n^1.5 F^0.2, and n^2.8."""
    change, (speed, load) = -(temperature - 20.0) / 30.0, np.asarray(course) - FULL
    return np.array([200.0 * np.exp(0.6 * change + 1.5 * speed + 0.2 * load), 50.0 * np.exp(2.8 * speed)])


def _law(moments=None):
    moments = moments or [_moment(20.0, _true_powers(20.0)), _moment(60.0, _true_powers(60.0))]
    return law_of(moments, MODEL, REACH)


def _steady_course():
    return Course(np.zeros(1), np.array([4000.0]), np.array([4000.0]))


def test_unit_power_laws_are_found_from_moments():
    """Unit: moments of power laws give their exponents, and between moments, whatever their spacing, the powers of the law."""
    half, light = FULL + np.log([0.5, 1.0]), FULL + np.log([1.0, 0.25])
    moments = [_moment(t, _true_powers(t, c), c) for t, c in ((20.0, FULL), (70.0, FULL), (45.0, half), (45.0, light))]
    law = _law(moments)
    assert law.exponents == pytest.approx(np.array([[0.6, 1.5, 0.2], [0.0, 2.8, 0.0]]), abs=0.02)
    exact = law._replace(exponents=np.array([[0.6, 1.5, 0.2], [0.0, 2.8, 0.0]]))
    for temperature, course in ((33.0, FULL), (90.0, half + np.log([0.9, 0.7]))):
        nodes = np.full(6, temperature)
        powers = exact.powers_at(nodes, course, exact.weights(nodes, course))
        assert powers == pytest.approx(_true_powers(temperature, course), rel=1e-12)
    two = _law()
    nodes = np.array([two.temperatures[0], two.temperatures[1]])
    assert two.weights(nodes, FULL) == pytest.approx(np.eye(2), abs=1e-9)
    assert two.weights(np.full(6, 40.0), FULL) == pytest.approx([0.5, 0.5])


def test_unit_moments_at_rest_and_without_a_power():
    """Unit: a machine at rest has no heat, whatever its moments; a term without power at a moment keeps its exponents."""
    silent = [_moment(20.0, [200.0, 0.0]), _moment(60.0, [100.0, 10.0])]
    law = _law(silent)
    assert np.array_equal(law.exponents[1], PRIORS[1])
    stop = Course(np.array([0.0, 100.0]), np.array([4000.0, 0.0]), np.array([4000.0, 4000.0]))
    whole, inflow = law.matrices[0], law.sources[0]
    assert law.net_heat(stop)(200.0, COLD + 5.0) == pytest.approx(inflow - whole @ (COLD + 5.0))
    assert law.heat(COLD, FULL, 0.0) == pytest.approx(np.zeros(6)) and law.heat(COLD, FULL).sum() == pytest.approx(
        200.0
    )


def test_unit_rows_and_figures_of_a_course():
    """Unit: rows rise, meet the breaks, and least and settling times of known curves come out between them."""
    times = rows_of(3600.0, (60.0, 600.0))
    assert (np.diff(times) > 0.0).all() and {0.0, 60.0, 600.0, 3600.0} <= set(times.tolist())
    assert len(rows_of(3600.0)) < 200
    # 30 (1 - exp(-t/50)) - 40 (1 - exp(-t/400)) falls to its least where 0.6 exp(-t/50) = 0.1 exp(-t/400).
    play = 30.0 - 30.0 * -np.expm1(-times / 50.0) + 20.0 * -np.expm1(-times / 400.0)
    least, time, inside = leasts_of(times, play)
    expected = np.log(0.6 / 0.05) / (1.0 / 50.0 - 1.0 / 400.0)
    assert time == pytest.approx(expected, rel=0.01) and inside
    exact = 30.0 - 30.0 * -np.expm1(-expected / 50.0) + 20.0 * -np.expm1(-expected / 400.0)
    assert least == pytest.approx(exact, rel=1e-4)
    assert not leasts_of(times, -times)[2] and leasts_of(times, -times)[1] == 3600.0
    table = 20.0 + 50.0 * -np.expm1(-times / 400.0)[:, np.newaxis]
    assert settled_times(times, table, 1.0) == pytest.approx(400.0 * np.log(50.0), rel=0.05)
    assert settled_times(times, table, 90.0) == 0.0
    # Columns together have the bits of each alone, also where rows are few.
    both = np.column_stack((play, -times))
    for rows in (both, both[:2]):
        together = leasts_of(times[: len(rows)], rows)
        alone = [leasts_of(times[: len(rows)], column) for column in rows.T]
        assert [tuple(map(float, each)) for each in zip(*together, strict=True)] == [
            tuple(map(float, each)) for each in alone
        ]
    assert seat(6.5e-3, 12.5e-6, 0.13, 0.9e-6) == pytest.approx(0.13 * 6.5e-3 / 13.4e-6)
