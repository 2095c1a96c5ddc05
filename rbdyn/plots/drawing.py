"""The bearing at one moment as circles, lines and arrows, with visible clearances, and the page that plays it.

Clearances are a thousandth of the rollers. So the drawing magnifies every play and every deviation from the ideal place by
``magnification``. At the ideal place a roller is in the middle of its pocket and half-way between the raceways. Cage and
inner ring are in the middle. Rollers are smaller than in reality to make room. Bodies that touch in the bearing touch in the
drawing. The centre of the outer ring is the origin. Paper coordinates: u to the right, v down, the load points down.

The page is one HTML file that fetches nothing and is readable on paper.
"""

import html
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.records import Record

if TYPE_CHECKING:
    from rbdyn.dynamics.motion import History
    from rbdyn.scene import Scene


# Radius of a roller in the drawing over the true one; half-width of the cage and of a ring over that.
ROLLER_SHARE, CAGE_SHARE, RING_SHARE = 0.62, 0.4, 0.45
# The longest arrows, in pitch radii.
RACE_ARROW, CAGE_ARROW = 0.32, 0.32
TIDY = (1.0, 2.0, 5.0)
# Columns of a history that go into the drawing unchanged.
AS_SAMPLED = ("time", "inner_angle", "cage_angle", "outer_load", "inner_load", "pocket_load", "land_load")


class Shape(NamedTuple):
    """``kind``: 'circle' (centre, then radius in ``radius``), 'polygon', 'line' or 'arrow' (tail, tip); points in mm."""

    kind: str
    role: str
    points: list[tuple[float, float]]
    radius: float = 0.0


class Reference(NamedTuple):
    """An arrow of a known force, and its words with the place where they begin [mm]."""

    arrow: Shape
    words: str
    u: float
    v: float


class Drawing(Record):
    """Sizes [mm] and motion: (frames,) or (frames, rollers); deviations in mm, angles in rad."""

    rollers: int
    pitch: float
    roller: float
    cage_half: float
    outer_gap: float
    inner_gap: float
    pocket_gap: float
    guide_gap: float
    guide_side: float  # +1 outer land, -1 inner land, 0 none
    largest_magnification: float
    race_scale: float  # N per mm of arrow
    cage_scale: float
    turns: float
    start: float  # shaft turns after the transient
    time: Array
    inner_angle: Array
    outer_angle: Array
    cage_angle: Array
    cage_x: Array
    cage_y: Array
    ring_x: Array
    ring_y: Array
    ahead: Array
    out: Array
    spin: Array
    outer_load: Array
    inner_load: Array
    pocket_load: Array
    land_load: Array

    @property
    def magnification(self) -> float:
        """The largest round one that fits."""
        return tidy(self.largest_magnification)

    @property
    def extent(self) -> float:
        """Half the side of a square around everything [mm]."""
        gap = self.largest_magnification * max(self.outer_gap, 0.0)
        return 1.03 * (self.pitch + (1.0 + RING_SHARE) * self.roller + gap + RACE_ARROW * self.pitch)

    @property
    def references(self) -> list[Reference]:
        """Arrows at the lower left, the scales of forces."""
        u = -0.97 * self.extent
        arrows = []
        for line, (role, words, longest, scale) in enumerate(
            (
                ("outer_force", "outer raceway", RACE_ARROW, self.race_scale),
                ("inner_force", "inner raceway", RACE_ARROW, self.race_scale),
                ("cage_force", "on the cage", CAGE_ARROW, self.cage_scale),
            )
        ):
            down = self.extent * (0.83 + 0.07 * line)
            force = tidy(0.8 * longest * self.pitch * scale)
            arrow = Shape("arrow", role, [(u, down), (u + force / scale, down)])
            arrows.append(Reference(arrow, f"{words}, {force:g} N", u + 0.3 * self.pitch, down))
        return arrows


def tidy(value: float) -> float:
    """The largest of 1, 2, 5, 10, ... not above ``value``."""
    decade = 10.0 ** math.floor(math.log10(value) + 1e-12)
    return max(digit * decade for digit in TIDY if digit * decade <= value * (1.0 + 1e-9))


