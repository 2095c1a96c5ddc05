"""Static stiffness of a row of rollers over its clearance: known answers, closed forms, symmetry."""

import math
from functools import partial

import numpy as np
import pytest
from conftest import ROOT

from rbdyn.base.faults import MethodError
from rbdyn.contact.hertz_line import iso_16281
from rbdyn.dynamics.part_figures import row_stiffness
from rbdyn.life.rollers import RollerContacts, static_stiffness, turned
from rbdyn.scene import Scene

LINE = iso_16281(2.2637e11, 10.595e-3).stiffness


def contacts(angle=None, slices=1):
    """Rollers without profile or tilt, alike at every azimuth."""
    return RollerContacts(LINE, (np.zeros((1, slices)), np.zeros((1, slices))))


@pytest.mark.parametrize(
    ("load", "clearance", "along", "across"),
    [
        (1e3, 0.0, 595, 542), (1e3, 20.0, 480, 87), (1e3, 52.5, 410, 45), (1e3, 80.0, 370, 30),
        (8.3e3, 0.0, 735, 670), (8.3e3, 20.0, 716, 343), (8.3e3, 52.5, 671, 206), (8.3e3, 80.0, 629, 143),
    ],
)  # fmt: skip
def test_literature_nu_209(load, clearance, along, across):
    """NU 209, computed apart from this code: within 2 % along the load, 8 % across it; four times the places move it by 1.3 %."""
    stiffness = static_stiffness(contacts, 15, load, clearance * 1e-6)
    assert stiffness.along * 1e-6 == pytest.approx(along, rel=0.02)
    assert stiffness.across * 1e-6 == pytest.approx(across, rel=0.08, abs=2.5)


def test_half_a_pitch_shows_the_whole_of_it():
    """Rings without tilt: as many places in half a pitch are twice as many in the whole, and err by a tenth of a per cent."""
    of = partial(static_stiffness, contacts, 15, 1e3, 5.25e-5)
    half, whole, fine = of(places=64, symmetric=True), of(places=128), of(places=4096)
    assert half.matrix == pytest.approx(whole.matrix, rel=1e-9, abs=1e-9 * whole.along)
    assert half.travel == pytest.approx(whole.travel, rel=1e-9)
    assert (half.along, half.across) == pytest.approx((fine.along, fine.across), rel=2e-3)


def test_laminae_of_a_cylinder_change_nothing():
    plain, sliced = (static_stiffness(partial(contacts, slices=slices), 15, 3e3, 2e-5, places=4) for slices in (1, 7))
    assert sliced.along == pytest.approx(plain.along, rel=1e-6)
    assert sliced.across == pytest.approx(plain.across, rel=1e-6)


def test_preload_stiffens_alike_in_every_direction():
    """A light load on a preloaded row: Z k/2 along and across, k that of two contacts in series at half the interference."""
    # Each contact takes half of the approach of 10 um.
    expected = 0.5 * 15 * 0.5 * (10 / 9) * LINE * 5e-6 ** (1 / 9)
    for load in (0.0, 1.0):
        stiffness = static_stiffness(contacts, 15, load, -2e-5, places=4)
        assert (stiffness.along, stiffness.across) == pytest.approx((expected, expected), rel=1e-4)


def test_one_pair_of_rollers_bears_a_light_load_in_a_wide_clearance():
    """Two rollers at half a pitch: 2 k cos^2 and 2 k sin^2 of pi/Z, k = dQ/d delta of two contacts in series at Q = W/(2 cos)."""
    rollers, load = 9, 200.0
    lean = math.pi / rollers
    stiffness = static_stiffness(contacts, rollers, load, 1e-3, places=1)
    one = 0.5 * (10 / 9) * LINE**0.9 * (0.5 * load / math.cos(lean)) ** 0.1
    expected = 2.0 * one * np.array([math.cos(lean) ** 2, math.sin(lean) ** 2])
    assert (stiffness.along, stiffness.across) == pytest.approx(expected, rel=1e-6)


