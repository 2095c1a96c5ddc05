"""Films of open inner contacts: the law against Reynolds's equation, its limits, and bearings that it drives."""

import math

import numpy as np
import pytest
from line_film_oracle import rigid
from scipy.integrate import quad

from rbdyn.base.faults import InputError
from rbdyn.contact.film_thickness import film_in_service
from rbdyn.contact.rolling_resistance import film_forces, inlet, layer_shape, open_film, touching_gap
from rbdyn.dynamics.parameters.model import oil_layer, roller_bearing, rolling_contacts
from rbdyn.dynamics.parameters.validity import film_drive_notes, left_out_notes, open_inner_films, traction_law_notes
from rbdyn.dynamics.simulate import simulate

OIL, RADIUS, LENGTH, SPEED = 0.01, 4.6e-3, 0.01, 5.0


@pytest.mark.parametrize("meniscus", [0.2, 1.0, 2.0, 5.0, 10.0, 100.0])
def test_oracle_rolling_force_of_a_starved_pair(meniscus):
    """Oracle: half the integral of (h - h_e) p' by quadrature, with the film's end by root finding."""
    assert inlet(meniscus).rolling == pytest.approx(2.0 * rigid(meniscus)[1], rel=1e-7)


def test_literature_flooded_pair():
    """Literature: 4.601 eta u l sqrt(R/h) for each surface (Martin 1916), the film's end at 0.475 sqrt(2 R h); film and
    streamers together shear between 3/4 and the whole of a full gap's pi.
    """
    flooded = inlet(math.inf)
    assert 6.0 * math.sqrt(2.0) * flooded.rolling == pytest.approx(4.601, abs=5e-4)
    assert flooded.end == pytest.approx(0.4751, abs=5e-5)
    assert 0.75 * math.pi < flooded.shear < math.pi


def test_rate_short_inlet():
    """Rate: a short film of length M ends at M/2, where the mean of X^2 - X_e^2 vanishes, and rolls as M^5."""
    near, nearer = inlet(2e-3), inlet(1e-3)
    assert nearer.end == pytest.approx(0.5e-3, rel=1e-5)
    assert near.rolling < 1e-8 and nearer.rolling < 0.2 * near.rolling


def test_unit_scales_of_the_film():
    """Unit: far above the touching gap both forces go as 1/sqrt(gap) by the closed form; in contact there are none; between
    they rise and fall without a jump.
    """
    film = open_film(OIL, RADIUS, LENGTH, 0.8, 1e-7)
    rolling, sliding = film_forces(film, -20e-6, SPEED, 2.0)
    assert rolling == pytest.approx(0.8 * 4.601 * OIL * SPEED * LENGTH * math.sqrt(RADIUS / 20e-6), rel=2e-4)
    full = math.pi * OIL * 2.0 * LENGTH * math.sqrt(2.0 * RADIUS / 20e-6)
    assert 0.75 * full < sliding < full
    assert film_forces(film, 1e-6, SPEED, 2.0) == film_forces(film, 0.0, SPEED, 2.0) == (0.0, 0.0)
    gaps = np.geomspace(1e-10, 1e-4, 400)
    forces = np.array([film_forces(film, -gap, SPEED, 2.0)[0] for gap in gaps])
    peak = int(forces.argmax())
    assert np.all(np.diff(forces[: peak + 1]) > 0.0) and np.all(np.diff(forces[peak:]) < 0.0)
    assert 0.5e-7 < gaps[peak] < 2e-7
    assert film_forces(film, -1e-5, -SPEED, -2.0) == tuple(-force for force in film_forces(film, -1e-5, SPEED, 2.0))


@pytest.mark.parametrize("ratio", [0.02, 0.2, 0.5, 0.8, 0.95, 0.989])
def test_oracle_film_that_a_layer_feeds(ratio):
    """Oracle: its rolling force and its shear are those of the pair whose meniscus lies where the gap has the layer's thickness,
    by quadrature; the streamers behind it fill the width in proportion to the flow.
    """
    meniscus = math.sqrt(1.0 / ratio**2 - 1.0)
    end = inlet(meniscus).end
    streamers = quad(lambda x: (1.0 + end * end) / (1.0 + x * x) ** 2, end, math.inf, epsabs=1e-12)[0]
    rolling, shear = layer_shape(ratio)
    assert rolling == pytest.approx(2.0 * rigid(meniscus)[1], abs=5e-6)
    assert shear == pytest.approx(math.atan(meniscus) + math.atan(end) + streamers, abs=3e-5)


