"""Pictures of a ball bearing: loads, contact angles and a section at one equilibrium; figures over one key of a sweep, maps over two."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.words import quantity
from rbdyn.plots.style import BLUE, GREEN, GREY, INNER, ORANGE, OUTER, Axes, Line2D, blank, save, subplots

if TYPE_CHECKING:
    from rbdyn.quasistatic.result import Ball, BallResult
    from rbdyn.quasistatic.sweep import SweepResult


Balls = Sequence["Ball"]
# Extent of the grooves in the drawing to either side of the radial line [rad]; a scene has no shoulders.
GROOVE = math.radians(62.0)
RING_FILL = "#E4E4E4"
LINE: dict[str, Any] = {"markersize": 3.5, "linewidth": 1.2}
# Rings below and above the balls, by the title of a row.
RINGS = {
    "": ("inner ring", "outer ring"),
    "inner row": ("inner ring", "middle ring"),
    "outer row": ("middle ring", "outer ring"),
}


def pictures(result: "BallResult", folder: Path) -> None:
    """Draw loads.png, angles.png and section.png of an equilibrium."""
    rows = {f"{name} row" if name else "": row.balls for name, row in result.row_reports.items()}
    loads(rows, folder / "loads.png")
    angles(rows, folder / "angles.png")
    section(rows, result.scene["bearing"], folder / "section.png")


def column(balls: Balls, name: str) -> Array:
    """One figure of all balls."""
    return np.array([getattr(ball, name) for ball in balls])


def closed(values: Array) -> Array:
    """Figures of all balls, the first ball once more at the end."""
    return np.append(values, values[0])


def loads(rows: Mapping[str, Balls], path: Path) -> None:
    """Contact loads around each row, azimuth 0 (the direction of x) below; the difference between the races is centrifugal."""
    figure = blank((5.2 * len(rows), 5.2))
    for place, (title, balls) in enumerate(rows.items(), 1):
        axis: Any = figure.add_subplot(1, len(rows), place, projection="polar")
        axis.set_theta_zero_location("S")
        azimuth = np.radians(closed(column(balls, "azimuth_deg")))
        for race, colour in (("outer", OUTER), ("inner", INNER)):
            load = closed(column(balls, f"{race}_load_N"))
            axis.plot(azimuth, load, "o-", color=colour, label=f"{race} raceway", **LINE)
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
    figure, axes = subplots(1, len(rows), figsize=(5.8 * len(rows), 3.8), squeeze=False)
    for axis, (title, balls) in zip(axes[0], rows.items(), strict=True):
        angles_on(axis, balls, {"inner": INNER, "outer": OUTER}, {"inner": "inner raceway", "outer": "outer raceway"})
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


def section(rows: Mapping[str, Balls], bearing: Mapping[str, Any], path: Path) -> None:
    """Axial section of each row at its most loaded ball, to scale: grooves, contact lines, angles and loads."""
    drawings = [bearing] if len(rows) == 1 else [bearing["inner"], bearing["outer"]]
    figure, axes = subplots(1, len(rows), figsize=(5.6 * len(rows), 5.9), squeeze=False)
    for axis, (title, balls), drawing in zip(axes[0], rows.items(), drawings, strict=True):
        place = int(np.argmax(column(balls, "inner_load_N")))
        _section_on(axis, balls[place], drawing)
        for name, height in zip(RINGS[title], (-0.66, 0.64), strict=True):
            axis.text(-0.7, height, name, fontsize=8, color=GREY)
        head = f"{title}, ball" if title else "ball"
        axis.set_title(f"{head} {place + 1} at {balls[place].azimuth_deg:.4g}°", fontsize=10)
    save(figure, path)


def _section_on(axis: Axes, ball: "Ball", drawing: Mapping[str, Any]) -> None:
    """One ball of diameter 1 about the origin: axial to the right, radial up."""
    outer, inner = math.radians(ball.outer_angle_deg), math.radians(ball.inner_angle_deg)
    for race, angle, load, side in (
        ("outer", outer, ball.outer_load_N, 1.0),
        ("inner", inner, ball.inner_load_N, -1.0),
    ):
        factor = drawing[f"{race}_groove_factor"]
        # The groove's centre lies on the contact line, on the other side of the ball's centre.
        centre = -side * (factor - 0.5) * _along(angle)
        _groove(axis, centre, factor, side)
        colour = OUTER if race == "outer" else INNER
        if race == "outer" or load > 0.0:
            _contact(axis, race, angle, load, side, colour)
        axis.plot(*centre, "+", color=colour, markersize=8, zorder=5)
    turn = np.linspace(0.0, 2.0 * math.pi, 200)
    axis.fill(0.5 * np.sin(turn), 0.5 * np.cos(turn), facecolor="white", edgecolor="black", linewidth=1.2, zorder=1)
    axis.plot([0.0, 0.0], [-0.72, 0.72], color=GREY, linewidth=0.8, linestyle=(0, (8, 3, 2, 3)), zorder=2)
    axis.annotate("", (0.0, 0.19), (0.0, 0.0), arrowprops={"arrowstyle": "->", "color": GREY}, zorder=4)
    axis.text(-0.015, 0.2, f"{ball.centrifugal_force_N:.3g} N\ncentrifugal", color=GREY, fontsize=8, ha="right")
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


def _contact(axis: Axes, race: str, angle: float, load: float, side: float, colour: str) -> None:
    """Contact line from the ball's centre to the race, its angle from the radial line, and the load."""
    reach = side * _along(angle)
    axis.plot([0.0, 0.62 * reach[0]], [0.0, 0.62 * reach[1]], color=colour, linewidth=1.4, zorder=3)
    axis.plot(*(0.5 * reach), "o", color=colour, markersize=5, zorder=4)
    turn = np.linspace(0.0, angle, 40)
    arc = 0.36 if race == "outer" else 0.3
    axis.plot(side * arc * np.sin(turn), side * arc * np.cos(turn), color=colour, linewidth=0.9, zorder=3)
    # Next to the line, on the side away from the radial line.
    away, side_of = (1.0, "left") if reach[0] >= 0.0 else (-1.0, "right")
    words = f"{math.degrees(angle):.2f}°\n{load:.4g} N"
    place = 0.66 * reach[0] + 0.02 * away, 0.63 * reach[1]
    axis.text(*place, words, color=colour, fontsize=9, ha=side_of, va="center", zorder=6)


