"""Pictures of a roller bearing: motion of the cage and its impacts; load, sliding and heat around the bearing; power by loss.

Also stiffness over clearance and speed, cage slip over speed and load, and a moving picture of the bearing with its forces (GIF, or MP4 with ffmpeg).
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Circle, FancyArrowPatch, Polygon

from rbdyn.base.arrays import Array
from rbdyn.base.faults import MethodError
from rbdyn.base.words import label
from rbdyn.dynamics import motion
from rbdyn.dynamics.cage_verdict import forced_orders, passing_orders
from rbdyn.dynamics.figures import PANELS
from rbdyn.dynamics.part_figures import row_stiffness
from rbdyn.plots import style
from rbdyn.plots.drawing import Drawing, Shape, drawing, shapes

if TYPE_CHECKING:
    from rbdyn.dynamics.motion import History
    from rbdyn.dynamics.slip_map import SlipMap
    from rbdyn.scene import Scene

SHOWN_POCKETS = 3
POCKET_COLOURS = (style.BLUE, style.ORANGE, style.GREEN)
# Above this many times the cage speed a whirl spectrum has only noise.
SHOWN_ORDERS = 30.0
# Losses below this share of the whole get no bar.
SMALLEST_SHARE = 1e-4


def _guide_circle(axis: Axes, history: "History") -> None:
    clearance = history.scene.orbit_play_m
    kind = "pocket" if history.scene.guide_clearance_m is None else "diametral guide"
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    x, y = clearance * 1e6 * np.cos(angle), clearance * 1e6 * np.sin(angle)
    axis.plot(x, y, "--", color=style.GREY, linewidth=0.9, label=f"half of the {kind} clearance")


def _plane(axis: Axes) -> None:
    axis.set_aspect("equal", adjustable="datalim")
    axis.locator_params(nbins=6)
    axis.set(xlabel="cage centre, along the load [µm]", ylabel="across [µm]")


def cage_orbit(
    histories: "Mapping[str, History]", path: Path, classes: Mapping[str, str] = MappingProxyType({})
) -> None:
    """Path of the cage centre about that of its guide: in the guide clearance, enlarged, and its spectrum; a column each.

    ``classes``: of the cage by the title of its history, which names and colours its path.
    """
    columns = len(histories)
    figure, axes = style.subplots(3, columns, figsize=(4.8 * columns, 12.6), squeeze=False)
    for column, (title, history) in zip(axes.T, histories.items(), strict=True):
        x, y = (1e6 * part for part in history.guide_eccentricity)
        colour = style.CAGE_COLOURS.get(classes.get(title, ""), style.BLUE)
        _orbit_spectrum(column[2], history, colour)
        for axis in column[:2]:
            axis.plot(x, y, linewidth=0.6, color=colour)
            axis.plot(x[0], y[0], "o", markersize=5, color=style.GREEN, label="start")
            axis.plot(x[-1], y[-1], "s", markersize=5, color=style.VERMILION, label="end")
            _plane(axis)
        _guide_circle(column[0], history)
        column[0].set_title(f"{title}; cage: {classes[title]}" if title in classes else title)
        column[1].set_title("enlarged")
    # Below the figure, where no orbit runs.
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="lower center", ncol=3, fontsize=8)
    style.save(figure, path)


def _orbit_spectrum(axis: Axes, history: "History", colour: str) -> None:
    """Radii of the circles of an orbit over their order, with the orders of what drives it."""
    frequency, amplitude = motion.orbit_spectrum(history)
    speed = motion.mean_cage_speed(history)
    order, passing = frequency * 2.0 * math.pi / abs(speed), passing_orders(history.scene, speed)
    near = abs(order) <= 1.2 * max(map(abs, passing))
    axis.semilogy(order[near], 1e6 * amplitude[near], color=colour, linewidth=0.8)
    marks = {name: (at,) for name, at in forced_orders(history.scene, speed).items()} | {"roller pass": passing}
    for (name, places), shade in zip(
        marks.items(), (style.ORANGE, style.VERMILION, style.SKY, style.GREY), strict=False
    ):
        for place in places:
            axis.axvline(place, color=shade, linewidth=0.9, linestyle="--", zorder=1)
        axis.plot([], [], "--", color=shade, label=f"{name} {', '.join(f'{place:.3g}' for place in places)}")
    axis.set(xlabel="order: turns of the orbit in a cage turn", ylabel="radius of the circle [µm]")
    axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(marks), fontsize=8, frameon=False)


def _draw_pockets(axis: Axes, history: "History") -> None:
    order = np.argsort(-np.abs(history.pocket_load).max(axis=0))[:SHOWN_POCKETS]
    for pocket, colour in zip(sorted(order), POCKET_COLOURS, strict=False):
        load = history.pocket_load[:, pocket]
        axis.plot(history.time * 1e3, load, linewidth=0.8, color=colour, label=f"pocket {pocket + 1}")
    axis.axhline(0.0, color="black", linewidth=0.6)
    axis.set_ylabel("wall force [N]\nfront +, rear −")


def _legend_above(axis: Axes) -> None:
    """Outside the axes, where no curve runs."""
    axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncol=SHOWN_POCKETS, frameon=False, fontsize=8)


def pocket_forces(histories: "Mapping[str, History]", path: Path) -> None:
    """Wall forces of the pockets with the largest forces over time, a panel each."""
    rows = len(histories)
    figure, axes = style.subplots(rows, 1, figsize=(9.0, 3.0 * rows), squeeze=False, sharex=True)
    for axis, (title, history) in zip(axes[:, 0], histories.items(), strict=True):
        _draw_pockets(axis, history)
        axis.set_title(title, loc="left")
        _legend_above(axis)
    axes[-1, 0].set_xlabel("time after the transient [ms]")
    style.save(figure, path)


def forces(history: "History", path: Path) -> None:
    """Wall forces of the pockets with the largest forces, and the land's dry load, over time; the largest marked."""
    touched = bool(history.land_load.any())
    figure, axes = style.subplots(1 + touched, 1, figsize=(9.0, 3.4 + 2.2 * touched), squeeze=False, sharex=True)
    pockets = axes[0, 0]
    _draw_pockets(pockets, history)
    hit = motion.largest(history, history.pocket_load)
    sample = int(np.argmin(np.abs(history.time - hit.time)))
    sign = -1.0 if hit.roller is not None and history.pocket_load[sample, hit.roller] < 0.0 else 1.0
    _mark(pockets, history, hit, sign, f"{hit.force:.4g} N, pocket {(hit.roller or 0) + 1}")
    _legend_above(pockets)
    if touched:
        land = axes[1, 0]
        land.plot(history.time * 1e3, history.land_load, linewidth=0.8, color=style.BLUE)
        land.set_ylabel("dry load of the\nguide land [N]")
        hit = motion.largest(history, history.land_load)
        _mark(land, history, hit, 1.0, f"{hit.force:.4g} N")
    elif history.scene.guide_clearance_m is not None:
        pockets.set_title("the guide land is never touched", fontsize=9, color=style.GREY, loc="left")
    axes[-1, 0].set_xlabel("time after the transient [ms]")
    style.save(figure, path)


