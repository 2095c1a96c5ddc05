"""Drawn surfaces, and what they leave open of the share of parts that keep a promise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from short_studies import short_study

from doe.designs import central_composite
from doe.pareto.manufacture import interval_of_share, percent, random_offsets
from doe.pareto.tolerance import Parts
from doe.response_surface import fit, model_matrix
from doe.response_surface.adequacy import correlation
from doe.study_file.sections import Tolerances
from doe.workflow.problem import Problem
from doe.workflow.surfaces import (
    Simulated,
    coefficient_root,
    drawn_responses,
    field_root,
    half_widths,
    residual_correlation,
)
from doe.workflow.tolerances import PickParts

DESIGN = central_composite(3, centre_replicates=6).coded
TERMS = ("1", "A", "B", "C", "AB", "AC", "BC", "A^2", "B^2", "C^2")
TRUTH = np.array(
    [
        [90.0, 1.0, 3.0, 10.0, 1.0, -1.0, 0.5, 2.0, 0.5, 1.0],
        [0.41, -0.01, -0.02, 0.05, -0.006, -0.015, -0.02, 0.035, 0.0, 0.02],
        [240.0, -1.0, -10.0, -0.6, 0.0, -0.2, -0.5, 0.6, 2.6, 0.7],
    ]
)
SCALE = np.array([8.0, 0.04, 4.0])


def truth(coded):
    """Responses (n, 3) of a quadratic that is known."""
    return model_matrix(coded, TERMS) @ TRUTH.T


def surfaces_of(random, noise=0.1, together=0.6, bend=0.0, **options):
    """Surfaces through runs with errors that belong together; what bends beyond a quadratic stands in ``bend``."""
    mixed = np.linalg.cholesky((1.0 - together) * np.eye(3) + together)
    values = truth(DESIGN) + noise * SCALE * (random.standard_normal((len(DESIGN), 3)) @ mixed.T)
    values += bend * SCALE * np.prod(np.sin(2.0 * DESIGN + 0.5), axis=1)[:, None]
    return [
        fit(DESIGN, column, name=name, centre=np.zeros(3), step=np.ones(3), **options)
        for name, column in zip(("force", "ratio", "loss"), values.T, strict=True)
    ]


def drawn(surfaces, at, draws=4000, simulated=None):
    return np.concatenate(list(drawn_responses(surfaces, at, draws, 3, simulated)))


def test_invariant_roots_are_those_of_covariances():
    """Invariant: roots times their transposes are the covariances, with blocks and for a field over many points."""
    random = np.random.default_rng(1)
    for options in ({}, {"block": np.arange(len(DESIGN)) % 2}):
        surface = surfaces_of(random, **options)[0]
        root = coefficient_root(surface)
        assert root @ root.T == pytest.approx(surface.covariance, rel=1e-9, abs=1e-12)
    points = 0.3 * random.standard_normal((500, 3))
    root = field_root(points)
    assert root.shape[1] < 200 and np.abs(root @ root.T - correlation(points, points)).max() < 1e-6


@pytest.mark.parametrize("bend", [0.0, 1.0])
def test_invariant_draws_scatter_as_the_surfaces_state(bend):
    """Invariant: 95 % of the draws lie within the stated half widths of the surfaces, with and without a model error."""
    random = np.random.default_rng(2)
    surfaces = surfaces_of(random, 0.02, bend=bend)
    assert not bend or all(surface.model_error is not None for surface in surfaces)
    surfaces = surfaces if bend else [replace(surface, model_error=None) for surface in surfaces]
    at = random.uniform(-1.0, 1.0, (6, 3))
    values = drawn(surfaces, at)
    middle = np.column_stack([surface.predict(at) for surface in surfaces])
    inside = (np.abs(values - middle) <= half_widths(surfaces, at)).mean(axis=0)
    assert inside == pytest.approx(np.full((6, 3), 0.95), abs=0.025)
    together = np.corrcoef(values[:, 0].T)
    assert together == pytest.approx(residual_correlation(surfaces), abs=0.1)


@pytest.mark.parametrize("bend", [0.0, 1.0])
def test_limit_case_draws_pass_what_was_simulated(bend):
    """Limit case: exactly where that is exact, not at all where it is worthless; between, as two means are weighed."""
    surfaces = surfaces_of(np.random.default_rng(2), 0.02, bend=bend)
    at = np.array([[0.5, 0.2, -0.4], [0.52, 0.2, -0.4], [0.0, 0.0, 0.0]])
    free = drawn(surfaces, at)
    alike = free[:, 0].std(axis=0)
    found = free[:, 0].mean(axis=0)[None] + 0.3 * alike
    exact = drawn(surfaces, at, simulated=Simulated(at[:1], found, np.zeros((1, 3))))
    assert exact[:, 0] == pytest.approx(np.broadcast_to(found, (4000, 3)), rel=1e-6)
    assert (exact[:, 1].std(axis=0) < 0.1 * free[:, 1].std(axis=0)).all()
    vague = drawn(surfaces, at, simulated=Simulated(at[:1], found, np.full((1, 3), 1e6)))
    assert vague.std(axis=0) == pytest.approx(free.std(axis=0), rel=0.1)
    both = drawn(surfaces, at, simulated=Simulated(at[:1], found, alike[None]))
    assert (both[:, 0] - free[:, 0].mean(axis=0)).mean(axis=0) / alike == pytest.approx([0.15] * 3, abs=0.05)
    assert both[:, 0].std(axis=0) == pytest.approx(alike / np.sqrt(2.0), rel=0.15)


def test_limit_case_exact_surfaces_have_one_draw():
    """A response without scatter at a point that was simulated exactly: all draws are the truth."""
    values = 3.0 + 2.0 * DESIGN[:, 0]
    exact = fit(DESIGN, values, name="gap", model="linear", centre=np.zeros(3), step=np.ones(3))
    at = DESIGN[:2] / 2.0
    simulated = Simulated(at, 3.0 + 2.0 * at[:, :1], np.zeros((2, 1)))
    shown = drawn([exact], at, 8, simulated)[..., 0]
    assert exact.residual_mean_square == 0.0
    assert shown == pytest.approx(np.tile(3.0 + 2.0 * at[:, 0], (8, 1)))


def test_closed_form_of_intervals_of_shares():
    """Closed form: of one count the shortest interval of its beta distribution; of two it reaches over both; at the ends to these."""
    low, high = interval_of_share(np.array([300]), 400)
    law = stats.beta(300.5, 100.5)
    assert law.cdf(high) - law.cdf(low) == pytest.approx(0.95, abs=0.06)
    all_draws = np.full(500, 300)
    many = interval_of_share(all_draws, 400)
    assert many == pytest.approx((law.ppf(0.025), law.ppf(0.975)), abs=0.006)
    wide = interval_of_share(np.repeat([40, 360], 250), 400)
    assert wide.low < 0.1 < 0.9 < wide.high
    every, none = interval_of_share(np.full(100, 400), 400), interval_of_share(np.zeros(100), 400)
    assert every.high == 1.0 and every.low == pytest.approx(stats.beta(400.5, 0.5).ppf(0.05), abs=1e-3)
    assert none.low == 0.0 and none.high == pytest.approx(1.0 - every.low)
    assert [percent(each) for each in (0.9504, 0.9999, 1.0, 0.0001)] == ["95.0", "above 99.9", "100.0", "below 0.1"]
    assert every.words.endswith("to 100.0 %")
    assert wide.containing(0.5) == wide == wide.containing(None)
    assert none.containing(0.5) == (0.0, 0.5) and every.containing(0.5) == (0.5, 1.0)


def test_closed_form_of_the_interval_of_one_linear_limit():
    """Closed form: of a level with Student's error the share is that of parts below the limit less the error."""
    errors = 0.2 * np.random.default_rng(1).standard_t(5, 4000)

    def kept(parts):
        return np.array([(parts[:, 0] + error <= 1.0).sum() for error in errors])

    limit, reach = np.array([1.0]), np.array([10.0])
    parts = Parts(
        objectives=lambda parts: parts[:, :1], centre=np.zeros(1), limits=limit, lower=-reach, upper=reach, names=["x"],
        distribution="uniform", count_on_draws=kept,
    )  # fmt: skip
    found = parts.widest(limit)
    half = found.half_widths[0]
    share = (1.0 + (1.0 - errors) / half).clip(0.0, 2.0) / 2.0
    # The shortest interval of these shares, which pile up at 1.
    assert found.interval.high == 1.0 and found.interval.low == pytest.approx(np.quantile(share, 0.05), abs=0.02)
    assert f"({found.interval.words}) of the parts" in found.sentence


