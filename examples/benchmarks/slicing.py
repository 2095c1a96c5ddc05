"""Slices of a roller with a profile or between tilted races: error of the load and of the statistics against cost.

The load law is exact in itself: its error is measured at equal approach against a very fine slicing, over all loads
up to twice the largest on the shaft. Statistics are compared with those of the finest slicing run.

``python examples/benchmarks/slicing.py [SCENE.toml]``, of a roller with a profile or between tilted races.
"""

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from studies import main

from rbdyn.accuracy.report import Progress, Report, Reporter, flat, records, reported
from rbdyn.accuracy.tolerances import (
    MARGIN,
    NEGLIGIBLE,
    Bias,
    bias_columns,
    bias_of,
    check_replicates,
    first_within,
    percent,
    undecided,
)
from rbdyn.accuracy.variants import with_options
from rbdyn.base.blocks import Sheet, columns_of
from rbdyn.base.faults import InputError
from rbdyn.base.records import shown
from rbdyn.contact.hertz_line import line_load
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.parameters.model import race_contact_law, roller_bearing
from rbdyn.dynamics.recording import run_series
from rbdyn.dynamics.run import prepare
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.scene import Scene

COUNTS = (5, 9, 15, 21, 31, 61, 121, 241)
FINE = 1001  # the most a scene may have
LOADS = 40
# Loads below this share of the largest: the touching part is too short to matter to anything.
LIGHTEST = 0.02


class Row(Bias):
    """One number of slices: largest relative error of the load at equal approach, nanoseconds a right-hand side."""

    slices: int = shown("slices")
    load_error: float = shown("load error", ".2g %")
    rhs_ns: float = shown("ns a right-hand side", ".0f")


def study(scene: Scene, progress: Reporter = None, counts: Sequence[int] = COUNTS, sought: float = MARGIN) -> Report:
    """A row a number of slices, and the fewest that keep load and statistics.

    Raises InputError for a roller without slices or a single replicate, RunError, KeyboardInterrupt.
    """
    rows = slice_rows(scene, counts, progress)
    chosen = conclusion(rows, scene, sought)
    numerics, written, finest = scene.numerics, records(rows), rows[-1]
    title = f"bias against {finest.slices} slices, 95 % errors"
    runs = f"{numerics.replicates} replicates of {numerics.turns:g} turns; load errors against {FINE} slices"
    return reported(
        "slices",
        (Sheet(title, (*columns_of(Row), *bias_columns(sought, lambda row: row, finest)), rows).block,),
        (chosen, runs),
        [flat(row) for row in written],
        lambda path: _draw(rows, path, sought),
        rows=written,
        conclusion=chosen,
        turns=numerics.turns,
        replicates=numerics.replicates,
        sought=sought,
    )


def slice_rows(scene: Scene, counts: Sequence[int] = COUNTS, progress: Reporter = None) -> list[Row]:
    """A row a number of slices, fewest first; the last is the reference of the statistics."""
    if not scene.needs_slices:
        plain = f"bearing.roller_profile = {scene.bearing.roller_profile!r} with bearing.tilt_mrad = 0"
        mend = "give the roller a profile or the races a tilt to study its slices"
        raise InputError([f"{plain}: one slice is exact; {mend}"])
    check_replicates(scene)
    counts = sorted(counts)
    counted = Progress(progress, len(counts) * scene.numerics.replicates)
    series: dict[int, list[Replicate]] = {}
    for count in counts:
        cut = with_options(scene, (f"model.slices={count}",))
        bearing = roller_bearing(cut)
        prepare(cut, bearing)
        series[count] = run_series(cut, bearing, [cut.numerics.rtol], 1, counted.step, Stop())[0]
    errors = load_errors(scene, counts)
    return [
        Row(
            **bias_of(runs, series[counts[-1]]).__dict__,
            slices=count,
            load_error=errors[count],
            rhs_ns=float(np.median([run.cpu_s / run.derivatives for run in runs])) * 1e9,
        )
        for count, runs in series.items()
    ]


def load_errors(scene: Scene, counts: Sequence[int]) -> dict[int, float]:
    """Largest relative error of the load over approaches, azimuths and both races, per number of slices."""
    largest = 2.0 * max(scene.operation.largest_load_N, 1.0)
    directions = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)] if scene.bearing.tilt else [(1.0, 0.0)]
    errors = dict.fromkeys(counts, 0.0)
    for race in ("outer", "inner"):
        fine, laws = (contact_law(scene, race, FINE), {count: contact_law(scene, race, count) for count in counts})
        overlaps = np.geomspace(1e-3, 1.0, LOADS) * overlap_at(fine, largest)
        for direction in directions:
            for overlap in overlaps:
                load = line_load(fine, overlap, *direction)[0]
                if load < LIGHTEST * largest:
                    continue
                for count, law in laws.items():
                    error = abs(line_load(law, overlap, *direction)[0] / load - 1.0)
                    errors[count] = max(errors[count], error)
    return errors


def contact_law(scene: Scene, race: str, slices: int) -> Any:
    """Load law of the "outer" or "inner" race with so many slices."""
    return race_contact_law(with_options(scene, (f"model.slices={slices}",)), race)


def overlap_at(law: Any, load: float) -> float:
    """Overlap [m] at which a contact bears a load [N], where the tilt is largest."""
    low, high = 0.0, 1e-6
    while line_load(law, high, 1.0, 0.0)[0] < load:
        high *= 2.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if line_load(law, middle, 1.0, 0.0)[0] < load else (low, middle)
    return high


def conclusion(rows: Sequence[Row], scene: Scene, sought: float = MARGIN) -> str:
    """The fewest slices shown to keep load and statistics, or what hides them.

    The last row is the reference of the statistics and no evidence for its own.
    """
    good = [row for row in rows if row.load_error <= NEGLIGIBLE]
    if not good:
        return f"not even {rows[-1].slices} slices keep the load within {percent(NEGLIGIBLE)}"
    why = f"{good[0].slices} slices are the fewest whose load is right within {percent(NEGLIGIBLE)}"
    fewest = f"{why}: {good[0].rhs_ns:.0f} ns a right-hand side. The scene has {scene.slices}."
    compared = [row for row in good if row is not rows[-1]]
    chosen, hidden = first_within(compared, lambda row: f"{row.slices} slices", sought)
    sentences = [fewest]
    if chosen is not None:
        what = f"At {chosen.slices} the biases of the outputs measure at most {percent(sought)}"
        sentences.append(f"{what} (their errors at most {percent(chosen.known_to)}).")
    if hidden:
        below = (chosen or rows[-1]).slices
        sentences.append(f"What fewer than {below} do to the outputs is {undecided(hidden, scene, sought)}.")
    return " ".join(sentences)


def _draw(rows: Sequence[Row], path: Any, sought: float) -> None:
    """Error of the load and bias of each output against the time of a right-hand side, marked with slices."""
    from rbdyn.plots.style import biases_at_work

    labels = "relative error", "processor time of a right-hand side [ns]"
    biases_at_work(rows, path, sought, labels, "rhs_ns", ("load at equal approach", "load_error"), "slices")


if __name__ == "__main__":
    sys.exit(main(study, __doc__, "all_options.toml"))
