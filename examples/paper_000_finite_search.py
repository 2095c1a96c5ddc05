"""Hu et al. 2021 once more: the conditions of their Tables 3 and 4 by their finite search and by the convex solver.

    python examples/paper_000_finite_search.py [--out DIR]

Prints searches, iterations, time, residual and offset distance (eq 19) beside their searches and seconds, which search
point is nearest to the solution, how the search depends on what the paper leaves out, and how little the solvers differ;
``--out`` writes table3.csv, table4.csv and figures 7 to 11. Nothing is tuned to their tables. Table 4, of double-decker
bearings, is solved by their search on all 4 Z + 4 equations at once, and by the convex solver row by row.

What the paper leaves out is taken so: outer raceway control; a gyroscopic moment without sign, as in its source texts;
steel; the ring neither tilts nor moves sideways (2 Z + 2 equations). The table's cell "B218" stands beside test 17, but loads
and speeds change at test 13: tests 13 to 24 are taken for the B218. Its dimensions are not in the paper; they are those of
the 218 of Harris (Rolling Bearing Analysis), with 52.32 % of the ball's diameter for both grooves. The load of figure 7 is
not printed either: that of tests 1 to 4. Their seconds are of MATLAB on a Xeon X5650.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import pandas as pd
import typer
from benchmarks.plain_newton import plain_newton
from numpy.typing import NDArray
from published import double_decker_search
from published.double_decker_search import SearchEnd

from rbdyn.accuracy.ball_solvers import Problem, problem_of, timed
from rbdyn.base.blocks import Table
from rbdyn.base.terminal import show
from rbdyn.quasistatic import finite_search
from rbdyn.quasistatic.double_decker import DoubleDeckerSolution, double_decker_of, solve_double_decker
from rbdyn.quasistatic.finite_search import Damping, Search, search_points
from rbdyn.quasistatic.row import equilibrium
from rbdyn.quasistatic.row.equilibrium import Solution
from rbdyn.quasistatic.row.model import constraint_of, load_of
from rbdyn.scene import BallScene
from rbdyn.scene.ball import DoubleDeckerScene, SingleRowScene

BEARINGS: dict[str, dict[str, Any]] = {
    "71808": {
        "kind": "angular_contact_ball",
        "balls": 29,
        "ball_diameter_mm": 3.175,
        "pitch_diameter_mm": 46.0,
        "contact_angle_deg": 25.0,
        "inner_groove_factor": 0.515,
        "outer_groove_factor": 0.525,
    },
    "B218": {
        "kind": "angular_contact_ball",
        "balls": 16,
        "ball_diameter_mm": 22.23,
        "pitch_diameter_mm": 125.3,
        "contact_angle_deg": 40.0,
        "inner_groove_factor": 0.5232,
        "outer_groove_factor": 0.5232,
    },
}


class Condition(NamedTuple):
    """A line of Table 3: test, bearing, loads [N], speed [rpm], and the searches and seconds that they took."""

    test: int
    bearing: str
    radial: float
    axial: float
    speed: float
    their_searches: int
    their_seconds: float


TABLE_3 = tuple(
    Condition(*line)
    for line in (
        (1, "71808", 200, 200, 10000, 3, 27.323),
        (2, "71808", 200, 200, 20000, 3, 29.641),
        (3, "71808", 200, 200, 30000, 4, 40.126),
        (4, "71808", 200, 200, 40000, 5, 48.753),
        (5, "71808", 200, 400, 10000, 3, 28.142),
        (6, "71808", 200, 400, 20000, 3, 28.97),
        (7, "71808", 200, 400, 30000, 5, 49.211),
        (8, "71808", 200, 400, 40000, 7, 60.094),
        (9, "71808", 200, 600, 10000, 3, 28.639),
        (10, "71808", 200, 600, 20000, 3, 29.785),
        (11, "71808", 200, 600, 30000, 7, 62.193),
        (12, "71808", 200, 600, 40000, 8, 70.516),
        (13, "B218", 500, 1000, 0, 3, 26.763),
        (14, "B218", 500, 1000, 5000, 5, 35.267),
        (15, "B218", 500, 1000, 10000, 7, 56.726),
        (16, "B218", 500, 1500, 0, 3, 29.878),
        (17, "B218", 500, 1500, 5000, 6, 47.252),
        (18, "B218", 500, 1500, 10000, 7, 59.646),
        (19, "B218", 1000, 2000, 0, 3, 27.514),
        (20, "B218", 1000, 2000, 5000, 4, 36.582),
        (21, "B218", 1000, 2000, 10000, 6, 46.913),
        (22, "B218", 1000, 3000, 0, 3, 31.122),
        (23, "B218", 1000, 3000, 5000, 7, 60.537),
        (24, "B218", 1000, 3000, 10000, 8, 67.128),
    )
)
# Axial load [N], speed [rpm], their searches and seconds; 200 N radial.
TABLE_4 = (
    (200, 10000, 6, 90.143),
    (200, 20000, 7, 108.636),
    (200, 30000, 7, 112.581),
    (200, 40000, 8, 131.64),
    (400, 10000, 6, 92.591),
    (400, 20000, 7, 115.74),
    (400, 30000, 8, 136.219),
    (400, 40000, 8, 137.415),
    (600, 10000, 7, 106.173),
    (600, 20000, 7, 128.318),
    (600, 30000, 8, 149.363),
    (600, 40000, 8, 150.817),
)
DOUBLE_DECKER = Path(__file__).parent / "double_decker.toml"
FIGURE_7 = TABLE_3[:4]
REPEATS = 5


class Outcome(NamedTuple):
    """A condition solved by the search and by the convex solver; ``offsets`` [m] of all search points, tried or not."""

    condition: Condition
    searched: Solution
    search_us: float
    convex: Solution
    convex_us: float
    offsets: NDArray[np.float64]


def scene(condition: Condition, gyroscopic: bool | str = "unsigned") -> SingleRowScene:
    """The scene of a condition."""
    made = BallScene.from_dict(
        {
            "bearing": BEARINGS[condition.bearing],
            "operation": {
                "radial_load_N": condition.radial,
                "axial_load_N": condition.axial,
                "inner_speed_rpm": condition.speed,
                "tilt": "fixed",
                "prescribed": {"y_mm": 0.0},
            },
            "model": {"raceway_control": "outer", "gyroscopic": gyroscopic},
        }
    )
    assert isinstance(made, SingleRowScene)
    return made


def offset_distances(points: NDArray[np.float64], balls: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance [m] of the mean of each set of starting positions from the mean of the ``balls`` at the solution (eq 19)."""
    return np.asarray(np.linalg.norm(points.mean(axis=1) - balls[:, :2].mean(axis=0), axis=1))


