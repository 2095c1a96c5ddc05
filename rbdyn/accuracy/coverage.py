"""Coverage: how often the stated intervals contain the truth, which is the claim of an error bar.

The truth is one long, settled, tightly integrated run with seeds of its own. The scene is then repeated with other seeds.
For every figure the study counts how often value and ``Quantity.error`` contain the truth, whose own error joins as root
sum of squares. It gives the same for the statistical error alone, the mean half-width and the mean offset. An interval that
always contains the truth is too wide.
"""

import math
from typing import Any

from rbdyn.accuracy.report import Progress, Report, Reporter, records, reported
from rbdyn.base.blocks import Sheet, columns_of
from rbdyn.base.records import Record, shown
from rbdyn.base.words import NORMAL, error_alone, value_alone, with_error
from rbdyn.dynamics.ensemble import in_turn
from rbdyn.dynamics.figures import BEARING
from rbdyn.dynamics.run import with_numerics
from rbdyn.dynamics.simulate import simulate
from rbdyn.result import SimulationResult
from rbdyn.scene import Scene

REPEATS = 200
# Of the truth: least replicates, turns counted over those of the scene, largest rtol, seed. It discards half as many turns as
# it counts.
TRUTH_REPLICATES, TRUTH_LENGTH, TRUTH_RTOL, TRUTH_SEED = 64, 10.0, 1e-3, 987_654
FIRST_SEED, SEED_STEP = 5000, 37
# Shares of a sound interval; a single figure scatters by 3 % over 200 repeats.
POOLED, LOWEST = (0.94, 0.96), 0.90


class Row(Record):
    """One figure: truth with its error, shares of repeats in which the stated error, and the statistical one alone, cover it.

    Also mean half-width and mean offset relative to the truth.
    """

    figure: str = shown("figure")
    truth: float = shown("truth", value_alone, error="truth_error")
    truth_error: float = shown("±", lambda error: error_alone(error).removeprefix("± "))
    covered: float = shown("covered", ".3f")
    statistical_alone: float = shown("statistical alone", ".3f")
    half_width: float = shown("half-width", ".2g %")
    offset: float = shown("offset", "+.2g %")


def study(scene: Scene, progress: Reporter = None, repeats: int | None = None) -> Report:
    """``rbdyn accuracy SCENE coverage``, ``REPEATS`` repeats unless given. Raises RunError, KeyboardInterrupt."""
    scene, repeats = one_bearing(scene), repeats or REPEATS
    exact = truth_of(scene)
    counted = Progress(progress, [in_turn(exact), *[in_turn(scene)] * repeats])
    truth = simulate(exact)
    counted.step()
    seeds = (FIRST_SEED + SEED_STEP * k for k in range(repeats))
    results = [simulate(with_numerics(scene, seed=seed)) for seed in counted.over(seeds)]
    rows = [row(figure.key, truth, results) for figure in BEARING if figure.slow]
    turns = sum(result.cost["turns"] for result in results) / repeats
    turns_each = scene.numerics.turns + scene.numerics.warm_up_turns
    longer = sum(result.counted_turns > 1.01 * scene.numerics.turns for result in results) / repeats
    planned = turns_each * (scene.numerics.replicates + scene.numerics.companions)
    length = (
        f"A run took {turns:.0f} shaft turns over all replicates and companions instead of the {planned:.0f} asked for, and "
        f"{100.0 * longer:.0f} % of the runs were lengthened."
    )
    sentences = [conclusion(rows, repeats), length]
    sheet = Sheet(f"95 % intervals that contain the truth, {repeats} repeats", columns_of(Row), rows)
    written = records(rows)
    figures: dict[str, Any] = {"pooled": pooled(rows), "repeats": repeats, "mean_turns": turns, "lengthened": longer}
    return reported(
        "coverage", (sheet.block,), sentences, written, rows=written, **figures, conclusion=" ".join(sentences)
    )


def one_bearing(scene: Scene) -> Scene:
    """The scene with the rollers of its seed, since another seed would be another bearing, not a repeat."""
    radii = scene.geometry.roller_radii
    if radii is None:
        return scene
    errors_um = (1e6 * radii - 500.0 * scene.bearing.roller_diameter_mm) / 0.5
    rollers = {"roller_diameter_spread_um": 0.0, "roller_diameter_errors_um": errors_um.tolist()}
    return scene.model_copy(update={"bearing": scene.bearing.model_copy(update=rollers)})


def truth_of(scene: Scene) -> Scene:
    """The scene of the truth: long after the transient, or as long as asked for with a schedule."""
    numerics = scene.numerics
    steady = scene.operation.schedule is None
    turns = TRUTH_LENGTH * numerics.turns
    return with_numerics(
        scene,
        replicates=max(TRUTH_REPLICATES, numerics.replicates),
        turns=turns if steady else numerics.turns,
        discard_turns=max(0.5 * turns, numerics.warm_up_turns) if steady else numerics.discard_turns,
        rtol=min(TRUTH_RTOL, 0.1 * numerics.rtol),
        impact_window_turns=scene.impact_window_turns,
        seed=TRUTH_SEED,
        companion=False,
        extend=False,
    )


def row(name: str, truth: SimulationResult, results: list[SimulationResult]) -> Row:
    """Coverage of one figure."""
    exact = truth.figures[name]
    doubt, size = exact.statistical_error or 0.0, abs(exact.value) or 1.0
    figures = [result.figures[name] for result in results]
    count = len(figures)

    def share(errors: list[float]) -> float:
        pairs = zip(figures, errors, strict=True)
        return sum(abs(figure.value - exact.value) <= math.hypot(error, doubt) for figure, error in pairs) / count

    return Row(
        figure=name,
        truth=exact.value,
        truth_error=doubt,
        covered=share([figure.error or 0.0 for figure in figures]),
        statistical_alone=share([figure.statistical_error or 0.0 for figure in figures]),
        half_width=sum(figure.error or 0.0 for figure in figures) / count / size,
        offset=sum(figure.value - exact.value for figure in figures) / count / size,
    )


def pooled(rows: list[Row]) -> float:
    """Share over all figures; those that agree by definition (slip and speed; contact and impact of a dry pocket) count once."""
    same = {"cage_slip"}
    truth = {row.figure: row.truth for row in rows}
    if truth["impact_contact_force_N"] == truth["impact_force_N"]:
        same.add("impact_contact_force_N")
    distinct = [row for row in rows if row.figure not in same]
    return sum(row.covered for row in distinct) / len(distinct)


def conclusion(rows: list[Row], repeats: int) -> str:
    """Whether the intervals cover the truth as often as they claim."""
    low, high = POOLED
    share, scatter = pooled(rows), NORMAL * math.sqrt(0.95 * 0.05 / repeats)
    narrow = [f"{row.figure} {row.covered:.2f}" for row in rows if row.covered < LOWEST]
    over_all = f"Pooled over the results {share:.3f} ({with_error(0.95, scatter)} for a sound interval of one result)"
    if narrow:
        return f"{over_all}; too narrow (below {LOWEST:.2f}): {', '.join(narrow)}."
    if share > high:
        return f"{over_all}; none is too narrow, together they are wider than they need be."
    return f"{over_all}; none below {LOWEST:.2f}." if share >= low else f"{over_all}; together they are too narrow."
