"""Response surfaces against statsmodels, published tables and known functions."""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import statsmodels.formula.api as smf
from statsmodels.stats.anova import anova_lm

from doe.designs import central_composite, to_coded
from doe.response_surface import describe, fit
from doe.response_surface.statistics import PureError, fits_of

TABLE = Path(__file__).parents[2] / "examples" / "ccd_table4.csv"
CENTRE, STEP = [0.02, 0.15, 0.3], [0.005, 0.05, 0.05]
RESPONSES = ["impact_force_N", "whirl_deviation_ratio", "power_loss_W"]
QUADRATIC = "y ~ A + B + C + A:B + A:C + B:C + I(A**2) + I(B**2) + I(C**2)"


@pytest.fixture(scope="module")
def printed():
    """Table 4 of the paper as printed: coded points and responses."""
    table = pd.read_csv(TABLE)
    return to_coded(table.iloc[:, 1:4].to_numpy(), CENTRE, STEP), table[RESPONSES].to_numpy()


@pytest.fixture(scope="module")
def behind_the_paper(printed):
    """The data behind the paper's equation (22) and Tables 5-7: five cells of Table 4 differ.

    The axial points are exact here, for the table rounds them.
    """
    points, values = printed[0].copy(), printed[1].copy()
    axial = np.abs(points) > 1.5
    points[axial] = np.sign(points[axial]) * 8**0.25
    for run, column, value in [(3, 0, 205.4), (9, 0, 174.8), (10, 0, 216.6), (12, 1, 0.7472), (16, 2, 398.9)]:
        values[run - 1, column] = value
    return points, values


def fitted(data, column, model):
    return fit(data[0], data[1][:, column], name=RESPONSES[column], model=model, centre=CENTRE, step=STEP)


def row(surface, source):
    return next(row for row in surface.anova if row.source == source)


@pytest.mark.parametrize("column", range(3))
def test_lack_of_fit_agrees_with_the_comparison_of_models(printed, column):
    surface = fitted(printed, column, "quadratic")
    frame = pd.DataFrame(printed[0], columns=list("ABC")).assign(y=printed[1][:, column])
    frame["point"] = [str(np.round(point, 6) + 0.0) for point in printed[0]]
    table = anova_lm(smf.ols(QUADRATIC, frame).fit(), smf.ols("y ~ point", frame).fit())
    assert surface.lack_of_fit.ss == pytest.approx(table.loc[1, "ss_diff"], rel=1e-9)
    assert surface.lack_of_fit.df == table.loc[1, "df_diff"] == 5
    assert surface.lack_of_fit.f == pytest.approx(table.loc[1, "F"], rel=1e-9)
    assert surface.lack_of_fit.p == pytest.approx(table.loc[1, "Pr(>F)"], rel=1e-9)
    assert surface.pure_error.ss == pytest.approx(table.loc[1, "ssr"], rel=1e-9)
    assert surface.pure_error.df == 5