def outcome(condition: Condition) -> Outcome:
    """Solve a condition both ways."""
    problem = problem_of(scene(condition))
    searched, search_us = timed(finite_search.solve, problem, REPEATS)
    convex, convex_us = timed(equilibrium.solve, problem, REPEATS)
    offsets = offset_distances(search_points(problem.row), convex.balls)
    return Outcome(condition, searched, search_us, convex, convex_us, offsets)


def table_3() -> list[Outcome]:
    """All single-row conditions."""
    return [outcome(condition) for condition in TABLE_3]


def all_together_ms() -> float:
    """Shortest time [ms] in which the convex solver goes through all of Table 3, one condition after the other."""
    problems = [problem_of(scene(condition)) for condition in TABLE_3]
    times = []
    for _ in range(REPEATS + 1):
        began = time.perf_counter()
        for problem in problems:
            equilibrium.solve(*problem)
        times.append(time.perf_counter() - began)
    return 1e3 * min(times)


class DoubleOutcome(NamedTuple):
    """A line of Table 4 by the search and by the convex solver; times of one solve [s]."""

    axial: float
    speed: float
    their_searches: int
    their_seconds: float
    searched: SearchEnd
    search_s: float
    convex: DoubleDeckerSolution
    convex_s: float


def double_decker_scene(axial: float, speed: float) -> DoubleDeckerScene:
    """The scene of a line of Table 4: rings that neither tilt nor move sideways, and that do not grow."""
    point = (f"operation.axial_load_N={axial}", f"operation.inner_speed_rpm={speed}", "operation.prescribed.y_mm=0")
    made = BallScene.load(DOUBLE_DECKER, [*point, "model.gyroscopic=unsigned", "model.ring_expansion=false"])
    assert isinstance(made, DoubleDeckerScene)
    return made


