"""Materials by name: elastic constants and density at 20 C."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Material:
    """Elastic modulus [Pa], Poisson's ratio [-] and density [kg/m^3]."""

    elastic_modulus: float
    poisson_ratio: float
    density: float


# Handbook values at room temperature; 52100 with the customary 206 GPa and 0.3.
MATERIALS = {
    "bearing_steel": Material(206e9, 0.30, 7827.0),
    "m50": Material(203e9, 0.28, 7900.0),
    "silicon_nitride": Material(317e9, 0.25, 3240.0),
    "aisi_4340": Material(205e9, 0.29, 7850.0),
    "bronze": Material(110e9, 0.33, 8800.0),
    "aluminium_bronze": Material(115e9, 0.33, 7550.0),
    "brass": Material(105e9, 0.34, 8500.0),
    "titanium_6al4v": Material(113.8e9, 0.342, 4430.0),
    "peek": Material(3.9e9, 0.40, 1320.0),
    "phenolic_cotton": Material(8e9, 0.30, 1350.0),
}


def equivalent_modulus(first: Material, second: Material) -> float:
    """Equivalent modulus E' = 2/[(1-nu1^2)/E1 + (1-nu2^2)/E2] [Pa] (E_eq of Chen et al. 2022, eq 6)."""
    compliance = sum((1.0 - part.poisson_ratio**2) / part.elastic_modulus for part in (first, second))
    return 2.0 / compliance
