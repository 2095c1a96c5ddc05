"""Materials by name: elastic constants, density and thermal expansion at 20 C."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Material:
    """Elastic modulus [Pa], Poisson's ratio [-], density [kg/m^3], linear thermal expansion [1/K] (steel if left out)."""

    elastic_modulus: float
    poisson_ratio: float
    density: float
    thermal_expansion: float = 12.0e-6


# Handbook values at room temperature; 52100 with the customary 206 GPa and 0.3. Expansions are from the middle
# of the usual ranges (4340 from its lower end, at 20 C); that of silicon nitride is sometimes misprinted as 3.4e-5.
MATERIALS = {
    "bearing_steel": Material(206e9, 0.30, 7827.0, 12.0e-6),
    "m50": Material(203e9, 0.28, 7900.0, 11.5e-6),
    "silicon_nitride": Material(317e9, 0.25, 3240.0, 3.2e-6),
    "aisi_4340": Material(205e9, 0.29, 7850.0, 12.7e-6),
    "bronze": Material(110e9, 0.33, 8800.0, 18.0e-6),
    "aluminium_bronze": Material(115e9, 0.33, 7550.0, 16.5e-6),
    "brass": Material(105e9, 0.34, 8500.0, 20.0e-6),
    "titanium_6al4v": Material(113.8e9, 0.342, 4430.0, 8.8e-6),
    "peek": Material(3.9e9, 0.40, 1320.0, 47.0e-6),
    "phenolic_cotton": Material(8e9, 0.30, 1350.0, 30.0e-6),
}
# Elastic modulus [Pa] between metals (cages of bronze and steel have 100 GPa and more) and polymers, laminates included.
SOFTEST_METAL = 20e9


def equivalent_modulus(first: Material, second: Material) -> float:
    """Equivalent modulus E' = 2/[(1-nu1^2)/E1 + (1-nu2^2)/E2] [Pa] (E_eq of Chen et al. 2022, eq 6)."""
    compliance = sum((1.0 - part.poisson_ratio**2) / part.elastic_modulus for part in (first, second))
    return 2.0 / compliance
