"""Stress and life of an angular contact ball bearing against preload and clearance (Sensors 2023, 23, 4503).

    python examples/paper_003_preload.py [--out DIR]

Tables 3 and 4 of that paper beside ours: at rest between rings that stay parallel, which is what its stresses belong
to, and at its 63000 rpm with centrifugal forces and gyroscopic moments, the ring held or free to tilt.
"""

from __future__ import annotations

import functools
import math
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import typer
from published import iso281
from published.common import Check, Table, canvas, percent, save, tell
from published.lundberg_palmgren import plain_capacities

from rbdyn import BallScene
from rbdyn.contact.point_contact import peak_pressure
from rbdyn.life.balls import row_life
from rbdyn.quasistatic import preload, result
from rbdyn.quasistatic.row.equilibrium import solve
from rbdyn.quasistatic.row.model import constraint_of, load_of, row_of

SPEED_RPM = 63000.0
RADIAL_N = 150.0
WORKING_AXIAL_N = 40.0
BALLS, PITCH_MM, INNER_GROOVE = 10, 18.0, 0.52
# Table 1 prints a ball of 4.4848 mm, eq 18 computes with 4.85 and an outer groove factor of 0.5235.
BALL_MM, OUTER_GROOVE, ANGLE_DEG = 4.85, 0.5235, 15.0
MODULUS_GPA = 210.0
# Picked out of six pairs of grooves after the fact, by the ratio of the printed stresses of both races; it serves the
# column "groove 0.53" only. ISO 76 and ISO 281 have it as the usual outer groove.
USUAL_OUTER_GROOVE = 0.53

# Axial force [N], stress on the inner and the outer race [MPa], contact angle [deg], life [h] of Table 4.
TABLE_4 = (
    (40, 1557, 1331, 13.9, 21500),
    (50, 1501, 1293, 15.5, 21500),
    (55, 1472, 1258, 16.1, 21500),
    (60, 1461, 1249, 16.4, 21200),
    (65, 1456, 1245, 16.7, 18700),
    (70, 1455, 1244, 16.7, 16600),
    (75, 1461, 1249, 17.0, 14800),
    (80, 1469, 1256, 17.1, 13200),
    (90, 1489, 1273, 17.2, 10800),
    (100, 1509, 1290, 17.4, 8950),
    (110, 1530, 1308, 17.5, 7450),
    (120, 1550, 1325, 17.7, 6340),
    (130, 1570, 1342, 17.8, 5560),
    (140, 1589, 1359, 17.9, 4820),
    (145, 1599, 1367, 18.0, 4510),
    (150, 1608, 1375, 18.0, 4220),
    (160, 1627, 1391, 18.1, 3720),
    (170, 1645, 1406, 18.1, 3700),
)
# Diametral clearance [um], contact angle [deg], life [h] of Table 3, under 150 N radial and 40 N axial.
TABLE_3 = (
    (12.4, 13.9, 14254),
    (14.4, 15.0, 19698),
    (15.3, 15.5, 21660),
    (16.5, 16.1, 24254),
    (17.2, 16.4, 25611),
    (17.8, 16.7, 27045),
    (18.4, 17.0, 28502),
    (18.9, 17.2, 29513),
    (19.5, 17.5, 31049),
    (20.0, 17.7, 32119),
    (20.4, 17.9, 33213),
    (20.9, 18.1, 34323),
)
# How the bearing is modelled: speed [rpm] and whether the inner ring is held parallel.
MODELS = {"at rest": (0.0, "fixed"), "63000 rpm": (SPEED_RPM, "fixed"), "63000 rpm, tilting": (SPEED_RPM, "free")}
# Misalignments of Fig. 13 [mrad], and none; its radial load.
TILTS_MRAD, TILTED_RADIAL_N = (0.0, 1.3, 1.9, 2.8), 200.0


def bearing(
    axial: float,
    model: str = "at rest",
    *,
    radial: float = RADIAL_N,
    clearance_mm: float | None = None,
    outer_groove: float = OUTER_GROOVE,
    tilt_mrad: float = 0.0,
) -> Any:
    """Scene of the paper's bearing under an axial force [N]."""
    speed, tilt = MODELS[model]
    steel = {"elastic_modulus_GPa": MODULUS_GPA, "poisson_ratio": 0.3, "density_kg_m3": 7850.0}
    angle = {"contact_angle_deg": ANGLE_DEG} if clearance_mm is None else {"radial_clearance_mm": clearance_mm}
    return BallScene.from_dict(
        {
            "bearing": {
                "kind": "angular_contact_ball",
                "balls": BALLS,
                "ball_diameter_mm": BALL_MM,
                "pitch_diameter_mm": PITCH_MM,
                "inner_groove_factor": INNER_GROOVE,
                "outer_groove_factor": outer_groove,
                **angle,
            },
            "operation": {
                "inner_speed_rpm": speed,
                "radial_load_N": radial,
                "axial_load_N": float(axial),
                "tilt": tilt,
                "prescribed": {"tilt_y_mrad": tilt_mrad} if tilt_mrad else {},
            },
            "materials": {"ball": steel, "rings": steel},
        },
        "Sensors 2023, 23, 4503",
    )


