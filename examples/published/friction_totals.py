"""Rolling resistance of ten catalogue bearings beside the totals of SKF and of Palmgren, over speed, load and oil.

SKF's and Palmgren's formulas are models, not measurements. Ours is a steady calculation: kinematic speeds, static loads with
centrifugal force, the very contact and rolling laws that are simulated, no traction; two points are simulated besides.

``catalogue_bearings.csv``: dimensions, capacities and reference speeds as catalogues list them, raceways from the NU (inner)
and the N (outer) bearing; the middle of the clearance class CN of ISO 5753-1.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from published.common import CHEN, Check, Effort, Table, canvas, save, simulated
from published.operating import palmgren_moments, skf_moments
from rbdyn import Scene
from rbdyn.contact.rolling_resistance import rolling_force
from rbdyn.dynamics.parameters.model import race_contact_law, rolling_law
from rbdyn.properties.catalogue import read_designation

BEARINGS = Path(__file__).parent / "catalogue_bearings.csv"
TEMPERATURE_C = 70.0
# Kinematic viscosity at 100 C of mineral oils with a viscosity index of 95, by ISO VG.
AT_100_C = {10: 2.64, 32: 5.29, 150: 14.55}
SPEEDS = (0.2, 0.5, 1.0)  # of the reference speed
LOADS = (0.02, 0.05, 0.2)  # of the dynamic capacity
STARVED = 10.0  # half-widths
# Bearing, rpm, N and ISO VG of the simulated points: the second is what a flooded law was first seen to be high at.
SIMULATED = (("NU 308 ECP", 8000.0, 4650.0, 32), ("NU 210 ECP", 6000.0, 2000.0, 32))
REGIMES = (
    ("all", None, None), ("light", "share_of_C", 0.02), ("heavy", "share_of_C", 0.2), ("slow", "share_of_n", 0.2),
    ("fast", "share_of_n", 1.0), ("thin oil", "grade", 10), ("thick oil", "grade", 150),
)  # fmt: skip


@functools.cache
def bearings() -> pd.DataFrame:
    """The catalogue rows by designation."""
    return pd.read_csv(BEARINGS).set_index("designation")


def viscosity_cst(grade: int, celsius: float = TEMPERATURE_C) -> float:
    """ASTM D341 through 40 C, where the grade is named, and 100 C."""

    def twice(x: float) -> float:
        return math.log10(math.log10(x + 0.7))

    warm, hot, kelvin = 313.15, 373.15, celsius + 273.15
    slope = (twice(grade) - twice(AT_100_C[grade])) / math.log10(hot / warm)
    return float(10.0**10.0 ** (twice(grade) - slope * math.log10(kelvin / warm)) - 0.7)


def overrides_of(name: str, speed_rpm: float, load_n: float, grade: int) -> tuple[str, ...]:
    """Keys of a bearing, its interior from the catalogue row, as changes of the example.

    Rollers span the raceways; their number fills the pitch circle at 1.22 diameters, their effective length gives C0 by
    ISO 76. Viscosity and pressure coefficient (0.9904 nu^0.139 1e-8/Pa: Gold's form for mineral oils) are the mineral
    oil's; how it thins with heat and conducts is MIL-L-23699's, 2.7 %/K (the three mineral oils 2.2 to 3.8 %/K).
    """
    row = bearings().loc[name]
    diameter = 0.5 * (row["outer_raceway_mm"] - row["inner_raceway_mm"])
    pitch = 0.5 * (row["outer_raceway_mm"] + row["inner_raceway_mm"])
    rollers = round(math.pi * pitch / (1.22 * diameter))
    length = row["C0_kN"] * 1e3 / (44.0 * (1.0 - diameter / pitch) * rollers * diameter)
    viscosity = viscosity_cst(grade)
    keys = {
        "bearing.rollers": rollers, "bearing.roller_diameter_mm": diameter, "bearing.pitch_diameter_mm": pitch,
        "bearing.effective_length_mm": length, "bearing.roller_length_mm": length + 0.1 * diameter,
        "bearing.radial_clearance_mm": row["cn_clearance_um"] * 1e-3, "cage.pocket_clearance_mm": 0.03 * diameter,
        "cage.guide_clearance_mm": 0.004 * pitch, "cage.mass_g": 2.4e-3 * pitch * diameter * row["width_mm"],
        "operation.inner_speed_rpm": speed_rpm, "operation.radial_load_N": load_n,
        "lubricant.temperature_C": TEMPERATURE_C, "lubricant.viscosity_mPas": 0.85 * viscosity,
        "lubricant.pressure_coefficient_1_GPa": 9.904 * viscosity**0.139,
    }  # fmt: skip
    return ("lubricant.oil=MIL-L-23699", *(f"{key}={float(value):.9g}" if isinstance(value, float) else f"{key}={value}"
                                           for key, value in keys.items()))  # fmt: skip


def contact_loads(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Loads of the rollers on the outer and the inner race [N] in static equilibrium, one roller on the load's line."""
    outer, inner = (race_contact_law(scene, which).stiffness for which in ("outer", "inner"))
    speeds, mean = scene.geometry.motion, 0.5 * sum(scene.geometry.raceways)
    pull = scene.geometry.roller_mass * speeds.cage_speed**2 * mean
    cosine = np.cos(2.0 * np.pi * np.arange(scene.bearing.rollers) / scene.bearing.rollers)

    def inner_load(room: float) -> float:
        def excess(load: float) -> float:
            return (load / inner) ** 0.9 + ((load + pull) / outer) ** 0.9 - room

        return 0.0 if excess(0.0) >= 0.0 else float(brentq(excess, 0.0, 2.0 * inner * room ** (10.0 / 9.0)))

    def loads(shift: float) -> np.ndarray:
        return np.array([inner_load(shift * c - 0.5e-3 * scene.mounted_clearance_mm) for c in cosine])

    target = float(scene.operation.radial_load_N)
    shift = brentq(lambda s: loads(s) @ cosine - target, 0.0, 2e-3, xtol=1e-12)
    found = loads(shift)
    return found + pull, found


def rolling_power(scene: Scene) -> tuple[float, float]:
    """Power of rolling resistance [W], 2 F u over the contacts that are closed, and that of rollers without load on the inner
    race, which centrifugal force rolls on the outer one."""
    oil, speed = scene.lubricant.in_service, abs(scene.geometry.motion.entrainment)
    total = idle = 0.0
    loads = contact_loads(scene)
    for side, radius in zip(loads, scene.geometry.reduced_radii, strict=True):
        law = rolling_law(scene, oil, radius)
        power = np.array([2.0 * speed * rolling_force(law, load, speed) if load > 0.0 else 0.0 for load in side])
        total, idle = total + power.sum(), idle + power[loads[1] == 0.0].sum()
    return float(total), float(idle)


def open_contacts(scene: Scene) -> tuple[int, float]:
    """How many inner contacts carry nothing, and what flooded oil in their gaps would add [W]: 4.60 eta u l sqrt(R/h) each."""
    outer_loads, inner_loads = contact_loads(scene)
    stiffness = race_contact_law(scene, "outer").stiffness
    count = int((inner_loads == 0.0).sum())
    # Rollers lie on the outer race; the gap at the inner one is near the clearance and grows to twice that opposite the load.
    angle = 2.0 * np.pi * np.arange(len(inner_loads)) / len(inner_loads)
    room = 0.5e-3 * scene.mounted_clearance_mm
    loaded = room + (inner_loads.max() / race_contact_law(scene, "inner").stiffness) ** 0.9
    shift = loaded + (outer_loads.max() / stiffness) ** 0.9
    gap = (room + (outer_loads / stiffness) ** 0.9 - shift * np.cos(angle))[inner_loads == 0.0]
    speed, oil = abs(scene.geometry.motion.entrainment), scene.lubricant.in_service
    force = 4.60 * oil.viscosity * speed * scene.bearing.effective_length_mm * 1e-3
    return count, float((2.0 * speed * force * np.sqrt(scene.geometry.reduced_radii[1] / gap)).sum())


def point(name: str, speed_rpm: float, load_n: float, grade: int) -> dict[str, Any]:
    """Ours, flooded and starved, and theirs at one operating point [W]."""
    row, shaft = bearings().loc[name], speed_rpm * math.pi / 30.0 * 1e-3
    keys, viscosity = overrides_of(name, speed_rpm, load_n, grade), viscosity_cst(grade)
    flooded = Scene.load(CHEN, keys)
    starved = Scene.load(CHEN, (*keys, f"lubricant.inlet_distance={STARVED}"))
    bore, outside = float(row["bore_mm"]), float(row["outside_diameter_mm"])
    rolling, sliding = (
        shaft * moment
        for moment in skf_moments(speed_rpm, load_n, viscosity, bore, outside, read_designation(name).series)
    )
    palmgren = [
        shaft * sum(palmgren_moments(speed_rpm, load_n, viscosity, 0.5 * (bore + outside), f0)) for f0 in (2, 3)
    ]
    (ours, idle), (short, _) = rolling_power(flooded), rolling_power(starved)
    return {
        "bearing": name, "speed_rpm": speed_rpm, "load_N": load_n, "grade": grade,
        "share_of_n": speed_rpm / row["reference_speed_rpm"], "share_of_C": load_n / row["C_kN"] * 1e-3,
        "flooded_W": ours, "idle_W": idle, "starved_W": short, "skf_rolling_W": rolling, "skf_total_W": rolling + sliding,
        "palmgren_2_W": palmgren[0], "palmgren_3_W": palmgren[1], "flooded_over_skf": ours / rolling,
        "starved_over_skf": short / rolling, "flooded_over_palmgren": ours / palmgren[0],
    }  # fmt: skip


def spread(ratios: Sequence[float]) -> tuple[float, float, float]:
    """Median, and between what 80 % lie."""
    low, middle, high = np.quantile(ratios, (0.1, 0.5, 0.9))
    return float(middle), float(low), float(high)


def exponents(frame: pd.DataFrame, column: str) -> np.ndarray:
    """Of speed, load and viscosity, each bearing with its own constant."""
    variables = np.log(np.column_stack((frame["speed_rpm"], frame["load_N"], frame["grade"].map(viscosity_cst))))
    basis = np.hstack((variables, pd.get_dummies(frame["bearing"]).to_numpy(float)))
    return np.linalg.lstsq(basis, np.log(frame[column].to_numpy()), rcond=None)[0][:3]


def friction_totals(effort: Effort | None = None, names: Sequence[str] | None = None) -> Check:
    """Ours beside SKF's and Palmgren's over bearings, speeds, loads and oils; simulated where an ``effort`` is given."""
    records = []
    for name in names or tuple(bearings().index):
        capacity, reference = bearings().loc[name, ["C_kN", "reference_speed_rpm"]]
        for grade in AT_100_C:
            for speed in SPEEDS:
                records += [point(name, speed * reference, share * capacity * 1e3, grade) for share in LOADS]
    frame = pd.DataFrame(records)
    checked = [simulated_row(*case, effort) for case in SIMULATED] if effort is not None else []
    tables = [points_table(frame), regime_table(frame), exponent_table(frame)]
    if checked:
        header = ("point", "loaded inner", "steady W", "simulated W", "starved steady W", "starved simulated W",
                  "SKF rolling W", "SKF total W", "oil in the open gaps W")  # fmt: skip
        tables.append(Table("two points simulated, ISO VG 32 at 70 C", header, tuple(checked)))
    return Check("Rolling resistance of ten catalogue bearings beside SKF's and Palmgren's models", tuple(tables),
                 conclusion(frame), frame, lambda path: draw(frame, path))  # fmt: skip


def simulated_row(name: str, speed_rpm: float, load_n: float, grade: int, effort: Effort) -> tuple[str, ...]:
    """The steady calculation beside a run."""
    found, keys = point(name, speed_rpm, load_n, grade), overrides_of(name, speed_rpm, load_n, grade)
    runs = [simulated(CHEN, effort, (*keys, *more)).power_terms_W["rolling_resistance"]
            for more in ((), (f"lubricant.inlet_distance={STARVED}",))]  # fmt: skip
    scene = Scene.load(CHEN, keys)
    gaps, added = open_contacts(scene)
    return (f"{name}, {speed_rpm:.0f} rpm, {load_n:.0f} N", f"{scene.bearing.rollers - gaps} of {scene.bearing.rollers}",
            f"{found['flooded_W']:.1f}", f"{runs[0]:.1f}", f"{found['starved_W']:.1f}", f"{runs[1]:.1f}",
            f"{found['skf_rolling_W']:.1f}", f"{found['skf_total_W']:.1f}", f"{added:.1f}")  # fmt: skip


def points_table(frame: pd.DataFrame) -> Table:
    """The points of the middle oil."""
    shown = frame[frame["grade"] == 32]
    columns = ("flooded_W", "starved_W", "skf_rolling_W", "skf_total_W", "palmgren_2_W", "palmgren_3_W")
    rows = tuple(
        (row["bearing"], f"{row['speed_rpm']:.0f}", f"{row['load_N']:.0f}", *(f"{row[name]:.3g}" for name in columns),
         f"{row['flooded_over_skf']:.2f}", f"{row['starved_over_skf']:.2f}")
        for row in shown.to_dict("records")
    )  # fmt: skip
    header = ("bearing", "rpm", "N", "ours flooded W", "ours starved W", "SKF rolling W", "SKF total W",
              "Palmgren f0 2 W", "Palmgren f0 3 W", "flooded/SKF", "starved/SKF")  # fmt: skip
    return Table("ISO VG 32 at 70 C; starved at 10 half-widths; ratios to SKF's rolling part", header, rows)


def regime_table(frame: pd.DataFrame) -> Table:
    """Medians and spreads."""
    rows = []
    for name, column, value in REGIMES:
        part = frame if column is None else frame[np.isclose(frame[column], value)]
        cells = [
            "{:.2f} ({:.2f} to {:.2f})".format(*spread(part[ratio]))
            for ratio in ("flooded_over_skf", "starved_over_skf", "flooded_over_palmgren")
        ]
        rows.append((name, str(len(part)), *cells, f"{(part['idle_W'] / part['flooded_W']).median():.2f}"))
    header = (
        "points",
        "how many",
        "flooded/SKF rolling",
        "starved/SKF rolling",
        "flooded/Palmgren f0 2",
        "idle rollers",
    )
    return Table("median, and where 80 % of the points lie; share of ours by rollers without load", header, tuple(rows))


def exponent_table(frame: pd.DataFrame) -> Table:
    """How each rises."""
    parts = frame.assign(loaded_W=frame["flooded_W"] - frame["idle_W"])
    rows = tuple(
        (name, *(f"{value:.2f}" for value in exponents(parts, column)))
        for name, column in (("ours, flooded", "flooded_W"), ("of it, loaded rollers", "loaded_W"),
                             ("of it, idle rollers", "idle_W"), ("ours, starved", "starved_W"),
                             ("SKF, rolling", "skf_rolling_W"), ("Palmgren, f0 2", "palmgren_2_W"))
    )  # fmt: skip
    return Table("power ~ speed^a load^b viscosity^c", ("model", "a", "b", "c"), rows)


def conclusion(frame: pd.DataFrame) -> str:
    """Where they part, and how far the law is to be trusted."""
    middle, low, high = spread(frame["flooded_over_skf"])
    loaded = float(((frame["flooded_W"] - frame["idle_W"]) / frame["skf_rolling_W"]).median())
    taken = 1.0 - frame["starved_W"] / frame["flooded_W"]
    (speed, load, flow), theirs = (exponents(frame, name) for name in ("flooded_W", "skf_rolling_W"))
    most = frame.loc[(frame["idle_W"] / frame["flooded_W"]).idxmax()]
    return (
        f"Flooded rolling resistance is {middle:.2f} of SKF's rolling part in the median ({low:.2f} to {high:.2f} for 80 % of "
        f"the points), low for slow and heavily loaded bearings and high for fast, lightly loaded ones in thick oil: it rises "
        f"with speed to the power {speed:.2f}, load {load:.2f}, viscosity {flow:.2f}, SKF's {theirs[0]:.2f}, {theirs[1]:.2f}, "
        f"{theirs[2]:.2f}. Two things part them. Rollers without load roll on the outer race by their centrifugal force and take "
        f"up to {100.0 * most['idle_W'] / most['flooded_W']:.0f} % of ours, growing with speed to the power "
        f"{exponents(frame, 'idle_W')[0]:.1f}; SKF's formula, which knows the load on the shaft alone, has no such term: the "
        f"loaded rollers by themselves are {loaded:.2f} of it in the median. And an elastohydrodynamic contact feels no load, "
        f"so that ours grows with load by loaded rollers only. Heating of the inlet is in both. A meniscus at "
        f"{STARVED:g} half-widths takes {100.0 * taken.min():.0f} to {100.0 * taken.max():.0f} % ({100.0 * taken.median():.0f} in "
        f"the median), most from light contacts; SKF's replenishment factor falls with speed times viscosity, which a fixed distance "
        f"hardly feels. SKF's and Palmgren's are models too: a factor "
        f"of {1.0 / high:.1f} to {1.0 / low:.1f} (model.rolling_resistance_factor) spans what SKF's would ask, "
        f"where solutions of a single flooded contact leave 0.97 to 1.15."
    )


def draw(frame: pd.DataFrame, path: Path) -> None:
    """Ours over theirs against the viscosity times speed."""
    figure, axes = canvas(1, 2, 5.0)
    flow = frame["speed_rpm"] * frame["grade"].map(viscosity_cst)
    for axis, column in zip(axes[0], ("flooded_over_skf", "starved_over_skf"), strict=True):
        for share, part in frame.groupby(frame["share_of_C"].round(3)):
            axis.plot(flow[part.index], part[column], "o", markersize=3, label=f"load {share:g} C")
        axis.axhline(1.0, color="black", linewidth=0.8)
        axis.set_xscale("log")
        axis.set_xlabel("viscosity times speed [mm²/s rpm]")
        axis.set_ylabel(column.replace("_", " "))
        axis.grid(alpha=0.3)
    axes[0][0].legend(fontsize=8)
    save(figure, path)
