"""Traction from a table over slip and load, mixed friction, and what a scene makes of both."""

import copy
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numba import njit
from plain_scene import TABLE

from rbdyn.base.faults import InputError
from rbdyn.contact import film_thickness as films
from rbdyn.contact import rheology
from rbdyn.contact.traction import (
    BlendedFourConstantTraction,
    CoulombTraction,
    FourConstantTraction,
    MixedTraction,
    NoTraction,
    asperity_load_share,
    four_constants,
    growth,
    traction,
    traction_surface,
)
from rbdyn.dynamics.parameters.model import race_traction
from rbdyn.dynamics.parameters.validity import race_report
from rbdyn.properties.materials import oil_at
from rbdyn.scene import Scene
from rbdyn.scene.lubricant import RHEOLOGIES, smallest_traction

OIL = oil_at("MIL-L-7808", 100.0)
INNER = films.RollingContact(3.57e-3, 3.5e-3, 226.4e9, 26.2)
SMALLEST, LARGEST, FASTEST = 16.0, 5200.0, 52.4
RHEOLOGY = {
    "thermal": rheology.thermal_newtonian("MIL-L-7808", 100.0, OIL.conductivity, 0.1),
    "eyring": rheology.Eyring(OIL.viscosity, OIL.pressure_coefficient, 5e6, 0.1),
    "limiting": rheology.LimitingShear(OIL.viscosity, OIL.pressure_coefficient, 0.07),
}


def curve_of(law):
    """Coefficient of a rheology over slip and load, in the film of the inner contact."""
    return lambda slip, load: rheology.traction_coefficient(
        law, INNER, slip, load, films.film_in_service(INNER, OIL, load)
    )


FITS = {name: traction_surface(curve_of(law), LARGEST, SMALLEST, FASTEST) for name, law in RHEOLOGY.items()}
SURFACES = {name: fit.surface for name, fit in FITS.items()}
FOUR = FourConstantTraction(*four_constants(0.0, 0.050, 0.036, 1.0))
MODELS = {
    **SURFACES,
    "mixed constants": MixedTraction(FOUR, 0.1, 0.02, 3.0, 0.097),
    "mixed surface": MixedTraction(SURFACES["thermal"], 0.12, 0.02, 9.0, 0.12),
}


@njit
def compiled_traction(model, slip, load):
    return traction(model, slip, load)


@pytest.mark.parametrize("name", RHEOLOGY)
def test_oracle_surface_against_its_curve(name):
    """Oracle: below 1e-3 of the peak anywhere in the table; the builder's own figure is below its tolerance."""
    fit, curve = FITS[name], curve_of(RHEOLOGY[name])
    draw = np.random.default_rng(5)
    slips = FASTEST * draw.random(4000) ** 4
    loads = draw.uniform(math.sqrt(SMALLEST), math.sqrt(LARGEST), 4000) ** 2
    exact = curve(slips, loads)
    found = np.array([compiled_traction(fit.surface, u, q) for u, q in zip(slips, loads, strict=True)])
    assert fit.error < 5e-4
    assert np.abs(found - exact).max() < 1e-3 * exact.max()
    # Also where the coefficient is small, as at lightly loaded rollers, it is true to a few parts in a thousand.
    assert np.abs(found / exact - 1.0).max() < 5e-3


@pytest.mark.parametrize("name", MODELS)
@given(slip=st.floats(-1000.0, 1000.0), load=st.floats(0.0, 1e5))
@settings(max_examples=200, deadline=None)
def test_invariant_traction_is_odd_and_never_drives(name, slip, load):
    """Invariant: odd, nil at rest, mu u >= 0; compiled equals interpreted to 1e-12."""
    model = MODELS[name]
    mu = compiled_traction(model, slip, load)
    assert abs(mu) < 1.0
    assert mu == -compiled_traction(model, -slip, load)
    # At a slip below 1e-15 m/s the sum A + D of the constants is their round-off.
    assert mu * math.copysign(1.0, slip) >= -1e-17
    assert mu == pytest.approx(traction(model, slip, load), rel=1e-12, abs=1e-15)
    assert compiled_traction(model, 0.0, load) == 0.0


@njit
def compiled_growth(model, slip, load):
    return growth(model, slip, load)