# The coefficients of equation (22), then source, sum of squares, mean square, F and P of Tables 5-7, as printed.
EQUATION_22 = [
    ("linear", "203.03 22.54 18.21 32.69"),
    ("quadratic", "0.73 0.004088 -0.062 0.021 0.004463 0.0004125 -0.031 0.012 0.044 0.022"),
    ("quadratic", "411.59 1.69 -21.72 -27.49 0.000 0.2 -0.075 2.09 9.73 4.87"),
]
TABLE_5 = """
model 26058.97 8686.32 41.45 <0.0001
A 6937.93 6937.93 33.11 <0.0001
B 4529.24 4529.24 21.61 0.0003
C 14591.80 14591.80 69.63 <0.0001
residual 3353.12 209.57
lack_of_fit 3055.66 277.79 4.67 0.0507
total 29412.08
"""
TABLE_6 = """
model 0.100 0.011 44.64 <0.0001
A 0.0002282 0.0002282 0.92 0.3601
B 0.053 0.053 212.56 <0.0001
C 0.005787 0.005787 23.32 0.0007
AB 0.0001593 0.0001593 0.64 0.4416
AC 0.000001361 0.000001361 0.005487 0.9424
BC 0.007806 0.007806 31.46 0.0002
A^2 0.002158 0.002158 8.70 0.0146
B^2 0.028 0.028 112.21 <0.0001
C^2 0.006994 0.006994 28.19 0.0003
residual 0.002481 0.0002481
lack_of_fit 0.002021 0.0004042 4.39 0.0650
total 0.10
"""
TABLE_7 = """
model 18401.12 2044.57 49.44 <0.0001
A 38.89 38.89 0.94 0.3551
B 6445.42 6445.42 155.85 <0.0001
C 10322.62 10322.62 249.61 <0.0001
AB 0.000 0.000 0.000 1.0000
AC 0.32 0.32 0.007738 0.9316
BC 0.045 0.045 0.001088 0.9743
A^2 62.99 62.99 1.52 0.2453
B^2 1363.65 1363.65 32.97 0.0002
C^2 341.25 341.25 8.25 0.0166
residual 413.56 41.36
lack_of_fit 219.46 43.89 1.13 0.4480
total 18814.67
"""
TABLES_5_TO_7 = [TABLE_5, TABLE_6, TABLE_7]
R2 = [0.8860, 0.9757, 0.9780]


def as_printed(text):
    """A printed number, to half a unit of its last digit."""
    digits = len(text.partition(".")[2])
    return pytest.approx(float(text), rel=0, abs=0.501 * 10.0**-digits)


@pytest.mark.parametrize("column", range(3))
def test_reproduces_equation_22_and_tables_5_to_7(behind_the_paper, column):
    model, coefficients = EQUATION_22[column]
    surface = fitted(behind_the_paper, column, model)
    assert surface.coefficients.tolist() == [as_printed(text) for text in coefficients.split()]
    for line in TABLES_5_TO_7[column].strip().splitlines():
        source, *texts = line.split()
        for key, text in zip(("ss", "ms", "f", "p"), texts, strict=False):
            number = getattr(row(surface, source), key)
            assert number < 1e-4 if text == "<0.0001" else number == as_printed(text), (source, key)
    assert surface.r2 == pytest.approx(R2[column], abs=5.1e-5)


def test_few_of_the_printed_numbers_follow_from_table_4_itself(printed):
    met = total = 0
    for column, (model, _) in enumerate(EQUATION_22):
        surface = fitted(printed, column, model)
        for line in TABLES_5_TO_7[column].strip().splitlines():
            source, *texts = line.split()
            met += row(surface, source).ss == as_printed(texts[0])
            total += 1
    # Terms of the ratio and of the loss that the changed cells do not touch, or hardly.
    assert (met, total) == (12, 33)


def test_loss_of_run_16_makes_nearly_all_pure_error_behind_the_paper(behind_the_paper):
    # An outlier among the centre runs; in the fit it is the most extreme run but swells the residual itself.
    surface = fitted(behind_the_paper, 2, "quadratic")
    outlier = surface.diagnostics.outlier
    assert outlier.run == 16 and outlier.studentized < -2.5 and outlier.p > 0.05
    centre = [2.7, 0.1, 0.2, 0.8, 0.2]
    without = float(np.var(centre) * 5)
    assert surface.pure_error.ss > 20 * without


@pytest.mark.parametrize(("column", "model"), [(0, "linear"), (1, "quadratic"), (2, "quadratic")])
def test_table_4_as_printed_has_significant_lack_of_fit(printed, column, model):
    surface = fitted(printed, column, model)
    assert surface.lack_of_fit.p < 0.05
    assert any("lack of fit is significant" in line for line in describe(surface))


