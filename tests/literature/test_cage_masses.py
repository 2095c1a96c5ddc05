"""The estimate of a cage compared with what a maker's catalogue weighs beyond rings and rollers."""

from __future__ import annotations

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
    """Literature: brass cages weigh what the estimate says, in the middle, and seven in ten within its error."""
    ratios, scales, errors = zip(*(CAGES["cage_over_catalogue"](series) for series in every), strict=True)
    found, error = np.concatenate(ratios), 0.01 * errors[0]
    assert found.size == count and min(scales) > 0.95 and max(scales) < 1.0
    assert np.median(found) == pytest.approx(1.0, abs=0.05)
    assert np.mean((1.0 / found > 1.0 - error) & (1.0 / found < 1.0 + error)) >= 0.7


def test_invariant_mass_and_section_are_one_cage():
    """Invariant: the volume is that of the bars and rings whose stiffness is worked out, to the rounding of its sizes."""
    cage = cage_estimate("2", 20.0, 17, 11.0, 11.108, 70.5)
    pockets = 17 * (11.0 + cage.pocket_clearance) * cage.bar_length
    whole = math.pi * 70.5 * (cage.bar_length + 2.0 * cage.side_ring_width)
    assert cage.volume == pytest.approx(cage.bar_thickness * (whole - pockets), rel=2e-3)
    (mass,) = (each for each in documented() if each.key == "cage.mass_g")
    assert (mass.low, mass.high) == (0.75, 1.25)


def test_unit_the_tables_of_cages_are_whole():
    """Unit: a row a series and a row a bearing, bars of polyamide softer than those of brass by their moduli."""
    assert CAGES["masses"]().count("\n") == 6
    rows = [line.split("|")[3:6] for line in CAGES["bars"]().splitlines()[2:]]
    assert len(rows) == 11
    for brass, clamped, soft in (map(float, row) for row in rows):
        assert brass < clamped and soft == pytest.approx(brass * 5.0 / 105.0, rel=0.1)