@pytest.mark.parametrize(
    ("name", "model"),
    [
        *MODELS.items(),
        ("four constants", FOUR),
        ("blended", BlendedFourConstantTraction(0.01, 0.2, 3.0, 0.03, 0.02)),
        ("coulomb", CoulombTraction(0.1, 0.02)),
        ("none", NoTraction()),
    ],
)
def test_unit_growth_is_the_slope_of_traction(name, model):
    """Unit: the growth is the difference quotient over the logarithm of the slip, even in it, compiled and interpreted alike."""
    draw = np.random.default_rng(2)
    for slip, load in zip(10.0 ** draw.uniform(-5.0, 1.5, 60), draw.uniform(1.0, 6000.0, 60), strict=True):
        step = 1e-5 * slip
        quotient = (traction(model, slip + step, load) - traction(model, slip - step, load)) / 2e-5
        found = compiled_growth(model, slip, load)
        assert found == pytest.approx(quotient, rel=1e-5, abs=1e-7 * traction(model, slip, load))
        assert found == compiled_growth(model, -slip, load)
        assert found == pytest.approx(growth(model, slip, load), rel=1e-12, abs=1e-300)


@pytest.mark.parametrize("name", [*SURFACES, "mixed surface"])
@given(slip=st.floats(allow_nan=False, allow_infinity=False), load=st.floats(allow_nan=False, allow_infinity=False))
@example(slip=4.528728074098563e-10, load=1.0)
@example(slip=-1e-300, load=5000.0)
@settings(max_examples=200, deadline=None)
def test_invariant_surface_takes_any_number(name, slip, load):
    """Invariant: any finite slip and load, however absurd, give a coefficient below one along the slip."""
    mu = compiled_traction(MODELS[name], slip, load)
    assert abs(mu) < 1.0 and mu * math.copysign(1.0, slip) >= 0.0
    assert mu == pytest.approx(traction(MODELS[name], slip, load), rel=1e-12, abs=1e-300)


@pytest.mark.parametrize("name", MODELS)
def test_unit_nan_is_not_hidden(name):
    """Unit: a slip that is NaN gives NaN, and no load, not even NaN or infinity, leaves the table.

    The force, coefficient times load, is then NaN by its load.
    """
    model = MODELS[name]
    assert math.isnan(compiled_traction(model, math.nan, 100.0))
    for load in (math.nan, -math.inf, -1.0):
        assert abs(compiled_traction(model, 1.0, load)) < 1.0
    assert not abs(compiled_traction(model, 1.0, math.inf)) > 1.0


@pytest.mark.parametrize("name", SURFACES)
def test_unit_surface_is_smooth_and_ends_level(name):
    """Unit: one-sided slopes agree across every cell edge and at the ends of the table; beyond, mu is constant."""
    surface = SURFACES[name]
    step = 1e-6  # of a cell: its slopes vary by about as much, and round-off of L (1e-15) gives 1e-9
    for edge in range(1, surface.columns + 1):
        root = surface.axes.load_origin + edge / surface.axes.load_density
        width = step / surface.axes.load_density
        logs = [
            math.log(compiled_traction(surface, 0.3, (root + k * width) ** 2))
            for k in (-1.0, 0.0, 1.0)
            if root + k * width > 0.0
        ]
        if len(logs) == 3:
            assert (logs[1] - logs[0]) / step == pytest.approx((logs[2] - logs[1]) / step, abs=2e-5)
    rows = surface.cells.shape[0] // surface.columns
    for edge in range(1, rows + 1):
        logs = []
        for k in (-1.0, 0.0, 1.0):
            ratio = math.expm1((edge + k * step) / surface.axes.slip_density)
            mu = compiled_traction(surface, ratio / surface.axes.speed_density, 500.0)
            logs.append(math.log(mu * (1.0 + ratio) / ratio))
        assert (logs[1] - logs[0]) / step == pytest.approx((logs[2] - logs[1]) / step, abs=2e-5)
    assert compiled_traction(surface, 1.0, 1e9) == compiled_traction(surface, 1.0, 2.0 * LARGEST)
    assert compiled_traction(surface, 1e6, 500.0) == pytest.approx(compiled_traction(surface, 1e5, 500.0), rel=1e-3)


def test_unit_light_rollers_are_driven_less():
    """Unit: at 1 m/s a roller held by its own inertia (54 N) has a thirtieth of the traction of the most loaded one.

    A published reading of the same curves is 25 to 55 times below a load-independent law (0.05).
    """
    light, heavy = (compiled_traction(SURFACES["thermal"], 1.0, load) for load in (54.0, 674.0))
    assert light < heavy / 25.0
    assert 25.0 < 0.050 / light < 55.0


def test_unit_bad_tables_are_refused():
    """Unit: coefficients that are not positive make no table."""
    with pytest.raises(ValueError, match="positive and finite"):
        traction_surface(lambda u, q: 0.0 * u * q, LARGEST, SMALLEST, FASTEST)


