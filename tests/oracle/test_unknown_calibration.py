"""Inputs found from measurements: closed forms, another sampler, and rigs whose truth is known."""

from collections.abc import Callable
from typing import Any

import emcee
import numpy as np
import pytest
from scipy import special, stats

from doe.arrays import Array
from doe.unknown.calibration import Batch, Matched, Unknowns, matched
from doe.unknown.cells import fit_cells
from doe.unknown.discrepancy import BY_ROW, Joint, Measured
from doe.unknown.posterior import contraction, learnt, seen
from doe.unknown.sampler import sampled
from doe.unknown.verdict import by_others, held_out, objections, reweighed, trial

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


def _measured(values: Array, scale: float, held: tuple[int, ...] = ()) -> Measured:
    row = np.tile(np.arange(ROWS), OUTPUTS)
    output = np.repeat(np.arange(OUTPUTS), ROWS)
    return Measured(values, RIG**2, output, row, np.full(OUTPUTS, scale), np.isin(row, held))


def _found(
    values: Array, scale: float, seed: int, truth: Callable[[Array], Array] = _truth, held: tuple[int, ...] = ()
) -> Matched:
    return matched(_simulate(truth, seed), _measured(values, scale, held), Unknowns(INPUTS), seed, particles=1000)


def _covered(found: Matched, truth: Array) -> Array:
    assert found.sampled is not None
    low, high = np.quantile(found.quantiles(found.sampled.points), (0.05, 0.95), axis=0)
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
        middle, sd = cells.given(values, known, asked)
        assert middle[place] == pytest.approx(mean[place, asked] + weights @ (values - mean[place])[known], rel=1e-10)
        left = whole[np.ix_(asked, asked)] - weights @ whole[np.ix_(known, asked)]
        assert sd[place] == pytest.approx(np.sqrt(np.diag(left)), rel=1e-10)


def test_components_foretell_all_cells_within_their_doubt() -> None:
    random = np.random.default_rng(3)
    batch = _simulate(_truth, 3)(random.random((96, INPUTS)), 0)
    cells = fit_cells(*batch, compared=RIG**2)
    assert len(cells.emulators) <= 4 < ROWS * OUTPUTS
    fresh = random.random((300, INPUTS))
    mean, doubt = cells.predict(fresh)
    assert mean == pytest.approx(cells.mean(fresh), abs=1e-10)
    off = mean - _truth(fresh)
    assert np.sqrt((off**2).mean()) < 0.01
    assert (off**2 / ((doubt**2).sum(axis=2) + cells.rest)).mean() < 2.0


def test_half_normal_discrepancies() -> None:
    taus = _measured(np.zeros(16), 0.1).taus(special.ndtri(np.linspace(0.05, 0.95, 19))[:, None] * [1.0, 1.0])
    assert taus[:, 0] == pytest.approx(stats.halfnorm(scale=0.1).ppf(np.linspace(0.05, 0.95, 19)))


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


def test_a_sound_rig_is_calibrated_and_held_out_rows_are_foretold() -> None:
    random = np.random.default_rng(6)
    truth = np.array([0.7, 0.3, 0.5])
    values = _truth(truth[None])[0] + RIG * random.standard_normal(RIG.size)
    found = _found(values, 0.05, 6, held=(1, 4, 6))
    assert found.sampled is not None and found.misfit < 2.0 and not found.refuted
    points = found.sampled.points
    taught = learnt(found.quantiles(points), np.full((len(points), 3), np.nan), np.full((9, 3), np.nan))
    assert [seen(each) for each in taught.contraction] == ["learned", "learned", "not seen"]
    test = held_out(found.sampled, found.joint, found.measured, 1)
    result = trial(test, found.measured, held=True)
    assert result.cells == 6 and result.inside >= 4 and result.crps < 0.3 * result.crps_before
    taus = {str(place): (tau, 0.05) for place, tau in enumerate(np.median(found.taus(points), axis=0))}
    assert not objections(result, taus, anything=taught.anything, foretells=True)
    # Without rows to spare each is foretold by the others.
    others = trial(by_others(found.sampled, found.joint, found.measured, 1), found.measured, held=False)
    assert others.cells == 10 and not others.rejected
    # Particles weighed anew: by all cells the same posterior, by the second output less of the first input, by none the prior.
    learnt_cells = found.measured.learnt
    second = learnt_cells[found.measured.output[learnt_cells] == 1]
    shares = [
        contraction(found.quantiles(reweighed(found.sampled, found.joint, found.measured, known, 1)))
        for known in (learnt_cells, second, second[:0])
    ]
    assert shares[0] == pytest.approx(taught.contraction, abs=0.1)
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
    taus = np.median(found.taus(points), axis=0)
    assert taus[0] > 0.2 > taus[1]
    taught = learnt(found.quantiles(points), np.full((len(points), 3), np.nan), np.full((9, 3), np.nan))
    assert not taught.narrow
    result = trial(by_others(found.sampled, found.joint, found.measured, 1), found.measured, held=False)
    told = objections(result, {"impact_force_N": (taus[0], 0.1)}, anything=taught.anything, foretells=True)
    assert any("physics is missing" in each for each in told)


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
    assert {seen(each) for each in contraction(quantiles)} == {"not seen"}
    before = np.random.default_rng(1).random((2000, INPUTS))
    (ridge,) = learnt(quantiles, 3.0 * quantiles, 3.0 * before).combinations
    assert set(ridge.powers) == {0, 1}
    assert ridge.powers[0] == pytest.approx(ridge.powers[1], rel=0.1)
    assert ridge.after < 0.3 * ridge.before
