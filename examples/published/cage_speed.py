"""Chen et al. 2022, Fig. 8, the only measurement in the five source papers: cage speed at 1200 N, 20 to 32 thousand rpm.

A high-speed camera followed a mark on the cage. The text states neither speeds nor differences, only that simulation and test
were "generally close" and "the trend was mostly the same"; clearances and cage of the tested bearing are not stated either.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from published.common import CHEN, Check, Effort, Finding, Table, canvas, error, findings_table, save, simulated, tally
from rbdyn.base.words import with_error

SPEEDS_RPM = tuple(range(20000, 32001, 2000))
LOAD_N = 1200
SOURCE = "Chen et al. 2022, Fig. 8 (text; values are in a picture)"


def cage_speed(effort: Effort, speeds: Sequence[int] = SPEEDS_RPM) -> Check:
    """Cage speed and slip of the example bearing at their seven speeds."""
    records = []
    for speed in speeds:
        result = simulated(CHEN, effort, (f"operation.inner_speed_rpm={speed}", f"operation.radial_load_N={LOAD_N}"))
        cage, slip = result.cage_speed_rpm, result.cage_slip
        records.append(
            {
                "shaft_rpm": speed,
                "cage_rpm": cage.value,
                "cage_rpm_error": error(cage),
                "slip": slip.value,
                "slip_error": error(slip),
                "kinematic_rpm": cage.value / (1.0 - slip.value),
            }
        )
    frame = pd.DataFrame(records)
    found = findings(frame)
    rows = tuple(
        (
            f"{r.shaft_rpm:g}", with_error(r.cage_rpm, r.cage_rpm_error), f"{r.kinematic_rpm:.0f}",
            with_error(100.0 * r.slip, 100.0 * r.slip_error), "not in the text",
        )
        for r in frame.itertuples()
    )  # fmt: skip

    def draw(path: Path) -> None:
        figure, axes = canvas(1, 1, 6.0)
        axes[0][0].errorbar(frame["shaft_rpm"], frame["cage_rpm"], frame["cage_rpm_error"], marker="o", label="rbdyn")
        axes[0][0].plot(frame["shaft_rpm"], frame["kinematic_rpm"], "k:", label="rolling without slip")
        axes[0][0].set(xlabel="shaft speed [rpm]", ylabel="cage speed [rpm]")
        axes[0][0].legend(fontsize=8)
        save(figure, path)

    header = ("shaft [rpm]", "cage [rpm]", "rolling without slip [rpm]", "slip [%]", "measured [rpm]")
    return Check(
        "Chen et al. 2022, Fig. 8: measured cage speed at 1200 N",
        (Table("cage speed, ours", header, rows), findings_table(found)),
        f"Of what is published: {tally(found)}. The measured speeds are in a picture; with those numbers this table is the test.",
        frame,
        draw,
        found,
    )


def findings(frame: pd.DataFrame) -> tuple[Finding, ...]:
    """The measurement that is not in the text, and the trend that is."""
    first, last = frame.iloc[0], frame.iloc[-1]
    slips = 100.0 * frame["slip"]
    span = f"{first['cage_rpm']:.0f} to {last['cage_rpm']:.0f} rpm"
    return (
        Finding(
            f"cage speed at {LOAD_N} N, {first['shaft_rpm']:.0f} to {last['shaft_rpm']:.0f} rpm", SOURCE, "measured",
            f"{span}, slip {slips.min():.2f} to {slips.max():.2f} %; untested: values are in a picture", "untested",
        ),
        Finding(
            "cage speed follows shaft speed ('the trend was mostly the same')", SOURCE, "trend", span,
            "agrees" if frame["cage_rpm"].is_monotonic_increasing else "differs",
        ),
    )  # fmt: skip
