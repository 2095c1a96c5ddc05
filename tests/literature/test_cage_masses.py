"""The estimate of a cage compared with what a maker's catalogue weighs beyond rings and rollers."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
from conftest import ROOT

from rbdyn.properties.cages import cage_estimate
from rbdyn.properties.catalogue import Envelope, roller_interior
from rbdyn.scene.uncertain import documented

STEEL, BRASS, POLYAMIDE = 7.827e-6, 8.5e-6, 1.3e-6  # [kg/mm^3]


def bearings(series):
    """Of each bearing of a series: whether its cage is of brass, mass and mass of rings and rollers [kg], cage's volume [mm^3]."""
    lines = (ROOT / "tests" / "helpers" / "catalogue_masses.csv").read_text(encoding="utf-8").splitlines()
    for row in csv.DictReader(line for line in lines if not line.startswith("#")):
        if row["size"][:-2] != series:
            continue
        known = {key: float(value) for key, value in row.items() if value and key not in ("size", "suffix")}
        bore, outside, width = known["bore"], known["outside"], known["width"]
        races = known["inner_raceway"], known.get("outer_raceway")
        inside = roller_interior(Envelope(bore, outside, width, 1.0, 1e3 * known["C0"], *races), series == "10")
        diameter, length, pitch = inside.roller_diameter, inside.roller_length, inside.pitch_diameter
        inner, outer = pitch - diameter, pitch + diameter
        # A plain inner ring, an outer one with flanges beside the rollers.
        rings = (inner**2 - bore**2) * width + (outer**2 - outside**2) * -width
        rings += (outer**2 - known["shoulder"] ** 2) * (width - length)
        steel = STEEL * 0.25 * math.pi * (rings + inside.rollers * diameter**2 * length)
        cage = cage_estimate(series, width, inside.rollers, diameter, length, pitch)
        yield "M" in row["suffix"], known["mass"], steel, cage.volume, cage.cage_error


def cage_over_catalogue(series):
    """Estimated over catalogue's mass of each brass cage of a series, and the error stated [%]."""
    rows = list(bearings(series))
    # Chamfers and undercuts: steel is scaled so that bearings with light cages have their mass.
    scale = np.median([(mass - POLYAMIDE * volume) / steel for brass, mass, steel, volume, _ in rows if not brass])
    assert 0.95 < scale < 1.0
    ratios = [BRASS * volume / (mass - scale * steel) for brass, mass, steel, volume, _ in rows if brass]
    return ratios, rows[0][-1]


@pytest.mark.parametrize(("every", "count"), [(("10",), 26), (("22",), 16), (("2", "3", "23"), 35)])
def test_literature_cage_masses(every, count):
    """Literature: brass cages weigh what the estimate says, in the middle, and seven in ten within its error."""
    ratios, errors = zip(*(cage_over_catalogue(series) for series in every), strict=True)
    found, error = np.concatenate(ratios), 0.01 * errors[0]
    assert found.size == count
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
