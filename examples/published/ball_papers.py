"""What two papers on ball bearings state beyond their tables, with ours next to it.

Hu et al. 2021: the finite initial value search on a double-decker bearing (Table 4, Figs 10 and 11). Sensors 2023, 23, 4503:
load, stiffness and life of a small angular contact bearing under radial load and misalignment (Table 2, Figs 7, 9, 10, 11
and 14). Their figures are pictures; what stands here is what their texts say of them.
"""

from __future__ import annotations

import functools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import paper_000_finite_search as hu
import paper_003_preload as sensors

from published.common import Check, Finding, Table, Verdict, canvas, findings_table, percent, save, tally
from published.lundberg_palmgren import plain_capacities
from rbdyn import BallScene
from rbdyn.life.balls import row_life
from rbdyn.quasistatic.row.equilibrium import Solution, solve
from rbdyn.quasistatic.row.model import constraint_of, load_of, row_of

HU, SENSORS = "Hu et al. 2021", "Sensors 2023, 23, 4503"
# Largest difference in a contact angle between their search and Newton's method, double-decker bearing.
HU_GAP_PERCENT = 1.1
# Table 2: radial load [N] and deflection angle [mrad] as printed. From the fourth condition on ten times smaller.
CONDITIONS = ((50, 7.0), (60, 8.0), (70, 9.0), (80, 1.1), (90, 1.2), (100, 1.3))
# The first three in line with the others.
MISPRINT = 0.1
LARGEST_LOAD_N, LARGEST_STIFFNESS_N_MM = 25.0, 1.9e4
# Fig 14: at 200 N radial.
DEFLECTIONS_MRAD = (1.3, 1.6, 1.9, 2.2, 2.5, 2.8)
# An "overall small" change of life.
SMALL = 0.2
# How the inner ring may stand: held axially where it just touches, for Table 2 states no axial force, or under the paper's
# working 40 N; at rest, as the stresses of its tables are.
HELD, WORKING = "held axially", "40 N axial"


def agrees(holds: bool) -> Verdict:
    """Of a statement without an error of its own."""
    return "agrees" if holds else "differs"


def span(values: pd.Series) -> str:
    """Least and largest of whole numbers, one where they are equal."""
    low, high = values.min(), values.max()
    return f"{low}" if low == high else f"{low} to {high}"


def double_decker_search() -> Check:
    """Hu et al. 2021, Table 4 and Figs 10 and 11: their search on the double-decker bearing, theirs and ours."""
    frame = hu.table_4_frame(hu.table_4())
    found = search_findings(frame)
    table = Table(
        "Table 4: searches and seconds, theirs and ours",
        ("Fa [N], rpm", "searches: theirs", "ours", "seconds: theirs", "ours", "nearest start", "gap of angles [%]"),
        tuple(
            (f"{r.axial:g}, {r.speed:g}", f"{r.their_searches}", f"{r.searches}", f"{r.their_seconds:g}",
             f"{r.search_s:.2f}", f"{r.nearest_search}", f"{r.gap_percent:.0e}")
            for r in frame.itertuples()
        ),
    )  # fmt: skip
    return Check(
        "Double-decker ball bearing: the finite initial value search of Hu et al. 2021",
        (table, findings_table(found)),
        f"Of what is published: {tally(found)}. The search solves all {len(frame)} conditions. The first start, where no contact "
        "is loaded, leads nowhere, and the second converges whatever the load. How far a search goes at a time is not in "
        "the paper, so its counts and the fall of its offsets cannot be had again.",
        frame,
        lambda path: hu.draw_figure_10(hu.table_4()[:4], path),
        found,
    )