# Most values of a key with a line of their own around the bearing.
MOST_LINES = 5
STYLES = ("-", "--", ":", "-.", (0, (5, 1, 1, 1, 1, 1)))
# Column of a map, its label, and whether it spans decades.
MAPS = (
    ("inner_pressure_MPa", "peak pressure, inner raceway [MPa]", False),
    ("outer_pressure_MPa", "peak pressure, outer raceway [MPa]", False),
    ("L10_Mrev", "L10 [million turns]", True),
    ("inner_angle_max_deg", "largest inner angle [°]", False),
)
ROUND_MAPS = (
    ("stiffness_x_N_per_um", "stiffness x [N/µm]", False),
    ("stiffness_z_N_per_um", "stiffness z [N/µm]", False),
)


def sweep_pictures(result: "SweepResult", folder: Path) -> list[str]:
    """Draw a sweep over one or two keys; returns the names, none where nothing was found or there are more keys.

    Over one key, or two of which the first has few values: angles.png, pressure_and_life.png and stiffness.png; azimuth.png over one.
    Over two: map.png.
    """
    shape = result.shape
    if not any(status == "ok" for status in result.statuses) or len(shape) > 2 or shape[-1] < 2:
        return []
    drawings = {"angles.png": angles_over_key, "pressure_and_life.png": pressure_and_life, "stiffness.png": stiffness}
    if len(shape) == 2 and shape[0] > MOST_LINES:
        drawings = {"map.png": maps}
    elif len(shape) == 1 and result.figures:
        drawings["azimuth.png"] = azimuth
    for name, draw in drawings.items():
        draw(result, folder / name)
    return list(drawings)


def label(key: str) -> str:
    """A key as an axis says it: its last part, the unit in brackets."""
    name, _, item = key.rpartition(".")[2].partition("[")
    words, unit = quantity(name)
    words = f"{words} {item.rstrip(']')}".rstrip()
    return f"{words} [{unit}]" if unit else words