@functools.cache
def table_4() -> tuple[DoubleOutcome, ...]:
    """The double-decker conditions by both solvers."""
    outcomes = []
    for axial, speed, their_searches, their_seconds in TABLE_4:
        scene = double_decker_scene(axial, speed)
        model, load = double_decker_of(scene), load_of(scene)
        searched, search_s = _fastest(double_decker_search.solve, model.stack, load)
        task = (model.stack, load, constraint_of(scene), model.middle_constraint)
        convex, convex_s = _fastest(solve_double_decker, *task)
        outcomes.append(
            DoubleOutcome(axial, speed, their_searches, their_seconds, searched, search_s, convex, convex_s)
        )
    return tuple(outcomes)


def _fastest(solve: Callable[..., Any], *task: Any) -> tuple[Any, float]:
    """What a solver returns, and its shortest time of ``REPEATS`` [s], compilation left out."""
    found, times = solve(*task), []
    for _ in range(REPEATS):
        began = time.perf_counter()
        solve(*task)
        times.append(time.perf_counter() - began)
    return found, min(times)


def layer_angles(solution: SearchEnd | DoubleDeckerSolution) -> dict[str, NDArray[np.float64]]:
    """Inner and outer contact angles (2, Z) [deg] around each layer."""
    layers = {"inner": solution.inner, "outer": solution.outer}
    return {name: np.degrees([layer.inner_angle, layer.outer_angle]) for name, layer in layers.items()}


def table_4_frame(outcomes: Sequence[DoubleOutcome]) -> pd.DataFrame:
    """Table 4, theirs and ours; ``gap_percent``: largest difference of the two solvers in a contact angle."""
    rows = []
    for o in outcomes:
        ours, exact = layer_angles(o.searched), layer_angles(o.convex)
        rows.append(
            {
                "axial": o.axial,
                "speed": o.speed,
                "their_searches": o.their_searches,
                "their_seconds": o.their_seconds,
                "status": o.searched.status,
                "searches": o.searched.searches,
                "iterations": o.searched.steps,
                "search_s": o.search_s,
                "residual_N": o.searched.residual,
                "nearest_search": 1 + int(np.argmin(o.searched.offsets)),
                "offset_um": 1e6 * o.searched.offsets[o.searched.searches - 1],
                "convex_us": 1e6 * o.convex_s,
                "gap_percent": 100.0 * max(float(np.abs(ours[name] / exact[name] - 1.0).max()) for name in ours),
                **{
                    f"{layer}_layer_{race}_deg": float(angles[place].max() if place == 0 else angles[place].min())
                    for layer, angles in exact.items()
                    for place, race in enumerate(("inner", "outer"))
                },
            }
        )
    return pd.DataFrame(rows)


