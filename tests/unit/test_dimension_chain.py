"""Dimension chains: the published pocket chain, intervals, yields, allocation and refusals."""

import json
from math import sqrt

import numpy as np
import pytest
from chains import by_name, chain, read_chain
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from doe.dimension_chain import chain_from, grade_tolerances, solve, tolerance_unit
from rbdyn.base.faults import InputError

POCKET = """
[closing_link]
lower_mm = 0.280
upper_mm = 0.290

[[link]]
name = "pocket width"
coefficient = 1
nominal_mm = 9.05
{pocket}

[[link]]
name = "roller diameter"
coefficient = -1
nominal_mm = 9
{roller}
"""
PRINTED = POCKET.format(pocket="upper_mm = 0\nlower_mm = -0.05", roller="upper_mm = 0.05\nlower_mm = 0")
SAMPLES = 100_000


def written(tmp_path, text):
    path = tmp_path / "CHAIN.toml"
    path.write_text(text)
    return path


def test_the_printed_chain_is_refused_with_the_reason_and_the_nearest(tmp_path):
    result = solve(read_chain(written(tmp_path, PRINTED)), samples=SAMPLES).as_dict()
    assert result["closing_link"]["nominal_mm"] == pytest.approx(0.05)
    assert result["closing_link"]["worst_case_mm"] == pytest.approx([-0.05, 0.05])
    assert result["closing_link"]["rss_mm"] == pytest.approx([-0.05 / sqrt(2), 0.05 / sqrt(2)])
    assert result["yield"]["as_given"] == 0
    assert result["yield"]["standard_error"] == pytest.approx(0.5 / SAMPLES, rel=1e-3)
    status = result["status"]
    assert status.startswith("refused: ")
    assert "-0.0500 to +0.0500 mm, outside 0.2800 to 0.2900 mm" in status
    assert "worst-case tolerance 0.1000 of 0.0100 mm, yield 0;" in status
    assert "pocket width 9.290 0/-0.005, roller diameter 9.000 +0.005/0" in status


@pytest.mark.parametrize("text", [PRINTED, POCKET.format(pocket="", roller="")])
def test_right_tolerances_for_the_printed_limits(tmp_path, text):
    allocation = solve(read_chain(written(tmp_path, text)), samples=10).as_dict()["allocation"]
    moved = 9.29 - read_chain(written(tmp_path, text)).link[0].nominal
    assert allocation == {
        "pocket width": {
            "nominal_mm": 9.29,
            "upper_mm": 0.0,
            "lower_mm": -0.005,
            "grade": None,
            "moved_mm": pytest.approx(moved),
        },
        "roller diameter": {"nominal_mm": 9.0, "upper_mm": 0.005, "lower_mm": 0.0, "grade": None, "moved_mm": 0.0},
    }


def test_without_deviations_the_allocated_ones_are_judged(tmp_path):
    result = solve(read_chain(written(tmp_path, POCKET.format(pocket="", roller=""))), samples=SAMPLES)
    assert result.status == "ok: deviations allocated"
    assert result.worst_case_mm == pytest.approx((0.28, 0.29))
    assert result.yields["truncated_normal"] == result.yields["uniform"] == 1
    assert result.standard_error > 0


def test_the_allocated_chain_given_back_is_accepted(tmp_path):
    text = POCKET.replace("9.05", "9.29").format(
        pocket="upper_mm = 0\nlower_mm = -0.005", roller="upper_mm = 0.005\nlower_mm = 0"
    )
    assert solve(read_chain(written(tmp_path, text)), samples=10).status == "ok"


def test_json_has_the_contract_keys(tmp_path):
    result = solve(read_chain(written(tmp_path, PRINTED)), samples=10).as_dict()
    assert list(result)[:5] == ["closing_link", "yield", "contributions", "allocation", "status"]
    assert list(result["closing_link"]) == ["nominal_mm", "worst_case_mm", "rss_mm"]
    assert list(result["yield"]) == ["as_given", "normal", "truncated_normal", "uniform", "standard_error"]
    each = {"variance_percent": pytest.approx(50), "worst_case_percent": pytest.approx(50)}
    assert result["contributions"] == {"pocket width": each, "roller diameter": each}
    assert json.loads(json.dumps(result, allow_nan=False)) == result


