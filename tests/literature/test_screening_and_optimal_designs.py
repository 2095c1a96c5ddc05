"""Definitive screening, D- and I-optimal designs against published properties, closed forms and free optimisation."""

from functools import cache
from itertools import combinations

import numpy as np
import pytest
from scipy.optimize import minimize

from doe.designs import definitive_screening, full_factorial, optimal
from doe.designs.design import conference_matrix
from doe.designs.model import evaluate, lost_terms, model_matrix, model_terms, moment_matrix
from doe.designs.optimal import Exchange
from doe.response_surface import fit

QUADRATIC = model_terms(2, "quadratic")


def information(points, terms):
    matrix = model_matrix(points, terms)
    return matrix.T @ matrix


def determinant(points, terms=QUADRATIC):
    """|X'X|^(1/p)."""
    return float(np.exp(np.linalg.slogdet(information(points, terms))[1] / len(terms)))


@cache
def moments(terms, factors):
    return moment_matrix(terms, factors, "box", 1.0)


def mean_variance(points, terms=QUADRATIC):
    """Mean variance of predictions over the box, of responses of variance 1."""
    return float(np.trace(np.linalg.inv(information(points, terms)) @ moments(tuple(terms), points.shape[1])))


@pytest.mark.parametrize("order", [2, 4, 6, 8])
def test_conference_matrices(order):
    matrix = conference_matrix(order)
    assert np.array_equal(matrix.T @ matrix, (order - 1) * np.eye(order))
    assert not np.diag(matrix).any()
    assert set(np.abs(matrix).ravel()) == {0.0, 1.0}


@pytest.mark.parametrize("factors", range(2, 9))
def test_literature_definitive_screening(factors):
    """Jones and Nachtsheim 2011: runs and levels; main effects free of each other and of all second-order effects."""
    design = definitive_screening(factors)
    assert len(design.coded) == 2 * (factors + factors % 2) + 1
    assert np.array_equal(np.unique(design.coded), [-1.0, 0.0, 1.0])
    assert (np.count_nonzero(design.coded == 0.0, axis=0) == 3).all()
    terms = model_terms(factors, "quadratic")
    second = model_matrix(design.coded, [term for term in terms if len(term) > 1])
    assert not (design.coded.T @ second).any()
    assert np.array_equal(design.coded.T @ design.coded, (len(design.coded) - 3) * np.eye(factors))
    assert lost_terms(design.coded, model_terms(factors, "pure_quadratic")) == []


def test_literature_definitive_screening_of_six_factors():
    """The same, 13 runs: a main effect has the standard error 1/sqrt(10); squares correlate by 1/3 - 1/(k - 1); every three
    factors have a full quadratic."""
    points = definitive_screening(6).coded
    squares = np.corrcoef((points**2).T)
    assert squares[~np.eye(6, dtype=bool)] == pytest.approx(1.0 / 3.0 - 1.0 / 5.0)
    covariance = np.linalg.inv(information(points, model_terms(6, "linear")))
    assert np.sqrt(np.diag(covariance)[1:]) == pytest.approx(10.0**-0.5)
    for three in combinations(range(6), 3):
        assert lost_terms(points[:, three], model_terms(3, "quadratic")) == []


def test_main_effects_are_told_in_spite_of_products():
    """The same: a product that the model lacks shifts squares and the mean, and no main effect."""
    points = definitive_screening(6, centre_replicates=2).coded
    slopes = np.array([2.0, -1.0, 0.5, 0.0, 3.0, -4.0])
    values = 7.0 + points @ slopes + 1.5 * points[:, 2] ** 2 + 5.0 * points[:, 0] * points[:, 1]
    fitted = fit(points, values, name="y", model="pure_quadratic", centre=np.zeros(6), step=np.ones(6))
    assert [fitted.by_term[letter] for letter in "ABCDEF"] == pytest.approx(slopes, abs=1e-12)


def test_closed_form_factorial_is_d_optimal():
    """Closed form: |X'X|^(1/p)/n = 1 is the most that coordinates within -1 and 1 allow, and 2^k points reach it."""
    terms = model_terms(3, "interaction")
    points = optimal(3, criterion="d", runs=8, terms=terms).coded
    assert determinant(points, terms) / 8 == pytest.approx(1.0)
    assert sorted(map(tuple, points)) == sorted(map(tuple, full_factorial(3, levels=2).coded))


def test_literature_nine_runs_in_two_factors():
    """Atkinson, Donev and Tobias: the 3^2 factorial, whose D-efficiency is 46.2 %."""
    design = optimal(2, criterion="d", runs=9)
    assert sorted(map(tuple, design.coded)) == sorted(map(tuple, full_factorial(2).coded))
    found = evaluate(design.coded, QUADRATIC, region=design.region, reach=design.extent)
    assert found.efficiency_percent["d"] == pytest.approx(46.2, abs=0.05)