def angles_over_key(result: "SweepResult", path: Path) -> None:
    """Range of the contact angles of all balls, on both races."""
    rows = _rows(result)
    figure, axes = subplots(1, len(rows), figsize=(5.8 * len(rows), 4.0), squeeze=False)
    for axis, (title, prefix) in zip(axes[0], rows.items(), strict=True):
        for race, colour in (("inner", INNER), ("outer", OUTER)):
            for x, style, _, pick in _lines(result):
                low, high = (pick(f"{prefix}{race}_angle_{end}_deg") for end in ("min", "max"))
                axis.fill_between(x, low, high, color=colour, alpha=0.12, linewidth=0.0)
                axis.plot(x, low, color=colour, linewidth=1.1, linestyle=style)
                axis.plot(x, high, color=colour, linewidth=1.1, linestyle=style, label=_once(axis, f"{race} raceway"))
        _finish(axis, result, "contact angles, least and largest [°]", title)
    save(figure, path)


def pressure_and_life(result: "SweepResult", path: Path) -> None:
    """Peak Hertz pressure of both races, and L10; a dot where each is best."""
    rows = _rows(result)
    figure, axes = subplots(len(rows), 2, figsize=(10.4, 3.8 * len(rows)), squeeze=False)
    for (pressure, life), (title, prefix) in zip(axes, rows.items(), strict=True):
        for x, style, _, pick in _lines(result):
            both = [pick(f"{prefix}{race}_pressure_MPa") for race in ("inner", "outer")]
            for race, values, colour in zip(("inner", "outer"), both, (INNER, OUTER), strict=True):
                pressure.plot(x, values, color=colour, linestyle=style, label=_once(pressure, f"{race} raceway"))
            _dot(pressure, x, np.maximum(*both), least=True)
            millions = pick(f"{prefix}L10_Mrev")
            life.plot(x, millions, color=GREEN, linestyle=style)
            _dot(life, x, millions, least=False)
        if _wide(result.columns[f"{prefix}L10_Mrev"]):
            life.set_yscale("log")
        _finish(pressure, result, "peak pressure [MPa]", title)
        _finish(life, result, "L10 [million turns]", title)
    save(figure, path)


def stiffness(result: "SweepResult", path: Path) -> None:
    """Diagonal stiffnesses of the inner ring: across and along the axis, and against tilting."""
    figure, (shift, tilt) = subplots(1, 2, figsize=(10.4, 3.8))
    for x, style, _, pick in _lines(result):
        for axis_name, colour in (("x", BLUE), ("y", ORANGE), ("z", GREEN)):
            values = pick(f"stiffness_{axis_name}_N_per_um")
            shift.plot(x, values, color=colour, linestyle=style, label=_once(shift, axis_name))
        for axis_name, colour in (("x", BLUE), ("y", ORANGE)):
            values = pick(f"stiffness_tilt_{axis_name}_Nm_per_mrad")
            tilt.plot(x, values, color=colour, linestyle=style, label=_once(tilt, f"tilt {axis_name}"))
    _finish(shift, result, "stiffness [N/µm]", "")
    _finish(tilt, result, "stiffness against tilt [N·m/mrad]", "")
    save(figure, path)


def azimuth(result: "SweepResult", path: Path) -> None:
    """Contact angles of every ball at some values of the key: inner above, outer below."""
    (key, values), solved = next(iter(result.keys.items())), [status == "ok" for status in result.statuses]
    places = [place for place, good in enumerate(solved) if good]
    sample = [places[i] for i in np.unique(np.linspace(0, len(places) - 1, MOST_LINES).round().astype(int))]
    balls = [result.balls_at(place) for place in sample]
    rows = _rows(result)
    figure, axes = subplots(2, len(rows), figsize=(5.8 * len(rows), 6.4), squeeze=False, sharex=True)
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.88, len(sample)))
    for title, name, pair in zip(rows, result.figures, axes.T, strict=True):
        for axis, race in zip(pair, ("inner", "outer"), strict=True):
            for place, records, shade in zip(sample, balls, shades, strict=True):
                angles_on(axis, records[name], {race: shade}, {race: f"{values[place]:.5g}"}, marks=".")
            axis.set_ylabel(f"{race} contact angle [°]")
        pair[0].set_xlabel("")
        pair[0].set_title(title, fontsize=10)
    axes[0, 0].legend(frameon=True, framealpha=0.8, edgecolor="none", fontsize=8, title=label(key), title_fontsize=8)
    save(figure, path)


