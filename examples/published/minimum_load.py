"""Cage slip at SKF's minimum load, and at half of it, of six catalogue bearings as ``rbdyn new`` writes them.

A maker asks for a minimum load so that rollers do not skid: slip should be small at it and grow below it. SKF's rule with
its factor by series and the reference speed of the catalogue; 0.7 of that speed, ISO VG 32 at 70 C, an oil bath.
"""

from __future__ import annotations

import functools
import json
import math
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from published.common import Check, Effort, Finding, Table, canvas, error, findings_table, save, tally
from rbdyn import Scene, simulate
from rbdyn.base.words import with_error
from rbdyn.life.rollers import SERIES, minimum_loads
from rbdyn.properties.catalogue import envelope, read_designation

BEARINGS = ("NU 210", "NU 220", "NU 308", "NU 320", "NU 2210", "NU 1020")
SPEED_SHARE = 0.7  # of the reference speed
SHARES = (1.0, 0.5)  # of the minimum load
# From here a cage counts as skidding: 5 to 10 % of slip are usual limits.
SKIDDING = 0.1


def least_load(name: str, speed_rpm: float) -> float:
    """SKF's minimum load [N] of a listed bearing."""
    named = read_designation(name)
    sizes, factor = envelope(named), SERIES[named.series].minimum_load
    assert sizes.reference_speed is not None
    rpm, mean = math.pi / 30.0, 0.5e-3 * (sizes.bore + sizes.outside)
    rules = minimum_loads(mean, speed_rpm * rpm, 0.0, 0.0, (factor, sizes.reference_speed * rpm))
    return rules[f"SKF, k_r = {factor:g}"]


@functools.cache
def tables(name: str, speed_rpm: float, load_n: float) -> dict[str, Any]:
    """The scene of a designation as tables."""
    point = ("--speed", f"{speed_rpm:g}", "--load", f"{load_n:g}", "--oil", "ISO VG 32", "--temperature", "70")
    words = [sys.executable, "-m", "rbdyn", "new", name, *point, "--json"]
    found: dict[str, Any] = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
    return found


def minimum_load(effort: Effort, names: Sequence[str] = BEARINGS) -> Check:
    """Slip of each bearing at both loads."""
    records = []
    for name in names:
        reference = envelope(read_designation(name)).reference_speed
        assert reference is not None
        speed = SPEED_SHARE * reference
        for share in SHARES:
            load = round(share * least_load(name, speed), 1)
            scene = Scene.from_dict(tables(name, speed, load), name, (*effort.overrides, "numerics.extend=false"))
            result = simulate(scene)
            records.append({"bearing": name, "speed_rpm": speed, "share": share, "load_N": load,
                            "slip": result.cage_slip.value, "slip_error": error(result.cage_slip)})  # fmt: skip
    frame = pd.DataFrame(records)
    found = findings(frame)
    rows = tuple(
        (str(name), f"{part['speed_rpm'].iloc[0]:.0f}", f"{part['load_N'].iloc[0]:.0f}",
         *(with_error(100.0 * row["slip"], 100.0 * row["slip_error"]) for _, row in part.iterrows()))
        for name, part in frame.groupby("bearing", sort=False)
    )  # fmt: skip
    header = ("bearing", "rpm", "SKF's minimum load N", "slip at it %", "slip at half of it %")
    table = Table(f"cage slip at {SPEED_SHARE:g} of the reference speed", header, rows)
    words = "; ".join(f"{finding.words}: {finding.ours}" for finding in found)
    return Check("SKF's minimum load: where skidding sets in", (table, findings_table(found)), f"{words}. {tally(found)}.",
                 frame, lambda path: draw(frame, path), found)  # fmt: skip


def findings(frame: pd.DataFrame) -> tuple[Finding, ...]:
    """Whether cages follow at the minimum load, and lag more at half of it."""
    full, half = (frame[frame["share"] == share].set_index("bearing") for share in SHARES)
    more = half["slip"] - full["slip"] > np.hypot(half["slip_error"], full["slip_error"])
    source = "SKF, minimum load of cylindrical roller bearings"
    low, high = (100.0 * full["slip"].agg(end) for end in ("min", "max"))
    below, above = (100.0 * half["slip"].agg(end) for end in ("min", "max"))
    follows = int((full["slip"] < SKIDDING).sum())
    return (
        Finding(f"no skidding at the minimum load (slip below {100.0 * SKIDDING:.0f} %)", source, "cross-check",
                f"{low:.2g} to {high:.2g} %, {follows} of {len(full)} below",
                "agrees" if follows == len(full) else "differs"),
        Finding("more slip at half of the minimum load", source, "trend",
                f"{below:.2g} to {above:.2g} %, more in {int(more.sum())} of {len(more)}", "agrees" if more.all() else "differs"),
    )  # fmt: skip


def draw(frame: pd.DataFrame, path: Path) -> None:
    """Slip at both loads, a line a bearing."""
    figure, axes = canvas(1, 1, 6.0)
    for name, part in frame.groupby("bearing", sort=False):
        axes[0][0].errorbar(
            part["share"], 100.0 * part["slip"], 100.0 * part["slip_error"], marker="o", label=str(name)
        )
    axes[0][0].set_xlabel("load over SKF's minimum load")
    axes[0][0].set_ylabel("cage slip [%]")
    axes[0][0].grid(alpha=0.3)
    axes[0][0].legend(fontsize=8)
    save(figure, path)
