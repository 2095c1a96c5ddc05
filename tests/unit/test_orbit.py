"""What a history tells: whirl, sections, spectra, loads around the bearing, on motions known in closed form."""

import dataclasses

import numpy as np
import pytest

from rbdyn.dynamics import motion
from rbdyn.dynamics.motion import History
from rbdyn.properties.materials import equivalent_modulus

TURNS, PER_TURN = 10, 512
WHIRL, CAGE = 0.4, 0.39  # of the shaft speed


def made(scene, **given):
    """A history of ten shaft turns: a cage that turns evenly, and whatever else is given; the rest at zero."""
    time = np.arange(TURNS * PER_TURN) * scene.turn_s / PER_TURN
    shaft = 2.0 * np.pi / scene.turn_s
    z = scene.bearing.rollers
    rollers = ("roller_", "azimuth", "outer_l", "inner_l", "pocket_", "outer_s", "inner_s", "outer_h", "inner_h")
    fields = {}
    for field in dataclasses.fields(History):
        shape = (len(time), z) if field.name.startswith(rollers) else len(time)
        fields[field.name] = np.zeros(shape)
    fields |= {
        "scene": scene,
        "time": time,
        "inner_angle": shaft * time + 0.3,
        "cage_angle": CAGE * shaft * time + 0.1,
        "cage_speed": np.full(len(time), CAGE * shaft),
    }
    return History(**{**fields, **given})


def circling(scene, order, size=50e-6):
    """Cage coordinates and velocities on a circle, at ``order`` times the shaft speed."""
    time = made(scene).time
    rate = order * 2.0 * np.pi / scene.turn_s
    cosine, sine = size * np.cos(rate * time), size * np.sin(rate * time)
    return {"cage_x": cosine, "cage_y": sine, "cage_vx": -rate * sine, "cage_vy": rate * cosine}


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_unit_whirl_of_a_circle(make_scene, sense):
    """Unit: a circular orbit has its own whirl speed at every moment, forward or backward; one value fills the histogram."""
    scene = make_scene()
    history = made(scene, **circling(scene, sense * WHIRL))
    rate = sense * WHIRL * 2.0 * np.pi / scene.turn_s
    assert motion.eccentricity(history) == pytest.approx(np.full(len(history.time), 50e-6), rel=1e-12)
    assert motion.whirl_speed(history) == pytest.approx(np.full(len(history.time), rate), rel=1e-9)
    assert motion.whirl_ratio(history) == pytest.approx(sense * WHIRL / CAGE, rel=1e-9)
    assert list(motion.whirl_quantiles(history).values()) == pytest.approx([sense * WHIRL / CAGE] * 5, rel=1e-9)
    edges, density = motion.whirl_histogram(history)
    assert (density * np.diff(edges)).sum() == pytest.approx(1.0)
    assert edges[0] < sense * WHIRL / CAGE < edges[-1]


def test_unit_whirl_is_about_the_guide(make_scene):
    """Unit: under inner guidance the orbit is that about the inner ring, which moves too."""
    scene = make_scene("cage.guidance=inner")
    about = circling(scene, WHIRL)
    ring = circling(scene, 1.0, 20e-6)
    moved = {key: about[key] + ring[key] for key in about}
    moved["cage_x"] = moved["cage_x"] + 1e-5
    history = made(scene, **moved, ring_x=ring["cage_x"] + 1e-5, ring_y=ring["cage_y"])
    # The ring's velocity is a difference of samples: (2 pi/512)^2/6 off, one-sided at the ends.
    rate = WHIRL * 2.0 * np.pi / scene.turn_s
    assert motion.whirl_speed(history)[1:-1] == pytest.approx(np.full(len(history.time) - 2, rate), rel=1e-4)
    assert motion.whirl_ratio(history) == pytest.approx(WHIRL / CAGE, rel=1e-9)


def test_unit_whirl_of_a_cage_at_the_centre(make_scene):
    """Unit: no orbit, no whirl, no division by zero."""
    assert not motion.whirl_speed(made(make_scene())).any()


@pytest.mark.parametrize(("order", "turn_of", "points"), [(1.0, "shaft", 10), (2.0, "shaft", 10), (CAGE, "cage", 4)])
def test_unit_poincare_of_a_periodic_orbit_is_a_point(make_scene, order, turn_of, points):
    """Unit: an orbit that repeats with every turn meets its section in one point; another does not."""
    scene = make_scene()
    x, y = motion.poincare(made(scene, **circling(scene, order)), turn_of)
    assert len(x) == points
    assert x == pytest.approx(np.full(points, 50e-6), abs=1e-13)
    assert y == pytest.approx(np.zeros(points), abs=1e-13)
    x, _ = motion.poincare(made(scene, **circling(scene, 0.31)), turn_of)
    assert np.ptp(x) > 10e-6


