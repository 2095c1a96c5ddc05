"""Rolling torque of the tapered bearing 32216, measured and simulated by others, beside our rolling law alone.

Wingertszahn et al., Lubricants 2023, 11, 369: 6 kN axial, 50 C, oil FVA 3, bath to half a roller. Their torque is the whole one,
with ribs, cage and churning; their simulation gives 1200 to 3800 N mm from 500 to 4000 rpm and lies slightly above the
measurement. Ours is the rolling resistance of 16 rollers between two races, each taken as a cylinder of its mean diameter.
The contact angle is assumed, the pressure coefficient is Gold's for mineral oil; the distance at which the oil begins is not
known, so three are shown.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd

from published.common import Check, Finding, Table, canvas, save
from rbdyn.contact.rolling_resistance import aihara_thermal_factor, biboulet_houpert, rolling_force, starved
from rbdyn.properties.oils import BASE_OILS

ROLLERS, DIAMETER, LENGTH, PITCH = 16, 17e-3, 22.7e-3, 108.5e-3
ANGLE, AXIAL = math.radians(15.6), 6000.0
MODULUS = 2.0 * 2.06e11 / (2.0 * (1.0 - 0.3**2))  # E' of two bodies of steel [Pa]
CELSIUS, CONDUCTIVITY, DENSITY = 50.0, 0.134, 887.6
SPEEDS = (500.0, 1000.0, 2000.0, 4000.0)
# The ends of their simulated torque [N mm].
THEIRS = {500.0: 1200.0, 4000.0: 3800.0}
INLETS = {"flooded": None, "5 half-widths": 5.0, "2 half-widths": 2.0}


def viscosity(celsius: float) -> float:
    """Dynamic viscosity of FVA 3 by the source [Pa s]."""
    return 0.062e-3 * math.exp(1021.7 / (celsius + 101.55))


def rolling_torque(rpm: float, inlet_distance: float | None) -> float:
    """Torque [N mm] of the rolling resistance alone, all surfaces at the kinematic speed."""
    eta, ratio = viscosity(CELSIUS), DIAMETER * math.cos(ANGLE) / PITCH
    omega = rpm * math.pi / 30.0
    entrainment = 0.25 * PITCH * omega * (1.0 - ratio**2)
    slope = eta * 1021.7 / (CELSIUS + 101.55) ** 2
    factor, exponent = BASE_OILS["mineral"].gold
    pressure_coefficient = 1e-8 * factor * (1e6 * eta / DENSITY) ** exponent
    load = AXIAL / (ROLLERS * math.sin(ANGLE))
    power = 0.0
    for side in (1.0, -1.0):
        radius = 0.5 * DIAMETER * (1.0 + side * ratio)
        heating = aihara_thermal_factor(slope, CONDUCTIVITY, entrainment)
        law = biboulet_houpert(eta, MODULUS, radius, LENGTH, heating)
        if inlet_distance is not None:
            law = starved(law, eta, pressure_coefficient, MODULUS, radius, LENGTH, inlet_distance)
        power += 2.0 * ROLLERS * rolling_force(law, load, entrainment) * entrainment
    return 1e3 * power / omega


def check() -> Check:
    """Our torque at three states of supply beside theirs."""
    found = {name: [rolling_torque(rpm, inlet) for rpm in SPEEDS] for name, inlet in INLETS.items()}
    frame = pd.DataFrame(found, index=pd.Index(SPEEDS, name="rpm"))
    columns = (*INLETS, "whole torque, simulated by Wingertszahn et al.")
    rows = tuple(
        (f"{rpm:g}", *(f"{found[name][i]:.0f}" for name in INLETS), f"{THEIRS[rpm]:g}" if rpm in THEIRS else "")
        for i, rpm in enumerate(SPEEDS)
    )
    ratios = {name: [frame[name][rpm] / torque for rpm, torque in THEIRS.items()] for name in INLETS}
    told = "; ".join(f"{name} {low:.2f} and {high:.2f}" for name, (low, high) in ratios.items())
    nearest = min(abs(np.log(pair)).max() for pair in ratios.values())
    finding = Finding(
        "rolling torque of 32216", "Wingertszahn et al. 2023 (read)", "measured", f"{told} of theirs",
        "agrees" if nearest < 0.1 else "differs",
    )  # fmt: skip

    def draw(path: Path) -> None:
        figure, axes = canvas(1, 1)
        for name in INLETS:
            axes[0][0].plot(SPEEDS, found[name], label=name)
        axes[0][0].plot(list(THEIRS), list(THEIRS.values()), "ks", label="Wingertszahn et al. 2023, simulated")
        axes[0][0].set_xlabel("speed [rpm]")
        axes[0][0].set_ylabel("torque [N mm]")
        axes[0][0].legend(fontsize=8)
        save(figure, path)

    return Check(
        "Rolling torque of the tapered bearing 32216",
        (Table("torque [N mm]; ours is rolling resistance alone", ("rpm", *columns), rows),),
        f"Our rolling resistance alone over their whole torque at {' and '.join(f'{rpm:g}' for rpm in THEIRS)} rpm: {told}.",
        frame,
        draw,
        (finding,),
    )
