"""Ranges of steady temperatures over the unknown inputs of a heat balance: surfaces, housing, contacts, share of the oil.

These inputs scale conductances, so each set of them is one linear system, with the heat linear in the temperatures. Their laws are
the documented ones (rbdyn/scene/unknown_inputs.toml). A key that the scene states is exact unless [uncertain] names it as
estimated, as for ``doe uncertainty``, which also varies all other inputs, by simulation.
"""

import math
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.thermal.fixed_point import HOTTEST
from rbdyn.thermal.network import NODES, Boundaries, Conductances, matrix, source

if TYPE_CHECKING:
    from rbdyn.scene.thermal import Thermal

# Keys of [thermal] that scale conductances, and the conductances that each scales.
SCALED = {
    "surface_factor": ("oil_outer", "oil_inner", "oil_rollers"),
    "housing_factor": ("outer_ambient", "inner_ambient"),
    "contact_factor": ("outer_rollers", "inner_rollers"),
    "oil_share": ("flow",),
}
# Input sets, a power of two, their seed, and the quantiles that a range holds.
SETS, SEED, QUANTILES = 256, 1, (0.05, 0.95)


class Ranges(NamedTuple):
    """Range of each node's temperature [C], the inputs that vary, and the share of input sets without a steady state."""

    temperatures: dict[str, tuple[float, float]]
    inputs: tuple[str, ...]
    unsteady: float

    def as_dict(self) -> dict[str, Any]:
        """JSON form."""
        return {
            "temperatures_C": {node: list(ends) for node, ends in self.temperatures.items()},
            "inputs": list(self.inputs),
            "share_without_steady_state": self.unsteady,
        }


def input_ranges(
    factors: Mapping[str, Array],
    conductances: Conductances,
    boundaries: Boundaries,
    temperatures: Array,
    heat: Array,
    heat_slopes: Array,
) -> Ranges:
    """Ranges of the temperatures about a steady state, 5 to 95 % of input sets.

    ``factors``: as of ``factors_of``. ``temperatures`` (4,) [C] and ``heat`` (4,) [W] of the state; ``heat_slopes`` dQ/dT (4, 4) [W/K]. Sets whose temperatures run
    away, or beyond what any oil bears, count as without a steady state and as the hottest.
    """
    constant_heat = heat - heat_slopes @ temperatures
    rows = []
    for row in range(SETS if factors else 1):
        varied = _scaled(conductances, {key: values[row] for key, values in factors.items()})
        whole = matrix(varied) - heat_slopes
        stable = np.linalg.eigvals(np.linalg.solve(matrix(varied), heat_slopes)).real.max() < 1.0
        solution = (
            np.linalg.solve(whole, constant_heat + source(varied, boundaries))
            if stable
            else np.full(len(NODES), HOTTEST)
        )
        rows.append(np.minimum(solution, HOTTEST))
    table = np.array(rows)
    unsteady = float(np.mean(table.max(axis=1) >= HOTTEST))
    ends = np.quantile(table, QUANTILES, axis=0).T
    ranges = {node: (float(low), float(high)) for node, (low, high) in zip(NODES, ends, strict=True)}
    return Ranges(ranges, tuple(f"thermal.{key}" for key in factors), unsteady)


def _scaled(conductances: Conductances, ratios: Mapping[str, float]) -> Conductances:
    """Conductances times the ratio of each input to its value in the scene."""
    names = {name: ratio for key, ratio in ratios.items() for name in SCALED[key]}
    return conductances._replace(**{name: ratio * getattr(conductances, name) for name, ratio in names.items()})


def factors_of(thermal: "Thermal", flows: bool, estimated: Collection[str]) -> dict[str, Array]:
    """Ratio of each unknown input to its value in the scene, (SETS,), by its key in [thermal].

    ``flows``: whether oil flows to the bearing; ``estimated``: keys of a scene whose stated values are estimates.
    """
    from scipy.stats import qmc

    from rbdyn.scene.uncertain import documented

    exact = {f"thermal.{key}" for key in thermal.model_fields_set} - set(estimated)
    laws = {
        key: entry
        for entry in documented()
        for key in (entry.key.removeprefix("thermal."),)
        if entry.key.startswith("thermal.") and key in SCALED and entry.key not in exact and getattr(thermal, key) > 0.0
    }
    if not flows:
        laws.pop("oil_share", None)
    if not laws:
        return {}
    sample = qmc.Sobol(len(laws), seed=SEED).random_base2(int(math.log2(SETS)))
    factors = {}
    for (key, entry), share in zip(sorted(laws.items()), sample.T, strict=True):
        low, high = float(entry.low or 0.0), float(entry.high or 0.0)
        value = low * (high / low) ** share if entry.law == "log_uniform" else low + (high - low) * share
        factors[key] = value / getattr(thermal, key)
    return factors
