"""Yields of dimension chains: Monte Carlo beside convolution, closed forms and the normal law."""

import numpy as np
import pytest
from chains import chain
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtr
from scipy.stats import kstest, triang, truncnorm, uniform

from doe.dimension_chain import solve
from doe.dimension_chain.allocation import Allocation
from doe.dimension_chain.links import stated_parts
from doe.dimension_chain.yields import CHUNK, draw, exact_shares, moments, quantile, share_below

SAMPLES = 100_000
LAWS = ["normal", "truncated_normal", "uniform", "triangular"]
MIXED = [
    (1, 9.0, 0.02, -0.01, {"distribution": "uniform"}),
    (-0.79, 4.0, 0.0, -0.03, {"mean_mm": -0.01, "distribution": "truncated_normal"}),
    (2, 1.5, 0.005, 0.0, {"distribution": "triangular"}),
    (-1, 3.0, 0.01, -0.01, {"capability": 1.33}),
]


def part(law, **extra):
    return stated_parts(chain([(1, 5.0, 0.02, -0.04, {"distribution": law} | extra)]).link)[0]


def exact(plain):
    search = Allocation(plain)
    return exact_shares(search.function, stated_parts(plain.link), plain.closing_link)


def drawn(plain, samples=SAMPLES, **options):
    search = Allocation(plain)
    return draw(search.function, stated_parts(plain.link), plain.closing_link, samples=samples, seed=2, **options)


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_threads_change_no_bit(threads):
    plain = chain(MIXED, (4.8, 4.85))
    one, many = drawn(plain, 3 * CHUNK + 17, threads=1), drawn(plain, 3 * CHUNK + 17, threads=threads)
    assert np.array_equal(one.values, many.values)
    assert (one.below, one.above) == (many.below, many.above)


@pytest.mark.parametrize(
    ("law", "reference"),
    [
        ("uniform", uniform(-0.04, 0.06)),
        ("triangular", triang(0.5, -0.04, 0.06)),
        ("truncated_normal", truncnorm(-4, 2, loc=0.0, scale=0.01)),
        ("wide", truncnorm(-0.2, 0.1, loc=0.0, scale=0.2)),
    ],
)
def test_the_draws_follow_their_law(law, reference):
    mean = {"mean_mm": 0.0} if law in ("truncated_normal", "wide") else {}
    if law == "wide":
        law, mean = "truncated_normal", mean | {"capability": 0.05}
    values = drawn(chain([(1, 5.0, 0.02, -0.04, {"distribution": law} | mean)]), 20_000).values
    assert kstest(values - 5.0, reference.cdf).pvalue > 1e-3
    assert values.min() >= 4.96 and values.max() <= 5.02


@pytest.mark.parametrize("law", LAWS)
def test_quantiles_invert_shares_and_moments_agree(law):
    one = part(law)
    places = (np.arange(20_000) + 0.5) / 20_000
    deviations = quantile(one, law, places)
    assert share_below(one, law, deviations) == pytest.approx(places, abs=1e-9)
    mean, variance = moments(one, law)
    assert (deviations.mean(), deviations.var()) == pytest.approx((mean, variance), rel=2e-3)


def test_moments_of_an_off_centre_truncated_normal():
    one = part("truncated_normal", mean_mm=0.01)
    reference = truncnorm(-5, 1, loc=0.01, scale=0.01)
    assert moments(one, "truncated_normal") == pytest.approx((reference.mean(), reference.var()))


@pytest.mark.parametrize("capability", [1e-2, 1e-4, 1e-5, 1e-9])
def test_invariant_a_normal_much_wider_than_its_limits_is_uniform(capability):
    """Invariant: variance, shares and quantiles of a cut normal end in those of a uniform part, without loss of digits."""
    wide, even = part("truncated_normal", capability=capability), part("uniform")
    assert moments(wide, "truncated_normal") == pytest.approx(moments(even, "uniform"), rel=3e-3, abs=1e-12)
    probability = np.linspace(0.0, 1.0, 11)
    assert quantile(wide, "truncated_normal", probability) == pytest.approx(
        quantile(even, "uniform", probability), rel=2e-3, abs=1e-5
    )
    places = quantile(even, "uniform", probability)
    assert share_below(wide, "truncated_normal", places) == pytest.approx(probability, abs=1e-3)


def test_two_equal_uniform_links_make_a_triangle():
    plain = chain([(1, 5.0, 0.1, -0.1, {"distribution": "uniform"})] * 2, (9.85, 10.05))
    # Below: 0.05^2/2 of 0.2^2, above: 0.15^2/2.
    assert exact(plain) == pytest.approx((0.05**2 / 0.08, 0.15**2 / 0.08), abs=1e-7)