def test_literature_six_runs_in_two_factors():
    """Box and Draper, Factorial designs, the |X'X| criterion, and some related matters, Technometrics 13 (1971): the best six."""
    d = (4.0 - 13.0**0.5) / 3.0
    best = np.array([[-1, -1], [1, -1], [-1, 1], [-d, -d], [1, 3 * d], [3 * d, 1]])
    assert determinant(best) ** 6 / 6**6 == pytest.approx(5.74e-3, abs=5e-6)
    found = optimal(2, criterion="d", runs=6).coded
    assert 0.999 < determinant(found) / determinant(best) <= 1.0 + 1e-9


@pytest.mark.parametrize("criterion", ["d", "i"])
def test_oracle_free_optimisation_finds_nothing_better(criterion):
    """Oracle: SciPy moves all coordinates at once, from 40 random designs of 7 runs and from the one found."""
    found = optimal(2, criterion=criterion, runs=7).coded

    def loss(flat):
        points = np.sin(flat).reshape(-1, 2)
        with np.errstate(divide="ignore"):
            return -np.log(determinant(points)) if criterion == "d" else np.log(mean_variance(points))

    random = np.random.default_rng(3)
    starts = [np.arcsin(found).ravel(), *random.uniform(-2.0, 2.0, (40, 14))]
    best = min(minimize(loss, start, method="BFGS").fun for start in starts)
    assert loss(np.arcsin(found).ravel()) < best + 2e-3


@pytest.mark.parametrize("runs", [11, 14, 20])
def test_each_criterion_wins_at_its_own(runs):
    d, i = (optimal(3, criterion=criterion, runs=runs) for criterion in ("d", "i"))
    found = [evaluate(each.coded, model_terms(3, "quadratic"), region="box", reach=1.0) for each in (d, i)]
    assert found[0].efficiency_percent["d"] > 1.05 * found[1].efficiency_percent["d"]
    assert found[0].scaled_prediction_variance.mean > 1.05 * found[1].scaled_prediction_variance.mean


@pytest.mark.parametrize("criterion", ["d", "i"])
def test_invariant_no_exchange_improves_the_design(criterion):
    """Invariant: from scratch, no coordinate moved by a part of the grid gains more than what counts as nothing."""
    terms = model_terms(3, "quadratic")
    points = optimal(3, criterion=criterion, runs=15, centre_replicates=1).coded

    def loss(points):
        return (
            -len(terms) * np.log(determinant(points, terms))
            if criterion == "d"
            else np.log(mean_variance(points, terms))
        )

    for run in range(1, 16):
        for factor in range(3):
            for step in (-0.05, 0.05):
                moved = points.copy()
                moved[run, factor] = np.clip(moved[run, factor] + step, -1.0, 1.0)
                assert loss(moved) > loss(points) - 3e-5


@pytest.mark.parametrize("criterion", ["d", "i"])
def test_closed_form_gain_of_an_exchange(criterion):
    """Closed form of Fedorov against both designs worked out from scratch."""
    random, terms = np.random.default_rng(4), model_terms(3, "quadratic")
    points, others = random.uniform(-1.0, 1.0, (16, 3)), random.uniform(-1.0, 1.0, (30, 3))
    moments = moment_matrix(terms, 3, "box", 1.0) if criterion == "i" else None
    exchange = Exchange(terms, np.zeros((10, 10)), moments, [None] * 3)
    old, new = (model_matrix(each, terms)[None] for each in (points[5], others))
    found = exchange.gain(np.linalg.inv(information(points, terms))[None], old, new)[0]
    for other, gain in zip(others, found, strict=True):
        after = points.copy()
        after[5] = other
        if criterion == "d":
            expected = (determinant(after, terms) / determinant(points, terms)) ** 10 - 1.0
        else:
            expected = 1.0 - mean_variance(after, terms) / mean_variance(points, terms)
        assert gain == pytest.approx(expected, rel=1e-8, abs=1e-10)


def test_runs_keep_to_values_that_a_factor_may_take():
    design = optimal(2, criterion="d", runs=8, levels=[np.array([-1.0, 0.0, 1.0]), None])
    assert lost_terms(design.coded, QUADRATIC, design.block) == []
    assert set(design.coded[:, 0]) == {-1.0, 0.0, 1.0}


def test_seeds_and_settings_fix_the_bits():
    one, again, other = (optimal(3, criterion="i", runs=12, seed=seed).coded for seed in (1, 1, 2))
    assert np.array_equal(one, again)
    assert mean_variance(other, model_terms(3, "quadratic")) == pytest.approx(
        mean_variance(one, model_terms(3, "quadratic")), rel=0.05
    )
    assert np.array_equal(np.rint(20.0 * one) / 20.0, one), "coordinates are parts of the half width"


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: definitive_screening(9), "kind = 'definitive_screening': is for 2 to 8 factors, not for 9; use kind"),
        (lambda: optimal(3, criterion="d", runs=9), "runs = 9: too few for a model of 10 terms; give at least 11"),
        (
            lambda: optimal(3, criterion="i", runs=4, centre_replicates=3),
            "runs = 4: with 3 at the centre too few for a model of 10 terms; give at least 8",
        ),
        (lambda: optimal(2, criterion="d", runs=501), "runs = 501: exchanges among more than 500 take long"),
    ],
)
def test_bad_designs_are_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()