def solved(scene: Any) -> dict[str, float]:
    """Stress on both races [MPa], greatest load [N] and its angle [deg], life by Lundberg and Palmgren [h]."""
    model = row_of(scene)
    solution = solve(model.row, model.control, load_of(scene), constraint_of(scene))
    if not solution.is_equilibrium:
        raise RuntimeError(solution.status)
    most = int(np.argmax(solution.inner_load))
    life = row_life(solution.inner_load, solution.outer_load, plain_capacities(scene.bearing), "inner")
    return {
        "inner": 1e-6 * float(peak_pressure(model.inner_contact, solution.inner_load.max())),
        "outer": 1e-6 * float(peak_pressure(model.outer_contact, solution.outer_load.max())),
        "load": float(solution.inner_load[most]),
        "angle": math.degrees(solution.inner_angle[most]),
        "life": life.hours(SPEED_RPM * math.pi / 30.0),
    }


def catalogue_life(axial: float, capacity: float) -> float:
    """ISO 281 life [h] at 63000 rpm from a rating [N], with X and Y of 15 degrees."""
    factors = iso281.load_factors(math.radians(ANGLE_DEG), axial, BALLS, 1e-3 * BALL_MM)
    million = iso281.basic_life(capacity, iso281.equivalent_load(RADIAL_N, axial, factors))
    return million * 1e6 / (60.0 * SPEED_RPM)


def read_back_capacity() -> float:
    """Rating [N] behind the first printed life: there the axial force is below e F_r, so P = F_r."""
    return RADIAL_N * (TABLE_4[0][4] * 60.0 * SPEED_RPM * 1e-6) ** (1.0 / 3.0)


@functools.cache
def table4() -> pd.DataFrame:
    """Table 4 beside ours, a row an axial force."""
    own_capacity = result.capacity_of(bearing(WORKING_AXIAL_N).bearing)
    records = []
    for axial, inner, outer, angle, hours in TABLE_4:
        record: dict[str, float] = {
            "axial_N": axial,
            "inner_MPa paper": inner,
            "outer_MPa paper": outer,
            "angle_deg paper": angle,
            "life_h paper": hours,
            "life_h ISO 281": catalogue_life(axial, own_capacity),
            "life_h ISO 281, read back": catalogue_life(axial, read_back_capacity()),
        }
        for name in MODELS:
            ours = solved(bearing(axial, name))
            record |= {
                f"inner_MPa {name}": ours["inner"],
                f"outer_MPa {name}": ours["outer"],
                f"load_N {name}": ours["load"],
                f"angle_deg {name}": ours["angle"],
                f"life_h {name}": ours["life"],
            }
        usual = solved(bearing(axial, outer_groove=USUAL_OUTER_GROOVE))
        record |= {"inner_MPa groove 0.53": usual["inner"], "outer_MPa groove 0.53": usual["outer"]}
        records.append(record)
    return pd.DataFrame(records)


@functools.cache
def table3() -> pd.DataFrame:
    """Table 3 beside ours, a row a clearance."""
    records = []
    for clearance, angle, hours in TABLE_3:
        drawn = bearing(WORKING_AXIAL_N, clearance_mm=1e-3 * clearance)
        record: dict[str, float] = {
            "clearance_um": clearance,
            "angle_deg paper": angle,
            "angle_deg eq 17": math.degrees(drawn.bearing.contact_angle),
            "life_h paper": hours,
        }
        for name in MODELS:
            record[f"life_h {name}"] = solved(bearing(WORKING_AXIAL_N, name, clearance_mm=1e-3 * clearance))["life"]
        record["life_h axial load alone"] = solved(bearing(WORKING_AXIAL_N, radial=0.0, clearance_mm=1e-3 * clearance))[
            "life"
        ]
        records.append(record)
    return pd.DataFrame(records)


@functools.cache
def optima() -> dict[str, preload.Scan]:
    """Preload on top of the working 40 N, for each model."""
    return {
        name: preload.over_preload(
            bearing(WORKING_AXIAL_N, name), [10.0 * step for step in range(14)], plain_capacities
        )
        for name in MODELS
    }