def test_intervals_of_an_asymmetric_chain_with_a_leverage():
    result = solve(chain([(1, 20.0, 0.05, -0.01), (-0.79, 10.0, 0.0, -0.02)], (12.0, 13.0)), samples=10)
    assert result.nominal_mm == pytest.approx(12.1)
    assert result.worst_case_mm == pytest.approx((12.09, 12.1658))
    half = sqrt(0.06**2 + 0.0158**2) / 2
    assert result.rss_mm == pytest.approx((12.1279 - half, 12.1279 + half))
    assert result.contributions["b"]["worst_case_percent"] == pytest.approx(100 * 0.0158 / 0.0758)
    assert result.contributions["b"]["variance_percent"] == pytest.approx(100 * (0.0158 / (2 * half)) ** 2)


def test_variance_contribution_follows_the_distribution():
    links = [(1, 5.0, 0.1, 0.0, {"distribution": kind}) for kind in ("normal", "uniform", "triangular")]
    shares = [each["variance_percent"] for each in solve(chain(links), samples=10).contributions.values()]
    assert shares == pytest.approx([100 * x / (1 + 3 + 1.5) for x in (1, 3, 1.5)])


@pytest.mark.parametrize("reach", [1.0, 0.6, 0.2])
def test_monte_carlo_agrees_with_root_sum_square(reach):
    links = [(1, 9.0, 0.02, -0.01), (-0.79, 4.0, 0.0, -0.03), (2, 1.5, 0.005, 0.0)]
    low, high = solve(chain(links), samples=1).rss_mm
    middle, half = (low + high) / 2, (high - low) / 2
    result = solve(chain(links, (middle - reach * half, middle + reach * half)), samples=SAMPLES, seed=3)
    exact = 2 * norm.cdf(3 * reach) - 1
    assert abs(result.yields["normal"] - exact) < 4 * result.standard_error
    assert result.yields["as_given"] == result.yields["normal"]


@pytest.mark.parametrize(
    ("distribution", "exact"),
    [("uniform", 0.5), ("triangular", 0.75), ("normal", 0.8663856), ("truncated_normal", 0.8687308)],
)
def test_yield_of_one_link_within_half_its_tolerance(distribution, exact):
    one = chain([(-2, 3.0, 0.1, -0.1, {"distribution": distribution})], (-6.1, -5.9))
    result = solve(one, samples=SAMPLES)
    assert abs(result.yields["as_given"] - exact) < 4 * result.standard_error


def test_a_given_mean_moves_the_yield():
    one = chain([(1, 3.0, 0.1, -0.1, {"mean_mm": 0.05})], (2.9, 3.05))
    result = solve(one, samples=SAMPLES)
    assert abs(result.yields["normal"] - 0.5) < 4 * result.standard_error


def test_monte_carlo_is_seeded():
    one = chain([(1, 3.0, 0.1, -0.1)], (2.95, 3.0))
    runs = [solve(one, samples=1000, seed=seed).yields for seed in (1, 1, 2)]
    assert runs[0] == runs[1] != runs[2]


def test_a_link_without_tolerance_is_a_constant():
    result = solve(chain([(1, 5.0, 0.1, 0.0), (-1, 4.5, 0.0, 0.0)]), samples=100)
    assert result.contributions["b"] == {"variance_percent": 0, "worst_case_percent": 0}
    assert result.yields["uniform"] == 1


coefficients = st.floats(0.1, 3).flatmap(lambda size: st.sampled_from([size, -size]))


@settings(max_examples=50, deadline=None)
@given(
    st.lists(st.tuples(coefficients, st.floats(1, 100)), min_size=1, max_size=5),
    st.floats(0.01, 1),
    st.sampled_from(["equal", "iso286"]),
    st.sampled_from(["worst_case", "rss"]),
)
def test_allocation_fills_the_limits(links, width, method, mode):
    result = solve(chain(links, (0.3, 0.3 + width), method=method, mode=mode), samples=1)
    spent = [abs(part.coefficient) * part.tolerance_mm for part in result.allocation]
    total = sum(spent) if mode == "worst_case" else sqrt(sum(t * t for t in spent))
    assert total == pytest.approx(width, abs=1e-9)
    interval = result.worst_case_mm if mode == "worst_case" else result.rss_mm
    assert interval == pytest.approx((0.3, 0.3 + width), abs=1e-9)
    moved = [a.name for a, link in zip(result.allocation, links, strict=True) if a.nominal_mm != link[1]]
    assert len(moved) <= 1
    for part in result.allocation:
        assert (part.upper_mm if part.coefficient > 0 else part.lower_mm) == 0


