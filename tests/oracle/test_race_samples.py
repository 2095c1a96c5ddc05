"""Samples of race contacts against closed forms: quantiles, power density, flash temperature, entries."""

import math

import numpy as np
import pytest
from conftest import ROOT

from rbdyn.dynamics.figures import quantile
from rbdyn.dynamics.forces.race_samples import RaceSamples, book_contact, book_value, follow_entry
from rbdyn.dynamics.forces.races import RaceWrench
from rbdyn.dynamics.forces.state import (
    ENTRY_ENERGIES,
    ENTRY_SLIPS,
    FOLLOWED,
    INNER_DENSITIES,
    INNER_FLASHES,
    SAMPLE_BINS,
    SAMPLED,
    SAMPLES_NUMBER,
    SAMPLES_TOTAL,
)
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.scene import Scene


def empty():
    """Sums of no samples."""
    return np.zeros((SAMPLED, 2 + SAMPLE_BINS))


def contact(load, slip, coefficient):
    """A contact of this load [N], slip [m/s] and traction coefficient, as the races give it."""
    return RaceWrench(0.0, 0.0, 0.0, 0.0, load, coefficient * load * slip, 0.0, 0.0, slip, 0.0)


@pytest.fixture(scope="module")
def samples():
    """Samples of the example's races."""
    return roller_bearing(Scene.load(ROOT / "examples" / "cylindrical_roller.toml")).samples


def of_histogram(values):
    """The 95 % value of samples."""
    sums = empty()
    for value in values:
        book_value.py_func(sums, 0, value)
    row = sums[0]
    return float(quantile(np.concatenate((row[:1], row[:1], row[2:]))))


def test_unit_quantile_of_known_samples():
    """Unit: of a lognormal and a uniform law within the width of a step (15 %) and far closer, at any level of the values."""
    random = np.random.default_rng(5)
    for scale in (1e-6, 1.0, 1e8):
        values = scale * np.exp(random.normal(0.0, 1.0, 20_000))
        assert of_histogram(values) == pytest.approx(np.quantile(values, 0.95), rel=0.03)
    assert of_histogram(random.uniform(0.0, 2.0, 20_000)) == pytest.approx(1.9, rel=0.05)
    assert of_histogram([3.0] * 50) == pytest.approx(3.0, rel=0.16)
    assert quantile(np.zeros(2 + SAMPLE_BINS)) == 0.0 == of_histogram([0.0] * 99 + [5.0])


def test_oracle_density_and_flash_temperature_of_one_contact(samples):
    """Oracle: mu Q |s|/(2 b l) and Blok's 1.11 mu (Q/l) |sqrt u1 - sqrt u2|/(e sqrt(2 b)) by hand."""
    assert isinstance(samples, RaceSamples)
    scene = Scene.load(ROOT / "examples" / "cylindrical_roller.toml")
    load, slip, mu, length = 400.0, 2.0, 0.04, scene.bearing.effective_length
    ring, roller, radius = scene.material("rings"), scene.material("roller"), scene.geometry.reduced_radii[1]
    modulus = 2.0 / sum((1.0 - steel.poisson_ratio**2) / steel.elastic_modulus for steel in (ring, roller))
    half = math.sqrt(8.0 * load / length * radius / (math.pi * modulus))
    speed = scene.geometry.motion.entrainment
    effusivity, sums = 0.5 * (ring.effusivity + roller.effusivity), empty()
    book_contact.py_func(samples.inner, contact(load, slip, mu), INNER_DENSITIES, INNER_FLASHES, sums)
    assert sums[INNER_DENSITIES, SAMPLES_TOTAL] == pytest.approx(mu * load * slip / (2.0 * half * length), rel=1e-6)
    flash = 1.11 * mu * load / length * (math.sqrt(speed) - math.sqrt(speed - slip)) / effusivity
    assert sums[INNER_FLASHES, SAMPLES_TOTAL] == pytest.approx(flash / math.sqrt(2.0 * half), rel=1e-6)
    book_contact.py_func(samples.inner, contact(0.0, slip, mu), INNER_DENSITIES, INNER_FLASHES, sums)
    assert sums[INNER_DENSITIES, SAMPLES_NUMBER] == 1.0


def test_unit_an_entry_ends_with_its_slip(samples):
    """Unit: slip where the load passes its limit, energy until the roller rolls; chatter at the limit is no further entry."""
    limit, rolling = samples.entry_load, samples.rolling_slip
    followed, sums = np.zeros((FOLLOWED, 1)), empty()

    def follow(load, slip):
        follow_entry.py_func(samples, contact(load, slip, 0.05), 0, followed, sums)

    for _ in range(int(samples.pause) + 2):
        follow(0.0, 5.0)
    loads, slips = (1.2, 2.0, 4.0, 6.0), (4.0, 3.0, 1.0, 0.5 * rolling)
    for share, slip in zip(loads, slips, strict=True):
        follow(share * limit, slip)
    for _ in range(5):
        follow(0.9 * limit, 5.0)
        follow(1.1 * limit, 5.0)
    assert sums[ENTRY_SLIPS, SAMPLES_NUMBER] == sums[ENTRY_ENERGIES, SAMPLES_NUMBER] == 1.0
    assert sums[ENTRY_SLIPS, SAMPLES_TOTAL] == pytest.approx(4.0)
    energy = sum(0.05 * share * limit * slip for share, slip in zip(loads[:3], slips[:3], strict=True))
    assert sums[ENTRY_ENERGIES, SAMPLES_TOTAL] == pytest.approx(energy * samples.spacing)


def test_unit_an_entry_without_slip_takes_no_energy(samples):
    """Unit: a roller that rolls already counts as an entry of its slip and of no energy; one that leaves early ends there."""
    followed, sums = np.zeros((FOLLOWED, 1)), empty()
    for load, slip in [
        *[(0.0, 5.0)] * (int(samples.pause) + 2),
        (2.0 * samples.entry_load, 0.1 * samples.rolling_slip),
    ]:
        follow_entry.py_func(samples, contact(load, slip, 0.05), 0, followed, sums)
    assert sums[ENTRY_SLIPS, SAMPLES_TOTAL] == pytest.approx(0.1 * samples.rolling_slip)
    assert sums[ENTRY_ENERGIES, SAMPLES_NUMBER] == 1.0 and sums[ENTRY_ENERGIES, SAMPLES_TOTAL] == 0.0
    for load in [0.0] * (int(samples.pause) + 2) + [2.0 * samples.entry_load, 0.2 * samples.entry_load]:
        follow_entry.py_func(samples, contact(load, 5.0, 0.05), 0, followed, sums)
    assert sums[ENTRY_SLIPS, SAMPLES_NUMBER] == 2.0