def test_unit_a_layer_that_fills_every_gap_is_flooded_and_none_has_no_film():
    """Unit: a thick layer gives the flooded forces; at a gap of its thickness and beyond there are none, and they fall to there
    without a jump, the shear's last part too.
    """
    flooded, thick = (open_film(OIL, RADIUS, LENGTH, 0.8, 1e-7, layer) for layer in (None, 1e4))
    assert film_forces(thick, -20e-6, SPEED, 2.0) == pytest.approx(film_forces(flooded, -20e-6, SPEED, 2.0), rel=1e-4)
    film, none = (open_film(OIL, RADIUS, LENGTH, 0.8, 1e-7, layer) for layer in (10e-6, 0.0))
    assert film_forces(film, -10e-6, SPEED, 2.0) == film_forces(film, -40e-6, SPEED, 2.0) == (0.0, 0.0)
    assert film_forces(none, -1e-7, SPEED, 2.0) == (0.0, 0.0)
    gaps = np.linspace(5e-6, 10.5e-6, 2000)
    forces = np.array([film_forces(film, -gap, SPEED, 2.0) for gap in gaps])
    assert np.all(np.diff(forces, axis=0) <= 0.0)
    assert np.abs(np.diff(forces, axis=0)).max() < 0.02 * forces[0].max()


def test_unit_layer_of_equal_contacts(make_scene):
    """Unit: preload without load or speed to speak of gives every inner contact K (d/2)^(10/9), and that load by hand the gap
    at the meniscus, 35.5 - 2.48 times b^2/(2 R) five half-widths ahead of its edge, above its film. The layer grows with
    load and inlet distance; a bearing whose inner race carries nothing has none.
    """
    starved = "model.open_contact_film=true", "lubricant.inlet_distance=5.0", "operation.inner_speed_rpm=100.0"
    scene = make_scene(*starved, "operation.radial_load_N=0.0", "bearing.radial_clearance_mm=-0.02")
    bearing, contact = roller_bearing(scene), rolling_contacts(scene)["inner"]
    load = bearing.inner.contact.stiffness * 5e-6 ** (10.0 / 9.0)
    ahead = (
        (6.0 * math.sqrt(35.0) - math.acosh(6.0)) * 4.0 * load / (math.pi * contact.equivalent_modulus * contact.length)
    )
    film = film_in_service(contact, scene.oil("inner"), load, 5.0)
    assert oil_layer(scene, bearing) == pytest.approx(ahead + film, rel=2e-3)
    assert bearing.open_film.inverse_root**-2 == pytest.approx(oil_layer(scene, bearing), rel=1e-14)

    # The loads need no film, so parameters without one serve all loads.
    wide = "operation.inner_speed_rpm=100.0", "bearing.radial_clearance_mm=0.05"
    dry = roller_bearing(make_scene(*wide))

    def layer(*changes):
        return oil_layer(make_scene(*wide, "lubricant.inlet_distance=5.0", *changes), dry)

    light = layer("operation.radial_load_N=200.0")
    assert 2.0 * light < layer("operation.radial_load_N=2000.0") < 10.0 * light
    assert layer("operation.radial_load_N=200.0", "lubricant.inlet_distance=10.0") > 2.0 * light
    assert layer("operation.radial_load_N=0.0") == 0.0
    # The estimate of what a scene without these films leaves out counts what the layer feeds.
    whole, part, little = (
        open_inner_films(make_scene(f"lubricant.inlet_distance={distance}", "operation.radial_load_N=200.0"))
        for distance in (1e4, 5.0, 1e-3)
    )
    assert whole == pytest.approx(open_inner_films(make_scene("operation.radial_load_N=200.0")), rel=1e-3)
    assert 0.0 < little < 0.2 * part < 0.2 * whole
    # What turns once with the ring lays oil as its root mean square does.
    both = layer("operation.radial_load_N=300.0", "operation.rotating_load_N=400.0")
    assert both == layer("operation.radial_load_N=500.0")