def search_findings(frame: pd.DataFrame) -> tuple[Finding, ...]:
    """Statements on Table 4 and Figs 10 and 11, from ``paper_000_finite_search.table_4_frame``."""
    theirs, ours = frame["their_searches"], frame["searches"]
    speeds = frame.groupby("axial")
    rises = all(group["searches"].is_monotonic_increasing and group["searches"].nunique() > 1 for _, group in speeds)
    swing = {
        layer: max(float(np.ptp(group[f"{layer}_layer_inner_deg"])) for _, group in speeds)
        for layer in ("inner", "outer")
    }
    spreads = all(
        group[f"{layer}_layer_inner_deg"].is_monotonic_increasing
        and group[f"{layer}_layer_outer_deg"].is_monotonic_decreasing
        for layer in ("inner", "outer")
        for _, group in speeds
    )
    gap = float(frame["gap_percent"].max())
    falls = bool((frame["nearest_search"] >= theirs).all())
    text = "model against model"
    return (
        Finding(
            "the search solves every condition in a few attempts (Table 4)", HU, "trend",
            f"{(frame['status'] == 'ok').sum()} of {len(frame)} conditions",
            agrees(bool((frame["status"] == "ok").all() and (ours <= theirs).all())),
        ),
        Finding(
            f"{span(theirs)} searches a condition (Table 4)", HU, text,
            f"{span(ours)} searches, so {span(theirs - ours)} fewer", agrees(bool((ours == theirs).all())),
        ),
        Finding(
            f"a condition takes {frame['their_seconds'].min():.0f} to {frame['their_seconds'].max():.0f} s (Table 4)", HU, text,
            f"{frame['search_s'].min():.2f} to {frame['search_s'].max():.2f} s, the convex solver "
            f"{1e-3 * frame['convex_us'].min():.1f} to {1e-3 * frame['convex_us'].max():.1f} ms: other machine and language",
            "untested",
        ),
        Finding(
            "searches rise with speed and axial load (Table 4)", HU, "trend",
            f"{span(ours)} in every condition", agrees(rises),
        ),
        Finding(
            "with speed inner angles rise and outer angles fall in both layers (Fig 10)", HU, "trend",
            "so in every group" if spreads else "not in every group", agrees(spreads),
        ),
        Finding(
            "the outer layer's angles hardly change with speed (Fig 10)", HU, "trend",
            f"inner angles rise by up to {swing['outer']:.2f} deg, in the inner layer by {swing['inner']:.2f} deg",
            agrees(swing["outer"] < 0.1 * swing["inner"]),
        ),
        Finding(
            f"two methods differ by at most {HU_GAP_PERCENT} % in a contact angle (Fig 10)", HU, text,
            f"search and convex solver by {gap:.0e} %", agrees(gap <= HU_GAP_PERCENT),
        ),
        Finding(
            "the offset from the solution falls from search to search (Fig 11)", HU, "trend",
            f"start {span(frame['nearest_search'])} is nearest to the solution; the last one tried lies "
            f"{frame['offset_um'].min():.0f} to {frame['offset_um'].max():.0f} um off", agrees(falls),
        ),
    )  # fmt: skip


def least_ball_load(radial: float, balls: int) -> float:
    """Least load of the most loaded ball [N] that any equilibrium under a radial load [N] allows.

    sum Q cos a cos psi = F_r with Q >= 0 and cos a <= 1, so F_r is at most Q_max times the sum of the positive cosines. That is
    largest with a ball in the load direction or two astride it: 1/sin(pi/Z) for an even Z, 1/(2 sin(pi/(2 Z))) for an odd one.
    """
    cosines = [
        np.maximum(np.cos(2.0 * np.pi * (np.arange(balls) + share) / balls), 0.0).sum() for share in (0.0, 0.25, 0.5)
    ]
    return radial / float(max(cosines))


def small_bearing(radial: float, tilt_mrad: float = 0.0, ring: str = HELD) -> Any:
    """The paper's bearing at rest under a radial load [N], its inner ring as ``ring`` says, misaligned so that the most loaded
    ball takes more."""
    scene = sensors.bearing(0.0 if ring == HELD else sensors.WORKING_AXIAL_N, radial=radial, tilt_mrad=-tilt_mrad)
    if ring != HELD:
        return scene
    data = scene.model_dump(exclude_none=True)
    data["operation"]["prescribed"] = {**data["operation"]["prescribed"], "z_mm": 0.0}
    return BallScene.from_dict(data, SENSORS)


def figures_of(radial: float, tilt_mrad: float = 0.0, ring: str = HELD) -> dict[str, float]:
    """Largest ball load [N], radial displacement [um], F_r over it (eq 7) [N/mm], life at 63000 rpm [h]."""
    scene = small_bearing(radial, tilt_mrad, ring)
    model = row_of(scene)
    found: Solution = solve(model.row, model.control, load_of(scene), constraint_of(scene))
    if not found.is_equilibrium:
        raise RuntimeError(found.status)
    life = row_life(found.inner_load, found.outer_load, plain_capacities(scene.bearing), "inner")
    return {
        "load_N": float(found.inner_load.max()),
        "displacement_um": 1e6 * float(found.displacement[0]),
        "stiffness_N_mm": 1e-3 * radial / float(found.displacement[0]),
        "life_h": life.hours(sensors.SPEED_RPM * math.pi / 30.0),
    }


