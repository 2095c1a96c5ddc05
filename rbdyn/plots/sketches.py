"""Sketches that explain names of sizes and signs: inline SVG of a scene's own geometry, coloured by the page that holds it.

A sketch is 400 units wide, so that its letters are readable on a narrow screen. Clearances are drawn many times as wide as they
are, and the caption says by how much. Paper coordinates as in ``drawing``: u to the right, v down, the load points down.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING, NamedTuple

from rbdyn.plots.drawing import element, ideal, shapes, tidy

if TYPE_CHECKING:
    from rbdyn.scene import Scene
    from rbdyn.scene.ball import SingleRowScene

Point = tuple[float, float]
WIDTH = 400.0
# A drawn gap, and a gap where the whole bearing is drawn, in drawn radii of a roller.
WIDE_GAP, GAP = 0.17, 0.1
HEAD = 11.0  # length of an arrow's head
# Distance of the grooves' centres from the ball's centre in the sketch, in ball diameters, and extent of the grooves [rad].
CENTRE_SHARE, GROOVE = 0.1, math.radians(58.0)


class Sketch(NamedTuple):
    """A picture as inline SVG, and the caption under it."""

    svg: str
    caption: str


class Canvas:
    """Lines, arrows and words on paper, back to front."""

    def __init__(self, height: float) -> None:
        self.height, self.body = height, list[str]()

    def add(self, text: str) -> None:
        """Any element."""
        self.body.append(text)

    def line(self, points: Sequence[Point], role: str) -> None:
        """An open line through the points."""
        self.add(f'<polyline class="{role}" points="{_listed(points)}"/>')

    def area(self, points: Sequence[Point], role: str) -> None:
        """A filled polygon."""
        self.add(f'<polygon class="{role}" points="{_listed(points)}"/>')

    def circle(self, centre: Point, radius: float, role: str) -> None:
        """A circle."""
        self.add(f'<circle class="{role}" cx="{centre[0]:.1f}" cy="{centre[1]:.1f}" r="{radius:.1f}"/>')

    def arrow(self, points: Sequence[Point], role: str) -> None:
        """A line with a head at its last point."""
        self.line(points, role)
        (a, b), (u, v) = points[-2], points[-1]
        along = math.atan2(v - b, u - a)
        wings = [(u + HEAD * math.cos(along + turn), v + HEAD * math.sin(along + turn)) for turn in (2.7, -2.7)]
        self.area([(u, v), *wings], f"{role} head")

    def words(self, place: Point, text: str, role: str = "", anchor: str = "middle") -> None:
        """One line of words, on its base line."""
        self.add(
            f'<text class="{role}" x="{place[0]:.1f}" y="{place[1]:.1f}" text-anchor="{anchor}">{escape(text)}</text>'
        )

    def number(self, place: Point, text: str) -> None:
        """A number in a disc, which the caption explains."""
        self.circle(place, 9.5, "badge")
        self.words((place[0], place[1] + 4.5), text, "in-badge")

    def svg(self) -> str:
        """The whole picture; its description is that of the page."""
        return f'<svg class="sketch" viewBox="0 0 {WIDTH:g} {self.height:g}">{"".join(self.body)}</svg>'


def clearances(scene: "Scene") -> Sketch:
    """Section through one roller: where the radial, the pocket and, where a ring guides the cage, the guide clearance are."""
    true = ideal(scene, math.pi)
    gap = WIDE_GAP * true.roller
    gaps = {"radial": "outer_gap", "pocket": "pocket_gap"} | ({"guide": "guide_gap"} if true.guide_side else {})
    factors = {name: tidy(gap / getattr(true, field)) for name, field in gaps.items()}
    widened = {field: factors[name] * getattr(true, field) for name, field in gaps.items()}
    d = replace(true, **widened, inner_gap=widened["outer_gap"])
    half = 0.5 * 1.32 * 2.0 * math.pi * d.pitch / d.rollers  # of the paper [mm]
    scale = 0.5 * WIDTH / half
    top = -(d.pitch + (1.6 + WIDE_GAP) * d.roller)
    height = (4.1 + 2.0 * WIDE_GAP) * d.roller

    def paper(u: float, v: float) -> Point:
        return (u + half) * scale, (v - top) * scale

    canvas = Canvas(height * scale)
    inside = "".join(element(shape) for shape in shapes(d, 0, 1.0) if shape.role not in ("spoke", "mark", "rim"))
    box = f"{-half:.3f} {top:.3f} {2.0 * half:.3f} {height:.3f}"
    canvas.add(f'<svg width="{WIDTH:g}" height="{height * scale:.1f}" viewBox="{box}">{inside}</svg>')
    middle, bar = -d.pitch, math.pi / d.rollers
    for side, name, depth in ((-1.0, "outer ring", 0.225), (1.0, "inner ring", 0.36)):
        race, ring = middle + side * d.roller, middle + side * ((1.0 + depth) * d.roller + d.outer_gap)
        canvas.line([paper(0.0, race), paper(0.0, race + side * d.outer_gap)], "measure")
        canvas.number(paper(0.0, ring), "1")
        canvas.words((paper(0.3 * d.roller, ring)[0], paper(0.0, ring)[1] + 5.0), name, anchor="start")
    for side in (-1.0, 1.0):
        wall = side * (d.roller + d.pocket_gap)
        canvas.line([paper(side * d.roller, middle), paper(wall, middle)], "measure")
        canvas.number(paper(wall + side * 0.3 * d.roller, middle + 0.15 * d.roller), "2")
    rim = d.pitch + d.guide_side * d.cage_half
    radii = (rim, rim + d.guide_side * d.guide_gap, rim - 0.6 * d.guide_side * d.cage_half)
    near, far, below = ((radius * math.sin(bar), -radius * math.cos(bar)) for radius in radii)
    canvas.words(paper(0.0, middle + 0.1 * d.roller), "roller")
    canvas.words(paper(-below[0], below[1] + 0.1 * d.roller), "cage")
    sizes_in_words = [
        f"1: radial clearance, {scene.bearing.radial_clearance_mm:g} mm on the diameter, a quarter of it at each of the four gaps between "
        f"roller and raceway along a diameter; drawn {factors['radial']:g} times as wide.",
        f"2: pocket clearance, {scene.cage.pocket_clearance_mm:g} mm, half of it at each wall; drawn {factors['pocket']:g} times as wide.",
    ]
    if d.guide_side:
        canvas.line([paper(*near), paper(*far)], "measure")
        canvas.number(paper(*below), "3")
        canvas.words((paper(-far[0], 0.0)[0], paper(*far)[1] + (20.0 if d.guide_side < 0.0 else -9.0)), "land")
        sizes_in_words.append(
            f"3: guide clearance, {scene.cage.guide_clearance_mm:g} mm on the diameter, half of it all around; drawn {factors['guide']:g} times as wide."
        )
    caption = f"{_name(scene)}, section through one roller, each part in the middle of its clearance. {' '.join(sizes_in_words)} Rollers and cage are drawn smaller."
    return Sketch(canvas.svg(), caption)


def roller_axes(scene: "Scene") -> Sketch:
    """The whole bearing with x along the load, y, the sense of positive speeds and the numbers of rollers."""
    true = ideal(scene)
    gap = GAP * true.roller
    d = replace(true, outer_gap=gap, inner_gap=gap, pocket_gap=1.5 * gap, guide_gap=gap)
    side = 1.02 * (d.pitch + 1.5 * d.roller + gap)
    scale = 0.5 * WIDTH / side

    def polar(radius: float, angle: float) -> Point:
        return (radius * math.sin(angle) + side) * scale, (radius * math.cos(angle) + side) * scale

    canvas = Canvas(WIDTH)
    inside = "".join(element(shape) for shape in shapes(d, 0, 1.0) if shape.role not in ("spoke", "mark", "rim"))
    box = f"{-side:.3f} {-side:.3f} {2.0 * side:.3f} {2.0 * side:.3f}"
    canvas.add(f'<svg width="{WIDTH:g}" height="{WIDTH:g}" viewBox="{box}">{inside}</svg>')
    hole = d.pitch - 2.0 * d.roller
    step = 2.0 * math.pi / d.rollers
    canvas.arrow([polar(0.0, 0.0), polar(0.72 * hole, 0.0)], "axis")
    canvas.arrow([polar(0.0, 0.0), polar(0.72 * hole, 0.5 * math.pi)], "axis")
    canvas.words((polar(0.6 * hole, 0.0)[0] - 10.0, polar(0.6 * hole, 0.0)[1]), "x, load", anchor="end")
    canvas.words((polar(0.72 * hole, 0.5 * math.pi)[0], polar(0.0, 0.0)[1] - 10.0), "y", anchor="end")
    canvas.line([polar(0.0, 0.0), polar(d.pitch - d.roller, 2.0 * step)], "thin")
    canvas.line([polar(0.62 * hole, 2.0 * step * share / 20) for share in range(21)], "measure")
    canvas.words(polar(0.74 * hole, 1.1 * step), "ψ", "measured")
    sense = [polar(0.42 * hole, math.pi * (0.75 + 0.5 * share / 20)) for share in range(21)]
    canvas.arrow(sense, "measure")
    canvas.words(polar(0.58 * hole, math.pi), "positive speed", "measured")
    for roller in range(4):
        u, v = polar(d.pitch, roller * step)
        canvas.words((u, v + 4.5), str(roller), "small")
    caption = (
        f"{_name(scene)}, seen as drawings and films show it. x points along the load on the inner ring, y is 90 degrees "
        "ahead of it. Angles such as ψ, here at roller 2, count from x towards y, the sense of positive speeds. "
        "Clearances are widened and rollers drawn smaller."
    )
    return Sketch(canvas.svg(), caption)


def ball_axes(scene: "SingleRowScene") -> Sketch:
    """Axial section of one ball without load: axes, groove centres and the sign of the contact angle."""
    size, height = 190.0, 384.0
    centre = (0.5 * WIDTH, 0.5 * height - 6.0)
    angle = scene.bearing.contact_angle

    def paper(axial: float, radial: float) -> Point:
        return centre[0] + size * axial, centre[1] - size * radial

    canvas = Canvas(height)
    for side in (1.0, -1.0):
        middle = (-side * CENTRE_SHARE * math.sin(angle), -side * CENTRE_SHARE * math.cos(angle))
        radius = 0.5 + CENTRE_SHARE
        turns = [GROOVE * (2.0 * share / 40 - 1.0) for share in range(41)]
        groove = [(middle[0] + radius * math.sin(turn), middle[1] + side * radius * math.cos(turn)) for turn in turns]
        shoulder, edge = groove[0][1], side * 0.93
        canvas.area([paper(*place) for place in [(-0.95, shoulder), *groove, (0.95, shoulder), (0.95, edge), (-0.95, edge)]], "ring")  # fmt: skip
    canvas.circle(centre, 0.5 * size, "roller")
    reach = (math.sin(angle), math.cos(angle))
    canvas.line([paper(0.0, -0.5), paper(0.0, 0.72)], "thin")
    canvas.line([paper(-0.5 * reach[0], -0.5 * reach[1]), paper(0.72 * reach[0], 0.72 * reach[1])], "contact")
    for side, name, shift in ((-1.0, "O", -14.0), (1.0, "I", 14.0)):
        u, v = paper(side * CENTRE_SHARE * reach[0], side * CENTRE_SHARE * reach[1])
        canvas.circle((u, v), 3.5, "point")
        canvas.words((u + shift, v + 5.0), name)
    canvas.line([paper(0.66 * math.sin(angle * share / 20), 0.66 * math.cos(angle * share / 20)) for share in range(21)], "measure")  # fmt: skip
    canvas.words(paper(0.74 * math.sin(0.5 * angle), 0.74 * math.cos(0.5 * angle)), "α > 0", "measured")
    for side, name in ((1.0, "outer ring"), (-1.0, "inner ring")):
        canvas.words(paper(-0.9, side * 0.8 - 0.03), name, anchor="start")
    canvas.arrow([paper(0.3, -0.8), paper(0.62, -0.8)], "load")
    canvas.words(paper(0.46, -0.72), "axial load > 0", "loaded")
    corner = (-0.86, -0.16)
    canvas.arrow([paper(*corner), paper(corner[0] + 0.22, corner[1])], "axis")
    canvas.arrow([paper(*corner), paper(corner[0], corner[1] + 0.22)], "axis")
    canvas.words(paper(corner[0] + 0.26, corner[1] - 0.03), "z", anchor="start")
    canvas.words(paper(corner[0] + 0.04, corner[1] + 0.2), "radial", anchor="start")
    caption = (
        f"One ball of a bearing with a contact angle α of {math.degrees(angle):g}° before it is loaded, in the plane through the axis. O and I are the "
        "centres of curvature of the outer and the inner groove; α is the angle of the line from O to I with the radial direction. An axial load "
        f"along z on the inner ring makes it positive. The centres are drawn {CENTRE_SHARE / (scene.bearing.outer_groove_factor - 0.5):.0f} and {CENTRE_SHARE / (scene.bearing.inner_groove_factor - 0.5):.0f} times as far from the ball's centre."
    )
    return Sketch(canvas.svg(), caption)


def _name(scene: "Scene") -> str:
    return getattr(scene.bearing, "designation", None) or f"Bearing of {scene.bearing.rollers} rollers"


def _listed(points: Sequence[Point]) -> str:
    return " ".join(f"{u:.1f},{v:.1f}" for u, v in points)