def test_invariant_share_grows_with_load():
    """Invariant: asperities carry more the more is to carry; equal to exp(-b Lambda^c) with Lambda as Q^-0.1."""
    loads = np.geomspace(1e-20, 1e12, 200)
    shares = [asperity_load_share(9.0, 0.097, float(load)) for load in loads]
    assert shares == sorted(shares) and 0.0 <= shares[0] < 1e-300 and 0.0 < shares[-1] <= 1.0
    for load in (1.0, 50.0, 700.0):
        expected = math.exp(-2.32 * (2.4 * load**-0.1) ** 0.97)
        assert asperity_load_share(2.32 * 2.4**0.97, 0.097, load) == pytest.approx(expected, rel=1e-12)
        assert asperity_load_share.py_func(9.0, 0.097, load) == pytest.approx(
            asperity_load_share(9.0, 0.097, load), rel=1e-13
        )


@given(slip=st.floats(-20.0, 20.0), load=st.floats(0.0, 1e4))
@settings(max_examples=100, deadline=None)
def test_oracle_mixed_is_the_weighted_mean(slip, load):
    """Oracle: share of dry friction and rest of the film's, written out with the C library."""
    mixed = MODELS["mixed constants"]
    share = math.exp(-3.0 * max(load, 1e-30) ** -0.097)
    expected = share * 0.1 * math.tanh(slip / 0.02) + (1.0 - share) * traction(FOUR, slip, load)
    assert compiled_traction(mixed, slip, load) == pytest.approx(expected, rel=1e-11, abs=1e-15)


def scene(*assignments):
    """A scene with assignments."""
    return Scene.from_dict(copy.deepcopy(TABLE), "s.toml", assignments)


def law_of(*assignments, load=2600.0, speed=26.2):
    """Law of the inner race of a scene."""
    chosen = scene(*assignments)
    return race_traction(
        chosen, films.RollingContact(3.57e-3, 3.5e-3, 226.4e9, speed), chosen.lubricant.in_service, load
    )


def test_unit_laws_of_a_scene():
    """Unit: the defaults give the load-independent law of before; each model and mixed friction give theirs."""
    assert law_of() == FOUR
    assert law_of("traction.mu_0=0.02") == BlendedFourConstantTraction(*four_constants(0.02, 0.050, 0.036, 1.0), 0.02)
    assert law_of("traction.model=coulomb") == CoulombTraction(0.1, 0.02)
    assert law_of("traction.model=coulomb", "traction.coulomb=0.0") == NoTraction()
    assert law_of("traction.model=off") == NoTraction()
    assert law_of("traction.constants=[-0.03, 0.1, 1.5, 0.03]") == FourConstantTraction(-0.03, 0.1, 1.5, 0.03)
    assert law_of("traction.constants=[-0.01, 0.1, 1.5, 0.03]") == BlendedFourConstantTraction(
        -0.01, 0.1, 1.5, 0.03, 0.02
    )
    curves = {"thermal_newtonian": "thermal", "eyring": "eyring", "limiting_shear": "limiting"}
    for model in RHEOLOGIES:
        law = law_of(f"traction.model={model}")
        slips, loads = np.array([0.2, 3.0]), np.array([600.0, 60.0])
        exact = rheology.with_body_creep(curve_of(RHEOLOGY[curves[model]])(slips, loads), INNER, slips, loads)
        found = [compiled_traction(law, 0.2, 600.0), compiled_traction(law, 3.0, 60.0)]
        assert found == pytest.approx(exact, abs=1e-4)
    mixed = law_of("traction.friction=mixed")
    assert mixed.fluid == FOUR and mixed.boundary == 0.1
    # With the film's Lambda of 2.4 at the most loaded roller: 5 F/Z = 650 N.
    film = films.film_in_service(INNER, OIL, 650.0)
    share = math.exp(-2.32 * films.lambda_ratio(film, 0.05e-6, 0.05e-6) ** 0.97)
    assert asperity_load_share(mixed.share_scale, mixed.share_exponent, 650.0) == pytest.approx(share)
    with pytest.raises(InputError, match="do not roll"):
        law_of("traction.friction=mixed", speed=0.0)
    with pytest.raises(InputError, match=r"off by .* % of the peak up to 5000 N; raise"):
        law_of("traction.model=eyring", "lubricant.pressure_coefficient_1_GPa=100.0", load=5000.0)