def _mark(axis: Axes, history: "History", hit: motion.Largest, sign: float, words: str) -> None:
    axis.plot(hit.time * 1e3, sign * hit.force, "v" if sign > 0.0 else "^", color=style.VERMILION, markersize=7)
    late = hit.time > 0.75 * history.time[-1]
    axis.annotate(f"largest: {words}", (hit.time * 1e3, sign * hit.force), xytext=(-10 if late else 10, -3),
                  textcoords="offset points", ha="right" if late else "left", fontsize=8,
                  bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.0})  # fmt: skip
    axis.margins(y=0.12)


def whirl(history: "History", path: Path) -> None:
    """Distribution of the instantaneous whirl ratio, with its median, its quartiles and the mean ratio."""
    edges, density = motion.whirl_histogram(history)
    quantiles = motion.whirl_quantiles(history)
    figure, axis = style.subplots(figsize=(6.4, 4.0))
    axis.stairs(density, edges, fill=True, color=style.SKY)
    axis.axvspan(quantiles[0.25], quantiles[0.75], color=style.GREY, alpha=0.15, linewidth=0, label="middle half")
    axis.axvline(quantiles[0.5], color=style.BLUE, linewidth=1.4, label=f"median {quantiles[0.5]:.3g}")
    mean = motion.whirl_ratio(history)
    axis.axvline(mean, color=style.VERMILION, linewidth=1.4, linestyle="--", label=f"mean {mean:.3g}")
    axis.set(xlabel="whirl speed of the cage centre over mean cage speed [-]", ylabel="probability density [-]")
    axis.legend(fontsize=8)
    style.save(figure, path)