def test_iso286_shares_by_the_tolerance_unit():
    parts = solve(chain([(1, 100.0), (-0.79, 8.0)], (92, 92.1), method="iso286"), samples=1).allocation
    assert tolerance_unit(8.0) == pytest.approx(0.000908)
    ratio = tolerance_unit(100.0) / tolerance_unit(8.0)
    assert parts[0].tolerance_mm / parts[1].tolerance_mm == pytest.approx(ratio)


@pytest.mark.parametrize("mode", ["worst_case", "rss"])
def test_fixed_links_keep_their_sizes_and_their_share(mode):
    fixed = {"fixed": True}
    links = [(1, 30.0), (-1, 12.0, 0.0, -0.06, fixed), (-1, 17.0)]
    result = solve(chain(links, (1.0, 1.1), mode=mode), samples=1)
    part = by_name(result)
    assert (part["b"].nominal_mm, part["b"].upper_mm, part["b"].lower_mm) == (12.0, 0.0, -0.06)
    free = 0.02 if mode == "worst_case" else 0.08 / sqrt(2)
    assert part["a"].tolerance_mm == pytest.approx(free)
    assert part["c"].tolerance_mm == pytest.approx(free)
    interval = result.worst_case_mm if mode == "worst_case" else result.rss_mm
    assert interval == pytest.approx((1.0, 1.1))


def test_the_adjusted_link_can_be_chosen():
    part = by_name(solve(chain([(1, 9.05), (-1, 9.0)], (0.28, 0.29), adjust="b"), samples=1))
    assert part["a"].nominal_mm == 9.05
    assert part["b"].nominal_mm == pytest.approx(8.76)


def test_grades_follow_the_standard():
    grades = grade_tolerances(9.0)
    assert list(grades)[:3] == ["IT01", "IT0", "IT1"]
    assert list(grades)[-1] == "IT18"
    assert list(grades.values()) == sorted(grades.values())
    # ISO 286-1 for 6 to 10 mm.
    listed = {"IT1": 1, "IT2": 1.5, "IT3": 2.5, "IT4": 4, "IT5": 6, "IT6": 9, "IT7": 15, "IT8": 22, "IT11": 90}
    for grade, micrometres in listed.items():
        assert 1e3 * grades[grade] == pytest.approx(micrometres, rel=1e-12)


def test_snapping_takes_the_widest_grade_that_fits():
    links, limits = [(1, 9.05), (-1, 9.0)], (0.28, 0.29)
    result = solve(chain(links, limits, grades=True), samples=SAMPLES)
    for part, (_, nominal) in zip(result.allocation, links, strict=True):
        assert part.grade == "IT4"
        assert part.tolerance_mm == pytest.approx(grade_tolerances(nominal)["IT4"])
        assert grade_tolerances(nominal)["IT4"] < 0.005 < grade_tolerances(nominal)["IT5"]
    assert result.worst_case_mm[1] == pytest.approx(0.29)
    assert result.worst_case_mm[0] > 0.28


def test_what_no_grade_fits_stays_unsnapped():
    parts = solve(chain([(1, 9.05), (-1, 9.0)], (0.28, 0.2805), grades=True), samples=1).allocation
    assert [part.grade for part in parts] == [None, None]
    assert parts[0].tolerance_mm == pytest.approx(0.00025)