def stated_and_true(study, random, noise, samples):
    """Stated share, its old half-width, its interval, and the true share of the parts, of one repeat of the design."""
    coded = study.design.coded
    values = truth(coded) + noise * SCALE * random.standard_normal((len(coded), 3))
    units = {"centre": study.centre, "step": study.step}
    surfaces = [fit(coded, column, name=name, **units) for name, column in zip(study.responses, values.T, strict=True)]
    point = study.actual(np.array([-0.5, 0.9, -0.8]))
    found = PickParts(study.with_surfaces(surfaces), point, Tolerances(samples=samples, gains=study.responses)).widest()
    base, nominal = (np.array([each.predict(study.coded(at)) for each in surfaces]) for at in (study.baseline, point))
    keep = np.where(base > nominal, 0.5 * (base - nominal), base - nominal)
    parts = study.coded(point + found.half_widths * random_offsets(20_000, 3, "normal", 99))
    kept = truth(parts) <= truth(study.coded(study.baseline)[None]) - keep
    return found.widest.probability, 1.96 * found.widest.standard_error, found.widest.interval, kept.all(axis=1).mean()


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.1, 0.3])
def test_invariant_the_interval_holds_the_true_share_of_parts(tmp_path, noise):
    """Invariant: in more than 90 of 100 repeats of the design, where the count of the parts alone held it in fewer than 40.

    An interval that holds it in 80 of 100 passes 60 repeats in 3 % of the cases, a count that holds it in half of them in 5 %.
    """
    study, random = Problem.load(short_study(tmp_path)), np.random.default_rng(11)
    rows = [stated_and_true(study, random, noise, 2048) for _ in range(60)]
    held = np.mean([low <= true <= high for _, _, (low, high), true in rows])
    before = np.mean([abs(share - true) <= half for share, half, _, true in rows])
    # The draws include the model error of the surfaces, which these have not, so that all repeats may hold it.
    assert held >= 0.9 and before < 0.4


def test_invariant_little_noise_leaves_little_open(tmp_path):
    """Invariant: the interval shrinks to that of the count of the parts, and holds the true share."""
    study = Problem.load(short_study(tmp_path))
    share, half, (low, high), true = stated_and_true(study, np.random.default_rng(1), 1e-5, 4096)
    assert low <= true <= high and high - low < 2.5 * half and low < share < high