def section(history: "History", path: Path) -> None:
    """Poincare sections: the cage centre once a shaft turn and once a cage turn, on its orbit."""
    x, y = (1e6 * part for part in history.guide_eccentricity)
    figure, axes = style.subplots(1, 2, figsize=(9.6, 5.4))
    turns: tuple[Literal["shaft", "cage"], ...] = ("shaft", "cage")
    for axis, turn_of in zip(axes, turns, strict=True):
        place_x, place_y = motion.poincare(history, turn_of)
        axis.plot(x, y, linewidth=0.4, color=style.SKY, alpha=0.7, label="orbit")
        marks = axis.scatter(place_x * 1e6, place_y * 1e6, c=np.arange(len(place_x)), cmap="viridis", s=22, zorder=3)
        _plane(axis)
        axis.set_title(f"once a {turn_of} turn: {len(place_x)} points", fontsize=10)
        figure.colorbar(marks, ax=axis, label=f"{turn_of} turn", orientation="horizontal", shrink=0.9)
    style.save(figure, path)


def spectra(history: "History", path: Path) -> None:
    """Amplitude spectra of cage eccentricity and cage speed; cage, shaft and roller-passing frequency marked."""
    cage = abs(motion.mean_cage_speed(history)) / (2.0 * np.pi)
    passing = cage * history.scene.bearing.rollers
    lines = {"cage": cage, "shaft": 1.0 / history.scene.turn_s, "roller passing": passing}
    figure, axes = style.subplots(2, 1, figsize=(9.0, 6.2), sharex=True)
    signals = (
        (motion.spectrum(history, motion.eccentricity(history)), 1e6, "eccentricity of the cage", "µm"),
        (motion.spectrum(history, history.cage_speed), 30.0 / np.pi, "cage speed", "rpm"),
    )
    reach = min(SHOWN_ORDERS * cage, float(signals[0][0].frequency[-1]))
    for axis, (spectrum, factor, name, unit) in zip(axes, signals, strict=True):
        visible = (spectrum.frequency > 0.0) & (spectrum.frequency <= reach)
        amplitude = factor * spectrum.amplitude[visible]
        axis.semilogy(spectrum.frequency[visible] * 1e-3, amplitude, color=style.BLUE, linewidth=1.0)
        for colour, (_, frequency) in zip((style.GREEN, style.ORANGE, style.VERMILION), lines.items(), strict=True):
            axis.axvline(frequency * 1e-3, color=colour, linewidth=0.9, linestyle="--", zorder=1)
        axis.set_ylabel(f"amplitude of the\n{name} [{unit}]")
    for colour, (name, frequency) in zip((style.GREEN, style.ORANGE, style.VERMILION), lines.items(), strict=True):
        axes[0].plot([], [], "--", color=colour, linewidth=0.9, label=f"{name}, {frequency:.0f} Hz")
    axes[0].legend(fontsize=8, loc="upper right")
    axes[1].set_xlabel("frequency [kHz]")
    style.save(figure, path)