def test_a_rigid_ring_rolls_across_its_clearance():
    """As loads vanish the centre is where two rollers touch: over a pitch s tan(pi/Z) across, s (1/cos(pi/Z) - 1)/2 along."""
    rollers, clearance = 12, 1e-4
    travel = static_stiffness(contacts, rollers, 1e-3, clearance).travel
    lean = math.pi / rollers
    assert travel[1] == pytest.approx(clearance * math.tan(lean), rel=3e-3)
    assert travel[0] == pytest.approx(0.5 * clearance * (1.0 / math.cos(lean) - 1.0), rel=1e-2)


def test_stiffness_is_the_slope_of_the_load():
    """Along the load: the force by which the ring must be pushed a little further, from two balances at one place of the rollers."""
    ends = [static_stiffness(contacts, 15, load, 2e-5, places=1) for load in (2999.0, 3001.0)]
    slope = static_stiffness(contacts, 15, 3000.0, 2e-5, places=1)
    assert slope.along == pytest.approx(0.5 * (ends[0].along + ends[1].along), rel=1e-6)


def test_axes_turn_with_the_load():
    """A load along y swaps both stiffnesses; one at 45 degrees couples them by half their difference; traces stay."""
    stiffness = np.diag([5e8, 1e8])
    assert turned(stiffness, -0.5 * math.pi) == pytest.approx(np.diag([1e8, 5e8]), abs=1.0)
    assert turned(stiffness, 0.25 * math.pi) == pytest.approx(np.array([[3e8, 2e8], [2e8, 3e8]]))


def test_centrifugal_force_parts_rollers_from_the_inner_race():
    """It takes the least loaded rollers out of the load zone, so the ring is softer; at a high one a light preload is gone."""
    still, spinning = (static_stiffness(contacts, 15, 1e3, 1e-5, force) for force in (0.0, 300.0))
    assert spinning.across < still.across
    with pytest.raises(MethodError, match="no roller carries load"):
        static_stiffness(contacts, 15, 0.0, -1e-6, 3e3)


def test_zero_load_in_a_clearance_is_refused():
    with pytest.raises(MethodError, match="give a load or an interference"):
        static_stiffness(contacts, 15, 0.0, 2e-5)


SCENE = ROOT / "examples" / "cylindrical_roller.toml"


def stiffness_of(*assignments):
    return row_stiffness(Scene.load(SCENE, assignments))


def test_profile_and_tilt_soften():
    """A crowned roller is softer than a cylinder; a tilt about the load's direction keeps the symmetry, another one couples x and y."""
    plain, crowned = stiffness_of(), stiffness_of("bearing.roller_profile='crowned'", "bearing.crown_radius_mm=400")
    tilts = ["bearing.tilt_mrad=1", "bearing.roller_profile='crowned'", "bearing.crown_radius_mm=400"]
    straight, askew = (stiffness_of(*tilts, f"bearing.tilt_direction_deg={angle}") for angle in (0, 40))
    assert crowned.along < plain.along and straight.along < crowned.along
    for symmetric in (plain, crowned, straight):
        assert abs(symmetric.matrix[0, 1]) < 1e-6 * symmetric.across
    assert abs(askew.matrix[0, 1]) > 1e-3 * askew.across
    assert askew.matrix[0, 1] == pytest.approx(askew.matrix[1, 0], rel=1e-6)


def test_the_operating_clearance_counts():
    """With fits the drawn clearance shrinks, and the ring is stiffer across the load, as at that clearance without fits."""
    fits = ("mounting.inner_interference_um=12", "mounting.bore_mm=30",
            "mounting.outside_diameter_mm=57", "mounting.housing_diameter_mm=90")  # fmt: skip
    mounted = Scene.load(SCENE, fits)
    assert mounted.geometry.clearance < mounted.bearing.radial_clearance - 2e-6
    bare = row_stiffness(Scene.load(SCENE), clearance=mounted.geometry.clearance)
    assert row_stiffness(mounted).across == pytest.approx(bare.across, rel=1e-3) and bare.across > stiffness_of().across
