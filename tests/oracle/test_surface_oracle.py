"""Every figure of a fit to Table 4, and to a design in blocks, against statsmodels."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import statsmodels.formula.api as smf
from scipy import stats
from statsmodels.stats.anova import anova_lm
from statsmodels.stats.outliers_influence import variance_inflation_factor
from surface_intervals import interval, new_run_interval

from doe.designs import central_composite, to_coded
from doe.response_surface import fit

TABLE = Path(__file__).parents[2] / "examples" / "ccd_table4.csv"
CENTRE, STEP = [0.02, 0.15, 0.3], [0.005, 0.05, 0.05]
RESPONSES = ["impact_force_N", "whirl_deviation_ratio", "power_loss_W"]
TERMS = "A + B + C + A:B + A:C + B:C + I(A**2) + I(B**2) + I(C**2)"
FORMULAS = {"linear": "A + B + C", "interaction": TERMS[: TERMS.index(" + I")], "quadratic": TERMS}
NEW = np.array([[0.3, -0.2, 1.1], [0.0, 0.0, 0.0], [-1.0, 1.0, 0.5]])


def table_4():
    """Coded points and responses."""
    table = pd.read_csv(TABLE)
    return to_coded(table.iloc[:, 1:4].to_numpy(), CENTRE, STEP), table[RESPONSES].to_numpy()


def errors_of(values):
    """Standard errors that differ from run to run."""
    return 0.01 * values.mean() * np.random.default_rng(3).uniform(0.5, 2.0, len(values))


def close(expected, size=1.0):
    """To 1e-9, or to the rounding of numbers of this size."""
    return pytest.approx(np.asarray(expected), rel=1e-9, abs=1e-12 * size)


@pytest.fixture(scope="module", params=[(c, m) for c in range(3) for m in FORMULAS])
def pair(request):
    """Our fit and the oracle's, of one response by one model."""
    column, model = request.param
    points, values = table_4()
    response = values[:, column]
    errors = errors_of(response)
    frame = pd.DataFrame(points, columns=list("ABC")).assign(y=response)
    oracle = smf.ols(f"y ~ {FORMULAS[model]}", frame).fit()
    ours = fit(points, response, name=RESPONSES[column], model=model, centre=CENTRE, step=STEP, standard_errors=errors)
    return ours, oracle


def rows(surface):
    return {row.source: row for row in surface.anova}


def test_coefficients_with_their_tests_and_intervals(pair):
    ours, oracle = pair
    table, size = pd.DataFrame(ours.coefficient_table), np.abs(oracle.params).max()
    assert table["coefficient"].to_numpy() == close(oracle.params, size)
    assert table["standard_error"].to_numpy() == close(oracle.bse)
    assert table["t"].to_numpy() == close(oracle.tvalues, 100)
    assert table["p"].to_numpy() == close(oracle.pvalues)
    assert table[["low", "high"]].to_numpy() == close(oracle.conf_int(), size)
    assert ours.covariance == close(oracle.cov_params(), float(np.diag(oracle.cov_params()).max()))


def test_analysis_of_variance(pair):
    ours, oracle = pair
    found, partial = rows(ours), anova_lm(oracle, typ=3)
    total = oracle.centered_tss
    for term, source in zip(ours.terms[1:], oracle.params.index[1:], strict=True):
        theirs = partial.loc[source]
        assert found[term].ss == close(theirs["sum_sq"], total)
        assert found[term].f == close(theirs["F"], 100)
        assert found[term].p == close(theirs["PR(>F)"], 1e3)
    assert found["residual"].ss == close(oracle.ssr)
    assert found["residual"].df == oracle.df_resid
    assert found["total"].ss == close(total)
    assert (found["model"].f, found["model"].p) == (close(oracle.fvalue), close(oracle.f_pvalue))


def test_summary_figures(pair):
    ours, oracle = pair
    press = float(((oracle.resid / (1 - ours_leverage(ours))) ** 2).sum())
    assert ours.r2 == close(oracle.rsquared)
    assert ours.adjusted_r2 == close(oracle.rsquared_adj)
    assert ours.press == close(press)
    assert ours.predicted_r2 == close(1 - press / oracle.centered_tss)
    assert ours.residual_mean_square == close(oracle.mse_resid)


def ours_leverage(surface):
    return np.array([run.leverage for run in surface.diagnostics.runs])


def test_influence(pair):
    ours, oracle = pair
    influence = oracle.get_influence()
    found = pd.DataFrame(ours.diagnostics.runs)
    assert found["leverage"].to_numpy() == close(influence.hat_matrix_diag)
    assert found["standardized"].to_numpy() == close(influence.resid_studentized_internal, 10)
    assert found["studentized"].to_numpy() == close(influence.resid_studentized_external, 10)
    assert found["cook"].to_numpy() == close(influence.cooks_distance[0])
    assert found["residual"].to_numpy() == close(oracle.resid, float(np.abs(oracle.fittedvalues).max()))
    assert found["predicted"].to_numpy() == close(oracle.fittedvalues)
    worst = int(np.abs(influence.resid_studentized_external).argmax())
    assert ours.diagnostics.outlier.run == worst + 1
    bonferroni = float(oracle.outlier_test(method="bonferroni").iloc[worst, 2])
    assert ours.diagnostics.outlier.p == close(bonferroni)
    assert ours.diagnostics.normality.p == close(stats.shapiro(influence.resid_studentized_internal).pvalue)


