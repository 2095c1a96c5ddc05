"""Bits do not depend on how many threads linear algebra has."""

import numpy as np
import pytest
from conftest import ROOT
from short_studies import paper_study
from threadpoolctl import threadpool_limits

from doe.emulator import fit_emulator
from doe.response_surface.statistics import fits_of
from doe.unknown.posterior import sampled
from doe.unknown.propagation import Runs, emulated, range_of, sobol
from doe.workflow.runs import read_runs
from doe.workflow.surfaces import fit_surfaces, with_rivals
from rbdyn.base.arrays import _controller, one_thread

THREADS = (1, 2)


def runs_of(seed, rows, inputs):
    """Outputs of a bent function with scatter, more rows than one search of an emulator takes."""
    draw = np.random.default_rng(seed)
    points = draw.random((rows, inputs))
    values = np.exp(points[:, 0]) + np.sin(6.0 * points[:, 1]) * points[:, 2] + 0.05 * draw.standard_normal(rows)
    return points, values


def with_threads(figures):
    """What a function gives under each number of threads."""
    shown = []
    for count in THREADS:
        with threadpool_limits(count, user_api="blas"):
            shown.append(figures())
    return shown


def test_invariant_emulators_have_the_same_bits_on_any_number_of_threads():
    """Invariant: fit, predictions, leave-one-out, covariances and draws of 600 runs."""
    points, values = runs_of(1, 600, 9)

    def figures():
        fitted = fit_emulator(points, values, np.full(600, 0.0025))
        draws = fitted.draw(16, np.random.default_rng(2))(points[:300])
        parts = (*fitted.predict(points), fitted.mean(points), fitted.covariance(points, points), draws)
        return [part.tobytes() for part in (*parts, *fitted.leave_one_out(), np.array(fitted.q2()))]

    one, *others = with_threads(figures)
    assert all(other == one for other in others)


def test_invariant_spread_and_samples_have_the_same_bits_on_any_number_of_threads(monkeypatch):
    """Invariant: spread over unknown inputs, shares of the variance, and a posterior sample."""
    monkeypatch.setattr("doe.unknown.propagation.REFITS", 3)
    points, values = runs_of(3, 256, 4)
    runs = Runs(points, values, np.full(256, 0.0025), np.full(256, 7))
    matrix = np.random.default_rng(4).random((4, 400))

    def density(at):
        return -(((at - 0.5) @ matrix) ** 2).sum(axis=1) / 40.0

    def figures():
        fitted = emulated(runs)
        return repr((range_of(fitted, points, 5), sobol(fitted, 4, 6), sampled(density, 4, 7, 400)))

    one, *others = with_threads(figures)
    assert all(other == one for other in others)


def test_unit_threads_are_given_back():
    """Unit: within there is one thread, afterwards as many as before, after an exception too."""

    def counts():
        # Those of numpy and scipy; other tests may have loaded libraries that bring one of their own.
        return [each["num_threads"] for each in _controller().info() if each["user_api"] == "blas"]

    @one_thread
    def inside(fails):
        assert set(counts()) == {1}
        if fails:
            raise KeyError

    with threadpool_limits(2, user_api="blas"):
        inside(False)
        with pytest.raises(KeyError):
            inside(True)
        assert set(counts()) == {2}


def test_invariant_a_fit_has_the_same_bits_on_any_number_of_threads():
    """Invariant: surfaces, their analysis of variance and their rivals."""
    study = paper_study()
    runs = read_runs(study, ROOT / "examples" / "ccd_table4.csv")
    one, *others = with_threads(lambda: repr(fits_of(with_rivals(fit_surfaces(study, runs))).as_dict()))
    assert all(other == one for other in others)