def maps(result: "SweepResult", path: Path) -> None:
    """A panel a figure over both keys; points without an equilibrium stay white."""
    rows = _rows(result)
    panels = [(row + name, f"{title} {text}".strip(), log) for title, row in rows.items() for name, text, log in MAPS]
    panels += ROUND_MAPS
    across = 3 if len(rows) == 1 else len(MAPS)
    lines = -(-len(panels) // across)
    figure, axes = subplots(lines, across, figsize=(4.7 * across, 3.8 * lines), grid=False)
    (first, heights), (last, widths) = result.keys.items()
    for axis, (column, text, log) in zip(axes.ravel(), panels, strict=False):
        values = _finite(result.grid(column))
        scale = "log" if log and _wide(values) else "linear"
        image = axis.pcolormesh(widths, heights, values, cmap="cividis", norm=scale, shading="nearest")
        figure.colorbar(image, ax=axis)
        if min(values.shape) >= 8 and np.isfinite(values).any() and scale == "linear":
            lines_drawn = axis.contour(widths, heights, values, 6, colors="white", linewidths=0.6)
            axis.clabel(lines_drawn, fontsize=7, fmt="%.4g")
        axis.set_title(text, fontsize=10)
        axis.set(xlabel=label(last), ylabel=label(first))
    for axis in axes.ravel()[len(panels) :]:
        axis.set_axis_off()
    save(figure, path)


def _rows(result: "SweepResult") -> dict[str, str]:
    """Title and prefix of the columns of each row of balls."""
    if "inner_load_max_N" in result.columns:
        return {"": ""}
    return {f"{name} row": f"{name}_row_" for name in ("inner", "outer")}


def _lines(result: "SweepResult") -> list[tuple[Array, Any, str, Callable[[str], Array]]]:
    """Values of the last key, and for each value of the first of two: style, name, and the selection of a column."""
    keys = list(result.keys.items())
    x = np.array(keys[-1][1], dtype=np.float64)

    def picker(*index: int) -> Callable[[str], Array]:
        return lambda column: _finite(result.grid(column)[index])

    if len(keys) == 1:
        return [(x, "-", "", picker())]
    text, _, unit = label(keys[0][0]).rstrip("]").partition(" [")
    return [(x, STYLES[i], f"{text} {value:.5g} {unit}".rstrip(), picker(i)) for i, value in enumerate(keys[0][1])]


def _finite(values: Array) -> Array:
    return np.where(np.isfinite(values), values, np.nan)


def _once(axis: Axes, name: str) -> str:
    """A name for the legend; none where the axis has it already."""
    return "" if name in axis.get_legend_handles_labels()[1] else name


def _dot(axis: Axes, x: Array, values: Array, least: bool) -> None:
    """Mark the best point, where there is one inside the range."""
    if not np.isfinite(values).any():
        return
    place = int(np.nanargmin(values) if least else np.nanargmax(values))
    if 0 < place < len(x) - 1:
        axis.plot(x[place], values[place], "o", color="black", markersize=5)
        axis.annotate(
            f"{x[place]:.4g}", (x[place], values[place]), xytext=(0, -12 if least else 12),
            textcoords="offset points", ha="center", va="center", fontsize=8,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.6},
        )  # fmt: skip


def _wide(values: Array) -> bool:
    """Whether values span more than a factor of thirty."""
    good = values[np.isfinite(values) & (values > 0.0)]
    return bool(good.size and good.max() > 30.0 * good.min())


def _finish(axis: Axes, result: "SweepResult", ylabel: str, title: str) -> None:
    axis.set(xlabel=label(list(result.keys)[-1]), ylabel=ylabel)
    axis.set_title(title, fontsize=10)
    handles, _ = axis.get_legend_handles_labels()
    handles += [Line2D([], [], color=GREY, linestyle=style, label=name) for _, style, name, _ in _lines(result) if name]
    if len(handles) > 1:
        axis.legend(handles=handles, frameon=True, framealpha=0.8, edgecolor="none", fontsize=8)
    if axis.get_yscale() == "log":
        axis.grid(alpha=0.15, linewidth=0.4, which="minor")