def test_intervals_of_predictions(pair):
    # The oracle knows no lack of fit, which the table has.
    ours, oracle = replace(pair[0], model_error=None), pair[1]
    theirs = oracle.get_prediction(pd.DataFrame(NEW, columns=list("ABC"))).summary_frame(alpha=0.1)
    assert ours.predict(NEW) == close(theirs["mean"])
    assert ours.prediction_standard_error(NEW) == close(theirs["mean_se"])
    for ends, names in (
        (interval(ours, NEW, 0.9), ("mean_ci_lower", "mean_ci_upper")),
        (new_run_interval(ours, NEW, 0.9), ("obs_ci_lower", "obs_ci_upper")),
    ):
        assert np.array(ends) == close(theirs[list(names)].to_numpy().T)


def test_variance_inflation(pair):
    ours, oracle = pair
    exog = oracle.model.exog
    for column in range(1, exog.shape[1]):
        assert ours.inflation[ours.terms[column]] == close(variance_inflation_factor(exog, column))


def test_covariance_from_known_variances(pair):
    ours, oracle = pair
    known = ours.known_variance
    variances = errors_of(oracle.model.endog) ** 2
    left = oracle.normalized_cov_params.to_numpy() @ oracle.model.exog.T
    assert known.covariance == close((left * variances) @ left.T, known.covariance.max())
    assert known.chi_square == close(oracle.ssr / variances.mean())


def test_blocks_are_a_source_of_their_own():
    points, values = table_4()
    block = np.arange(20) % 3
    ours = fit(points, values[:, 1], name="y", centre=CENTRE, step=STEP, block=block)
    frame = pd.DataFrame(points, columns=list("abc")).assign(y=values[:, 1], block=block)
    oracle = smf.ols(f"y ~ {TERMS.lower().replace('i(', 'I(')} + C(block, Sum)", frame).fit()
    found, partial = rows(ours), anova_lm(oracle, typ=3)
    assert found["block"].ss == close(partial.loc["C(block, Sum)", "sum_sq"])
    assert found["block"].p == close(partial.loc["C(block, Sum)", "PR(>F)"])
    assert found["block"].df == 2
    assert found["B"].f == close(partial.loc["b", "F"])
    assert found["residual"].ss == close(oracle.ssr)
    effects = oracle.params[["C(block, Sum)[S.0]", "C(block, Sum)[S.1]"]].to_numpy()
    # The oracle's effects sum to zero over the blocks, ours over the runs.
    by_block = np.array([*effects, -effects.sum()])
    shift = by_block[block].mean()
    assert list(ours.blocks.values()) == close(by_block - shift)
    assert ours.coefficients[0] == close(oracle.params["Intercept"] + shift)
    names = [name for name in oracle.params.index if "block" not in name and name != "Intercept"]
    assert ours.coefficients[1:] == close(oracle.params[names], np.abs(oracle.params).max())
    assert ours.covariance[1:, 1:] == close(oracle.cov_params().loc[names, names], 1e-3)
    alone = smf.ols("y ~ C(block, Sum)", frame).fit()
    assert ours.r2 == close(1 - oracle.ssr / alone.ssr)
    model = anova_lm(alone, oracle)
    assert found["model"].f == close(model.loc[1, "F"])
    assert found["model"].p == close(model.loc[1, "Pr(>F)"])


def test_pure_error_counts_within_blocks():
    points, values = table_4()
    block = np.arange(20) % 2
    ours = fit(points, values[:, 1], name="y", centre=CENTRE, step=STEP, block=block)
    frame = pd.DataFrame(points).round(9).assign(y=values[:, 1], block=block)
    saturated = smf.ols("y ~ C(cell)", frame.assign(cell=frame.groupby([0, 1, 2, "block"]).ngroup())).fit()
    assert ours.pure_error.ss == close(saturated.ssr)
    assert ours.pure_error.df == saturated.df_resid == 4


def test_orthogonal_blocks_leave_the_surface_as_it_is():
    design = central_composite(3, alpha="orthogonal_blocks", centre_replicates=6, blocks=True)
    values = 10 + design.coded @ [1.0, 2.0, 3.0] + np.random.default_rng(5).normal(size=len(design.coded))
    with_blocks, without = (
        fit(design.coded, values, name="y", centre=CENTRE, step=STEP, block=block) for block in (design.block, None)
    )
    assert with_blocks.coefficients == close(without.coefficients)
    assert with_blocks.blocks and not without.blocks
