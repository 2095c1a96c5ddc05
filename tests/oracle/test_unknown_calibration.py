"""Inputs found from measurements: closed forms, another sampler, and rigs whose truth is known."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import emcee
import numpy as np
import pytest
from scipy import integrate, special, stats

from doe.unknown.calibration import (
    MOST,
    Batch,
    Judgement,
    Matched,
    Particles,
    Unknowns,
    bayes_factor,
    by_others,
    held_out,
    judge,
    matched,
    objections,
    reweighed,
)
from doe.unknown.posterior import (
    BEYOND,
    BY_ROW,
    INSIDE,
    SHARE,
    STRONG,
    WIDER,
    Errors,
    Joint,
    Measured,
    contraction,
    contraction_words,
    densest_intervals,
    fit_cells,
    joint,
    learnt,
    sampled,
    unseen_offsets,
)
from doe.unknown.width import Scores, power_of, scores_of, width
from rbdyn.base.arrays import Array

ROWS, OUTPUTS, INPUTS = 8, 2, 3
ACROSS = np.linspace(-1.0, 1.0, ROWS)
NOISE = np.repeat([0.01, 0.02], ROWS)
RIG = np.repeat([0.02, 0.03], ROWS)


def _truth(quantiles: Array) -> Array:
    """A simulation in closed form: logarithms (n, 16) of two outputs in eight rows; the third input counts for nothing."""
    first, second = (2.0 * quantiles.T - 1.0)[:2, :, None]
    one = 0.5 * first + 0.4 * second * ACROSS + 0.15 * first * ACROSS**2
    two = 0.3 * second + 0.5 * np.sin(first) * ACROSS - 0.2 * second * ACROSS**2
    return np.hstack([one, two])


def _simulate(truth: Callable[[Array], Array], seed: int) -> Callable[[Array, int], Batch]:
    random = np.random.default_rng(seed)

    def simulate(quantiles: Array, stage: int) -> Batch:
        values = truth(quantiles)
        told = NOISE**2 * random.chisquare(4, values.shape) / 4.0
        noisy = values + NOISE * random.standard_normal(values.shape)
        return Batch(quantiles, noisy, told, np.full(values.shape, 4))

    return simulate


def _measured(values: Array, scale: float, held: tuple[int, ...] = (), accuracy: float = 0.0) -> Measured:
    row = np.tile(np.arange(ROWS), OUTPUTS)
    output = np.repeat(np.arange(OUTPUTS), ROWS)
    return Measured(
        values, RIG**2, output, row, np.full(OUTPUTS, scale), np.isin(row, held), np.full(OUTPUTS, accuracy)
    )


def _found(
    values: Array,
    scale: float,
    seed: int,
    truth: Callable[[Array], Array] = _truth,
    held: tuple[int, ...] = (),
    accuracy: float = 0.0,
) -> Matched:
    measured = _measured(values, scale, held, accuracy)
    return matched(_simulate(truth, seed), measured, Unknowns(INPUTS), seed, particles=1000)


def _covered(found: Matched, truth: Array) -> Array:
    assert found.sampled is not None
    low, high = densest_intervals(found.quantiles(found.sampled.points))
    covered: Array = (truth >= low) & (truth <= high)
    return covered


def test_evidence_and_posterior_of_a_linear_gaussian_are_those_of_the_closed_form() -> None:
    slopes = np.array([[1.0, 0.5, 0.0], [0.2, -1.0, 2.0], [0.0, 1.0, 1.0], [3.0, 0.0, 0.3]])
    sd, y = 0.5, np.array([0.7, -1.2, 0.4, 2.0])
    found = sampled(lambda x: stats.norm.logpdf(y, x @ slopes.T, sd).sum(axis=1), 3, 1, particles=40_000)
    exact = stats.multivariate_normal.logpdf(y, np.zeros(4), slopes @ slopes.T + sd**2 * np.eye(4))
    assert np.exp(found.log_evidence - exact) == pytest.approx(1.0, abs=0.02)
    covariance = np.linalg.inv(np.eye(3) + slopes.T @ slopes / sd**2)
    mean = covariance @ slopes.T @ y / sd**2
    assert np.abs((found.points.mean(axis=0) - mean) / np.sqrt(np.diag(covariance))).max() < 0.05
    assert np.cov(found.points.T) == pytest.approx(covariance, abs=0.02)


@pytest.mark.slow
def test_a_curved_ridge_has_the_means_that_emcee_finds() -> None:
    def likelihood(x: Array) -> Array:
        return -0.5 * ((x[:, 0] * np.abs(x[:, 1]) - 1.0) / 0.1) ** 2 - 0.5 * (x[:, 2] - x[:, 0] ** 2) ** 2

    random = np.random.default_rng(1)
    other = emcee.EnsembleSampler(64, 3, lambda x: likelihood(x) - 0.5 * (x**2).sum(axis=1), vectorize=True)
    # Walkers start on both sides, between which they hardly pass; the density is the same there.
    start = 1.0 + 0.05 * random.standard_normal((64, 3))
    start[::2, 1] *= -1.0
    np.random.seed(1)
    other.run_mcmc(start, 6000)
    chain = other.get_chain(discard=1000, flat=True)
    chain = np.abs(chain)
    points = np.abs(sampled(likelihood, 3, 2, particles=8000).points)
    assert np.abs((points.mean(axis=0) - chain.mean(axis=0)) / chain.std(axis=0)).max() < 0.1


def test_cells_are_jointly_normal_as_by_the_whole_covariance() -> None:
    random = np.random.default_rng(2)
    mean, own, roots = (
        random.standard_normal((2, 6)),
        random.uniform(0.1, 1.0, (2, 6)),
        random.standard_normal((2, 6, 3)),
    )
    values, known, asked = random.standard_normal(6), np.array([0, 1, 3, 5]), np.array([2, 4])
    cells = Joint(mean, own, roots)
    for place in range(2):
        whole = np.diag(own[place]) + roots[place] @ roots[place].T
        some = np.ix_(known, known)
        exact = stats.multivariate_normal.logpdf(values[known], mean[place, known], whole[some])
        assert cells.log_density(values, known)[place] == pytest.approx(exact, rel=1e-12)
        weights = whole[np.ix_(asked, known)] @ np.linalg.inv(whole[some])
        middle, apart, common = cells.conditional(values, known, asked)
        assert middle[place] == pytest.approx(mean[place, asked] + weights @ (values - mean[place])[known], rel=1e-10)
        left = whole[np.ix_(asked, asked)] - weights @ whole[np.ix_(known, asked)]
        assert np.diag(apart[place]) + common[place] @ common[place].T == pytest.approx(left, rel=1e-10)
        # Without any cell that is known, the whole covariance.
        _, apart, common = cells.conditional(values, known[:0], asked)
        whole_asked = whole[np.ix_(asked, asked)]
        assert np.diag(apart[place]) + common[place] @ common[place].T == pytest.approx(whole_asked, rel=1e-12)


def test_the_offset_of_a_sensor_is_integrated_out_as_by_quadrature() -> None:
    """The covariance with a rank-one term an output gives the mean of the likelihood over both offsets, by Gauss-Hermite."""
    values, accuracy = _truth(np.array([[0.6, 0.4, 0.5]]))[0] + np.repeat([0.12, -0.2], ROWS), 0.1
    random = np.random.default_rng(4)
    cells = fit_cells(*_simulate(_truth, 4)(random.random((96, INPUTS)), 0), allowance=RIG**2)
    quantiles, level = random.random((5, INPUTS)), np.full((5, OUTPUTS), 0.03)
    errors = Errors(level, level, np.zeros(level.shape, bool))
    places = np.arange(values.size)
    closed = joint(cells, _measured(values, 0.03, accuracy=accuracy), quantiles, errors).log_density(values, places)
    bare = joint(cells, _measured(values, 0.03), quantiles, errors)
    nodes, weights = np.polynomial.hermite_e.hermegauss(120)
    logs = [
        bare.log_density(values - accuracy * np.repeat([one, two], ROWS), places)
        + np.log(share * other / (2.0 * np.pi))
        for one, share in zip(nodes, weights, strict=True)
        for two, other in zip(nodes, weights, strict=True)
        if share * other > 1e-30
    ]
    assert closed == pytest.approx(special.logsumexp(logs, axis=0), abs=1e-6)


def test_an_unseen_offset_is_that_of_the_dense_algebra() -> None:
    """The estimate's variance and the move of the inputs, by the inverse of the whole covariance."""
    random = np.random.default_rng(5)
    cells = fit_cells(*_simulate(_truth, 5)(random.random((96, INPUTS)), 0), allowance=RIG**2)
    measured = replace(_measured(np.zeros(16), 0.02, accuracy=0.05), spread=np.full(OUTPUTS, 0.3))
    centre = np.array([0.3, -0.2, 0.0])
    first = unseen_offsets(cells, measured, special.ndtr, centre)[0]
    assert first is not None
    steps = np.vstack([centre + 0.5 * np.eye(INPUTS), centre - 0.5 * np.eye(INPUTS)])
    means, doubt = cells.mean(special.ndtr(steps)), cells.predict(special.ndtr(centre[None]))[1][0]
    slopes, ones = (means[:INPUTS] - means[INPUTS:]).T, np.repeat([1.0, 0.0], ROWS)
    other = np.outer(1.0 - ones, 1.0 - ones) * (0.02**2 + 0.05**2)
    whole = np.diag(RIG**2 + cells.left_out + (BY_ROW * 0.02) ** 2) + doubt @ doubt.T + slopes @ slopes.T + other
    variance = 1.0 / (ones @ np.linalg.solve(whole, ones))
    moved = slopes.T @ np.linalg.solve(whole + np.outer(ones, ones) * (0.02**2 + 0.05**2), ones) * first.offset
    assert first.moves == pytest.approx(moved, rel=1e-8)

    def density(scale: float) -> float:
        def at(tau: float) -> float:
            sd = np.sqrt(variance + 0.05**2 + tau**2)
            return float(stats.norm.pdf(first.offset, 0.0, sd) * stats.halfnorm(scale=scale).pdf(tau))

        return float(integrate.quad(at, 0.0, 8.0 * scale)[0])

    assert 0.5 * density(0.3) / density(0.02) == pytest.approx(STRONG, rel=5e-3)