def drawing(history: "History", turns: float, frames_per_turn: int, most_frames: int = 2000) -> Drawing:
    """Frames at equal intervals from ``turns`` shaft turns about the largest pocket force."""
    from rbdyn.dynamics.motion import largest

    scene, z = history.scene, history.scene.bearing.rollers
    interval = float(history.time[1] - history.time[0])
    per_turn = scene.turn_s / interval
    window = min(round(turns * per_turn), len(history.time))
    stride = max(round(per_turn / frames_per_turn), math.ceil(window / most_frames), 1)
    peak = round(largest(history, history.pocket_load).time / interval)
    first = min(max(peak - window // 2, 0), len(history.time) - window)
    frames = slice(first, first + window, stride)
    sizes = _sizes(scene)
    pitch = sizes["pitch"]
    place = np.arange(z) * (2.0 * np.pi / z)
    x = history.roller_x[frames] - history.outer_x[frames, None]
    y = history.roller_y[frames] - history.outer_y[frames, None]
    lead = np.arctan2(y, x) - history.cage_angle[frames, None] - place
    turned = np.cumsum(history.roller_spin, axis=0)[frames] * interval
    race = max(float(history.outer_load.max()), float(history.inner_load.max()), 1e-9)
    cage = max(float(np.abs(history.pocket_load).max()), float(history.land_load.max()), 1e-9)
    return Drawing(
        rollers=z,
        **sizes,
        race_scale=race / (RACE_ARROW * pitch),
        cage_scale=cage / (CAGE_ARROW * pitch),
        turns=window * interval / scene.turn_s,
        start=first * interval / scene.turn_s,
        outer_angle=scene.operation.speeds[1] * history.time[frames],
        cage_x=1e3 * (history.cage_x - history.outer_x)[frames],
        cage_y=1e3 * (history.cage_y - history.outer_y)[frames],
        ring_x=1e3 * (history.ring_x - history.outer_x)[frames],
        ring_y=1e3 * (history.ring_y - history.outer_y)[frames],
        ahead=pitch * ((lead + np.pi) % (2.0 * np.pi) - np.pi),
        out=1e3 * np.hypot(x, y) - pitch,
        spin=turned,
        **{name: getattr(history, name)[frames] for name in AS_SAMPLED},
    )


def ideal(scene: "Scene", turned: float = 0.0) -> Drawing:
    """One frame of the bearing at rest, every body at its ideal place: the first roller at the angle ``turned`` [rad]."""
    z = scene.bearing.rollers
    still, loads = np.zeros(1), np.zeros((1, z))
    motion: dict[str, Any] = {
        **{name: loads if name.endswith("_load") else still for name in AS_SAMPLED},
        **dict.fromkeys(("outer_angle", "cage_x", "cage_y", "ring_x", "ring_y", "land_load"), still),
        **dict.fromkeys(("ahead", "out", "spin"), loads),
        "cage_angle": still + turned,
    }
    return Drawing(rollers=z, **_sizes(scene), race_scale=1.0, cage_scale=1.0, turns=0.0, start=0.0, **motion)


def _sizes(scene: "Scene") -> dict[str, Any]:
    pitch, true_roller = 0.5 * scene.bearing.pitch_diameter_mm, 0.5 * scene.bearing.roller_diameter_mm
    outer, inner = (1e3 * radius for radius in scene.geometry.raceways)
    roller = ROLLER_SHARE * true_roller
    cage_half = CAGE_SHARE * roller
    pocket_gap = 0.5e3 * scene.pocket_clearance_m
    clearance = scene.guide_clearance_m
    guide_gap = 0.0 if clearance is None else 1e3 * clearance
    # The pockets must leave a cross-bar at the inner rim, and the land must stay on its side of the raceway.
    room = 0.93 * (pitch - cage_half) * math.sin(math.pi / scene.bearing.rollers) - roller
    limits = [room / pocket_gap, 0.95 * (roller - cage_half) / guide_gap if guide_gap else math.inf]
    return {
        "pitch": pitch,
        "roller": roller,
        "cage_half": cage_half,
        "outer_gap": outer - pitch - true_roller,
        "inner_gap": pitch - true_roller - inner,
        "pocket_gap": pocket_gap,
        "guide_gap": guide_gap,
        "guide_side": 0.0 if clearance is None else 1.0 if scene.cage.guidance == "outer" else -1.0,
        "largest_magnification": max(min(limits), 1.0),
    }


def shapes(d: Drawing, frame: int, magnification: float) -> list[Shape]:
    """Shapes of one frame, back to front."""
    m = magnification
    outer = d.pitch + d.roller + m * d.outer_gap
    inner = d.pitch - d.roller - m * d.inner_gap
    thick = RING_SHARE * d.roller
    cage = (m * float(d.cage_x[frame]), m * float(d.cage_y[frame]))
    ring = (m * float(d.ring_x[frame]), m * float(d.ring_y[frame]))
    items = [
        Shape("circle", "ring", [(0.0, 0.0)], outer + thick),
        Shape("circle", "space", [(0.0, 0.0)], outer),
        Shape("circle", "ring", [_paper(ring)], inner),
        Shape("circle", "space", [_paper(ring)], inner - 1.6 * thick),
    ]
    for middle, radius, angle in (
        ((0.0, 0.0), outer + 0.5 * thick, d.outer_angle[frame]),
        (ring, inner - 0.8 * thick, d.inner_angle[frame]),
    ):
        items.append(Shape("circle", "mark", [_paper(_polar(middle, radius, float(angle)))], 0.3 * thick))
    land = d.pitch + d.guide_side * (d.cage_half + m * d.guide_gap)
    if d.guide_side:
        items.append(Shape("circle", "land", [_paper((0.0, 0.0) if d.guide_side > 0.0 else ring)], land))
    items += [Shape("polygon", "cage", bar) for bar in _bars(d, frame, m, cage)]
    for side in (-1.0, 1.0):
        items.append(Shape("circle", "rim", [_paper(cage)], d.pitch + side * d.cage_half))
    arrows = []
    for j in range(d.rollers):
        angle = float(d.cage_angle[frame] + 2.0 * np.pi * j / d.rollers + m * d.ahead[frame, j] / d.pitch)
        centre = _polar((0.0, 0.0), d.pitch + m * float(d.out[frame, j]), angle)
        spoke = _polar(centre, 0.8 * d.roller, float(d.spin[frame, j]))
        items.append(Shape("circle", "roller", [_paper(centre)], d.roller))
        items.append(Shape("line", "spoke", [_paper(centre), _paper(spoke)]))
        for role, load, touch, away in (
            ("outer_force", d.outer_load, d.roller, 1.0),
            ("inner_force", d.inner_load, -d.roller, -1.0),
        ):
            size = float(load[frame, j]) / d.race_scale
            if size > 0.0:
                tail = _polar(centre, touch + away * size, angle)
                arrows.append(Shape("arrow", role, [_paper(tail), _paper(_polar(centre, touch, angle))]))
        size = float(d.pocket_load[frame, j]) / d.cage_scale
        if size != 0.0:
            tip = _polar(centre, size, angle + 0.5 * math.pi)
            arrows.append(Shape("arrow", "cage_force", [_paper(centre), _paper(tip)]))
    if d.land_load[frame] > 0.0:
        arrows.append(_land_arrow(d, frame, cage, ring))
    return items + arrows


def _land_arrow(d: Drawing, frame: int, cage: tuple[float, float], ring: tuple[float, float]) -> Shape:
    """Force of the land on the cage, where they touch."""
    middle = (0.0, 0.0) if d.guide_side > 0.0 else ring
    # The cage touches an outer land away from the centre of the guide, an inner land on the other side.
    angle = math.atan2(cage[1] - middle[1], cage[0] - middle[0]) + (math.pi if d.guide_side < 0.0 else 0.0)
    touch = d.pitch + d.guide_side * d.cage_half
    tail = touch + d.guide_side * float(d.land_load[frame]) / d.cage_scale
    return Shape("arrow", "cage_force", [_paper(_polar(cage, tail, angle)), _paper(_polar(cage, touch, angle))])


def _bars(d: Drawing, frame: int, m: float, cage: tuple[float, float]) -> list[list[tuple[float, float]]]:
    """Cross-bars between the pockets: parallel walls, round rims."""
    half = d.roller + m * d.pocket_gap
    step = 2.0 * math.pi / d.rollers
    rims = (d.pitch - d.cage_half, d.pitch + d.cage_half)
    (inner, a), (outer, b) = ((rim, math.asin(min(half / rim, 1.0))) for rim in rims)
    bars = []
    for j in range(d.rollers):
        here = float(d.cage_angle[frame]) + j * step
        corners = (
            (inner, here + a), (outer, here + b), (outer, here + 0.5 * step),
            (outer, here + step - b), (inner, here + step - a), (inner, here + 0.5 * step),
        )  # fmt: skip
        bars.append([_paper(_polar(cage, radius, angle)) for radius, angle in corners])
    return bars


def _polar(middle: tuple[float, float], radius: float, angle: float) -> tuple[float, float]:
    return middle[0] + radius * math.cos(angle), middle[1] + radius * math.sin(angle)


def _paper(place: tuple[float, float]) -> tuple[float, float]:
    return place[1], place[0]


TURNS = 3.0
FRAMES_PER_TURN = 128
# About 5 bytes each: the page stays below 3 MB however many rollers there are.
MOST_NUMBERS = 400_000
PER_ROLLER, PER_FRAME = 6, 9
TEMPLATE = Path(__file__).with_name("player.html")
BEARING = Path(__file__).with_name("bearing.js")


def player_html(history: "History", cage: str = "") -> str:
    """The page, of up to three shaft turns about the largest pocket force; rounded to 0.1 um, 1 mrad and four digits.

    ``cage``: its class, for the title.
    """
    most_frames = MOST_NUMBERS // (PER_ROLLER * history.scene.bearing.rollers + PER_FRAME)
    picture = drawing(history, TURNS, FRAMES_PER_TURN, most_frames)
    moving = motion_record(history, picture)
    moving["title"] += f"; cage: {cage}" if cage else ""
    record = json.dumps(moving, separators=(",", ":"), allow_nan=False)
    page = TEMPLATE.read_text(encoding="utf-8").replace("{{BEARING}}", BEARING.read_text(encoding="utf-8"))
    # Data last, so that no mark inside it is replaced.
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
            [*(round(x, 3) for place in reference.arrow.points for x in place), reference.words, round(reference.u, 3)]
            for reference in d.references
        ],
        # Rounded down, so that everything still fits at its upper end.
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
    body = "".join(element(shape) for shape in shapes(d, 0, d.magnification))
    for reference in d.references:
        u, v, words = reference.u, reference.v + 0.018 * side, html.escape(reference.words)
        body += f'{element(reference.arrow)}<text x="{u:.2f}" y="{v:.2f}">{words}</text>'
    words = html.escape(f"First frame; clearances magnified {d.magnification:g} times, rollers drawn smaller.")
    return (
        f'<svg viewBox="{-side:.2f} {-side:.2f} {2 * side:.2f} {2 * side:.2f}" style="--unit:{side / 33:.4f}px" role="img" aria-label="{words}">'
        '<defs><marker id="tip" viewBox="0 0 6 6" refX="5" refY="3" markerWidth="3" markerHeight="3" orient="auto">'
        f'<path d="M0 0 6 3 0 6z" fill="context-stroke"/></marker></defs>{body}</svg><p>{words}</p>'
    )


def element(shape: Shape) -> str:
    """A shape in SVG, its role as class."""
    role = shape.role
    (u, v), last = shape.points[0], shape.points[-1]
    if shape.kind == "circle":
        return f'<circle class="{role}" cx="{u:.2f}" cy="{v:.2f}" r="{shape.radius:.2f}"/>'
    if shape.kind == "polygon":
        corners = " ".join(f"{p:.2f},{q:.2f}" for p, q in shape.points)
        return f'<polygon class="{role}" points="{corners}"/>'
    tip = ' marker-end="url(#tip)"' if shape.kind == "arrow" else ""
    return f'<line class="{role}" x1="{u:.2f}" y1="{v:.2f}" x2="{last[0]:.2f}" y2="{last[1]:.2f}"{tip}/>'
