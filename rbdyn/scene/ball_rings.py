"""What a scene of balls must tell of its rings before their growth can be known."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbdyn.scene import mounting as mountings

if TYPE_CHECKING:
    from rbdyn.scene.ball import BallRow, BallScene


def outermost_rows(scene: BallScene) -> tuple[BallRow, BallRow]:
    """The row on the inner ring and the row in the outer ring: one and the same but in a double-decker bearing."""
    from rbdyn.scene.ball import DoubleDecker

    bearing = scene.bearing
    return (bearing.inner, bearing.outer) if isinstance(bearing, DoubleDecker) else (bearing, bearing)


def ring_faults(scene: BallScene) -> list[str]:
    """One sentence for each diameter or oil that is missing, and for each that is told twice in different ways."""
    found = _unmounted_faults(scene) if scene.mounting is None else _mounted_faults(scene)
    inner, outer = outermost_rows(scene)
    middle = None if inner is outer else scene.bearing.middle  # type: ignore[union-attr]
    if middle is not None and middle.speed_split == "torque_balance" and middle.speed_rpm is None:
        if scene.lubricant is None:
            found.append(
                "lubricant: missing; bearing.middle.speed_split = 'torque_balance' needs its viscosity, or set 'oil'"
            )
        for name, row in (("inner", inner), ("outer", outer)):
            if row.contact_angle == 0.0:
                found.append(
                    f"bearing.{name}.contact_angle_deg = 0: has no load torque after Palmgren; set bearing.middle.speed_split"
                    " = 'oil' or give bearing.middle.speed_rpm"
                )
    return found


def _unmounted_faults(scene: BallScene) -> list[str]:
    if not scene.model.ring_expansion:
        return []
    inner, outer = outermost_rows(scene)
    turning, speed = (
        scene.operation,
        "turns; the growth of its ring needs it; add it, or set model.ring_expansion = false",
    )
    prefix = ("bearing.", "bearing.") if inner is outer else ("bearing.inner.", "bearing.outer.")
    found = []
    if turning.inner_speed_rpm != 0.0 and inner.bore_mm is None:
        found.append(f"{prefix[0]}bore_mm: missing; the inner ring {speed}")
    paper = scene.model.ring_expansion_form == "paper"
    if turning.outer_speed_rpm != 0.0 and outer.outside_diameter_mm is None and not paper:
        found.append(f"{prefix[1]}outside_diameter_mm: missing; the outer ring {speed}")
    if paper and inner is not outer and outer.bore_mm is None:
        found.append(
            "bearing.outer.bore_mm: missing; model.ring_expansion_form = 'paper' takes it for the middle ring's; add it"
        )
    return found


def _mounted_faults(scene: BallScene) -> list[str]:
    assert scene.mounting is not None
    mounting = scene.mounting
    inner, outer = outermost_rows(scene)
    found = mountings.faults(mounting, scene.bearing)
    for key, told, row in (
        ("bore_mm", mounting.bore_mm, inner),
        ("outside_diameter_mm", mounting.outside_diameter_mm, outer),
    ):
        drawn = getattr(row, key)
        if drawn is not None and drawn != told:
            found.append(
                f"mounting.{key} = {told:g} and the bearing's {key} = {drawn:g} contradict each other: leave the bearing's out"
            )
    for row in {id(row): row for row in (inner, outer)}.values():
        if row.clearance_change_um != 0.0:
            found.append(
                f"clearance_change_um = {row.clearance_change_um:g} and [mounting] both tell what mounting changes; leave one out"
            )
    if scene.model.ring_expansion and scene.model.ring_expansion_form == "paper":
        found.append(
            "model.ring_expansion_form = 'paper' knows no fits; take [mounting] away or set it to 'thick_ring'"
        )
    return found
