"""A page of HTML that plays the motion of the bearing: no file beside it, nothing fetched, readable on paper."""

import html
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rbdyn.arrays import Array
from rbdyn.plots.drawing import Drawing, Shape, drawing, shapes

if TYPE_CHECKING:
    from rbdyn.dynamics.motion.history import History

TURNS = 3.0
FRAMES_PER_TURN = 128
# About 5 bytes each: the page stays below 3 MB however many rollers there are.
MOST_NUMBERS = 400_000
PER_ROLLER, PER_FRAME = 6, 9
TEMPLATE = Path(__file__).with_name("player.html")
BEARING = Path(__file__).with_name("bearing.js")


def player_html(history: "History") -> str:
    """The page, of up to three shaft turns about the largest pocket force; rounded to 0.1 um, 1 mrad and four digits."""
    most_frames = MOST_NUMBERS // (PER_ROLLER * history.scene.bearing.rollers + PER_FRAME)
    picture = drawing(history, TURNS, FRAMES_PER_TURN, most_frames)
    record = json.dumps(motion_record(history, picture), separators=(",", ":"), allow_nan=False)
    page = TEMPLATE.read_text(encoding="utf-8").replace("{{BEARING}}", BEARING.read_text(encoding="utf-8"))
    # Data last, so that nothing in it can be taken for a mark to be replaced.
    return page.replace("{{FIRST_FRAME}}", _svg(picture)).replace("{{DATA}}", record.replace("<", "\\u003c"))


def motion_record(history: "History", d: Drawing) -> dict[str, Any]:
    """What ``bearing.js`` draws: sizes [mm], and the motion as flat lists, frame after frame."""
    turn = 2.0 * np.pi
    scene = history.scene
    return {
        "title": f"{d.rollers} rollers, {scene.operation.inner_speed_rpm:g} rpm, {scene.operation.radial_load_N:g} N",
        "frames": len(d.time),
        "rollers": d.rollers,
        "turn_s": scene.turn_s,
        **{
            name: round(getattr(d, name), 6)
            for name in (
                "pitch", "roller", "cage_half", "outer_gap", "inner_gap", "pocket_gap", "guide_gap", "guide_side",
                "race_scale", "cage_scale", "extent", "magnification",
            )
        },
        "references": [
            [*(round(x, 3) for place in each.arrow.points for x in place), each.words, round(each.u, 3)]
            for each in d.references
        ],
        # Rounded down, so that at its upper end all still fits.
        "largest_magnification": float(np.floor(d.largest_magnification * 10.0) / 10.0),
        "time_us": _numbers(d.time * 1e6, 1),
        "inner_angle": _numbers(d.inner_angle % turn, 3),
        "outer_angle": _numbers(d.outer_angle % turn, 3),
        "cage_angle": _numbers(d.cage_angle % turn, 4),
        **{f"{name}_um": _numbers(1e3 * getattr(d, name), 1) for name in ("cage_x", "cage_y", "ring_x", "ring_y")},
        **{f"{name}_um": _numbers(1e3 * getattr(d, name), 1) for name in ("ahead", "out")},
        "spin": _numbers(d.spin % turn, 2),
        **{f"{name}_N": _digits(getattr(d, name)) for name in ("outer_load", "inner_load", "pocket_load", "land_load")},
    }  # fmt: skip


def _numbers(values: Array, decimals: int) -> list[float]:
    """Flat, frame after frame; whole numbers without a point."""
    return [int(x) if x == int(x) else x for x in np.round(values, decimals).ravel().tolist()]


def _digits(loads: Array) -> list[float]:
    """To a ten-thousandth of the largest: finer than a line is wide."""
    largest = float(np.abs(loads).max())
    return _numbers(loads, 3 - int(np.floor(np.log10(largest))) if largest > 0.0 else 0)


def _svg(d: Drawing) -> str:
    """The first frame as an inline picture: shown without scripts and on paper."""
    side = d.extent
    body = "".join(_element(shape) for shape in shapes(d, 0, d.magnification))
    for each in d.references:
        body += _element(each.arrow)
        body += f'<text x="{each.u:.2f}" y="{each.v + 0.018 * side:.2f}">{html.escape(each.words)}</text>'
    words = html.escape(f"First frame; clearances magnified {d.magnification:g} times, rollers drawn smaller.")
    return (
        f'<svg viewBox="{-side:.2f} {-side:.2f} {2 * side:.2f} {2 * side:.2f}" style="--unit:{side / 33:.4f}px" role="img" aria-label="{words}">'
        '<defs><marker id="tip" viewBox="0 0 6 6" refX="5" refY="3" markerWidth="3" markerHeight="3" orient="auto">'
        f'<path d="M0 0 6 3 0 6z" fill="context-stroke"/></marker></defs>{body}</svg><p>{words}</p>'
    )


def _element(shape: Shape) -> str:
    role = shape.role
    (u, v), last = shape.points[0], shape.points[-1]
    if shape.kind == "circle":
        return f'<circle class="{role}" cx="{u:.2f}" cy="{v:.2f}" r="{shape.radius:.2f}"/>'
    if shape.kind == "polygon":
        corners = " ".join(f"{p:.2f},{q:.2f}" for p, q in shape.points)
        return f'<polygon class="{role}" points="{corners}"/>'
    tip = ' marker-end="url(#tip)"' if shape.kind == "arrow" else ""
    return f'<line class="{role}" x1="{u:.2f}" y1="{v:.2f}" x2="{last[0]:.2f}" y2="{last[1]:.2f}"{tip}/>'
