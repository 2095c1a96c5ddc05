"""Selective assembly: parts sorted into classes and matched, beside closed forms."""

from math import sqrt

import numpy as np
import pytest
from chains import chain, with_functions
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtri
from scipy.stats import truncnorm

from doe.dimension_chain import solve
from doe.dimension_chain.links import stated_parts
from doe.dimension_chain.yields import class_edges, share_below
from rbdyn.base.faults import InputError

EQUAL = [(1, 9.3, 0.0, -0.012), (-1, 9.0, 0.012, 0.0)]
SAMPLES = 200_000


def class_shares(part, edges):
    """Share of a part's production in each class."""
    below = share_below(part, part.distribution, edges - part.nominal_mm)
    below[[0, -1]] = 0.0, 1.0
    return np.diff(below)


def matched(links, limits, **wish):
    table = {"first": "a", "second": "b", "samples": SAMPLES} | wish
    plain = with_functions(chain(links, limits), selective=table)
    return solve(plain, samples=10).selective


@pytest.mark.parametrize("classes", [3, 6])
@pytest.mark.parametrize("by", ["width", "probability"])
def test_two_equal_normal_parts_follow_the_closed_form(classes, by):
    found = matched(EQUAL, (0.28, 0.296), classes=classes, by=by)
    # Within a class both parts are truncated normals of one variance; class means cancel.
    edges = np.linspace(-3, 3, classes + 1) if by == "width" else ndtri(np.linspace(0, 1, classes + 1))
    edges[[0, -1]] = -np.inf, np.inf
    shares = np.diff(truncnorm(-np.inf, np.inf).cdf(edges))
    within = sum(p * truncnorm(low, high).var() for p, low, high in zip(shares, edges[:-1], edges[1:], strict=True))
    sigma = 0.012 / 6
    assert found.matched_deviation_mm == pytest.approx(sigma * sqrt(2 * within), rel=0.015)
    assert found.random_deviation_mm == pytest.approx(sigma * sqrt(2), rel=0.01)
    # Shares of a class in two samples of n differ by chance alone, by about sqrt(4 p/(pi n)).
    chance = sum(np.sqrt(p / np.pi / SAMPLES) for p in shares)
    assert found.matched == pytest.approx(1 - chance, abs=chance)


@pytest.mark.parametrize(("limits", "needed"), [((0.276, 0.300), 1), ((0.282, 0.294), 2), ((0.2855, 0.2905), 5)])
def test_classes_needed_divide_the_worst_case(limits, needed):
    # Two tolerances of 0.012 mm in n classes leave 0.024/n about 0.288 mm.
    assert matched(EQUAL, limits).classes_needed == needed


def test_worst_case_of_unequal_tolerances_keeps_their_difference():
    found = matched([(1, 9.3, 0.006, -0.006), (-1, 9.0, 0.003, -0.003)], (0.2, 0.4), classes=3)
    # Class means run apart by 4 - 2 um a class; each class is 4 + 2 um wide.
    assert found.worst_case_mm == pytest.approx((0.3 - 0.002 - 0.003, 0.3 + 0.002 + 0.003))


def test_unequal_spreads_leave_parts_without_a_mate_in_classes_of_one_width():
    wide, narrow = {"capability": 1.0}, {"capability": 2.0}
    links = [(1, 9.3, 0.0, -0.012, wide), (-1, 9.0, 0.012, 0.0, narrow)]
    found = matched(links, (0.28, 0.296), classes=4)
    parts = stated_parts(chain(links).link)
    shares = [class_shares(part, class_edges(part, 4, "width")) for part in parts]
    # Large mates with large: classes in the order of size on both.
    assert found.matched == pytest.approx(np.minimum(*shares).sum(), abs=0.004)
    assert found.matched < 0.9
    assert matched(links, (0.28, 0.296), classes=4, by="probability").matched > 0.99


def test_parts_that_add_up_mate_large_with_small():
    found = matched([(1, 9.0, 0.01, -0.01), (1, 8.0, 0.01, -0.01)], (16.995, 17.005), classes=4)
    assert found.worst_case_mm == pytest.approx((16.995, 17.005))
    assert found.good == pytest.approx(1.0, abs=0.01)
    assert found.random < 0.8


def test_the_other_links_come_as_they_come():
    links = [*EQUAL, (1, 5.0, 0.006, -0.006)]
    found = matched(links, (5.28, 5.296), classes=20)
    assert found.matched_deviation_mm == pytest.approx(0.002, rel=0.03)
    assert found.worst_case_mm == pytest.approx((5.2874 - 0.006, 5.2886 + 0.006), abs=1e-4)


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(["normal", "truncated_normal", "uniform", "triangular"]),
    st.integers(2, 12),
    st.sampled_from(["width", "probability"]),
)
def test_classes_share_out_the_whole_production(law, classes, by):
    part = stated_parts(chain([(1, 5.0, 0.02, -0.04, {"distribution": law})]).link)[0]
    edges = class_edges(part, classes, by)
    assert (edges[0], edges[-1]) == pytest.approx((4.96, 5.02))
    assert np.all(np.diff(edges) > 0)
    shares = class_shares(part, edges)
    assert shares.sum() == pytest.approx(1.0)
    if by == "probability":
        assert shares == pytest.approx(np.full(classes, 1 / classes))


@pytest.mark.parametrize(
    ("wish", "words"),
    [
        ({"first": "x"}, 'selective.first = "x": is not a part; name one of a, b'),
        ({"second": "a"}, 'selective.second = "a": is the first part too; name another'),
    ],
)
def test_wrong_pairs_are_refused(wish, words):
    with pytest.raises(InputError) as caught:
        matched(EQUAL, (0.28, 0.296), **wish)
    assert caught.value.faults == [words]