def _around(axis: Axes, history: "History", values: np.ndarray, factor: float, colour: str, label: str) -> None:
    profile = motion.against_azimuth(history, values)
    degrees = np.degrees(profile.azimuth)
    axis.fill_between(degrees, factor * profile.low, factor * profile.high, color=colour, alpha=0.2, linewidth=0)
    axis.plot(degrees, factor * profile.mean, color=colour, linewidth=1.4, label=label)
    axis.set(xlim=(-180.0, 180.0), xticks=range(-180, 181, 60))


def roller_loads(history: "History", path: Path) -> None:
    """Load of a roller on both races against azimuth: mean, and the band of nine tenths."""
    figure, axis = style.subplots(figsize=(7.0, 4.2))
    _around(axis, history, history.outer_load, 1.0, style.OUTER, "outer raceway")
    _around(axis, history, history.inner_load, 1.0, style.INNER, "inner raceway")
    axis.set_ylim(bottom=0.0)
    axis.set(xlabel="azimuth of the roller from the load [°]", ylabel="roller load [N]\nmean, and 5 % to 95 %")
    axis.legend(fontsize=9)
    style.save(figure, path)


def sliding(history: "History", path: Path) -> None:
    """Slip, pressure times sliding speed, and heat at both races against azimuth."""
    figure, axes = style.subplots(3, 1, figsize=(7.0, 8.4), sharex=True)
    pressed = motion.pressure_velocity(history, "outer"), motion.pressure_velocity(history, "inner")
    panels = (
        ("slip: ring less\nroller surface [m/s]", 1.0, history.outer_slip, history.inner_slip),
        ("Hertz pressure ×\nsliding speed [MPa·m/s]", 1e-6, pressed[0], pressed[1]),
        ("heat of a contact [W]", 1.0, history.outer_heat, history.inner_heat),
    )
    for axis, (words, factor, outer, inner) in zip(axes, panels, strict=True):
        _around(axis, history, outer, factor, style.OUTER, "outer raceway")
        _around(axis, history, inner, factor, style.INNER, "inner raceway")
        axis.set_ylabel(words)
    axes[0].legend(fontsize=9)
    axes[0].set_title("mean, and 5 % to 95 % of the samples", fontsize=10)
    axes[-1].set_xlabel("azimuth of the roller from the load [°]")
    style.save(figure, path)


def power_by_loss(terms: Mapping[str, float], path: Path) -> None:
    """Mean power [W] of each loss, largest on top, without those below a ten-thousandth of all."""
    total = sum(abs(power) for power in terms.values())
    largest = {term: power for term, power in terms.items() if abs(power) > SMALLEST_SHARE * total}
    names = sorted(largest, key=lambda term: largest[term])
    figure, axis = style.subplots(figsize=(7.0, 1.2 + 0.38 * max(len(names), 1)))
    bars = axis.barh([name.replace("_", " ") for name in names], [largest[name] for name in names], color=style.BLUE)
    axis.bar_label(bars, fmt="%.3g", padding=3, fontsize=9)
    axis.set_xlabel(f"mean power lost [W], {sum(terms.values()):.4g} W in all")
    axis.margins(x=0.12)
    axis.grid(axis="y", visible=False)
    style.save(figure, path)


# Of a row.
BELOW = 0.25


