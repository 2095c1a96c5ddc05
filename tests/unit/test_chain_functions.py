"""Links that are functions: press fits, temperature, expressions; their worst case and their linear form."""

import numpy as np
import pytest
from chains import by_name, chain, with_functions
from hypothesis import given, settings
from hypothesis import strategies as st

from doe.dimension_chain import solve
from doe.dimension_chain.allocation import Allocation
from doe.dimension_chain.closing import closing_function, evaluate, interval, names_in, press_fit_factor
from doe.dimension_chain.links import PressFit, stated_parts
from doe.dimension_chain.yields import draw
from rbdyn.base.faults import InputError

# Raceways and the seats of an inner ring: a, b raceways, c shaft seat, d ring bore.
FITTED = [(1, 34.7, 0.0, -0.01), (-1, 34.5, 0.005, -0.005), (0, 27.0, 0.012, -0.004), (0, 27.0, 0.0, -0.006)]
GROWTH = {"name": "growth", "coefficient": -1, "press_fit": {"shaft": "c", "bore": "d", "raceway_mm": 34.5}}
SAMPLES = 50_000


def factor_of(fit_mm, **press_fit):
    return press_fit_factor(PressFit(shaft="c", bore="d", **press_fit), fit_mm)


def fitted(limits=(0.1, 0.3), **press_fit):
    return with_functions(chain(FITTED, limits), GROWTH | {"press_fit": GROWTH["press_fit"] | press_fit})


def test_solid_shaft_in_a_ring_of_its_steel_keeps_the_ratio_of_diameters():
    factor = factor_of(27, raceway_mm=34.5, shaft_bore_mm=0, outside_mm=34.5)
    assert factor == pytest.approx(27 / 34.5, rel=1e-12)


def test_ring_in_a_rigid_housing_shrinks_at_its_raceway_as_lame_says():
    factor = factor_of(60, raceway_mm=52.5, shaft_bore_mm=52.5, outside_mm=120, bore_modulus_GPa=1e9, shaft_poisson=0.3)
    # u(a)/u(b) of a ring under outer pressure: 2 a b/((1 - nu) b^2 + (1 + nu) a^2), all the interference at b.
    a, b, nu = 52.5, 60.0, 0.3
    assert factor == pytest.approx(-2 * a * b / ((1 - nu) * b**2 + (1 + nu) * a**2), rel=1e-6)


def test_a_hollow_shaft_gives_way():
    solid, hollow = (factor_of(27, raceway_mm=34.5, shaft_bore_mm=bore, outside_mm=34.5) for bore in (0, 18))
    assert 0 < hollow < solid < 1


@settings(max_examples=100, deadline=None)
@given(st.floats(-0.03, 0.03), st.floats(-0.02, 0.02))
def test_a_loose_fit_never_changes_the_raceway(overlap, change):
    function = closing_function(fitted(interference_change_mm=change).link)
    sizes = {"a": 34.7, "b": 34.5, "c": 27.0 + overlap, "d": 27.0}
    growth = 0.2 - function.value(sizes)
    assert growth == pytest.approx(max(overlap + change, 0.0) * 27 / 34.5, abs=1e-12)


def test_worst_case_of_a_fit_lies_at_the_corners():
    plain = fitted()
    low, high = interval(closing_function(plain.link), stated_parts(plain.link), "worst_case")
    assert high == pytest.approx(34.7 - 34.495)
    assert low == pytest.approx(34.69 - 34.505 - 0.018 * 27 / 34.5)


def test_worst_case_between_the_corners_is_found():
    hump = {"name": "hump", "coefficient": 1, "expression": "0.1 - (a - 5.03)**2 + 0*b"}
    bent = with_functions(chain([(0, 5.0, 0.1, -0.1), (1, 2.0, 0.01, 0.0)]), hump)
    low, high = interval(closing_function(bent.link), stated_parts(bent.link), "worst_case")
    assert high == pytest.approx(2.11, abs=1e-9)
    assert low == pytest.approx(2.1 - 0.13**2, abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4))
def test_no_assembly_leaves_the_worst_case(places):
    plain = fitted()
    function, parts = closing_function(plain.link), stated_parts(plain.link)
    sizes = {p.name: p.nominal_mm + p.middle_mm + x * p.tolerance_mm / 2 for p, x in zip(parts, places, strict=True)}
    low, high = interval(function, parts, "worst_case")
    assert low - 1e-12 <= function.value(sizes) <= high + 1e-12


def test_root_sum_square_takes_the_slopes_at_mid_tolerance():
    plain = fitted()
    low, high = interval(closing_function(plain.link), stated_parts(plain.link), "rss")
    slope = 27 / 34.5
    assert high - low == pytest.approx(np.sqrt(0.01**2 + 0.01**2 + (slope * 0.016) ** 2 + (slope * 0.006) ** 2))
    assert (low + high) / 2 == pytest.approx(34.695 - 34.5 - slope * 0.007)