def tilted_loads() -> pd.DataFrame:
    """Inner load of each ball [N] at rest under misalignments in the plane of a radial load of 200 N."""
    columns: dict[str, Any] = {"azimuth_deg": 360.0 * np.arange(BALLS) / BALLS}
    for tilt in TILTS_MRAD:
        scene = bearing(WORKING_AXIAL_N, radial=TILTED_RADIAL_N, tilt_mrad=-tilt)
        model = row_of(scene)
        solution = solve(model.row, model.control, load_of(scene), constraint_of(scene))
        columns[f"{tilt:g} mrad"] = solution.inner_load
    return pd.DataFrame(columns)


def preload_and_clearance() -> Check:
    """Tables 3 and 4, what they belong to, and the best preload by each model."""
    stress, clearance = table4(), table3()
    frame = pd.concat([stress.assign(table=4), clearance.assign(table=3)], ignore_index=True)
    return Check(
        "Preload and clearance of an angular contact ball bearing (Sensors 2023, Tables 3 and 4)",
        (_stress_table(stress), _life_table(stress), _clearance_table(clearance), _optimum_table()),
        _conclusion(stress, clearance),
        frame,
        _draw,
    )


def _whole(frame: pd.DataFrame, first: str, columns: dict[str, str], title: str) -> Table:
    rows = tuple(
        (f"{row[first]:g}", *(f"{row[key]:.1f}" if "angle" in key else f"{row[key]:.0f}" for key in columns))
        for row in frame.to_dict("records")
    )
    return Table(title, ("", *columns.values()), rows)


def _stress_table(frame: pd.DataFrame) -> Table:
    columns = {"inner_MPa paper": "inner: paper"}
    columns |= {f"inner_MPa {name}": name for name in MODELS}
    columns |= {"inner_MPa groove 0.53": "groove 0.53", "outer_MPa paper": "outer: paper"}
    columns |= {
        "outer_MPa at rest": "at rest",
        "outer_MPa 63000 rpm": "63000 rpm",
        "outer_MPa groove 0.53": "groove 0.53",
    }
    columns |= {"angle_deg paper": "angle: paper", "angle_deg at rest": "at rest"}
    return _whole(frame, "axial_N", columns, "Peak stress [MPa] and contact angle [deg] by axial force [N]")


def _life_table(frame: pd.DataFrame) -> Table:
    columns = {
        "life_h paper": "paper",
        "life_h ISO 281": "ISO 281",
        "life_h ISO 281, read back": f"C = {read_back_capacity():.0f} N",
    }
    columns |= {f"life_h {name}": f"L-P {name}" for name in MODELS}
    return _whole(frame, "axial_N", columns, "Life [h] at 63000 rpm by axial force [N]")


def _clearance_table(frame: pd.DataFrame) -> Table:
    columns = {"angle_deg paper": "angle: paper", "angle_deg eq 17": "eq 17", "life_h paper": "life: paper"}
    columns |= {f"life_h {name}": f"L-P {name}" for name in MODELS}
    columns |= {"life_h axial load alone": "L-P, 40 N axial alone"}
    return _whole(frame, "clearance_um", columns, "Angle [deg] and life [h] at 63000 rpm by diametral clearance [um]")


def _optimum_table() -> Table:
    rows = []
    for name, found in optima().items():
        least, longest = found.least_stress, found.longest_life
        rows.append(
            (
                name,
                f"{least.value:.1f}",
                f"{1e-6 * least.peak_pressure:.0f}",
                f"{longest.value:.1f}",
                percent(least.million_turns / longest.million_turns - 1.0),
                percent(longest.peak_pressure / least.peak_pressure - 1.0),
            )
        )
    header = ("", "preload for stress [N]", "stress [MPa]", "for life [N]", "life at the first", "stress at the second")
    return Table("Best preload on top of the working 40 N (the paper: 30 N)", header, tuple(rows))


