"""One equilibrium of a ball bearing: loads and contact angles around it, and a section through the most loaded ball."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rbdyn.arrays import Array
from rbdyn.plots.style import GREY, INNER, OUTER, Axes, plain, plt, save

if TYPE_CHECKING:
    from rbdyn.quasistatic.result import BallResult

Balls = Sequence[Mapping[str, float]]
# How far the grooves are drawn to either side of the radial line [rad]; shoulders are not part of a scene.
GROOVE = math.radians(62.0)
RING_FILL = "#E4E4E4"
LINE: dict[str, Any] = {"markersize": 3.5, "linewidth": 1.2}
# Rings below and above the balls, by the title of a row.
RINGS = {
    "": ("inner ring", "outer ring"),
    "inner row": ("inner ring", "middle ring"),
    "outer row": ("middle ring", "outer ring"),
}


def pictures(result: "BallResult", folder: Path) -> list[str]:
    """Draw loads.png, angles.png and section.png of an equilibrium; returns the names, none where nothing was found."""
    if not result.found:
        return []
    rows = {f"{name} row" if name else "": row.balls for name, row in result.row_reports.items()}
    loads(rows, folder / "loads.png")
    angles(rows, folder / "angles.png")
    section(rows, result.scene["bearing"], folder / "section.png")
    return ["loads.png", "angles.png", "section.png"]


def column(balls: Balls, name: str) -> Array:
    """One figure of all balls."""
    return np.array([ball[name] for ball in balls])


def closed(values: Array) -> Array:
    """Figures of all balls, the first ball once more at the end."""
    return np.append(values, values[0])


def loads(rows: Mapping[str, Balls], path: Path) -> None:
    """Contact loads around each row, azimuth 0 (the direction of x) below; what lies between the races' is centrifugal."""
    figure = plt.figure(figsize=(5.2 * len(rows), 5.2))
    for place, (title, balls) in enumerate(rows.items(), 1):
        axis: Any = figure.add_subplot(1, len(rows), place, projection="polar")
        axis.set_theta_zero_location("S")
        azimuth = np.radians(closed(column(balls, "azimuth_deg")))
        for race, colour in (("outer", OUTER), ("inner", INNER)):
            load = closed(column(balls, f"{race}_load_N"))
            axis.plot(azimuth, load, "o-", color=colour, label=f"{race} race", **LINE)
            if race == "inner":
                axis.fill(azimuth, load, color=colour, alpha=0.12)
        axis.set_rlim(bottom=0.0)
        axis.set_rlabel_position(158.0)
        axis.tick_params(labelsize=8)
        axis.grid(alpha=0.35, linewidth=0.6)
        axis.spines["polar"].set_visible(False)
        axis.set_title(f"{title}: contact loads [N]" if title else "contact loads [N]", fontsize=10, pad=14)
        axis.legend(loc="upper left", bbox_to_anchor=(-0.12, 1.1), frameon=False, fontsize=8)
    save(figure, path)


def angles(rows: Mapping[str, Balls], path: Path) -> None:
    """Contact angles against azimuth; a ball without an inner contact leaves a gap in the inner line."""
    figure, axes = plt.subplots(1, len(rows), figsize=(5.8 * len(rows), 3.8), squeeze=False)
    for axis, (title, balls) in zip(axes[0], rows.items(), strict=True):
        angles_on(axis, balls, {"inner": INNER, "outer": OUTER}, {"inner": "inner race", "outer": "outer race"})
        axis.set_title(title, fontsize=10)
        axis.legend(frameon=False, fontsize=8)
    save(figure, path)


def angles_on(
    axis: Axes, balls: Balls, colours: Mapping[str, Any], labels: Mapping[str, str], marks: str = "o"
) -> None:
    """Contact angles of the named races against azimuth, once around from ball 1 to ball 1."""
    azimuth = column(balls, "azimuth_deg")
    for race, colour in colours.items():
        angle = column(balls, f"{race}_angle_deg")
        if race == "inner":
            angle = np.where(column(balls, "inner_load_N") > 0.0, angle, np.nan)
        axis.plot(np.append(azimuth, 360.0), closed(angle), f"{marks}-", color=colour, label=labels[race], **LINE)
    axis.set(xlim=(0.0, 360.0), xticks=range(0, 361, 60), xlabel="azimuth [°]", ylabel="contact angle [°]")
    plain(axis)