def test_root_sum_square_mode_accepts_what_worst_case_refuses():
    links, limits = [(1, 9.29, 0.0, -0.007), (-1, 9.0, 0.007, 0.0)], (0.278, 0.288)
    strict = solve(chain(links, limits), samples=SAMPLES)
    assert strict.status.startswith("refused: ")
    assert solve(chain(links, limits, mode="rss"), samples=SAMPLES).status == "ok"
    assert strict.yields["normal"] > 0.99
    wide = [(1, 9.29, 0.0, -0.01), (-1, 9.0, 0.01, 0.0)]
    assert "RSS tolerance 0.0141" in solve(chain(wide, limits, mode="rss"), samples=10).status


FREE = [(1, 9.0), (-1, 8.0)]


@pytest.mark.parametrize(
    ("links", "settings", "words"),
    [
        (FREE, {"limits": (0.3, 0.2)}, "closing_link.lower_mm = 0.3: must be below upper_mm = 0.2"),
        ([(0, 9.0), (1, 8.0)], {}, 'link "a": coefficient = 0: must not be zero'),
        ([(1, 9.0, {"name": "b"}), (1, 8.0)], {}, 'link.name = "b": used 2 times'),
        (FREE, {"adjust": "c"}, 'allocate.adjust = "c": is not a link; name one of a, b'),
        ([(1, 9.0, 0.1, 0.0, {"fixed": True}), (1, 8.0)], {"adjust": "a"}, 'adjust = "a": is fixed; name one of b'),
        ([(1, 9.0, {"fixed": True}), (1, 8.0)], {}, 'link "a": fixed = true without deviations; give'),
        ([(1, 9.0, 0.1, 0.0, {"fixed": True})], {}, "fixed = true on every link"),
        ([(1, 9.0, 0.1), (1, 8.0, 0.1, 0.0)], {}, 'link "a": only one of upper_mm and lower_mm'),
        ([(1, 9.0, 0.1, 0.2)], {}, 'link "a": lower_mm = 0.2: exceeds upper_mm = 0.1'),
        ([(1, 9.0), (1, -8.0)], {"method": "iso286"}, 'link "b": nominal_mm = -8: ISO 286'),
        ([(1, 9.0, {"mean_mm": 0.1})], {}, 'link "a": mean_mm = 0.1: needs deviations'),
        ([(1, 9.0, 0.1, 0.0, {"mean_mm": 0.2})], {}, 'link "a": mean_mm = 0.2: is a deviation from the nominal'),
        ([(1, 9.0, 0.1, 0.0, {"mean_mm": 0.05, "distribution": "uniform"})], {}, 'mean_mm = 0.05: not for "uniform"'),
    ],
)
def test_wrong_chains_are_refused_with_key_value_and_mend(links, settings, words):
    with pytest.raises(InputError) as caught:
        solve(chain(links, **settings), samples=10)
    assert len(caught.value.faults) == 1
    assert words in caught.value.faults[0]


def test_all_faults_of_a_file_come_at_once_with_its_name(tmp_path):
    text = PRINTED.replace("coefficient = -1", "coefficient = 0").replace("upper_mm = 0.290", "upper_mm = 0.2")
    path = written(tmp_path, text)
    with pytest.raises(InputError) as caught:
        read_chain(path)
    assert len(caught.value.faults) == 2
    assert all(fault.startswith(f"{path}: ") for fault in caught.value.faults)


def test_unknown_keys_and_missing_links_are_named():
    with pytest.raises(InputError, match=r"link\[1\]\.nominal: unknown key; did you mean nominal_mm"):
        chain_from(
            {"closing_link": {"lower_mm": 0, "upper_mm": 1}, "link": [{"name": "a", "coefficient": 1, "nominal": 2}]},
            "x.toml",
        )
    with pytest.raises(InputError, match=r"x\.toml: link"):
        chain_from({"closing_link": {"lower_mm": 0, "upper_mm": 1}, "link": []}, "x.toml")


def test_samples_must_be_positive():
    with pytest.raises(InputError, match="samples = 0: must be at least 1"):
        solve(chain(FREE), samples=0)


def test_standard_error_is_never_zero_and_shrinks():
    one = chain([(1, 3.0, 0.1, -0.1, {"distribution": "uniform"})], (2.0, 4.0))
    errors = [solve(one, samples=samples).standard_error for samples in (100, 10000)]
    assert errors == pytest.approx([0.5 / 101, 0.5 / 10001])
    assert np.all(np.array(errors) > 0)