def test_unit_inputs_of_a_film_reach_the_law():
    """Unit: more pressure coefficient more grip, another oil another grip, rougher surfaces more share, less oil less film."""
    stiff = law_of("traction.model=eyring", "lubricant.pressure_coefficient_1_GPa=12.0")
    plain = law_of("traction.model=eyring")
    assert compiled_traction(stiff, 0.1, 600.0) > 1.2 * compiled_traction(plain, 0.1, 600.0)
    santotrac = law_of("traction.model=thermal_newtonian", "traction.rheology_oil=Santotrac 30")
    assert compiled_traction(santotrac, 0.1, 600.0) > compiled_traction(SURFACES["thermal"], 0.1, 600.0)
    smooth, rough = (law_of("traction.friction=mixed", f"lubricant.race_roughness_um={s}") for s in (0.05, 0.3))
    assert rough.share_scale < smooth.share_scale
    starved = law_of("traction.friction=mixed", "lubricant.inlet_distance=0.5")
    assert starved.share_scale < smooth.share_scale


def test_unit_race_report():
    """Unit: film, Lambda and pressure of each race at a load; the outer film is the thicker; none if nothing rolls."""
    report = race_report(scene(), 674.0, 674.0)
    inner, outer = report["inner"].film, report["outer"].film
    assert report["inner"].max_pressure_MPa == pytest.approx(1390.0, rel=5e-3)
    assert 0.16 < inner.central_film_um < outer.central_film_um < 0.24
    assert 2.3 < inner.lambda_ratio < outer.lambda_ratio < 3.1
    assert inner.minimum_film_um < inner.central_film_um and outer.minimum_film_um < outer.central_film_um


@pytest.mark.parametrize(
    ("assignments", "words"),
    [
        (
            ("traction.constants=[-0.03,0.1,1.5,0.03]", "traction.mu_m=0.06"),
            ("traction.constants = [-0.03, 0.1, 1.5, 0.03]", "traction.mu_m = 0.06", "not both"),
        ),
        (("traction.constants=[-0.04,0.1,1.5,0.03]",), ("must not be below 0", "fix")),
        (("traction.constants=[0.1,-5.0,1.0,0.02]",), ("must not be below 0", "fix")),
        (("traction.constants=[-0.03,0.1,0.0,0.03]",), ("C, must be greater than 0",)),
        (("traction.constants=[0.1,0.2]",), ("list of four numbers",)),
        (("traction.constants=3",), ("list of four numbers",)),
        (("traction.model=coulomb", "traction.friction=mixed"), ("'coulomb' has no film", "choose")),
        (("traction.rheology_oil=water",), ("choose one of 'MIL-L-7808'",)),
        (("lubricant.viscosity_mPas=0.0",), ("viscosity_mPas = 0.0", "greater than 0")),
        (("lubricant.race_roughness_um=0.0",), ("race_roughness_um = 0.0", "greater than 0")),
        (("traction.limiting_shear_ratio=7.0",), ("limiting_shear_ratio = 7.0", "at most 1")),
    ],
)
def test_unit_bad_input_is_refused_in_a_sentence(assignments, words):
    """Unit: one fault, one sentence, with key, value and mend."""
    with pytest.raises(InputError) as caught:
        scene(*assignments)
    (fault,) = caught.value.faults
    assert fault.startswith("s.toml: ")
    for word in words:
        assert word in fault


@given(a=st.floats(-0.2, 0.2), b=st.floats(-0.5, 0.5), c=st.floats(0.05, 5.0), d=st.floats(-0.05, 0.2))
@settings(max_examples=200, deadline=None)
def test_oracle_smallest_traction(a, b, c, d):
    """Oracle: the smallest value of the law by a dense scan; between its points the law is flat there."""
    slips = np.concatenate((np.linspace(0.0, 60.0 / c, 6001), [1e6]))
    scanned = float(((a + b * slips) * np.exp(-c * slips) + d).min())
    smallest = smallest_traction(a, b, c, d)
    assert smallest <= scanned + 1e-12
    assert smallest == pytest.approx(scanned, abs=1e-4)


def test_unit_a_step_at_a_node_of_the_finest_table():
    """Unit: a step of 0.4 % over the load costs half of that, also where a node's difference quotient straddles it."""
    ends = math.sqrt(SMALLEST), math.sqrt(LARGEST)
    step = (ends[0] + 97 / 192 * (ends[1] - ends[0])) ** 2
    fit = traction_surface(
        lambda slip, load: 0.05 * np.tanh(slip) * (1.0 + 4e-3 * (load > step)), LARGEST, SMALLEST, FASTEST
    )
    assert 1e-3 < fit.error < 4e-3
