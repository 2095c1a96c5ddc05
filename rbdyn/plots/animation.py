"""A moving picture of the bearing and its forces: GIF, or MP4 where ffmpeg is installed."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib import animation
from matplotlib.axes import Axes
from matplotlib.patches import Circle, FancyArrowPatch, Polygon

from rbdyn.plots.drawing import Drawing, Shape, drawing, shapes
from rbdyn.plots.style import GREEN, GREY, INNER, OUTER, plt

if TYPE_CHECKING:
    from rbdyn.dynamics.motion.history import History

TURNS = 2.0
FRAMES_PER_TURN = 40
FRAMES_PER_SECOND = 15
FORCES = {"outer_force": OUTER, "inner_force": INNER, "cage_force": GREEN}
# Fill and edge.
LOOKS = {
    "ring": ("#e4e7ea", "#8a9096"),
    "space": ("white", "#8a9096"),
    "mark": ("#3c4248", "none"),
    "land": ("none", "#b08a3c"),
    "cage": ("#e3c27a", "#9c7a2e"),
    "rim": ("none", "#c9a95c"),
    "roller": ("#cdd6df", "#59636d"),
}


def moving_bearing(history: "History", stem: Path) -> Path:
    """Write ``stem``.mp4, or .gif where there is no ffmpeg: two shaft turns about the largest pocket force."""
    picture = drawing(history, TURNS, FRAMES_PER_TURN)
    figure = plt.figure(figsize=(6.0, 6.6), dpi=80)
    axis = figure.add_axes((0.0, 0.0, 1.0, 6.0 / 6.6))
    figure.text(
        0.02, 0.975, f"clearances magnified {picture.magnification:g} times, rollers drawn smaller",
        fontsize=10, va="center",
    )  # fmt: skip
    words = figure.text(0.02, 0.935, "", fontsize=10, va="center", color=GREY)
    turn_s = history.scene.turn_s

    def draw(frame: int) -> list[Any]:
        axis.clear()
        _set_up(axis, picture)
        for shape in shapes(picture, frame, picture.magnification):
            _add(axis, shape)
        words.set_text(f"shaft turn {picture.time[frame] / turn_s:.2f}, {picture.time[frame] * 1e3:.3f} ms")
        return []

    film = animation.FuncAnimation(figure, draw, frames=len(picture.time), blit=False)
    ffmpeg = animation.writers.is_available("ffmpeg")
    path = stem.with_suffix(".mp4" if ffmpeg else ".gif")
    film.save(path, writer=(animation.FFMpegWriter if ffmpeg else animation.PillowWriter)(fps=FRAMES_PER_SECOND))
    plt.close(figure)
    return path


def _set_up(axis: Axes, picture: Drawing) -> None:
    side = picture.extent
    axis.set(xlim=(-side, side), ylim=(side, -side), aspect="equal")
    axis.set_axis_off()
    for reference in picture.references:
        _add(axis, reference.arrow)
        axis.text(reference.u, reference.v, reference.words, fontsize=8.5, va="center")
    axis.annotate("load", (0.9 * side, 0.97 * side), xytext=(0.9 * side, 0.78 * side), ha="center", fontsize=9,
                  arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 1.6})  # fmt: skip


def _add(axis: Axes, shape: Shape) -> None:
    if shape.kind == "arrow":
        look: dict[str, Any] = {
            "arrowstyle": "-|>",
            "mutation_scale": 9,
            "shrinkA": 0,
            "shrinkB": 0,
            "linewidth": 2.2,
            "zorder": 5,
        }
        axis.add_patch(FancyArrowPatch(shape.points[0], shape.points[1], color=FORCES[shape.role], **look))
    elif shape.kind == "line":
        axis.plot(*zip(*shape.points, strict=True), color="#59636d", linewidth=1.0)
    else:
        fill, edge = LOOKS[shape.role]
        line = "--" if shape.role == "land" else "-"
        style: dict[str, Any] = {"facecolor": fill, "edgecolor": edge, "linewidth": 0.9, "linestyle": line, "zorder": 2}
        circle = shape.kind == "circle"
        axis.add_patch(Circle(shape.points[0], shape.radius, **style) if circle else Polygon(shape.points, **style))