def test_three_equal_uniform_links_follow_irwin_and_hall():
    plain = chain([(1, 1.5, 0.5, -0.5, {"distribution": "uniform"})] * 3, (3.5, 5.0))
    # The sum of three numbers from 0 to 1 lies below 1/2 with 1/48, above 2 with 1/6.
    assert exact(plain) == pytest.approx((1 / 48, 1 / 6), abs=1e-7)


def test_normal_links_follow_the_normal_law():
    plain = chain([(1, 9.0, 0.02, -0.01), (-0.79, 4.0, 0.0, -0.03)], (5.84, 5.86))
    mean, deviation = 9.005 - 0.79 * 3.985, np.hypot(0.03, 0.79 * 0.03) / 6
    expected = ndtr((5.84 - 1e-9 - mean) / deviation), ndtr((mean - 5.86 - 1e-9) / deviation)
    assert exact(plain) == pytest.approx(expected, rel=1e-9)
    result = solve(plain, samples=100)
    assert result.normal_yield == pytest.approx(1 - sum(expected))
    assert result.exact_yields["normal"] == pytest.approx(1 - sum(expected))


def test_monte_carlo_agrees_with_convolution_law_by_law():
    plain = chain(MIXED, (5.84, 5.87))
    result = solve(plain, samples=SAMPLES)
    for law, share in result.exact_yields.items():
        assert abs(result.yields[law] - share) < 4 * result.standard_errors[law], law
    assert 0.5 < result.exact_yields["as_given"] < 0.999


def test_low_and_high_side_are_told_apart_in_ppm():
    plain = chain(MIXED, (5.845, 5.86))
    result, sides = solve(plain, samples=SAMPLES), exact(chain(MIXED, (5.845, 5.86)))
    for key, share in zip(("low", "high"), sides, strict=True):
        error = result.rejected["as_given"][f"{key}_standard_error_ppm"]
        assert abs(result.rejected["as_given"][f"{key}_ppm"] - 1e6 * share) < 4 * error
    assert sides[1] > 1.2 * sides[0]


@settings(max_examples=25, deadline=None)
@given(st.permutations(MIXED), st.floats(5.82, 5.88), st.floats(0.001, 0.05))
def test_the_order_of_links_does_not_matter_and_shares_add_up(links, low, width):
    here, there = exact(chain(links, (low, low + width))), exact(chain(MIXED, (low, low + width)))
    assert here == pytest.approx(there, abs=2e-7)
    assert 0 <= sum(here) <= 1 + 1e-9


def test_one_link_and_none_need_no_lattice():
    assert exact(chain([(-1, 5.0, 0.1, 0.0, {"distribution": "uniform"})], (-5.09, -5.0))) == pytest.approx((0.1, 0))
    assert exact(chain([(1, 5.0, 0.0, 0.0)], (5.1, 6.0))) == (1, 0)


def test_quantiles_and_moments_of_the_closing_link():
    result = solve(chain([(1, 5.0, 0.06, 0.0), (-1, 2.0, 0.08, 0.0)], (2, 4)), samples=SAMPLES)
    deviation = 0.1 / 6
    assert result.mean_mm == pytest.approx(2.99, abs=5 * deviation / SAMPLES**0.5)
    assert result.standard_deviation_mm == pytest.approx(deviation, rel=0.01)
    assert (result.cp, result.cpk) == pytest.approx((2 / (6 * deviation), 0.99 / (3 * deviation)), rel=0.01)
    assert result.quantiles_mm[0.5] == pytest.approx(2.99, abs=3e-4)
    assert result.quantiles_mm[0.975] - result.quantiles_mm[0.025] == pytest.approx(3.92 * deviation, rel=0.02)


def test_capability_narrows_a_normal_part():
    links = [(1, 5.0, 0.1, -0.1, {"capability": 2.0})]
    assert exact(chain(links, (4.95, 5.05)))[0] == pytest.approx(ndtr(-3.0), rel=1e-5)


def test_settings_of_the_file_hold_unless_given():
    plain = chain([(1, 5.0, 0.1, -0.1)], (4.95, 5.05))
    plain = plain.model_validate(plain.model_dump() | {"monte_carlo": {"samples": 1000, "seed": 7}})
    assert solve(plain).yields == solve(plain, samples=1000, seed=7).yields
    assert solve(plain).samples == 1000