def test_unit_poincare_of_a_shaft_that_turns_backward(make_scene):
    """Unit: turns are counted whichever way the shaft goes."""
    scene = make_scene()
    forward = made(scene, **circling(scene, 0.31))
    backward = dataclasses.replace(forward, inner_angle=-forward.inner_angle)
    assert motion.poincare(backward, "shaft")[0] == pytest.approx(motion.poincare(forward, "shaft")[0], abs=1e-15)


def test_unit_spectrum_of_a_sine(make_scene):
    """Unit: a sine shows its amplitude at its frequency, a constant nothing; peaks come largest first."""
    scene = make_scene()
    history = made(scene)
    # Five turns a segment: 80 Hz between frequencies.
    signal = 7.0 + 3.0 * np.sin(2.0 * np.pi * 1600.0 * history.time) + np.cos(2.0 * np.pi * 4000.0 * history.time)
    spectrum = motion.spectrum(history, signal)
    assert spectrum.frequency[1] == pytest.approx(80.0)
    (first, size), (second, lesser) = spectrum.peaks(2)
    assert (first, second) == pytest.approx((1600.0, 4000.0))
    assert (size, lesser) == pytest.approx((3.0, 1.0), rel=1e-3)
    assert spectrum.amplitude[spectrum.frequency > 8000.0].max() < 1e-3


def test_unit_binned_load_against_azimuth(make_scene):
    """Unit: each roller in the bin it stands in, after any number of turns; mean and spread of its loads."""
    scene = make_scene("bearing.rollers=4")
    history = made(scene)
    samples = len(history.time)
    stands = np.array([-0.75, -0.25, 0.25, 0.75]) * np.pi
    turns = 2.0 * np.pi * (np.arange(samples) % 7)[:, None]
    history = dataclasses.replace(history, azimuth=stands + turns)
    ramp = np.linspace(0.0, 1.0, samples)[:, None]
    profile = motion.against_azimuth(history, np.array([10.0, 20.0, 30.0, 40.0]) + ramp, bins=4)
    assert profile.azimuth == pytest.approx(stands)
    assert profile.mean == pytest.approx([10.5, 20.5, 30.5, 40.5])
    assert profile.low == pytest.approx([10.05, 20.05, 30.05, 40.05])
    assert profile.high == pytest.approx([10.95, 20.95, 30.95, 40.95])
    assert (profile.samples == samples).all()
    thirds = motion.against_azimuth(history, np.zeros((samples, 4)), bins=12)
    assert np.isnan(thirds.mean).sum() == 8 and thirds.samples.sum() == 4 * samples


def test_unit_largest_force_between_samples(make_scene):
    """Unit: the vertex of a parabola is found though no sample hits it; at either end the sample counts."""
    scene = make_scene()
    history = made(scene)
    step = history.time[1]
    loads = np.zeros((len(history.time), 10))
    loads[98:103, 6] = -(80.0 - 3.0 * (np.arange(-2.0, 3.0) - 0.3) ** 2)
    hit = motion.largest(history, loads)
    assert hit == pytest.approx((80.0, 100.3 * step, 6))
    assert motion.largest(history, history.time) == (history.time[-1], history.time[-1], None)
    assert motion.largest(history, history.land_load).force == 0.0


def test_unit_contact_pressure_and_sliding(make_scene):
    """Unit: Hertz's pressure bears the load over his half-width (Johnson 1985, 4.2c); pv takes the size of the slip."""
    scene = make_scene()
    load, slip = np.full((TURNS * PER_TURN, 10), 800.0), np.full((TURNS * PER_TURN, 10), -0.5)
    history = made(scene, inner_load=load, inner_slip=slip)
    modulus = equivalent_modulus(scene.material("roller"), scene.material("rings"))
    length, radius = 3.5e-3, scene.geometry.reduced_radii[1]
    half_width = np.sqrt(8.0 * 800.0 * radius / (np.pi * length * modulus))
    pressure = motion.contact_pressure(history, "inner")
    assert 0.5 * np.pi * half_width * pressure[0, 0] * length == pytest.approx(800.0)
    assert motion.pressure_velocity(history, "inner") == pytest.approx(0.5 * pressure)
    assert not motion.contact_pressure(history, "outer").any()
