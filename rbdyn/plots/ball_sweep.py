"""Sweeps of a ball bearing: angles, loads, pressure, life and stiffness over one key, maps over two."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rbdyn.arrays import Array
from rbdyn.base.words import quantity
from rbdyn.plots.ball import angles_on
from rbdyn.plots.style import BLUE, GREEN, GREY, INNER, ORANGE, OUTER, Axes, Line2D, plain, plt, save

if TYPE_CHECKING:
    from rbdyn.quasistatic.sweep.result import SweepResult

# Values of a key that are drawn around the bearing, or as lines of their own.
MOST_LINES = 5
STYLES = ("-", "--", ":", "-.", (0, (5, 1, 1, 1, 1, 1)))
# Column of a map, its label, and whether it spans decades.
MAPS = (
    ("inner_pressure_MPa", "peak pressure, inner race [MPa]", False),
    ("outer_pressure_MPa", "peak pressure, outer race [MPa]", False),
    ("L10_Mrev", "L10 [million turns]", True),
    ("inner_angle_max_deg", "largest inner angle [°]", False),
)
ROUND_MAPS = (
    ("stiffness_x_N_per_um", "stiffness x [N/µm]", False),
    ("stiffness_z_N_per_um", "stiffness z [N/µm]", False),
)


def pictures(result: "SweepResult", folder: Path) -> list[str]:
    """Draw a sweep over one or two keys; returns the names, none where nothing was found or there are more keys.

    Over one key, or two of which the first has few values: angles.png, pressure_and_life.png and stiffness.png; azimuth.png over one.
    Over two: map.png.
    """
    shape = result.shape
    if not any(status == "ok" for status in result.statuses) or len(shape) > 2 or shape[-1] < 2:
        return []
    drawn = {"angles.png": angles, "pressure_and_life.png": pressure_and_life, "stiffness.png": stiffness}
    if len(shape) == 2 and shape[0] > MOST_LINES:
        drawn = {"map.png": maps}
    elif len(shape) == 1 and result.figures:
        drawn["azimuth.png"] = azimuth
    for name, draw in drawn.items():
        draw(result, folder / name)
    return list(drawn)


def label(key: str) -> str:
    """A key as an axis says it: its last part, the unit in brackets."""
    name, _, item = key.rpartition(".")[2].partition("[")
    words, unit = quantity(name)
    words = f"{words} {item.rstrip(']')}".rstrip()
    return f"{words} [{unit}]" if unit else words


def angles(result: "SweepResult", path: Path) -> None:
    """Range of the contact angles of all balls, on both races."""
    rows = _rows(result)
    figure, axes = plt.subplots(1, len(rows), figsize=(5.8 * len(rows), 4.0), squeeze=False)
    for axis, (title, prefix) in zip(axes[0], rows.items(), strict=True):
        for race, colour in (("inner", INNER), ("outer", OUTER)):
            for x, style, _, pick in _lines(result):
                low, high = (pick(f"{prefix}{race}_angle_{end}_deg") for end in ("min", "max"))
                axis.fill_between(x, low, high, color=colour, alpha=0.12, linewidth=0.0)
                axis.plot(x, low, color=colour, linewidth=1.1, linestyle=style)
                axis.plot(x, high, color=colour, linewidth=1.1, linestyle=style, label=_once(axis, f"{race} race"))
        _finish(axis, result, "contact angles, least and largest [°]", title)
    save(figure, path)


def pressure_and_life(result: "SweepResult", path: Path) -> None:
    """Peak Hertz pressure of both races, and L10; a dot where each is best."""
    rows = _rows(result)
    figure, axes = plt.subplots(len(rows), 2, figsize=(10.4, 3.8 * len(rows)), squeeze=False)
    for (pressure, life), (title, prefix) in zip(axes, rows.items(), strict=True):
        for x, style, _, pick in _lines(result):
            both = [pick(f"{prefix}{race}_pressure_MPa") for race in ("inner", "outer")]
            for race, values, colour in zip(("inner", "outer"), both, (INNER, OUTER), strict=True):
                pressure.plot(x, values, color=colour, linestyle=style, label=_once(pressure, f"{race} race"))
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
    figure, (shift, tilt) = plt.subplots(1, 2, figsize=(10.4, 3.8))
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
    shown = [places[i] for i in np.unique(np.linspace(0, len(places) - 1, MOST_LINES).round().astype(int))]
    balls = [result.balls_at(place) for place in shown]
    rows = _rows(result)
    figure, axes = plt.subplots(2, len(rows), figsize=(5.8 * len(rows), 6.4), squeeze=False, sharex=True)
    shades = plt.get_cmap("viridis")(np.linspace(0.0, 0.88, len(shown)))
    for title, name, pair in zip(rows, result.figures, axes.T, strict=True):
        for axis, race in zip(pair, ("inner", "outer"), strict=True):
            for place, records, shade in zip(shown, balls, shades, strict=True):
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
    figure, axes = plt.subplots(lines, across, figsize=(4.7 * across, 3.8 * lines))
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
    """The last key's values, and for each value of the first of two: style, name, and what picks a column."""
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
    plain(axis)
    if axis.get_yscale() == "log":
        axis.grid(alpha=0.15, linewidth=0.4, which="minor")