def what_is_left_out() -> list[tuple[str, int, int, int, int]]:
    """How the search depends on what the paper leaves out: (choice, solved, fewest and most searches, iterations in all)."""
    choices: list[tuple[str, Search, Damping]] = [
        (f"step {step:g} of the radius of O1", Search(step=step), Damping()) for step in (0.01, 0.03, 0.1, 0.3, 1.0)
    ]
    choices += [(f"mu in N and {unit}", Search(), Damping(length_unit=length))
                for unit, length in (("m", 1.0), ("um", 1e-6))]  # fmt: skip
    choices += [
        (f"Armijo with b = {b:g}, w = {w:g}", Search(), Damping(backtrack=b, decrease=w))
        for b, w in ((0.5, 1e-4), (0.8, 0.4))
    ]
    problems = [problem_of(scene(condition)) for condition in TABLE_3]
    rows = []
    for name, search, damping in choices:
        found = [finite_search.solve(*problem, search=search, damping=damping) for problem in problems]
        searches = [solution.searches or 0 for solution in found]
        solved = sum(solution.is_equilibrium for solution in found)
        rows.append((name, solved, min(searches), max(searches), sum(solution.steps for solution in found)))
    return rows


def angles(solve: Callable[..., Solution], problem: Problem) -> NDArray[np.float64]:
    """Inner and outer contact angle (2, Z) [deg] of a problem; NaN where the solver fails."""
    found = solve(*problem)
    both = np.degrees([found.inner_angle, found.outer_angle])
    return both if found.is_equilibrium else np.full_like(both, np.nan)


def figure_7() -> dict[str, Any]:
    """Contact angles around the 71808 by speed [rpm]: by the search, plain Newton, and with the moment's sign kept [deg].

    ``lost``: speeds at which plain Newton fails; ``method_gap``: largest difference of the two methods elsewhere,
    ``sign_gap``: what the sign changes [deg].
    """
    curves: dict[str, dict[float, NDArray[np.float64]]] = {"search": {}, "newton": {}, "signed": {}}
    for condition in FIGURE_7:
        unsigned, signed = problem_of(scene(condition)), problem_of(scene(condition, True))
        curves["search"][condition.speed] = angles(finite_search.solve, unsigned)
        curves["newton"][condition.speed] = angles(plain_newton, unsigned)
        curves["signed"][condition.speed] = angles(equilibrium.solve, signed)
    gaps = {
        name: [float(np.abs(curve - curves["search"][speed]).max()) for speed, curve in curves[name].items()]
        for name in ("newton", "signed")
    }
    lost = [speed for speed, curve in curves["newton"].items() if not np.isfinite(curve).all()]
    return {
        "curves": curves,
        "lost": lost,
        "method_gap": float(np.nanmax(gaps["newton"])),
        "sign_gap": max(gaps["signed"]),
    }


def frame(outcomes: Sequence[Outcome]) -> pd.DataFrame:
    """Table 3, theirs and ours."""
    return pd.DataFrame(
        {
            **o.condition._asdict(),
            "status": o.searched.status,
            "searches": o.searched.searches,
            "iterations": o.searched.steps,
            "search_us": o.search_us,
            "residual_N": o.searched.residual,
            "nearest_search": 1 + int(np.argmin(o.offsets)),
            "offset_um": 1e6 * o.offsets[(o.searched.searches or 1) - 1],
            "unloaded_balls": int(np.sum(o.convex.inner_load <= 0.0)),
            "convex_us": o.convex_us,
            "convex_steps": o.convex.steps,
            "convex_residual_N": o.convex.residual,
            "gap_deg": float(np.degrees(np.abs(o.searched.inner_angle - o.convex.inner_angle).max())),
        }
        for o in outcomes
    )


def draw_figure_7(found: dict[str, Any], path: Path) -> None:
    """Contact angles against azimuth: both methods, and what the sign of the gyroscopic moment changes."""
    from rbdyn.plots.style import BLUE, GREEN, ORANGE, VERMILION, plain, save, subplots

    curves = found["curves"]
    figure, axes = subplots(1, 2, figsize=(11.0, 4.8), sharey=True)
    z = next(iter(curves["search"].values())).shape[1]
    azimuth = 360.0 * np.arange(z) / z
    for (speed, both), colour in zip(curves["search"].items(), (BLUE, GREEN, ORANGE, VERMILION), strict=True):
        for axis in axes:
            axis.plot(azimuth, both[0], color=colour, label=f"{speed:g} rpm")
            axis.plot(azimuth, both[1], "--", color=colour)
        axes[0].plot(azimuth, curves["newton"][speed].T, ".", color=colour, markersize=4)
        axes[1].plot(azimuth, curves["signed"][speed].T, "x", color=colour, markersize=4)
    titles = ("finite search (lines), plain Newton (dots)", "moment without (lines) and with its sign (crosses)")
    for axis, title in zip(axes, titles, strict=True):
        plain(axis)
        axis.set_xlabel("azimuth of the ball [deg]")
        axis.set_title(title, fontsize=10)
    axes[0].set_ylabel("contact angle [deg], inner solid, outer dashed")
    axes[0].legend(fontsize=8, frameon=False)
    save(figure, path)