def draw_slip_map(
    slip_map: "SlipMap", path: Path, marks: Mapping[str, tuple[float, float]] = MappingProxyType({})
) -> None:
    """A panel a figure, values written into the cells; failed points stay white.

    ``marks``: speed [rpm] and load [N] of points to mark, by their names; between cells they are at their places by straight lines.
    """
    width = max(4.2, 0.85 * len(slip_map.columns) + 2.0)
    count = len(PANELS) + bool(slip_map.cages)
    rows = math.ceil(count / 2)
    size = 2.0 * width, rows * max(3.2, 0.5 * len(slip_map.rows) + 1.8)
    figure, axes = style.subplots(rows, 2, figsize=size, grid=False)
    for axis in axes.ravel()[count:]:
        axis.set_axis_off()
    for axis, panel in zip(axes.ravel(), PANELS, strict=False):
        values = panel.percent * slip_map.grid(panel.key)
        image = axis.imshow(values, origin="lower", aspect="auto", cmap="cividis")
        middle = np.nanmean([np.nanmin(values), np.nanmax(values)]) if np.isfinite(values).any() else 0.0
        for (row, column), value in np.ndenumerate(values):
            text = f"{value:.3g}" if np.isfinite(value) else "failed"
            colour = "white" if np.isfinite(value) and value < middle else "black"
            # A value is below its place where that may be marked.
            axis.text(column, row - BELOW * bool(marks), text, ha="center", va="center", fontsize=8, color=colour)
        figure.colorbar(image, ax=axis)
        _label_axes(axis, slip_map, f"{label(panel.key)} [%]" if panel.percent > 1.0 else label(panel.key))
        _mark_points(axis, slip_map, marks)
    if slip_map.cages:
        _draw_classes(axes.ravel()[len(PANELS)], slip_map, BELOW * bool(marks))
        _mark_points(axes.ravel()[len(PANELS)], slip_map, marks)
    style.save(figure, path)


def _label_axes(axis: Axes, slip_map: "SlipMap", title: str) -> None:
    axis.set_xticks(range(len(slip_map.columns)), [f"{value:g}" for value in slip_map.columns])
    axis.set_yticks(range(len(slip_map.rows)), [f"{value:g}" for value in slip_map.rows])
    along, up = (label(key.rpartition(".")[2]) for key in slip_map.axes)
    axis.set(xlabel=along, ylabel=up, title=title)


def _draw_classes(axis: Axes, slip_map: "SlipMap", below: float) -> None:
    """Cells in the colour of the class of their cage, with its name, replicates, and the share of the commonest class."""
    names = [point.verdict.name if point.verdict else "" for point in slip_map.points]
    colours = np.array([to_rgb(style.CAGE_COLOURS.get(name, "white")) for name in names])
    axis.imshow(colours.reshape(len(slip_map.rows), len(slip_map.columns), 3), origin="lower", aspect="auto", alpha=0.5)
    for row, cells in enumerate(slip_map.cages):
        for column, text in enumerate(cells):
            found = slip_map.points[row * len(slip_map.columns) + column].verdict
            share = "" if found is None or found.largest_share is None else f"\n{found.largest_share:.2f}"
            axis.text(column, row - below, text.replace(", ", "\n") + share, ha="center", va="center", fontsize=8)
    _label_axes(axis, slip_map, "class of the cage, and its share of bearings alike")


# Clearances of a picture over the operating or the drawn one, whichever is larger, and how many of them.
CLEARANCE_SPAN, CLEARANCE_POINTS = (-0.5, 2.0), 26


def stiffness_over_clearance(scene: "Scene", path: Path) -> None:
    """Stiffness along and across the load, and the travel over a pitch, over the diametral clearance; the operating one is marked.

    Clearances without a stiffness, where no roller carries load, stay empty.
    """
    operating = scene.geometry.clearance
    largest = max(abs(operating), abs(scene.bearing.radial_clearance), 1e-6)
    clearances = np.sort([*np.linspace(*CLEARANCE_SPAN, CLEARANCE_POINTS) * largest, operating])
    rows = [stiffness_row(scene, float(clearance)) for clearance in clearances]
    figure, (above, below) = style.subplots(2, 1, figsize=(6.4, 5.6), sharex=True)
    here = stiffness_row(scene, operating)
    for axis, place, words, colour in (
        (above, 0, "along the load", style.BLUE), (above, 1, "across the load", style.VERMILION), (below, 2, "", style.GREEN),
    ):  # fmt: skip
        axis.plot(1e6 * clearances, [row[place] for row in rows], color=colour, label=words)
        axis.plot([1e6 * operating], [here[place]], "o", color=colour)
        axis.axvline(1e6 * operating, color=style.GREY, linewidth=0.8, linestyle=":")
    above.set(ylabel="stiffness [N/µm]", ylim=(0.0, None), title="Static loads; dots: operating clearance")
    above.legend(frameon=False)
    below.set(
        xlabel="diametral operating clearance [µm]", ylabel="travel of the shaft over a pitch [µm]", ylim=(0.0, None)
    )
    style.save(figure, path)