def test_monte_carlo_takes_the_kink_and_reports_what_a_straight_line_misses():
    plain = fitted(interference_change_mm=-0.005)
    result = solve(plain, samples=SAMPLES)
    generator = np.random.default_rng(5)
    a, b, c, d = (
        p.nominal_mm + p.mean_mm + p.sigma_mm * generator.standard_normal(SAMPLES) for p in stated_parts(plain.link)
    )
    expected = a - b - np.maximum(c - d - 0.005, 0) * 27 / 34.5
    assert result.mean_mm == pytest.approx(expected.mean(), abs=5e-5)
    assert result.standard_deviation_mm == pytest.approx(expected.std(), rel=0.02)
    bent = result.linearisation
    assert bent.worst_case_error_mm == pytest.approx(0.009 * 27 / 34.5)
    # A growth that is never negative takes more on the mean than its tangent says.
    assert bent.mean_shift_mm > 2e-4
    assert result.exact_yields is None


def test_temperature_widens_in_proportion_and_varies():
    growth = {
        "name": "warm", "coefficient": -1,
        "thermal_growth": {
            "of": "a", "expansion_per_K": 12e-6, "temperature_rise_K": 50.0, "upper_K": 10.0, "lower_K": -5.0,
        },
    }  # fmt: skip
    result = solve(with_functions(chain([(1, 40.0, 0.01, 0.0)], (39.0, 41.0)), growth), samples=10)
    assert result.nominal_mm == pytest.approx(40 - 0.024)
    assert result.worst_case_mm == pytest.approx((40 - 0.0288, 40.01 - 40.01 * 12e-6 * 45), abs=1e-8)
    assert result.contributions["warm"]["worst_case_percent"] == pytest.approx(100 * 0.0072 / 0.0172, rel=1e-3)


def test_a_function_may_use_a_function():
    links = [{"name": "gap", "coefficient": 0, "expression": "a - b"}]
    links.append({"name": "slant", "coefficient": 1, "expression": "sqrt(gap**2 + 4**2)"})
    result = solve(
        with_functions(chain([(0, 9.0, 0.1, -0.1, {"fixed": True}), (1, 6.0, 0.0, 0.0)], (10.8, 11.2)), *links),
        samples=10,
    )
    assert result.nominal_mm == pytest.approx(11.0)
    assert result.worst_case_mm == pytest.approx((6 + np.hypot(2.9, 4), 6 + np.hypot(3.1, 4)))


def test_a_function_without_a_value_is_refused():
    root = {"name": "root", "coefficient": 1, "expression": "sqrt(a - 5)"}
    with pytest.raises(InputError, match="no finite closing link"):
        solve(with_functions(chain([(0, 5.0, 0.02, -0.01), (1, 2.0, 0.0, 0.0)], (1, 3)), root), samples=SAMPLES)


def test_a_part_that_cannot_bring_the_closing_link_to_its_limits_is_refused():
    near = {"name": "near", "coefficient": 1, "expression": "-a + 0.001/(1 + a*a)"}
    with pytest.raises(InputError, match=r'allocate.adjust = "a": no nominal of this part brings'):
        solve(with_functions(chain([(1, 5.0, 0.1, -0.1)], (1, 3)), near), samples=SAMPLES)


def test_expressions_read_arithmetic_and_nothing_else():
    assert evaluate("max(a, 2*b, 0) - abs(-b)/2 + cos(0)*pi**2", {"a": 1.0, "b": 3.0}) == pytest.approx(4.5 + np.pi**2)
    assert names_in("min(a, b) + a*sqrt(c)") == ["a", "b", "c"]
    for text in ("__import__('os')", "a.real", "[a]", "a if b else c", "open(a)", "sqrt(a, b)", "a <", "'a'", "True"):
        with pytest.raises(ValueError, match=r"contains|not an arithmetic"):
            names_in(text)


def test_allocation_fills_the_worst_case_of_a_bent_chain():
    links = [(1, 34.7), (-1, 34.5), (*FITTED[2], {"fixed": True}), (*FITTED[3], {"fixed": True})]
    result = solve(with_functions(chain(links, (0.10, 0.15)), GROWTH), samples=10)
    assert result.worst_case_mm == pytest.approx((0.10, 0.15), abs=1e-8)
    parts = by_name(result)
    # The fit takes from 0 to 0.018 of interference.
    assert parts["a"].tolerance_mm == pytest.approx((0.05 - 0.018 * 27 / 34.5) / 2, abs=1e-8)