def test_published_picture_of_the_data_behind_the_paper(behind_the_paper):
    terms, lack, *_ = describe(fitted(behind_the_paper, 1, "quadratic"))
    assert "significant at 0.05: B (p < 0.0001)" in terms
    assert "not significant: A, AB, AC" in terms
    assert "lack of fit is not significant (p = 0.0650 against pure error)" in lack


def test_json_has_the_contract_keys_and_no_nan(printed):
    surface = fitted(printed, 1, "quadratic")
    result = fits_of([surface]).as_dict()["responses"][surface.name]
    assert list(result) == [
        *("model", "coefficients", "anova", "lack_of_fit", "pure_error", "r2", "adjusted_r2", "predicted_r2"),
        *("press", "cv_percent", "adequate_precision", "stationary_point", "terms", "standard_errors", "vif"),
        *("tests", "covariance", "residual_dof", "observation_variance", "actual_coefficients"),
        *("transform", "box_cox", "blocks", "elimination", "canonical", "known_variance", "model_error"),
        *("diagnostics", "rival", "sentences"),
    ]
    assert list(result["stationary_point"]) == ["coded", "actual", "eigenvalues", "nature"]
    terms = ["A", "B", "C", "AB", "AC", "BC", "A^2", "B^2", "C^2"]
    assert list(result["coefficients"]) == ["1", *terms]
    sources = [each["source"] for each in result["anova"]]
    assert sources == ["model", *terms, "residual", "lack_of_fit", "pure_error", "total"]
    assert json.loads(json.dumps(result, allow_nan=False)) == result


def test_summary_numbers_by_their_definitions(printed):
    points, values = printed
    surface = fitted(printed, 2, "quadratic")
    deviation = surface.residual_mean_square**0.5
    assert surface.cv_percent == pytest.approx(100 * deviation / values[:, 2].mean())
    span = np.ptp(surface.predict(points))
    assert surface.adequate_precision == pytest.approx(span / (deviation * (10 / 20) ** 0.5))


def exact(function, **keywords):
    """Surface through noise-free values of a function on a three-factor design."""
    points = central_composite(3).coded
    return fit(points, function(points), name="y", centre=CENTRE, step=STEP, **keywords)


@pytest.mark.parametrize(
    ("curvature", "nature"), [((1, 2, 3), "minimum"), ((-1, -2, -3), "maximum"), ((-1, 2, 3), "saddle")]
)
def test_stationary_point_of_a_known_quadratic(curvature, nature):
    place = np.array([0.3, -0.5, 0.8])
    surface = exact(lambda x: 7 + (x - place) ** 2 @ np.array(curvature))
    found = surface.stationary_point
    assert found.coded == pytest.approx(place, abs=1e-9)
    assert found.actual == pytest.approx(np.array(CENTRE) + place * STEP, abs=1e-9)
    assert found.eigenvalues == pytest.approx(sorted(curvature), abs=1e-9)
    assert found.nature == nature


def test_coupled_factors_rotate_the_stationary_axes():
    surface = exact(lambda x: x[:, 0] * x[:, 1] + x[:, 2] ** 2)
    assert surface.stationary_point.eigenvalues == pytest.approx([-0.5, 0.5, 1], abs=1e-9)


def test_no_stationary_point_without_curvature_in_each_direction():
    assert exact(lambda x: x @ [1.0, 2.0, 3.0], model="linear").stationary_point is None
    assert exact(lambda x: x[:, 0] ** 2 + x[:, 1]).stationary_point is None


def test_reduction_keeps_what_counts_and_its_hierarchy():
    noise = 0.05 * np.random.default_rng(1).normal(size=20)
    surface = exact(lambda x: 5 + x[:, 0] * x[:, 1] + 2 * x[:, 2] + noise, model="reduced")
    assert surface.terms == ("1", "A", "B", "C", "AB")
    assert row(surface, "AB").p < 0.05
    assert row(surface, "A").p > 0.05  # kept for the sake of AB


