"""The thermal network: closed forms of one and two nodes, energy, tight couplings, nodes without a way out."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbdyn.thermal.network import NODES, Boundaries, Conductances, carried_off, matrix, source, temperatures

USUAL = Conductances(30.0, 8.0, 5.0, 12.0, 18.0, 11.0, 7.0, 4.0)
INLET_WARM = Boundaries(inlet=60.0, ambient=20.0)
# Log-uniform conductances over nine decades, zero for those that may be missing.
some = st.floats(-4.0, 5.0).map(lambda exponent: 10.0**exponent)
perhaps = st.one_of(st.just(0.0), some)
networks = st.builds(Conductances, some, some, some, some, perhaps, perhaps, perhaps, perhaps, perhaps)


def test_unit_one_node():
    """Unit: heat in the oil alone, without seats: all nodes at the inlet plus heat over the oil's conductance."""
    alone = USUAL._replace(outer_ambient=0.0, inner_ambient=0.0)
    found = temperatures(alone, INLET_WARM, np.array([90.0, 0.0, 0.0, 0.0]))
    assert found == pytest.approx(np.full(4, 63.0), rel=1e-14)


def test_unit_two_nodes():
    """Unit: oil and outer ring alone have the closed form of two nodes; what is tied to the oil has its temperature."""
    flow, film, seat = 30.0, 8.0, 7.0
    network = Conductances(flow, film, 5.0, 12.0, 0.0, 0.0, seat, 0.0)
    oil, outer = 200.0, 100.0
    found = temperatures(network, INLET_WARM, np.array([oil, outer, 0.0, 0.0]))
    first, second = oil + flow * 60.0, outer + seat * 20.0
    determinant = (flow + film) * (film + seat) - film**2
    at_oil = (first * (film + seat) + second * film) / determinant
    at_outer = (second * (flow + film) + first * film) / determinant
    assert found == pytest.approx([at_oil, at_outer, at_oil, at_oil], rel=1e-14)


def test_unit_sump_of_a_bath():
    """Unit: without a sump the balance is the former one; an endless one holds the oil at the surroundings; one node has the closed form."""
    heat = np.array([100.0, 40.0, 60.0, 80.0])
    bath = USUAL._replace(flow=0.0)
    assert np.array_equal(matrix(bath), matrix(bath._replace(sump=0.0)))
    small = temperatures(bath._replace(sump=1e-9), INLET_WARM, heat)
    assert small == pytest.approx(temperatures(bath, INLET_WARM, heat), rel=1e-9)
    endless = temperatures(bath._replace(sump=1e12), INLET_WARM, heat)
    assert endless[0] == pytest.approx(INLET_WARM.ambient, abs=1e-9) and endless[3] > endless[0]
    oil = bath._replace(sump=1.5, outer_ambient=0.0, inner_ambient=0.0)
    assert temperatures(oil, INLET_WARM, np.array([90.0, 0.0, 0.0, 0.0])) == pytest.approx(np.full(4, 80.0), rel=1e-14)


def test_unit_equations_of_the_network():
    """Unit: the temperatures solve G T = Q + b, and G^-1 is their derivative by heat."""
    heat = np.array([100.0, 40.0, 60.0, 80.0])
    found = temperatures(USUAL, INLET_WARM, heat)
    assert matrix(USUAL) @ found == pytest.approx(heat + source(USUAL, INLET_WARM), rel=1e-13)
    more = [temperatures(USUAL, INLET_WARM, heat + unit) - found for unit in np.eye(4)]
    assert np.transpose(more) == pytest.approx(np.linalg.inv(matrix(USUAL)), rel=1e-10)


@settings(max_examples=300, deadline=None)
@given(networks, st.lists(st.floats(0.0, 1e4), min_size=4, max_size=4), st.floats(-20.0, 150.0))
def test_unit_energy_in_is_energy_out(network, heat, inlet):
    """Unit: the heat of the nodes leaves by oil, sump, housing and shaft, to 1e-12 of what the ways carry."""
    boundaries, heat = Boundaries(inlet, 20.0), np.array(heat)
    found = temperatures(network, boundaries, heat)
    ways = carried_off(network, boundaries, found)
    carried = heat.sum() + sum(abs(way) for way in ways.values())
    # A temperature in C has sixteen digits, and each way carries its round-off.
    largest = max(abs(found).max(), abs(inlet), 20.0)
    round_off = np.finfo(float).eps * sum((network.flow, *network[6:])) * largest
    assert abs(sum(ways.values()) - heat.sum()) <= 1e-12 * carried + 4.0 * round_off


def test_unit_energy_of_usual_networks():
    """Unit: energy in equals energy out to 1e-12 of the heat, with seats and a warm inlet."""
    heat = np.array([120.0, 35.0, 55.0, 70.0])
    for boundaries in (INLET_WARM, Boundaries(20.0, 20.0), Boundaries(20.0, 60.0)):
        ways = carried_off(USUAL, boundaries, temperatures(USUAL, boundaries, heat))
        assert sum(ways.values()) == pytest.approx(heat.sum(), rel=1e-12)


@settings(max_examples=300, deadline=None)
@given(networks)
def test_unit_matrix_is_symmetric_and_positive_definite(network):
    """Unit: G is symmetric; its quadratic form is the heat of all couplings and ways out, hence positive."""
    whole = matrix(network)
    assert np.array_equal(whole, whole.T)
    assert np.all(np.linalg.eigvalsh(whole) > -1e-12 * whole.max())
    # The determinant is a product of the pivots, which the elimination forms without a subtraction.
    rises = temperatures(network, Boundaries(0.0, 0.0), np.ones(4))
    assert np.all(rises > 0.0)


def test_unit_tight_network_keeps_its_digits():
    """Unit: couplings 1e14 times as large as the way out leave one temperature, exact to round-off."""
    tight = Conductances(0.0, 5e15, 4e15, 6e15, 20e15, 10e15, 9.0, 5.0)
    found = temperatures(tight, INLET_WARM, np.array([100.0, 200.0, 300.0, 100.0]))
    assert found == pytest.approx(np.full(4, 70.0), rel=1e-14)


def test_unit_nodes_are_named_once():
    """Unit: four nodes in the order of the arrays."""
    assert NODES == ("oil", "outer", "inner", "rollers") and matrix(USUAL).shape == (4, 4)