def test_an_offset_below_the_unseen_one_moves_inputs_and_one_above_is_found() -> None:
    """The linear estimate against the whole calibration of rigs whose first sensor is off."""
    values = _truth(np.array([[0.6, 0.4, 0.5]]))[0]
    sound = _found(values, np.nan, 6, accuracy=0.03)
    unseen = _against(sound)[1].outputs[0].unseen
    assert unseen is not None and sound.sampled is not None
    for factor, hidden in ((0.4, True), (2.0, False)):
        off = _found(values + np.repeat([factor * unseen.offset, 0.0], ROWS), np.nan, 6, accuracy=0.03)
        assert off.sampled is not None
        assert _against(off)[1].outputs[0].explained is hidden
        if hidden:
            moved = (off.sampled.points.mean(axis=0) - sound.sampled.points.mean(axis=0))[0]
            assert moved == pytest.approx(factor * unseen.moves[0], rel=0.5) and moved > 0.0


@pytest.mark.slow
def test_intervals_of_rigs_with_sensors_of_stated_accuracy_cover_as_often_as_they_say() -> None:
    """Sensors that are 10 % off, as a standard deviation, in both outputs: intervals hold the inputs if this is stated."""
    random = np.random.default_rng(11)
    covered: dict[float, list[Any]] = {0.1: [], 0.0: []}
    for seed in range(30):
        truth = random.random(INPUTS)
        offsets = np.repeat(0.1 * random.standard_normal(OUTPUTS), ROWS)
        values = _truth(truth[None])[0] + offsets + RIG * random.standard_normal(RIG.size)
        for accuracy, insides in covered.items():
            insides.append(_covered(_found(values, 0.02, seed, accuracy=accuracy), truth)[:2])
    assert 0.83 <= np.mean(covered[0.1]) <= 0.97
    # The same rigs twice: of the inputs that only one of both holds, chance alone would leave half to either (McNemar).
    inside, without = (np.concatenate(insides) for insides in covered.values())
    gained, lost = int((inside & ~without).sum()), int((~inside & without).sum())
    assert stats.binomtest(gained, gained + lost, alternative="greater").pvalue < 0.05, (gained, lost)