@functools.cache
def conditions() -> pd.DataFrame:
    """Table 2 by ours: without deflection, ring held or under 40 N, and with the deflections as printed and in line."""
    records = []
    for radial, tilt in CONDITIONS:
        line = tilt * (MISPRINT if tilt > 2.0 else 1.0)
        record: dict[str, float] = {"radial_N": radial, "deflection_mrad": tilt}
        cases = {HELD: (0.0, HELD), WORKING: (0.0, WORKING), "as printed": (tilt, WORKING), "in line": (line, WORKING)}
        for name, (mrad, ring) in cases.items():
            record |= {f"{key} {name}": value for key, value in figures_of(radial, mrad, ring).items()}
        records.append(record)
    return pd.DataFrame(records)


@functools.cache
def deflections() -> pd.DataFrame:
    """Fig 14: life at 200 N radial by deflection, which loads the most loaded ball more, or less."""
    records = []
    for tilt in DEFLECTIONS_MRAD:
        more, less = (figures_of(sensors.TILTED_RADIAL_N, sign * tilt, WORKING)["life_h"] for sign in (1.0, -1.0))
        records.append({"deflection_mrad": tilt, "life_h": more, "life_h other sense": less})
    return pd.DataFrame(records)


def angular_contact() -> Check:
    """Sensors 2023: what its text says of Table 2 and Figs 7, 9, 10, 11 and 14."""
    frame, tilted = conditions(), deflections()
    found = angular_findings(frame, tilted)
    columns = {
        f"load_N {HELD}": "load [N]: held axially", f"load_N {WORKING}": "40 N axial", "load_N as printed": "with deflection",
        "load_N in line": "first three a tenth", f"displacement_um {HELD}": "shift [um]: held",
        "displacement_um in line": "with deflection", f"stiffness_N_mm {HELD}": "stiffness [N/mm]: held",
        f"stiffness_N_mm {WORKING}": "40 N axial", f"life_h {HELD}": "life [h]: held", f"life_h {WORKING}": "40 N axial",
    }  # fmt: skip
    rows = tuple(
        (f"{row['radial_N']:g} N, {row['deflection_mrad']:g} mrad", *(f"{row[key]:.3g}" if abs(row[key]) < 1e3 else f"{row[key]:.0f}" for key in columns))
        for row in frame.to_dict("records")
    )  # fmt: skip
    lives = tuple(
        (f"{r.deflection_mrad:g}", f"{r.life_h:.0f}", f"{other:.0f}")
        for r, other in zip(tilted.itertuples(), tilted["life_h other sense"], strict=True)
    )
    least = least_ball_load(100.0, sensors.BALLS)

    def draw(path: Path) -> None:
        figure, axes = canvas(1, 3)
        for axis, key, label in zip(
            axes[0], ("load_N", "stiffness_N_mm", "life_h"),
            ("largest ball load [N]", "radial stiffness [N/mm]", "life [h]"), strict=True,
        ):  # fmt: skip
            for ring in (HELD, WORKING):
                axis.plot(frame["radial_N"], frame[f"{key} {ring}"], "o-", label=ring)
            axis.set(xlabel="radial load [N]", ylabel=label)
        axes[0][0].plot(100.0, LARGEST_LOAD_N, "k*", label="paper")
        axes[0][1].plot(100.0, LARGEST_STIFFNESS_N_MM, "k*", label="paper")
        axes[0][0].axhline(least, color="k", linestyle=":", label="least by equilibrium at 100 N")
        axes[0][2].set_yscale("log")
        for axis in axes[0]:
            axis.legend(fontsize=7)
        save(figure, path)

    return Check(
        "Angular contact ball bearing: load, stiffness and life under radial load and deflection (Sensors 2023)",
        (
            Table("Table 2, ours at rest", ("condition", *columns.values()), rows),
            Table(
                "Life [h] at 200 N radial by deflection", ("mrad", "loads the most loaded ball", "other sense"), lives
            ),
            findings_table(found),
        ),
        f"Of what is published: {tally(found)}. A largest ball load of {LARGEST_LOAD_N:g} N at 100 N is impossible: a ball gives the "
        f"ring Q cos a cos psi at most, balls of the other half push back, and {sensors.BALLS} balls of {LARGEST_LOAD_N:g} N "
        f"each hold {100.0 * LARGEST_LOAD_N / least:.0f} N. Table 2 states no axial force: held axially the largest load is "
        "Stribeck's 4.37 F/(Z cos a). The paper does not state in which sense the ring is deflected.",
        frame,
        draw,
        found,
    )


