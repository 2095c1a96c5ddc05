"""Adaptive searches on fronts that are known, compared with even runs and the direct search; sources in ``known_fronts``."""

import numpy as np
import pytest
from known_fronts import (
    THREE,
    bearing,
    bearing_direct,
    bearing_front,
    bearing_runs,
    bearing_share,
    dtlz2,
    search,
    share,
    share_of_best,
    zdt1,
)

from doe.adaptive import AdaptiveSearch, Plan
from doe.adaptive.emulators import Region, Runs
from doe.designs import central_composite


@pytest.mark.slow
@pytest.mark.parametrize("problem", [zdt1, dtlz2])
def test_literature_80_runs_find_the_front_under_noise(problem):
    """ZDT1 and DTLZ2, 2 % noise: the finalists of 80 runs, 24 of them fresh, against as many points of the true front.

    A search that misses the share in four of five cases passes with three seeds in 10 % of the cases, with five in 6 %.
    """
    ours = [share(problem, search(problem, seed).front.points) for seed in (1, 2, 3)]
    # As many runs of a Sobol sequence, the same emulators.
    even = [share(problem, search(problem, seed, first=55, batch=1).front.points) for seed in (1, 2, 3)]
    assert np.median(ours) >= 0.97
    assert np.median(ours) > np.median(even)


@pytest.mark.slow
def test_a_tabulated_bearing_100_runs():
    """Whirl turns several times there, and its least lies in a narrow valley on a face of the region. Measured, of the best front of
    as many points: seeds 1 to 5 0.959 (0.897 to 0.983); any rounding gives other searches. The least is where no run met the
    valley."""
    found = [bearing_search(seed) for seed in (1, 2, 3)]
    shares = [bearing_share(points) for points in found]
    assert np.mean(shares) > 0.95
    assert min(shares) > 0.92
    front = bearing_front()
    ends, direct = (front.min(axis=0), front.max(axis=0)), [bearing_direct(seed) for seed in (1, 2)]
    beside = [share_of_best(bearing(points), each, ends) for points in found for each in direct]
    assert np.mean(beside) > 0.965


def bearing_search(seed, budget=100):
    """From a central composite design as in the example, on a drawing of micrometres; the finalists in coded units."""
    centre, half = np.array([0.02, 0.15, 0.30]), np.array([0.005, 0.05, 0.05]) * 1.681792830507429
    evaluate = bearing_runs(seed)
    coded = central_composite(3, centre_replicates=6).coded / 1.681792830507429
    eight, fine = np.full(20, 8), 0.001 / half
    region = Region(-np.ones(3), np.ones(3), -centre / half, fine, 1.000001 * fine)
    design = Runs(coded, *evaluate(coded, eight), eight)

    def at(points, replicates):
        return evaluate((points - centre) / half, replicates)

    found = AdaptiveSearch(at, centre, half, region, design, THREE, Plan(budget, seed=seed), centre).front()
    return (found.front.points - centre) / half