def draw_figure_10(outcomes: Sequence[DoubleOutcome], path: Path) -> None:
    """Contact angles against azimuth in both layers: the search (lines) and the convex solver (dots)."""
    from rbdyn.plots.style import BLUE, GREEN, ORANGE, VERMILION, plain, save, subplots

    figure, axes = subplots(1, 2, figsize=(11.0, 4.8))
    for o, colour in zip(outcomes, (BLUE, GREEN, ORANGE, VERMILION), strict=True):
        ours, exact = layer_angles(o.searched), layer_angles(o.convex)
        for axis, name in zip(axes, ours, strict=True):
            azimuth = 360.0 * np.arange(ours[name].shape[1]) / ours[name].shape[1]
            axis.plot(azimuth, ours[name][0], color=colour, label=f"{o.speed:g} rpm")
            axis.plot(azimuth, ours[name][1], "--", color=colour)
            axis.plot(azimuth, exact[name].T, ".", color=colour, markersize=4)
            axis.set_title(f"{name} layer", fontsize=10)
    for axis in axes:
        plain(axis)
        axis.set_xlabel("azimuth of the ball [deg]")
    axes[0].set_ylabel("contact angle [deg], inner solid, outer dashed")
    axes[0].legend(fontsize=8, frameon=False)
    save(figure, path)


class Tried(NamedTuple):
    """A search to draw: its name, ``offsets`` [m] of all search points, how many were tried, and how many they tried."""

    name: str
    offsets: NDArray[np.float64]
    searches: int
    their_searches: int


def draw_offsets(tried: Sequence[Tried], path: Path) -> None:
    """Offset distance against the search: filled where it was tried, open where it would have gone on."""
    from rbdyn.plots.style import plain, save, subplots

    figure, axis = subplots(figsize=(7.6, 4.8))
    plain(axis)
    for one in tried:
        count = np.arange(1, one.offsets.size + 1)
        (line,) = axis.plot(count, 1e6 * one.offsets, linewidth=0.7, alpha=0.5)
        axis.plot(count[: one.searches], 1e6 * one.offsets[: one.searches], "o", color=line.get_color(), markersize=5,
                  label=f"{one.name}: {one.searches} searches, theirs {one.their_searches}")  # fmt: skip
    axis.set_xlabel("search")
    axis.xaxis.get_major_locator().set_params(integer=True)
    axis.set_ylabel("offset distance from the solution [um]")
    axis.legend(fontsize=6.5, frameon=False, ncols=2)
    save(figure, path)


def _show(table: pd.DataFrame) -> None:
    header = ("test", "bearing", "Fr/Fa/rpm", "searches", "theirs", "nearest", "steps", "offset [um]", "left [N]", "[us]",
              "their s", "convex [us]", "steps", "left [N]")  # fmt: skip
    rows = [
        (f"{r.test}", f"{r.bearing}", f"{r.radial}/{r.axial}/{r.speed}", f"{r.searches}", f"{r.their_searches}",
         f"{r.nearest_search}", f"{r.iterations}", f"{r.offset_um:.1f}", f"{r.residual_N:.0e}", f"{r.search_us:.0f}",
         f"{r.their_seconds:g}", f"{r.convex_us:.0f}", f"{r.convex_steps}", f"{r.convex_residual_N:.0e}")
        for r in table.itertuples()
    ]  # fmt: skip
    show([Table("Table 3", header, rows)])