def test_reduction_of_pure_noise_leaves_little():
    values = np.random.default_rng(0).normal(size=20)
    surface = exact(lambda x: values, model="reduced")
    for term in surface.terms[1:]:
        needed = any(term in other for other in surface.terms if other != term)
        assert needed or row(surface, term).p <= 0.05
    json.dumps(surface.as_dict(), allow_nan=False)
    left = set(surface.terms) | {each.term for each in surface.elimination}
    assert left == {"1", "A", "B", "C", "AB", "AC", "BC", "A^2", "B^2", "C^2"}
    assert any("removed in this order" in line for line in describe(surface))


def test_without_replicates_there_is_no_pure_error():
    points = central_composite(3, centre_replicates=1).coded
    values = np.random.default_rng(2).normal(size=len(points))
    surface = fit(points, values, name="y", centre=CENTRE, step=STEP)
    assert surface.pure_error == PureError(ss=None, df=0, ms=None)
    assert surface.lack_of_fit.p is None
    assert "no run is replicated" in describe(surface)[1]
    json.dumps(surface.as_dict(), allow_nan=False)


def test_equal_replicates_leave_lack_of_fit_undefined():
    surface = exact(lambda x: 0.1 + np.sin(x[:, 0]))
    assert surface.pure_error.ss == 0
    assert surface.lack_of_fit.f is None
    assert "agree exactly" in describe(surface)[1]


def test_replicates_away_from_the_centre_count():
    points = np.vstack([central_composite(2, centre_replicates=1).coded] * 2)
    values = np.random.default_rng(4).normal(size=18)
    surface = fit(points + 1e-12, values, name="y", centre=[0, 0], step=[1, 1])
    assert surface.pure_error.df == 9
    assert surface.pure_error.ss == pytest.approx(((values[:9] - values[9:]) ** 2).sum() / 2)


def test_prediction_keeps_the_shape_of_its_points(printed):
    surface = fitted(printed, 0, "linear")
    assert surface.predict(np.zeros((2, 5, 3))).shape == (2, 5)
    assert surface.predict([0.0, 0.0, 0.0]) == pytest.approx(surface.coefficients[0])
    assert surface.prediction_standard_error(np.zeros((2, 5, 3))).shape == (2, 5)


def test_reduction_takes_terms_from_the_quadratic_in_order(printed):
    for column in range(3):
        full, less = fitted(printed, column, "quadratic"), fitted(printed, column, "reduced")
        assert set(less.terms) <= set(full.terms)
        assert less.residual_dof == 20 - len(less.terms)
        assert all(full.terms.index(a) < full.terms.index(b) for a, b in pairwise(less.terms))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda x, y: (x[:10], y[:10], "quadratic"), "10 runs are too few .* give at least 11"),
        (lambda x, y: (x, y + 1e15, "linear"), "differ by .* which rounding hides; subtract a constant"),
        (lambda x, y: (x[:4], y[:4], "linear"), "give at least 5"),
        (lambda x, y: (x * [1, 1, 0], y, "linear"), "cannot separate C from"),
        (lambda x, y: (np.vstack([x[:8]] * 2), np.tile(y[:8], 2), "quadratic"), "cannot separate .*singular"),
        (lambda x, y: (x, np.where(np.arange(20) == 4, np.nan, y), "linear"), "value of run 5 is nan"),
        (lambda x, y: (np.where(x == 0, np.inf, x), y, "linear"), "coded factor is not a finite"),
        (lambda x, y: (x, y[:3], "linear"), "do not match"),
        (lambda x, y: (x, y, "cubic"), "choose linear, interaction, pure_quadratic, quadratic or reduced"),
        (lambda x, y: (x, np.full(20, 0.1), "linear"), "all 20 values are 0.1, so there is nothing to fit"),
    ],
)
def test_bad_data_are_refused_with_the_mend(change, words):
    points = central_composite(3).coded
    coded, values, model = change(points, np.arange(20.0))
    with pytest.raises(ValueError, match=words):
        fit(coded, values, name="y", model=model, centre=CENTRE, step=STEP)
