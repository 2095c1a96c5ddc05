"""How a double-decker bearing divides its speed: published rule, limits, invariants."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbdyn.quasistatic.double_decker import (
    RPM,
    LayerFriction,
    balanced_split,
    load_torque,
    oil_share,
    oil_torque,
    static_equivalent_load,
)

INNER, OUTER = 18e-3, 33.5e-3
THIN = 10e-6  # kinematic viscosity [m^2/s]
SPEED = 40000.0 * RPM


def layers(inner_load=0.0, outer_load=0.0, viscosity=THIN):
    """Both layers of the paper's bearing."""
    return LayerFriction(INNER, viscosity, inner_load), LayerFriction(OUTER, viscosity, outer_load)


def test_literature_share_of_oil():
    """Literature: eq 13 gives the middle ring of 18 and 33.5 mm 5.76 % of the speed: 2303 of 40000 rpm."""
    share = oil_share(INNER, OUTER)
    assert share == pytest.approx(18.0**4.5 / (18.0**4.5 + 33.5**4.5), rel=1e-13)
    assert share * SPEED / RPM == pytest.approx(2303.2, abs=0.1)
    assert oil_share(0.03, 0.03) == 0.5


def test_literature_palmgren_in_his_units():
    """Literature: both branches of M0 and M1 in N mm, by hand."""
    assert oil_torque(3000.0 * RPM, 0.05, 20e-6, 2.0) == pytest.approx(1e-10 * 2.0 * 60000.0 ** (2 / 3) * 50.0**3)
    assert oil_torque(-10.0 * RPM, 0.05, 20e-6, 2.0) == pytest.approx(160e-10 * 2.0 * 50.0**3)
    angle = math.radians(15.0)
    # P0 = 0.5 (100) + 0.46 (200) = 142 N, P1 = 0.9 (200) cot 15 - 10 = 661.8 N.
    by_hand = 0.001 * (142.0 / 1180.0) ** 0.33 * (0.9 * 200.0 / math.tan(angle) - 10.0) * 18e-3
    assert load_torque(100.0, 200.0, angle, 18e-3, 1180.0) == pytest.approx(by_hand, rel=1e-12)
    assert static_equivalent_load(100.0, 10.0, angle) == 100.0
    assert static_equivalent_load(0.0, 100.0, math.radians(27.5)) == pytest.approx(35.5)


@given(
    inner=st.floats(-60000.0, 60000.0),
    outer=st.floats(-60000.0, 60000.0),
    pitch=st.floats(0.35, 1.0),
    viscosity=st.floats(5e-6, 500e-6),
)
@settings(max_examples=60, deadline=None)
def test_limit_without_load_both_rules_agree(inner, outer, pitch, viscosity):
    """Limit: the balance of oil torques alone is eq 13, in any sense of both rings, while both layers run fast."""
    whole = (inner - outer) * RPM
    share = oil_share(pitch * OUTER, OUTER)
    slowest = min(share, 1.0 - share) * abs(inner - outer) * viscosity * 1e6
    if slowest < 2100.0:
        return
    friction = [LayerFriction(dm, viscosity) for dm in (pitch * OUTER, OUTER)]
    split = balanced_split(*friction, inner * RPM, outer * RPM)
    assert split.status == "shared"
    assert split.share == pytest.approx(share, rel=1e-9)
    expected = outer * RPM + share * whole
    assert split.speed == pytest.approx(expected, abs=1e-9 * abs(whole))
    assert math.copysign(1.0, split.torque) == math.copysign(1.0, whole)


def test_limit_heavy_load_stops_the_layer_that_rubs_more():
    """Limit: as load outweighs oil, the layer of the smaller torque takes all the speed, whichever it is."""
    stands = balanced_split(*layers(1.0, 2.0), SPEED)
    assert (stands.status, stands.share, stands.speed) == ("outer layer stands", 0.0, 0.0)
    carried = balanced_split(*layers(2.0, 1.0), SPEED)
    assert (carried.status, carried.share, carried.speed) == ("inner layer stands", 1.0, SPEED)
    # A carried middle ring hands on what the turning outer layer needs, not what the inner could.
    assert carried.torque == pytest.approx(layers(0.0, 1.0)[1].torque(SPEED))
    reversed_ = balanced_split(*layers(2.0, 1.0), 0.0, SPEED)
    assert (reversed_.speed, reversed_.torque) == (0.0, -carried.torque)


@given(
    loads=st.tuples(st.floats(0.0, 0.05), st.floats(0.0, 0.05)),
    rpm=st.floats(-60000.0, 60000.0).filter(lambda n: abs(n) > 1.0),
    viscosity=st.floats(1e-6, 500e-6),
)
@settings(max_examples=100, deadline=None)
def test_invariant_torques_balance_or_a_layer_stands(loads, rpm, viscosity):
    """Invariant: shared means equal torques; standing means that the other layer cannot break it away."""
    inner, outer = layers(*loads, viscosity)
    split = balanced_split(inner, outer, rpm * RPM)
    hands_on, holds = inner.torque((1.0 - split.share) * rpm * RPM), outer.torque(split.share * rpm * RPM)
    if split.status == "shared":
        assert hands_on == pytest.approx(holds, rel=1e-9)
        assert abs(split.torque) == pytest.approx(holds, rel=1e-9)
    elif split.status == "outer layer stands":
        assert hands_on <= outer.torque(0.0)
    else:
        assert split.status == "inner layer stands"
        assert holds <= inner.torque(0.0)


def test_unit_no_answer_is_told():
    """Unit: equal and constant torques leave the share open; rings that turn together leave nothing to share."""
    twins = 2 * [LayerFriction(OUTER, 1e-6, 0.01)]
    open_ = balanced_split(*twins, 10.0 * RPM)
    assert (open_.status, open_.share) == ("undetermined", 0.5)
    together = balanced_split(*layers(), SPEED, SPEED)
    assert (together.status, together.speed, together.torque) == ("no relative speed", SPEED, 0.0)


def test_unit_load_moves_the_share_off_that_of_oil():
    """Unit: load torque on the inner layer drags the middle ring along, on the outer it holds it back."""
    bare = balanced_split(*layers(), SPEED).share
    dragged, held = balanced_split(*layers(0.003, 0.0), SPEED), balanced_split(*layers(0.0, 0.003), SPEED)
    assert held.share < bare < dragged.share