def section(rows: Mapping[str, Balls], bearing: Mapping[str, Any], path: Path) -> None:
    """Axial section of each row at its most loaded ball, to scale: grooves, contact lines, angles and loads."""
    drawings = [bearing] if len(rows) == 1 else [bearing["inner"], bearing["outer"]]
    figure, axes = plt.subplots(1, len(rows), figsize=(5.6 * len(rows), 5.9), squeeze=False)
    for axis, (title, balls), drawing in zip(axes[0], rows.items(), drawings, strict=True):
        place = int(np.argmax(column(balls, "inner_load_N")))
        _section_on(axis, balls[place], drawing)
        for name, height in zip(RINGS[title], (-0.66, 0.64), strict=True):
            axis.text(-0.7, height, name, fontsize=8, color=GREY)
        head = f"{title}, ball" if title else "ball"
        axis.set_title(f"{head} {place + 1} at {balls[place]['azimuth_deg']:.4g}°", fontsize=10)
    save(figure, path)


def _section_on(axis: Axes, ball: Mapping[str, float], drawing: Mapping[str, Any]) -> None:
    """One ball of diameter 1 about the origin: axial to the right, radial up."""
    outer, inner = math.radians(ball["outer_angle_deg"]), math.radians(ball["inner_angle_deg"])
    touching = ball["inner_load_N"] > 0.0
    for race, angle, side in (("outer", outer, 1.0), ("inner", inner, -1.0)):
        factor = drawing[f"{race}_groove_factor"]
        # The groove's centre lies on the contact line, on the other side of the ball's centre.
        centre = -side * (factor - 0.5) * _along(angle)
        _groove(axis, centre, factor, side)
        colour = OUTER if race == "outer" else INNER
        if race == "outer" or touching:
            _contact(axis, ball, race, angle, side, colour)
        axis.plot(*centre, "+", color=colour, markersize=8, zorder=5)
    turn = np.linspace(0.0, 2.0 * math.pi, 200)
    axis.fill(0.5 * np.sin(turn), 0.5 * np.cos(turn), facecolor="white", edgecolor="black", linewidth=1.2, zorder=1)
    axis.plot([0.0, 0.0], [-0.72, 0.72], color=GREY, linewidth=0.8, linestyle=(0, (8, 3, 2, 3)), zorder=2)
    axis.annotate("", (0.0, 0.19), (0.0, 0.0), arrowprops={"arrowstyle": "->", "color": GREY}, zorder=4)
    axis.text(-0.015, 0.2, f"{ball['centrifugal_force_N']:.3g} N\ncentrifugal", color=GREY, fontsize=8, ha="right")
    axis.set(xlim=(-0.78, 0.78), ylim=(-0.74, 0.74), aspect="equal")
    axis.set_axis_off()


def _along(angle: float) -> Array:
    """Unit vector (axial, radial) at an angle from the radial direction."""
    return np.array([math.sin(angle), math.cos(angle)])


def _groove(axis: Axes, centre: Array, radius: float, side: float) -> None:
    """A ring's section beyond its groove: ``side`` 1 above, -1 below."""
    turn = np.linspace(-GROOVE, GROOVE, 120)
    x, y = centre[0] + radius * np.sin(turn), centre[1] + side * radius * np.cos(turn)
    shoulder, edge = y[0], side * 0.74
    ring_x = np.concatenate(([-0.74], x, [0.74, 0.74, -0.74]))
    ring_y = np.concatenate(([shoulder], y, [shoulder, edge, edge]))
    axis.fill(ring_x, ring_y, facecolor=RING_FILL, edgecolor="none", zorder=0)
    axis.plot(ring_x[:-2], ring_y[:-2], color="black", linewidth=1.0, zorder=2)


def _contact(axis: Axes, ball: Mapping[str, float], race: str, angle: float, side: float, colour: str) -> None:
    """Contact line from the ball's centre to the race, its angle from the radial line, and the load."""
    reach = side * _along(angle)
    axis.plot([0.0, 0.62 * reach[0]], [0.0, 0.62 * reach[1]], color=colour, linewidth=1.4, zorder=3)
    axis.plot(*(0.5 * reach), "o", color=colour, markersize=5, zorder=4)
    turn = np.linspace(0.0, angle, 40)
    arc = 0.36 if race == "outer" else 0.3
    axis.plot(side * arc * np.sin(turn), side * arc * np.cos(turn), color=colour, linewidth=0.9, zorder=3)
    # Beside the line, on the side away from the radial line.
    away, side_of = (1.0, "left") if reach[0] >= 0.0 else (-1.0, "right")
    words = f"{ball[f'{race}_angle_deg']:.2f}°\n{ball[f'{race}_load_N']:.4g} N"
    place = 0.66 * reach[0] + 0.02 * away, 0.63 * reach[1]
    axis.text(*place, words, color=colour, fontsize=9, ha=side_of, va="center", zorder=6)