def test_threads_change_no_bit_of_a_bent_chain():
    search = Allocation(fitted())
    one, three = (
        draw(
            search.function, stated_parts(search.chain.link), search.chain.closing_link,
            samples=SAMPLES, seed=4, threads=threads,
        )
        for threads in (1, 3)
    )  # fmt: skip
    assert np.array_equal(one.values, three.values)
    assert one.below == three.below and one.above == three.above


@pytest.mark.parametrize(
    ("function", "words"),
    [
        ({"press_fit": {"shaft": "c", "bore": "x", "raceway_mm": 30.0}}, 'uses "x", which is not an earlier link'),
        ({"press_fit": {"shaft": "c", "bore": "d", "raceway_mm": 25.0}}, "outside_mm is missing"),
        ({"press_fit": {"shaft": "c", "bore": "d", "raceway_mm": 27.0, "outside_mm": 30.0}}, "is on neither part"),
        ({"expression": "a +"}, 'expression = "a +": is not an arithmetic expression'),
        ({"expression": "open(a)"}, "only + - * / **"),
        (
            {"thermal_growth": {"of": "a", "expansion_per_K": 1e-5, "temperature_rise_K": 9.0, "lower_K": 5.0}},
            "lower_K = 5: exceeds upper_K = 0; swap them",
        ),
        ({"expression": "later + a"}, 'uses "later"'),
        ({"expression": "a", "nominal_mm": 3.0}, "nominal_mm = 3.0: a link of kind expression has none"),
        (
            {"expression": "a", "thermal_growth": {"of": "a", "expansion_per_K": 1e-5, "temperature_rise_K": 9.0}},
            "thermal_growth and expression contradict",
        ),
    ],
)
def test_wrong_functions_are_refused_with_key_value_and_mend(function, words):
    with pytest.raises(InputError) as caught:
        used = {"name": "uses", "coefficient": 1, "expression": "c - d"}
        solve(with_functions(chain(FITTED), used, {"name": "f", "coefficient": 1} | function), samples=10)
    assert len(caught.value.faults) == 1
    assert words in caught.value.faults[0]


@pytest.mark.parametrize(
    ("expression", "words"),
    [
        ("9**9**9", "is inf at any size"),
        ("0*9**9**9", "is nan at any size"),
        ("9" * 400, "is inf at any size"),
        ("1/0", "is inf at any size"),
        ("b/0", "is inf at b = 30, which"),
        ("b**b**b", "is inf at b = "),
        ("(-b)**0.5", "is nan at b = "),
        ("exp(b)", "is 1.06865e+13 at b"),
        ("+".join(["b"] * 5000), "has 9999 characters, more than 1000"),
        ("-" * 5000 + "b", "has 5001 characters, more than 1000"),
        ("-" * 101 + "b", "nests deeper than 100 operations"),
        ("(" * 300 + "b" + ")" * 300, "is not an arithmetic expression"),
    ],
)
def test_an_expression_without_a_value_is_told_by_its_own_link(expression, words):
    """One sentence with link, expression (cut) and mend: no big whole number, no complex one, no traceback."""
    shape = {"name": "shape", "coefficient": 1, "expression": expression}
    with pytest.raises(InputError) as caught:
        solve(with_functions(chain([(1, 2.0, 0.01, 0.0), (1, 30.0, 0.01, 0.0)]), shape), samples=10)
    (fault,) = caught.value.faults
    assert fault.startswith('link "shape": expression = "')
    assert words in fault and "; " in fault and len(fault) < 350


@pytest.mark.parametrize(
    ("expression", "words"), [("1/(a - 0.99)", "is inf at a = 0.99 (1 of 2"), ("sqrt(a - 0.985)", "is nan at a = 0.98")]
)
def test_a_corner_or_an_assembly_without_a_value_is_told(expression, words):
    """The nominal has a value: a corner of the tolerances has none, or an assembly drawn beyond them."""
    bent = {"name": "bent", "coefficient": 1, "expression": expression}
    links = [(0, 1.0, 0.01, -0.01, {"fixed": True}), (1, 2.0, 0.01, -0.01)]
    with pytest.raises(InputError) as caught:
        solve(with_functions(chain(links, (1.0, 200.0)), bent), samples=1_000_000, source="FILE")
    (fault,) = caught.value.faults
    assert f'link "bent": expression = "{expression}": {words}' in fault and "assemblies tried" in fault


def test_a_value_at_every_place_is_the_same_as_before():
    """Floats throughout: whole powers and quotients give what Python gives for floats, over arrays too."""
    for a in (0.3, 7.0, np.array([0.5, 2.0])):
        assert np.array_equal(evaluate("2**3/4 - a**2 + 7/a**-1", {"a": a}), 2.0 - a**2 + 7 / a**-1.0)
    assert evaluate(" +".join(["a"] * 100), {"a": 1.0}) == 100.0
