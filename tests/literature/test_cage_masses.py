"""The estimate of a cage compared with what a maker's catalogue weighs beyond rings and rollers."""

import math
import runpy

import numpy as np
import pytest
from conftest import ROOT

from rbdyn.properties.catalogue import cage_estimate
from rbdyn.scene.uncertain import documented

CAGES = runpy.run_path(str(ROOT / "examples" / "benchmarks" / "cages.py"))


@pytest.mark.parametrize(("every", "count"), [(("10",), 26), (("22",), 16), (("2", "3", "23"), 35)])
def test_literature_cage_masses(every, count):
    """Literature: brass cages weigh what the estimate says, in the middle."""
    ratios, scales = zip(*(CAGES["cage_over_catalogue"](series) for series in every), strict=True)
    found = np.concatenate(ratios)
    assert found.size == count and min(scales) > 0.95 and max(scales) < 1.0
    assert np.median(found) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("key", ["cage.mass_g", "cage.bar_thickness_mm"])
def test_literature_nine_in_ten_cages_are_in_the_range_of_their_estimate(key):
    """Literature: the range of an estimated cage has nine in ten of 77 cages, and its variance is theirs within a quarter."""
    (law,) = (each for each in documented() if each.key == key)
    weights = 1.0 / np.concatenate([CAGES["cage_over_catalogue"](series)[0] for series in CAGES["SERIES"]])
    assert weights.size == 77 and 0.9 <= np.mean((weights > law.low) & (weights < law.high)) < 0.95
    assert (law.high - law.low) ** 2 / 12.0 == pytest.approx(np.mean((weights - 1.0) ** 2), rel=0.25)


def test_invariant_mass_and_section_are_one_cage():
    """Invariant: the volume is that of the bars and rings whose stiffness is worked out, to the rounding of its sizes."""
    cage = cage_estimate("2", 20.0, 17, 11.0, 11.108, 70.5)
    pockets = 17 * (11.0 + cage.pocket_clearance) * cage.bar_length
    whole = math.pi * 70.5 * (cage.bar_length + 2.0 * cage.side_ring_width)
    assert cage.volume == pytest.approx(cage.bar_thickness * (whole - pockets), rel=2e-3)


def test_unit_the_tables_of_cages_are_whole():
    """Unit: a row a series and a row a bearing, bars of polyamide softer than those of brass by their moduli."""
    assert CAGES["masses"]().count("\n") == 6
    rows = [line.split("|")[3:6] for line in CAGES["bars"]().splitlines()[2:]]
    assert len(rows) == 11
    for brass, clamped, soft in (map(float, row) for row in rows):
        assert brass < clamped and soft == pytest.approx(brass * 5.0 / 105.0, rel=0.1)