def stiffness_row(scene: "Scene", clearance: float) -> tuple[float, float, float]:
    """Stiffness along and across the load [N/um] and travel [um] at a diametral clearance [m]; NaN where no roller carries load."""
    try:
        found = row_stiffness(scene, clearance)
    except MethodError:
        return math.nan, math.nan, math.nan
    return 1e-6 * found.along, 1e-6 * found.across, 1e6 * max(found.travel)


def draw_stiffness(
    speeds_rpm: Sequence[float], loads: Sequence[float], along: Array, across: Array, path: Path
) -> None:
    """Stiffness k_xx (full) and k_yy (dashed) [N/um], each (loads, speeds), over speed; a colour a load [N]."""
    figure, axis = style.subplots(figsize=(6.4, 4.2))
    for colour, load, *rows in zip(itertools.cycle(style.METHOD_COLOURS[1:]), loads, along, across, strict=False):
        for name, row, line in zip(("k_xx", "k_yy"), rows, ("-", "--"), strict=True):
            axis.plot(speeds_rpm, row, color=colour, linestyle=line, label=f"{name}, {load:g} N")
    axis.set(xlabel="inner speed [rpm]", ylabel="stiffness [N/µm]", ylim=(0.0, None))
    axis.legend(frameon=False, fontsize=8, ncols=max(1, len(loads) // 3))
    style.save(figure, path)


def _mark_points(axis: Axes, slip_map: "SlipMap", marks: Mapping[str, tuple[float, float]]) -> None:
    """Diamonds with names at speeds and loads of a map; points at one place share a diamond."""
    names: dict[tuple[float, float], list[str]] = {}
    for name, place in marks.items():
        names.setdefault(place, []).append(name)
    for (speed, load), together in names.items():
        column = float(np.interp(speed, slip_map.columns, range(len(slip_map.columns))))
        row = float(np.interp(load, slip_map.rows, range(len(slip_map.rows))))
        axis.plot(
            [column],
            [row],
            marker="D",
            markersize=6.0,
            color=style.VERMILION,
            markeredgecolor="white",
            linestyle="none",
        )
        # The name is on the side with more room.
        side, shift = ("right", -7.0) if column > 0.5 * (len(slip_map.columns) - 1) else ("left", 7.0)
        axis.annotate(
            ", ".join(together), (column, row), (shift, 9.0), textcoords="offset points", ha=side, va="center",
            fontsize=8, color="black", bbox={"boxstyle": "round,pad=0.2", "fc": "white", "ec": style.VERMILION, "lw": 0.8},
        )  # fmt: skip


TURNS = 2.0
FRAMES_PER_TURN = 40
FRAMES_PER_SECOND = 15
FORCES = {"outer_force": style.OUTER, "inner_force": style.INNER, "cage_force": style.GREEN}
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
    from matplotlib import animation

    picture = drawing(history, TURNS, FRAMES_PER_TURN)
    figure = style.blank((6.0, 6.6), dpi=80)
    axis = figure.add_axes((0.0, 0.0, 1.0, 6.0 / 6.6))
    figure.text(
        0.02, 0.975, f"clearances magnified {picture.magnification:g} times, rollers drawn smaller",
        fontsize=10, va="center",
    )  # fmt: skip
    words = figure.text(0.02, 0.935, "", fontsize=10, va="center", color=style.GREY)
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
        paint: dict[str, Any] = {"facecolor": fill, "edgecolor": edge, "linewidth": 0.9, "linestyle": line, "zorder": 2}
        circle = shape.kind == "circle"
        axis.add_patch(Circle(shape.points[0], shape.radius, **paint) if circle else Polygon(shape.points, **paint))
