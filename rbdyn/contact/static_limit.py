"""Pressure that leaves a permanent dent of 1e-4 of a rolling element's diameter (ISO 76)."""

BALLS, ROLLERS = 4200e6, 4000e6  # [Pa]


def dent_sentence(pressure: float, limit: float, race: str) -> str:
    """What a ``pressure`` above the ``limit`` [Pa] does to the "inner" or "outer" race, and the mend."""
    kind = "rollers" if limit == ROLLERS else "balls"
    what = f"{1e-6 * pressure:.0f} MPa on the {race} race are more than the {1e-6 * limit:.0f} MPa of ISO 76"
    return f"{what}: the race dents; lessen the load or take more or larger {kind}"
