"""What the model leaves out: each estimate by hand, and the notes where it matters."""

import math
from itertools import pairwise

import pytest
from scipy.integrate import quad

from rbdyn.dynamics.parameters.validity import (
    LEFT_OUT,
    cylinder_moment,
    disc_moment,
    friction_factor,
    left_out_notes,
    open_inner_films,
    spin_windage,
)

OIL, AIR = (900.0, 5e-3), (1.2, 1.8e-5)


def test_unit_disc_moment():
    """Unit: 0.5 rho w^2 r^5 C_n of both faces, on both sides of Re = 3e5; laminar it rises with w^1.5 and r^4."""
    # Re = 900 * 1e-4 * 100/5e-3 = 1800, C_n = 3.87/sqrt(1800) = 0.091217
    assert disc_moment(*OIL, 100.0, 0.01) == pytest.approx(0.5 * 900.0 * 1e4 * 1e-10 * 0.0912168, rel=1e-5)
    assert disc_moment(*OIL, 400.0, 0.01) / disc_moment(*OIL, 100.0, 0.01) == pytest.approx(8.0)
    assert disc_moment(*OIL, 100.0, 0.02) / disc_moment(*OIL, 100.0, 0.01) == pytest.approx(16.0)
    # Re = 900 * 0.01 * 1000/5e-3 = 1.8e6, C_n = 0.146/1.8e6^0.2 = 0.0081903
    assert disc_moment(*OIL, 1000.0, 0.1) == pytest.approx(0.5 * 900.0 * 1e6 * 1e-5 * 0.0081903, rel=1e-4)
    assert disc_moment(*OIL, 0.0, 0.01) == 0.0


def test_literature_rotating_cylinder():
    """Literature: Theodorsen and Regier 1944: the factor solves their law and is 0.0077 at Re = 1e4; slow, it is Stokes'
    4/Re, 4 pi eta w r^2 l of moment; the factor has no jump.
    """
    for reynolds in (90.0, 1e3, 1e5, 1e7):
        root = math.sqrt(friction_factor(reynolds))
        assert 1.0 / root == pytest.approx(-0.6 + 4.07 * math.log10(reynolds * root), rel=1e-9)
    assert friction_factor(1e4) == pytest.approx(0.0077, rel=5e-3)
    stokes = 4.0 * math.pi * AIR[1] * 2.0 * 0.01**2 * 0.05
    assert cylinder_moment(*AIR, 2.0, 0.01, 0.05) == pytest.approx(stokes, rel=1e-12)
    assert cylinder_moment(*AIR, 0.0, 0.01, 0.05) == 0.0
    near = [friction_factor(10.0 ** (0.001 * step)) for step in range(-3000, 6000)]
    assert all(0.99 < after / before <= 1.0 for before, after in pairwise(near))


def test_unit_windage_of_the_example(outer):
    """Unit: 12.7 W: of ten rollers, ends and surfaces at their spin against the cage, of the cage's faces and its rim."""
    oil = outer.lubricant.in_service
    mixture = 0.02 * oil.density + 0.98 * 1.2, oil.viscosity
    # Epicyclic, 24000 rpm, raceways 34.49 and 52.51 mm, roller 9 mm: cage 996 rad/s, spin against it 5813 rad/s.
    ends = 10.0 * 5813.2 * disc_moment(*mixture, 5813.2, 4.5e-3)
    surfaces = 10.0 * 5813.2 * cylinder_moment(*mixture, 5813.2, 4.5e-3, 5e-3)
    faces = 996.35 * (disc_moment(*mixture, 996.35, 24.75e-3) - disc_moment(*mixture, 996.35, 20.25e-3))
    rim = 996.35 * cylinder_moment(*mixture, 996.35, 20.25e-3, 6e-3)
    assert spin_windage(outer) == pytest.approx(ends + surfaces + faces + rim, rel=1e-4)
    assert spin_windage(outer) == pytest.approx(12.7, abs=0.1)


def test_unit_open_films_of_the_example(outer, make_scene):
    """Unit: 8 W, by quadrature over the open part of the circle; none where a preload closes every gap."""
    oil = outer.lubricant.in_service
    # 650 N on the most loaded roller; Palmgren: 3.84e-5 Q^0.9/l^0.8 mm of either race.
    clearance, approach = 10e-6, 2e-3 * 3.84e-5 * 650.0**0.9 / 3.5**0.8
    opens = math.acos(clearance / (clearance + approach))

    def root(s):  # the gap opens as s^2
        return 2.0 * s / math.sqrt(clearance - (clearance + approach) * math.cos(opens + s * s))

    mean = quad(root, 0.0, math.sqrt(math.pi - opens))[0] / math.pi
    films = 10.0 * 2.0 * 4.601 * oil.viscosity * 26.16**2 * 3.5e-3 * math.sqrt(3.569e-3) * mean
    assert open_inner_films(outer) == pytest.approx(films, rel=0.015)
    assert open_inner_films(make_scene("bearing.radial_clearance_mm=-0.004")) == 0.0
    wider = make_scene("bearing.radial_clearance_mm=0.08")
    assert open_inner_films(wider) < open_inner_films(outer)


def test_unit_notes_only_where_it_matters(outer, make_scene):
    """Unit: power is told beyond three hundredths of the loss, skew and flanges where rings are tilted, an elastic cage
    where it is soft; the list names all that is left out.
    """
    windage = spin_windage(outer)
    assert tuple(left_out_notes(outer, 1e4)) == ()
    (told,) = left_out_notes(outer, windage / 0.031)
    assert "windage of spinning rollers and cage" in told and "13 W (3.1 %" in told
    assert tuple(left_out_notes(outer, windage / 0.029)) == ()
    # Without any loss there is no share.
    assert tuple(left_out_notes(outer, 0.0)) == ()
    tilted = tuple(left_out_notes(make_scene("bearing.tilt_mrad=0.4"), 1e4))
    assert [note.split(", which")[0] for note in tilted] == [
        "not modelled: skew of rollers",
        "not modelled: contact of roller ends and flanges",
    ]
    (soft,) = left_out_notes(make_scene("materials.cage=peek"), 1e4)
    assert "elastic deformation of the cage ring" in soft
    assert tuple(left_out_notes(make_scene("materials.cage=brass"), 1e4)) == ()
    names = " ".join(item.name for item in LEFT_OUT)
    for word in ("windage", "films at unloaded inner", "churning", "skew", "flanges", "cage ring"):
        assert word in names
    assert all(item.changes and item.estimate for item in LEFT_OUT)


def test_unit_result_carries_the_notes(outer_result):
    """Unit: a result says what its own power loss makes noticeable."""
    assert any("not modelled: windage" in note for note in outer_result.notes)
