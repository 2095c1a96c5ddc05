"""Fuzz: random tables of runs, with and without noise, repeats, known variances and nearly equal columns, are fitted and judged."""

import json

import numpy as np
import pytest
import statsmodels.api as sm
from surface_intervals import interval

from doe.response_surface import Surface, describe, fit, model_matrix
from doe.response_surface.statistics import fits_of
from rbdyn.base.faults import MethodError


def random_table(seed: int) -> tuple[Surface, dict[str, object]]:
    """A surface of a random table, and what is true of it; raises MethodError where the table is refused."""
    random = np.random.default_rng(seed)
    factors, noise, wave = int(random.integers(1, 5)), *random.choice([0.0, 1e-3, 0.1, 1.0], 2)
    model = str(random.choice(["linear", "interaction", "pure_quadratic", "quadratic", "reduced"]))
    points = random.uniform(-1.0, 1.0, (int(random.integers(18, 40)), factors))
    repeats = int(random.integers(0, 7))
    points = np.vstack([points, np.tile(points[:1], (repeats, 1))])
    near = factors > 1 and random.random() < 0.2
    if near:
        points[:, 1] = points[:, 0] + 10.0 ** random.uniform(-7, -3) * random.standard_normal(len(points))
    slopes, curves, waves = (
        random.normal(size=factors),
        random.normal(size=factors),
        1.5 * random.normal(size=(30, factors)),
    )
    phases, shares = random.uniform(0.0, 2.0 * np.pi, 30), random.normal(size=30) * np.sqrt(2.0 / 30.0)
    curved = model in ("pure_quadratic", "quadratic", "reduced")

    def truth(x: np.ndarray) -> np.ndarray:
        return np.asarray(10.0 + x @ slopes + curved * (x**2) @ curves + wave * np.cos(x @ waves.T + phases) @ shares)

    options: dict[str, object] = {}
    if random.random() < 0.4 and noise > 0.0:
        count = int(random.choice([4, 8, 16]))
        runs = truth(points) + noise * np.sqrt(count) * random.standard_normal((count, len(points)))
        values, errors = runs.mean(axis=0), runs.std(axis=0, ddof=1) / np.sqrt(count)
        options = {"standard_errors": errors, "replicates": np.full(len(points), count)}
    else:
        values = truth(points) + noise * random.standard_normal(len(points))
    units = {"centre": np.zeros(factors), "step": np.ones(factors)}
    surface = fit(points, values, name="y", model=model, **units, **options)  # type: ignore[arg-type]
    # Means of three runs, within the region of all.
    inside = points[random.integers(0, len(points), (100, 3))].mean(axis=1)
    low, high = interval(surface, inside)
    rounding = 1e-9
    held = float(np.mean((low - rounding <= truth(inside)) & (truth(inside) <= high + rounding)))
    kind = "deterministic" if noise == 0.0 else "noisy"
    return surface, {"near": near, "held": held, "kind": kind, "model_holds": wave == 0.0, "repeats": repeats}


def check(surface: Surface, near: object) -> None:
    """Finite JSON, one sentence on lack of fit, nearly equal columns named, and the numbers of statsmodels."""
    json.dumps(fits_of([surface]).as_dict(), allow_nan=False)
    sentences = describe(surface)
    assert sum("y: lack of fit" in line for line in sentences) == 1
    named = any("variance inflation factor" in line for line in sentences)
    assert named == bool(max(filter(None, surface.inflation.values()), default=0.0) > 10.0)
    assert named or not near or surface.model == "reduced"
    assert not any("explains the residual" in line for line in sentences)
    if surface.model_error is not None:
        assert surface.model_error.variance > 0.0 and surface.interval_dof > 0
    oracle = sm.OLS(surface.data.values, model_matrix(surface.data.points, surface.terms)).fit()
    if max(filter(None, surface.inflation.values()), default=0.0) < 1e3 and surface.residual_mean_square > 1e-20:
        assert surface.coefficients == pytest.approx(oracle.params, rel=1e-8, abs=1e-9)
        assert np.sqrt(np.diag(surface.covariance)) == pytest.approx(oracle.bse, rel=1e-6)


def fuzz(count: int) -> dict[str, float]:
    """Figures of ``count`` tables: how many are refused, and the coverage of their means by kind."""
    held: dict[str, list[float]] = {}
    refused = 0
    for seed in range(count):
        try:
            surface, true = random_table(seed)
        except MethodError:
            refused += 1
            continue
        check(surface, true["near"])
        kind = f"{true['kind']}, model {'true' if true['model_holds'] else 'false'}, {'repeats' if true['repeats'] else 'single runs'}"
        held.setdefault(kind, []).append(float(str(true["held"])))
    return {"refused": refused, **{kind: float(np.mean(shares)) for kind, shares in sorted(held.items())}}


def test_fuzz_of_random_tables() -> None:
    found = fuzz(60)
    assert found.pop("refused") <= 10 and min(found.values()) > 0.8


@pytest.mark.slow
def test_fuzz_of_a_thousand_random_tables() -> None:
    """Every kind of table covers what it states: at least 0.9, over points within the runs."""
    found = fuzz(1000)
    print(found)
    assert found.pop("refused") <= 60 and min(found.values()) > 0.9
