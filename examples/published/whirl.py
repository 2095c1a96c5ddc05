"""Check 6: cage whirl as the guide land loses its oil: where the cage leaves the film and strikes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from published.common import (
    CHEN,
    LAWS,
    Check,
    Effort,
    Finding,
    Table,
    canvas,
    error,
    findings_table,
    save,
    simulated,
    tally,
)
from rbdyn import History, Scene, history
from rbdyn.base.words import with_error

FILLS = (1.0, 0.3, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)
PAPER = (0.72, 0.96)
ISOTROPIC = math.sqrt(4.0 / math.pi - 1.0)
# Share of time in dry contact above which a cage rubs along the land rather than strikes it.
RUBBING = 0.5


def motion(run: History) -> dict[str, float]:
    """Eccentricity over clearance, mean and deviation; whirl over cage speed; dry contacts a cage turn and their share."""
    x, y = run.guide_eccentricity
    size = np.hypot(x, y) / run.scene.guide_clearance_m
    duration = run.time[-1] - run.time[0]
    angle = np.unwrap(np.arctan2(y, x))
    touching = run.land_load > 0.0
    turned = run.cage_angle[-1] - run.cage_angle[0]
    return {
        "eccentricity": float(size.mean()),
        "eccentricity_deviation": float(size.std()),
        "whirl_speed_ratio": float((angle[-1] - angle[0]) / duration / (turned / duration)),
        "dry_share": float(touching.mean()),
        "contacts_per_turn": float((np.diff(touching.astype(int)) == 1).sum() / (turned / (2.0 * math.pi))),
    }


def regime(dry_share: float, contacts: float) -> str:
    """In words."""
    if contacts == 0.0 and dry_share == 0.0:
        return "in the film"
    return "rubs along the land" if dry_share > RUBBING else "strikes the land"


def whirl(
    effort: Effort, fills: Sequence[float] = FILLS, laws: Sequence[str] = LAWS, history_turns: float = 20.0
) -> Check:
    """Whirl deviation ratio and the cage's motion against the fill of the guide land."""
    records = []
    for law in laws:
        for fill in fills:
            overrides = (f"model.land_fill={fill}", f"traction.model={law}")
            result = simulated(CHEN, effort, overrides)
            scene = Scene.load(CHEN, (*effort.overrides, *overrides))
            moved = motion(history(scene, history_turns))
            records.append({
                "law": law, "fill": fill, "ratio": result.whirl_deviation_ratio.value,
                "ratio_error": error(result.whirl_deviation_ratio), **moved,
                "land_N": result.loads.max_land_N, "impact_N": result.impact_force_N.value,
                "impact_error": error(result.impact_force_N), "slip": result.cage_slip.value,
                "regime": regime(moved["dry_share"], moved["contacts_per_turn"]),
            })  # fmt: skip
    frame = pd.DataFrame(records)
    rows = tuple(
        (
            row["law"], f"{row['fill']:g}", with_error(row["ratio"], row["ratio_error"]),
            with_error(row["eccentricity"], row["eccentricity_deviation"]), f"{round(row['whirl_speed_ratio'], 2) + 0.0:.2f}",
            f"{100.0 * row['dry_share']:.1f}", f"{row['contacts_per_turn']:.1f}", f"{row['land_N']:.0f}",
            with_error(row["impact_N"], row["impact_error"]), f"{100.0 * row['slip']:.2f}", row["regime"],
        )
        for row in records
    )  # fmt: skip

    def draw(path: Path) -> None:
        figure, axes = canvas(1, 2, 5.0)
        for law, part in frame.groupby("law", sort=False):
            axes[0][0].errorbar(part["fill"], part["ratio"], part["ratio_error"], marker="o", label=law)
            axes[0][1].plot(part["fill"], part["contacts_per_turn"], "o-", label=law)
        axes[0][0].axhspan(*PAPER, alpha=0.15, label="Chen et al. 2022, Table 4")
        axes[0][0].axhline(ISOTROPIC, color="black", linewidth=0.8, linestyle=":", label="isotropic random velocity")
        axes[0][0].set_ylabel("cage whirl deviation ratio")
        axes[0][1].set_ylabel("dry land contacts a cage turn")
        for axis in axes[0]:
            axis.set_xscale("log")
            axis.set_xlabel("fill of the guide land")
            axis.grid(alpha=0.3)
        axes[0][0].legend(fontsize=8)
        save(figure, path)

    found = findings(frame)
    return Check(
        "Cage whirl against starvation of the guide land",
        (
            Table(
                "24000 rpm, 1300 N; e/c: eccentricity over clearance with its deviation; dry: share of time [%]",
                ("traction law", "fill", "whirl ratio", "e/c", "whirl/cage speed", "dry %", "contacts a turn", "land max N",
                 "impact N", "slip %", "regime"),
                rows,
            ),
            findings_table(found),
        ),
        conclusion(frame, found),
        frame,
        draw,
        found,
    )  # fmt: skip


def findings(frame: pd.DataFrame) -> tuple[Finding, ...]:
    """Their whirl ratios beside ours on the fullest land."""
    found = []
    for law, part in frame.groupby("law", sort=False):
        flooded = part.loc[part["fill"].idxmax()]
        off = max(PAPER[0] - flooded["ratio"], flooded["ratio"] - PAPER[1])
        found.append(
            Finding(
                f"cage whirl deviation ratio of {PAPER[0]:g} to {PAPER[1]:g}", "Chen et al. 2022, Table 4",
                "model against model", f"{with_error(flooded['ratio'], flooded['ratio_error'])} ({law}, fill {flooded['fill']:g})",
                "agrees" if off <= 0.0 else "unclear" if off <= flooded["ratio_error"] else "differs",
            )
        )  # fmt: skip
    return tuple(found)


def conclusion(frame: pd.DataFrame, found: Sequence[Finding]) -> str:
    """Where the film is lost, and what that does to the ratio."""
    parts = []
    for law, part in frame.groupby("law", sort=False):
        dry = part[part["regime"] != "in the film"]
        first = f"from fill {dry['fill'].max():g} down" if len(dry) else "at no fill shown"
        parts.append(
            f"with {law} it touches {first} and the ratio goes from {part['ratio'].iloc[0]:.2f} to "
            f"{part['ratio'].iloc[-1]:.2f}"
        )
    reaches = "reaches" if frame["ratio"].max() > PAPER[0] else "does not reach"
    return (
        f"The flooded land carries the cage without contact; {'; '.join(parts)}. An isotropic random velocity would give "
        f"{ISOTROPIC:.2f}; starvation alone {reaches} the paper's {PAPER[0]:.2f} to {PAPER[1]:.2f}. {tally(found)}."
    )