def _conclusion(stress: pd.DataFrame, clearance: pd.DataFrame) -> str:
    def miss(name: str, race: str) -> pd.Series:
        # The outer stress at 50 N is a misprint (1293 for 1283) and left out.
        kept = stress[stress["axial_N"] != 50]
        return kept[f"{race}_MPa {name}"] / kept[f"{race}_MPa paper"] - 1.0

    inner, outer, usual_in, usual_out = (
        miss(name, race) for name in ("at rest", "groove 0.53") for race in ("inner", "outer")
    )
    usual = pd.concat([usual_in, usual_out])
    read_back = stress["life_h ISO 281, read back"] / stress["life_h paper"] - 1.0
    before_last = read_back.iloc[:-1]
    neighbours = stress["life_h ISO 281, read back"].iloc[-1] / (1.0 + read_back.iloc[-2])
    own = result.capacity_of(bearing(WORKING_AXIAL_N).bearing)
    best = optima()
    rest, fast, free = (best[name].least_stress.value for name in MODELS)
    lives = [best[name].longest_life.value for name in MODELS]

    def change(column: str) -> str:
        return percent(clearance[column].iloc[-1] / clearance[column].iloc[0] - 1.0)

    return (
        f"The printed stresses are those of rings at rest that stay parallel, at 15 degrees in every row: inner "
        f"{percent(inner.min())} to {percent(inner.max())}, outer {percent(outer.min())} to {percent(outer.max())} "
        f"with the text's outer groove of 0.5235. The ratio of the races' stresses is that of 0.53, picked after the fact out "
        f"of six pairs of grooves; it leaves {percent(usual.min())} to {percent(usual.max())} in all, even enough to be the "
        f"elastic constants or the ball's size, which stress alone cannot tell apart (1293 MPa at 50 N is a misprint for 1283). "
        f"No centrifugal force is in them: at 63000 rpm the outer race bears "
        f"{percent(stress['outer_MPa 63000 rpm'].iloc[5] / stress['outer_MPa at rest'].iloc[5] - 1.0)} more at 70 N, "
        f"and an inner ring free to tilt has its least stress at {40.0 + free:.0f} N instead of {40.0 + rest:.0f} N "
        f"({40.0 + fast:.0f} N when held). The printed angles follow that of the most loaded ball (within 0.3 degrees from 60 N on). "
        f"The life column is the catalogue's (C/P)^3, with C = {read_back_capacity():.0f} N read back from its first row (ISO 281 gives {own:.0f} N) and "
        f"ISO 281 factors of 15 degrees within {percent(before_last.min())} to {percent(before_last.max())}, the last row "
        f"(3700 h, where its neighbours lead to {neighbours:.0f} h) apart; so it has no extremum, while "
        f"the life from the ball loads (the paper's eqs 8-10) has one, at {40.0 + lives[0]:.0f} N at rest and "
        f"{40.0 + lives[1]:.0f} N at speed, the ring held. Table 3's rise of {change('life_h paper')} with clearance is not what these "
        f"loads give: {change('life_h at rest')} at rest, {change('life_h 63000 rpm')} at speed, since the most loaded ball takes more of "
        f"the radial load; only the 40 N axial force alone gives a rise, {change('life_h axial load alone')}."
    )


def _draw(path: Path) -> None:
    figure, axes = canvas(2, 2, 5.2, 4.0)
    stress, clearance = table4(), table3()
    (left, right), (below, loads) = axes
    left.plot(stress["axial_N"], stress["inner_MPa paper"], "ko", ms=4, label="paper")
    right.plot(stress["axial_N"], stress["life_h paper"], "ko", ms=4, label="paper")
    right.plot(stress["axial_N"], stress["life_h ISO 281, read back"], "k:", label="ISO 281, C read back")
    below.plot(clearance["clearance_um"], clearance["life_h paper"], "ko", ms=4, label="paper")
    for name in MODELS:
        left.plot(stress["axial_N"], stress[f"inner_MPa {name}"], label=name)
        right.plot(stress["axial_N"], stress[f"life_h {name}"], label=f"ball loads, {name}")
        below.plot(clearance["clearance_um"], clearance[f"life_h {name}"], label=f"ball loads, {name}")
    left.plot(stress["axial_N"], stress["inner_MPa groove 0.53"], "k:", label="at rest, groove 0.53")
    left.set(xlabel="axial force [N]", ylabel="peak stress, inner race [MPa]")
    right.set(xlabel="axial force [N]", ylabel="life at 63000 rpm [h]", yscale="log")
    below.set(xlabel="diametral clearance [um]", ylabel="life at 63000 rpm [h]", yscale="log")
    tilted = tilted_loads()
    for name in tilted.columns[1:]:
        angle = (tilted["azimuth_deg"] + 180.0) % 360.0 - 180.0
        order = np.argsort(angle)
        loads.plot(angle.iloc[order], tilted[name].iloc[order], "o-", ms=3, label=f"tilt {name}")
    loads.set(xlabel="azimuth from the radial load [deg]", ylabel="inner load of a ball [N], at rest")
    for panel in axes.flat:
        panel.legend(fontsize=7)
    save(figure, path)


def main(out: Annotated[Path | None, typer.Option(help="Folder for the numbers and pictures.")] = None) -> None:
    """Regenerate both tables and print what they belong to."""
    tell(preload_and_clearance(), out, "paper_003")


if __name__ == "__main__":
    typer.run(main)