def test_components_foretell_all_cells_within_their_doubt() -> None:
    random = np.random.default_rng(3)
    batch = _simulate(_truth, 3)(random.random((96, INPUTS)), 0)
    cells = fit_cells(*batch, allowance=RIG**2)
    assert len(cells.emulators) <= 4 < ROWS * OUTPUTS
    fresh = random.random((300, INPUTS))
    mean, doubt = cells.predict(fresh)
    assert mean == pytest.approx(cells.mean(fresh), abs=1e-10)
    off = mean - _truth(fresh)
    assert np.sqrt((off**2).mean()) < 0.01
    assert (off**2 / ((doubt**2).sum(axis=2) + cells.left_out)).mean() < 2.0


def test_errors_of_the_simulation_are_half_normal_of_three_kinds() -> None:
    count = 100_000
    scores = special.ndtri((np.arange(count) + 0.5) / count)[:, None] * [1.0, 1.0]
    spread = np.random.default_rng(1).standard_normal((500, 16))
    measured = _measured(np.zeros(16), 0.1).with_scales(spread)
    errors = measured.errors(scores)
    assert errors.beyond.mean(axis=0) == pytest.approx(2.0 * BEYOND, abs=2.0 / count)
    allowed, wide = errors.level[~errors.beyond[:, 0], 0], errors.level[errors.beyond[:, 0], 0]
    assert measured.wide == pytest.approx([1.0, 1.0], rel=0.05)
    for sizes, scale in ((allowed, 0.1), (wide, measured.wide[0])):
        assert stats.kstest(sizes, stats.halfnorm(scale=scale).cdf).statistic < 1e-3
    # Half of what goes beyond is an error of the level alone, whose rows err by what is allowed at most.
    rows = errors.rows[errors.beyond[:, 0], 0]
    assert np.mean(rows == wide) == pytest.approx(0.5 + 0.5 * np.mean(wide[: wide.size // 2] <= 0.1), abs=1e-3)
    assert rows[: rows.size // 2].max() == 0.1
    # An exact simulation has no errors, whatever outputs vary by.
    none = _measured(np.zeros(16), 0.0).with_scales(spread).errors(scores)
    assert not none.level.any() and not none.beyond.any()


def test_by_default_a_share_of_what_inputs_do_within_rows_is_allowed() -> None:
    random = np.random.default_rng(2)
    # The first output varies by 0.3 % over the inputs and by much over the rows, the second by 20 % over the inputs.
    simulated = np.repeat([0.003, 0.2], ROWS) * random.standard_normal((20_000, 16)) + np.arange(16.0)
    measured = _measured(np.zeros(16), np.nan).with_scales(simulated)
    assert measured.scales == pytest.approx([SHARE * 0.003, SHARE * 0.2], rel=0.02)
    assert measured.wide == pytest.approx([0.003, 0.2], rel=0.02)
    stated = _measured(np.zeros(16), 0.1).with_scales(simulated)
    assert stated.scales.tolist() == [0.1, 0.1] and stated.wide == pytest.approx([WIDER * 0.1] * 2)


def test_densest_intervals_hold_an_end_and_agree_with_quantiles_in_the_middle() -> None:
    random = np.random.default_rng(3)
    # Of 1 - (1 - q)^4 the densest 90 % begin at 0; of a symmetric one they are its quantiles.
    low, high = densest_intervals(np.column_stack([random.beta(1.0, 4.0, 40_000), random.beta(8.0, 8.0, 40_000)]))
    assert low[0] == 0.0 and high[0] == pytest.approx(1.0 - 0.1**0.25, abs=0.01)
    assert [low[1], high[1]] == pytest.approx(stats.beta(8.0, 8.0).ppf([0.05, 0.95]), abs=0.02)
    assert densest_intervals(1.0 - random.beta(1.0, 4.0, (4000, 1)))[1] == [1.0]


def test_the_densest_interval_of_a_flat_posterior_is_the_whole_range_and_of_an_informative_one_no_wider() -> None:
    random = np.random.default_rng(4)
    low, high = densest_intervals(random.random((4000, 200)))
    assert np.mean((low == 0.0) & (high == 1.0)) >= 0.95
    # Where the density falls to half its mean at one end, that end is left out; of a dome both are, and 90 % stay inside.
    # The share of a sample of 4000 has a standard error of 0.5 %, so four of them bound each of 200.
    sloped = densest_intervals(1.5 - np.sqrt(2.25 - 2.0 * random.random((4000, 200))))
    assert not sloped[0].any() and (sloped[1] < 1.0).all()
    assert (1.5 - 0.5 * sloped[1]) * sloped[1] == pytest.approx(INSIDE, abs=0.02)
    dome = stats.beta(3, 2).cdf(densest_intervals(random.beta(3, 2, (4000, 200))))
    assert dome[1] - dome[0] == pytest.approx(INSIDE, abs=0.02)


def _widths(factor: float, rows: int, repeats: int, seed: int) -> Array:
    """Chances (repeats,) of tables of three correlated cells a row, predicted by ``factor`` times their standard deviation."""
    random, root = np.random.default_rng(seed), np.linalg.cholesky(0.6 + 0.4 * np.eye(3))
    chances = []
    for _ in range(repeats):
        truths = random.standard_normal((rows, 3)) @ root.T / factor
        draws = random.standard_normal((rows, 500, 3)) @ root.T
        parts = [scores_of(one, truth, np.arange(3)) for one, truth in zip(draws, truths, strict=True)]
        chances.append(width(parts).chance)
    return np.array(chances)


@pytest.mark.slow
@pytest.mark.parametrize("rows", [4, 16])
def test_width_of_right_predictions_is_rejected_in_one_of_twenty(rows: int) -> None:
    chances = _widths(1.0, rows, 400, rows)
    assert 0.02 <= (chances <= 0.05).mean() <= 0.08
    assert stats.kstest(chances, "uniform").pvalue > 0.01


def test_predictions_twice_too_wide_or_narrow_are_rejected() -> None:
    for factor in (0.5, 2.0):
        assert (_widths(factor, 16, 40, 5) <= 0.05).mean() >= 0.95


def test_width_names_the_output_and_knows_what_it_cannot_tell() -> None:
    random = np.random.default_rng(6)
    truths, draws = random.standard_normal((16, 3)) * [1.0, 0.3, 1.0], random.standard_normal((16, 800, 3))
    parts = [scores_of(one, truth, np.arange(3)) for one, truth in zip(draws, truths, strict=True)]
    found = width(parts)
    assert found.rejected and found.output == 1 and found.worst == pytest.approx(0.3, abs=0.1)
    assert width([Scores(np.zeros(6), random.standard_normal((20_000, 6)), np.zeros(6, int))]).chance < 0.001


def _power(rows: int, outputs: int, held: int = 0, seed: int = 1) -> tuple[int, float, float, bool]:
    row = np.repeat(np.arange(rows), outputs)
    power = power_of(np.tile(np.arange(outputs), rows), row, row < held, seed)
    return power.cells, power.wide, power.narrow, power.enough


def test_a_design_says_before_any_run_what_it_can_judge() -> None:
    """The power is that of chi-square limits, follows from the design alone, and decides as many tables of it do."""
    # Of 12 rows of one output six are predicted: squares of six standard normals, halved or doubled, against their limits.
    cells, wide, narrow, enough = _power(12, 1)
    low, high = stats.chi2(6).ppf([0.025, 0.975])
    assert cells == 6 and not enough
    assert [wide, narrow] == pytest.approx([stats.chi2(6).cdf(4.0 * low), stats.chi2(6).sf(high / 4.0)], abs=0.015)
    # Which rows are predicted changes nothing where all have the same outputs; rows that are held out are predicted too.
    assert len({_power(8, 3, seed=seed) for seed in range(6)}) == 1
    assert _power(8, 2)[0] == 8 and _power(8, 2, held=3)[0] == 2 * (2 + 3)
    assert [_power(rows, 3)[3] for rows in (4, 6, 8, 16)] == [False, False, True, True]
    for factor, power in ((0.5, wide), (2.0, narrow)):
        random, rejected = np.random.default_rng(3), 0
        for _ in range(300):
            scores = Scores(random.standard_normal(6) * factor, random.standard_normal((800, 6)), np.zeros(6, int))
            rejected += width([scores]).rejected
        assert rejected / 300 == pytest.approx(power, abs=0.1)


def test_a_factor_of_evidence_is_a_ratio_of_odds() -> None:
    assert bayes_factor(0.5, 0.1) == pytest.approx(9.0)
    assert bayes_factor(0.1, 0.1) == pytest.approx(1.0)
    assert bayes_factor(1.0, 0.1) == MOST and bayes_factor(0.0, 0.1) == 1.0 / MOST


def _of_prior(random: np.random.Generator, scale: float) -> tuple[Array, Array]:
    """A rig drawn from the prior: its inputs (d,) and what is measured on it (c,)."""
    truth, tau = random.random(INPUTS), scale * np.abs(random.standard_normal((OUTPUTS, 1)))
    off = tau * random.standard_normal((OUTPUTS, 1)) + BY_ROW * tau * random.standard_normal((OUTPUTS, ROWS))
    return truth, _truth(truth[None])[0] + off.ravel() + RIG * random.standard_normal(RIG.size)


@pytest.mark.slow
def test_intervals_of_forty_rigs_cover_as_often_as_they_say() -> None:
    random, covered, ranks = np.random.default_rng(5), [], []
    for seed in range(40):
        truth, values = _of_prior(random, 0.1)
        found = _found(values, 0.1, seed)
        covered.append(_covered(found, truth))
        assert found.sampled is not None
        ranks.append((found.quantiles(found.sampled.points) < truth).mean(axis=0))
    assert 0.85 <= np.mean(covered) <= 0.95
    for each in np.transpose(ranks):
        assert stats.kstest(each, "uniform").pvalue > 0.01


@pytest.mark.slow
def test_a_biased_simulation_needs_a_discrepancy() -> None:
    random = np.random.default_rng(5)
    covered: dict[float, list[Any]] = {0.1: [], 0.0: []}
    for seed in range(12):
        truth = random.random(INPUTS)
        bias = np.repeat(0.2 * random.choice([-1.0, 1.0], OUTPUTS), ROWS)
        values = _truth(truth[None])[0] + bias + RIG * random.standard_normal(RIG.size)
        for scale in covered:
            found = _found(values, scale, seed)
            # Where nothing is left the truth is not covered either.
            covered[scale].append([False, False] if found.sampled is None else _covered(found, truth)[:2])
    assert np.mean(covered[0.1]) >= 0.8
    assert np.mean(covered[0.0]) < 0.5


def _against(found: Matched, seed: int = 1) -> tuple[list[str], Judgement]:
    """Why a match may not be called calibrated."""
    assert found.sampled is not None
    judgement = judge(found, ["impact", "loss"], seed)
    return objections(judgement, has_learned=True, emulated=found.misfit < 2.0), judgement


def test_a_sound_rig_is_calibrated_and_held_out_rows_are_predicted() -> None:
    random = np.random.default_rng(6)
    truth = np.array([0.7, 0.3, 0.5])
    values = _truth(truth[None])[0] + RIG * random.standard_normal(RIG.size)
    found = _found(values, np.nan, 6, held=(1, 4, 6))
    assert found.sampled is not None and found.misfit < 2.0 and not found.refuted
    points = found.sampled.points
    taught = learnt("abc", found.quantiles(points), np.full((len(points), 3), np.nan), np.full((9, 3), np.nan))
    assert [contraction_words(each) for each in taught.learned.values()] == ["learned", "learned", "not seen"]
    particles = Particles.of(found.sampled, found.joint, found.measured)
    against, judgement = _against(found)
    assert not against and taught.has_learned
    result = judgement.trial
    assert (
        result.rows == "held out"
        and result.cells == 6
        and result.inside >= 4
        and result.crps < 0.3 * result.crps_before
    )
    assert result.width.cells == 4 + 6
    assert held_out(particles, 1).places.tolist() == np.flatnonzero(found.measured.validation).tolist()
    # Without rows to spare each is predicted by the others.
    others = by_others(particles, 1)
    assert others.places.size == 10 and np.abs(others.residuals).max() < 3.0
    # Particles weighed anew: by all cells the same posterior, by the second output less of the first input, by none the prior.
    learnt_cells = found.measured.learnt
    second = learnt_cells[found.measured.output[learnt_cells] == 1]
    shares = [
        contraction(found.quantiles(reweighed(particles, known, 1))) for known in (learnt_cells, second, second[:0])
    ]
    assert shares[0] == pytest.approx(list(taught.learned.values()), abs=0.1)
    assert shares[1][0] < shares[0][0] - 0.01
    assert shares[2] == pytest.approx(np.zeros(3), abs=0.25)


def test_missing_physics_is_not_taken_for_inputs() -> None:
    random = np.random.default_rng(7)
    values = _truth(np.array([[0.5, 0.5, 0.5]]))[0] + RIG * random.standard_normal(RIG.size)
    # What no input can do: every other row much higher in the first output.
    values[:ROWS] += 0.25 * np.array([1.0, -1.0] * (ROWS // 2))
    found = _found(values, 0.1, 7)
    assert found.sampled is not None
    points = found.sampled.points
    taught = learnt("abc", found.quantiles(points), np.full((len(points), 3), np.nan), np.full((9, 3), np.nan))
    assert not taught.narrow
    against, judgement = _against(found)
    assert [each.explained for each in judgement.outputs] == [False, True]
    assert any(each.startswith("impact is not explained") and "physics is missing" in each for each in against)


def test_a_biased_sensor_is_named_with_its_bias() -> None:
    """The second output reads 20 % too high, which no input does in all rows."""
    random = np.random.default_rng(8)
    values = _truth(np.array([[0.6, 0.4, 0.5]]))[0] + np.repeat([0.0, np.log(1.2)], ROWS)
    found = _found(values + RIG * random.standard_normal(RIG.size), np.nan, 8)
    against, judgement = _against(found)
    impact, loss = judgement.outputs
    assert impact.explained and not loss.explained and loss.evidence is not None and loss.evidence > 100.0
    assert loss.bias[1] < np.log(1.2) < loss.bias[2] and loss.unseen is not None and loss.unseen.offset < np.log(1.2)
    assert any(each.startswith("loss is not explained") and "sensor" in each for each in against)
    # Stated as allowed, it is none against.
    assert all(each.explained for each in _against(_found(values, 0.2, 8))[1].outputs)
    assert all(each.explained for each in _against(_found(values, np.nan, 8, accuracy=0.2))[1].outputs)


def test_predictions_too_wide_are_a_reason() -> None:
    """A table whose sensors are ten times as good as they state."""
    random = np.random.default_rng(9)
    values = _truth(np.array([[0.6, 0.4, 0.5]]))[0] + 0.1 * RIG * random.standard_normal(RIG.size)
    against, _ = _against(_found(values, np.nan, 9))
    assert any("too wide" in each for each in against)


def test_what_no_input_set_gives_is_refuted_by_the_cells_that_do_it() -> None:
    values = _truth(np.array([[0.5, 0.5, 0.5]]))[0]
    values[3] += 5.0
    values[5] += 5.0
    found = _found(values, 0.1, 8)
    assert found.refuted == [3, 5] and found.sampled is not None
    # An exact simulation would leave nothing at all.
    found = _found(values, 0.0, 8)
    assert found.refuted == [3, 5] and found.sampled is None


def test_only_a_product_is_seen() -> None:
    """y = theta1 theta2: their ridge is told, and neither alone."""

    def product(quantiles: Array) -> Array:
        log = 3.0 * (quantiles[:, 0] + quantiles[:, 1] - 1.0)
        return np.repeat(log[:, None], ROWS * OUTPUTS, axis=1)

    found = _found(np.zeros(ROWS * OUTPUTS), 0.05, 9, product)
    assert found.sampled is not None
    quantiles = found.quantiles(found.sampled.points)
    assert {contraction_words(each) for each in contraction(quantiles)} == {"not seen"}
    before = np.random.default_rng(1).random((2000, INPUTS))
    (ridge,) = learnt("abc", quantiles, 3.0 * quantiles, 3.0 * before).combinations
    assert set(ridge.powers) == {"a", "b"}
    assert ridge.powers["a"] == pytest.approx(ridge.powers["b"], rel=0.1)
    assert ridge.sd_percent < 0.3 * ridge.sd_percent_before