def main(out: Annotated[Path | None, typer.Option(help="Write both tables and figures 7 to 11 here.")] = None) -> None:
    """Print the tables; write the figures."""
    outcomes = table_3()
    table, found = frame(outcomes), figure_7()
    _show(table)
    failed = table[table["status"] != "ok"]
    typer.echo(
        f"{len(table) - len(failed)} of {len(table)} conditions solved by the search, {table['search_us'].sum() / 1e3:.1f} ms "
        f"together (theirs: {table['their_seconds'].sum():.0f} s); by the convex solver {all_together_ms():.2f} ms; "
        f"contact angles differ by at most {table['gap_deg'].max():.1e} deg; {int((table['unloaded_balls'] > 0).sum())} "
        "conditions have unloaded balls, which rule a as printed refuses. The search point nearest to the solution is number "
        f"{table['nearest_search'].min()} to {table['nearest_search'].max()}; their counts correlate with it by "
        f"{table['nearest_search'].corr(table['their_searches']):.2f}, with ours not at all: ours converges from the second"
    )
    double = table_4_frame(table_4())
    block = Table(
        "Table 4, double-decker",
        ("Fa [N], rpm", "searches", "theirs", "nearest", "steps", "offset [um]", "left [N]", "[ms]", "their s",
         "convex [us]", "gap [%]", "inner layer [deg]", "outer"),
        [
            (f"{r.axial}, {r.speed}", f"{r.searches}", f"{r.their_searches}", f"{r.nearest_search}", f"{r.iterations}",
             f"{r.offset_um:.1f}", f"{r.residual_N:.0e}", f"{r.search_ms:.0f}", f"{r.their_seconds:g}",
             f"{r.convex_us:.0f}", f"{r.gap_percent:.0e}", f"{r.inner_layer_inner_deg:.2f}", f"{r.outer_layer_inner_deg:.2f}")
            for r in double.assign(search_ms=1e3 * double["search_s"]).itertuples()
        ],
    )  # fmt: skip
    show([block])
    block = Table(
        "what the paper leaves out, over Table 3",
        ("choice", "solved", "searches", "iterations in all"),
        [(name, f"{solved}", f"{few}-{most}", f"{steps}") for name, solved, few, most, steps in what_is_left_out()],
    )
    show([block])
    typer.echo(
        f"figure 7: search and plain Newton differ by {found['method_gap']:.1e} deg (paper: 0.84 %) and plain Newton fails at "
        f"{', '.join(f'{speed:g}' for speed in found['lost']) or 'no'} rpm; inner angles rise with speed and outer ones fall, "
        "as the figures of the paper must and its text does not; the sign of the "
        f"gyroscopic moment changes contact angles by up to {found['sign_gap']:.2f} deg"
    )
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        table.to_csv(out / "table3.csv", index=False, float_format="%.6g")
        double.to_csv(out / "table4.csv", index=False, float_format="%.6g")
        draw_figure_7(found, out / "figure_7.png")
        for bearing, figure in (("71808", "figure_8"), ("B218", "figure_9")):
            of_bearing = [o for o in outcomes if o.condition.bearing == bearing]
            draw_offsets(
                [Tried(f"test {o.condition.test}", o.offsets, o.searched.searches or 0, o.condition.their_searches)
                 for o in of_bearing],
                out / f"{figure}.png",
            )  # fmt: skip
        draw_figure_10(table_4()[:4], out / "figure_10.png")
        draw_offsets(
            [Tried(f"{o.axial:g} N, {o.speed:g} rpm", o.searched.offsets, o.searched.searches, o.their_searches)
             for o in table_4()],
            out / "figure_11.png",
        )  # fmt: skip
        typer.echo(f"written to {out}: table3.csv, table4.csv, figure_7.png to figure_11.png")


if __name__ == "__main__":
    typer.run(main)