def test_unit_touching_gap():
    """Unit: there Martin's load equals Palmgren's; roughness is the least."""
    stiffness = 1.3e9
    gap = touching_gap(OIL, RADIUS, LENGTH, SPEED, stiffness, 1e-9)
    assert 4.895 * OIL * SPEED * RADIUS * LENGTH / gap == pytest.approx(stiffness * gap ** (10.0 / 9.0), rel=1e-9)
    assert touching_gap(OIL, RADIUS, LENGTH, SPEED, stiffness, 1e-6) == 1e-6


@pytest.mark.slow
def test_invariant_a_concentric_unloaded_bearing_is_driven_by_films(make_scene):
    """Invariant: without load and films the cage of a concentric bearing slows down; films drive it; power balances to 1e-4
    and the rolling resistance of both races adds up.
    """
    unloaded = (
        "operation.radial_load_N=0.0", "bearing.inner_ring_mass_kg=1e5", "lubricant.viscosity_mPas=30.0",
        "operation.inner_speed_rpm=4000.0", "numerics.discard_turns=20",
    )  # fmt: skip
    driven = simulate(make_scene(*unloaded, "model.open_contact_film=true"), workers=1)
    assert driven.power_balance.relative_gap < 1e-4
    assert driven.rolling_resistance_W["inner"] > 0.0
    assert sum(driven.rolling_resistance_W.values()) == pytest.approx(
        driven.power_terms_W["rolling_resistance"], rel=1e-12
    )
    alone = simulate(make_scene(*unloaded), workers=1)
    assert alone.rolling_resistance_W["inner"] == alone.power_terms_W["inner_race_traction"] == 0.0
    assert driven.cage_slip.value < alone.cage_slip.value - 0.02


def test_unit_notes_and_refusal(make_scene, outer):
    """Unit: below 1 % of C a note says what slip rests on; the films are no longer left out; no film without its law."""
    light = "operation.radial_load_N=50.0"
    (off,) = film_drive_notes(make_scene(light))
    assert "Set model.open_contact_film = true" in off
    (on,) = film_drive_notes(make_scene(light, "model.open_contact_film=true"))
    assert "flooded" in on and "lubricant.inlet_distance" in on
    (fed,) = film_drive_notes(make_scene(light, "model.open_contact_film=true", "lubricant.inlet_distance=5.0"))
    assert "at open contacts fill gaps up to 2 um, as lubricant.inlet_distance and the load set it" in fed
    (none,) = film_drive_notes(
        make_scene("operation.radial_load_N=0.0", "model.open_contact_film=true", "lubricant.inlet_distance=5.0")
    )
    assert "are missing, because no loaded inner contact feeds them" in none
    assert film_drive_notes(outer) == ()
    assert any("oil films" in note for note in left_out_notes(outer, 20.0))
    assert not any("oil films" in note for note in left_out_notes(make_scene("model.open_contact_film=true"), 20.0))
    assert any("times the simulated loss" in note for note in left_out_notes(outer, 1e-3))
    with pytest.raises(InputError, match="open_contact_film = true contradict"):
        make_scene("model.open_contact_film=true", "model.rolling_resistance=off")


def test_unit_slip_depends_on_the_traction_law(make_scene, outer):
    """Unit: from 1 % of slip a note names the law and the others that its oil may have; none without slip or traction."""
    (note,) = traction_law_notes(outer, 0.012)
    assert note.startswith("cage slip: 1.2 % depends on traction.model = 'four_constant'")
    assert "'eyring' and 'thermal_newtonian'" in note and "limiting_shear" not in note
    (graded,) = traction_law_notes(make_scene("lubricant.oil=ISO VG 32"), 0.5)
    assert "50 % depends on traction.model = 'limiting_shear'" in graded and "'eyring' and 'four_constant'" in graded
    assert traction_law_notes(outer, 0.009) == traction_law_notes(make_scene("traction.model=off"), 0.5) == ()