def angular_findings(frame: pd.DataFrame, tilted: pd.DataFrame) -> tuple[Finding, ...]:
    """Statements of the text, from ``conditions`` and ``deflections``."""
    last = frame.iloc[-1]
    load, working = last[f"load_N {HELD}"], last[f"load_N {WORKING}"]
    least = least_ball_load(float(last["radial_N"]), sensors.BALLS)
    stiffness, preloaded = frame[f"stiffness_N_mm {HELD}"], frame[f"stiffness_N_mm {WORKING}"]
    life = frame[f"life_h {HELD}"].to_numpy()
    drops = -np.diff(life)
    change = tilted["life_h"].iloc[-1] / tilted["life_h"].iloc[0] - 1.0
    other = tilted["life_h other sense"].iloc[-1] / tilted["life_h other sense"].iloc[0] - 1.0
    printed, line = frame["load_N as printed"], frame["load_N in line"]
    shifts = frame[f"displacement_um {HELD}"]
    text = "model against model"
    return (
        Finding(
            f"largest ball load {LARGEST_LOAD_N:g} N at 100 N radial (Fig 9)", SENSORS, text,
            f"{load:.1f} N held axially ({percent(load / LARGEST_LOAD_N - 1.0)}), {working:.1f} N under 40 N axial; "
            f"equilibrium allows none below {least:.1f} N", agrees(least <= LARGEST_LOAD_N),
        ),
        Finding(
            "ball loads rise with radial load (Fig 9)", SENSORS, "trend",
            f"{frame[f'load_N {HELD}'].iloc[0]:.1f} to {load:.1f} N",
            agrees(bool(frame[f"load_N {HELD}"].is_monotonic_increasing)),
        ),
        Finding(
            "radial stiffness rises with radial load (Fig 10)", SENSORS, "trend",
            f"held axially {stiffness.iloc[0]:.0f} to {stiffness.iloc[-1]:.0f} N/mm; under 40 N axial it goes from "
            f"{preloaded.iloc[0]:.0f} to {preloaded.iloc[-1]:.0f} N/mm", agrees(bool(stiffness.is_monotonic_increasing)),
        ),
        Finding(
            f"radial stiffness {LARGEST_STIFFNESS_N_MM:.0f} N/mm at most, at 100 N (Fig 10)", SENSORS, text,
            f"{stiffness.iloc[-1]:.0f} N/mm held axially ({percent(stiffness.iloc[-1] / LARGEST_STIFFNESS_N_MM - 1.0)})",
            agrees(abs(stiffness.iloc[-1] / LARGEST_STIFFNESS_N_MM - 1.0) < 0.09),
        ),
        Finding(
            "life falls with radial load, ever more slowly (Fig 11)", SENSORS, "trend",
            f"{life[0]:.0f} to {life[-1]:.0f} h, by {drops[0]:.0f} h at first and {drops[-1]:.0f} h at last",
            agrees(bool((drops > 0.0).all() and (np.diff(drops) < 0.0).all())),
        ),
        Finding(
            "life falls little with deflection, 1.3 to 2.8 mrad at 200 N (Fig 14)", SENSORS, "trend",
            f"{percent(change)} where it loads the most loaded ball, {percent(other)} in the other sense",
            agrees(-SMALL < change < 0.0),
        ),
        Finding(
            "ball loads rise from condition 1 to 6 (Table 2 and Fig 9)", SENSORS, text,
            f"{', '.join(f'{one:.0f}' for one in printed)} N with the deflections as printed, {', '.join(f'{one:.0f}' for one in line)} N "
            "with the first three a tenth: misprints", agrees(bool(printed.is_monotonic_increasing)),
        ),
        Finding(
            "radial displacements of a finite-element model within 9 % of its theory (Fig 7)", SENSORS, text,
            f"{shifts.iloc[0]:.2f} to {shifts.iloc[-1]:.2f} um held axially; theirs are in a picture", "untested",
        ),
    )  # fmt: skip
