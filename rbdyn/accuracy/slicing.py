"""Slices of a roller with a profile or between tilted races: error of the load and of the statistics against cost.

The load law is exact in itself: its error is measured at equal approach against a very fine slicing, over all loads
up to twice the largest on the shaft. Statistics come from short runs, against those of the finest slicing run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rbdyn.accuracy.report import Progress, Report, Table, record
from rbdyn.accuracy.tolerances import NEGLIGIBLE, OUTPUTS, Bias, bias_cells, bias_of, flat
from rbdyn.contact.hertz_line import line_load
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.metrics import Replicate
from rbdyn.dynamics.model import race_contact_law, roller_bearing
from rbdyn.dynamics.simulate import prepare, run_series
from rbdyn.faults import InputError
from rbdyn.option_cost import with_options
from rbdyn.scene import Scene

FORMAT = "rbdyn.slices/1"
COUNTS = (5, 9, 15, 21, 31, 61, 121, 241)
FINE = 1001  # the most a scene may have
LOADS = 40
TURNS, DISCARDED, REPLICATES = 20, 5, 4
# Loads below this share of the largest: the touching part is too short to matter to anything.
LIGHTEST = 0.02


@dataclass(frozen=True)
class Row(Bias):
    """One number of slices: largest relative error of the load at equal approach, nanoseconds a right-hand side."""

    slices: int
    load_error: float
    rhs_ns: float

    def as_dict(self) -> dict[str, Any]:
        """JSON form."""
        return dict(self.__dict__)


def study(
    scene: Scene, progress: Callable[[int, int], None] | None = None, counts: Sequence[int] = COUNTS
) -> Report:
    """``rbdyn accuracy --slices``. Raises InputError for a roller without slices, RunError, KeyboardInterrupt."""
    rows = slice_rows(scene, counts, progress)
    chosen = conclusion(rows, scene)
    header = ("slices", "load error", "ns a right-hand side", *OUTPUTS)
    cells = [
        (f"{row.slices}", f"{100.0 * row.load_error:.2g} %", f"{row.rhs_ns:.0f}", *bias_cells(row))
        for row in rows
    ]
    return Report(
        stem="slices",
        record=record(
            FORMAT,
            rows=[row.as_dict() for row in rows],
            conclusion=chosen,
            turns=TURNS,
            replicates=REPLICATES,
        ),
        tables=(Table(f"bias against {rows[-1].slices} slices, 95 % errors", header, cells),),
        sentences=(chosen, f"{REPLICATES} replicates of {TURNS} turns; load errors against {FINE} slices"),
        sheets={"slices": [flat(row) for row in rows]},
        pictures={"slices": lambda path: _draw(rows, path)},
    )


def slice_rows(
    scene: Scene, counts: Sequence[int] = COUNTS, progress: Callable[[int, int], None] | None = None
) -> list[Row]:
    """A row a number of slices, fewest first; the last is the reference of the statistics."""
    if not scene.needs_slices:
        raise InputError(
            [
                f"bearing.roller_profile = {scene.bearing.roller_profile!r} with bearing.tilt_mrad = 0: one slice is "
                "exact; give the roller a profile or the races a tilt to study its slices"
            ]
        )
    counts = sorted(counts)
    counted = Progress(progress, len(counts) * REPLICATES)
    series: dict[int, list[Replicate]] = {}
    for count in counts:
        cut = with_options(
            scene,
            (
                f"model.slices={count}",
                f"numerics.turns={TURNS}",
                f"numerics.discard_turns={DISCARDED}",
                f"numerics.impact_window_turns={TURNS}",
                f"numerics.replicates={REPLICATES}",
            ),
        )
        bearing = roller_bearing(cut)
        prepare(cut, bearing)
        series[count] = run_series(
            cut, bearing, [cut.numerics.rtol], 1, lambda done, total: counted.step(), Stop()
        )[0]
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
    directions = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)] if scene.bearing.tilt_mrad else [(1.0, 0.0)]
    errors = dict.fromkeys(counts, 0.0)
    for race in ("outer", "inner"):
        fine, laws = (
            contact_law(scene, race, FINE),
            {count: contact_law(scene, race, count) for count in counts},
        )
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


def conclusion(rows: Sequence[Row], scene: Scene) -> str:
    """The fewest slices whose load and statistics are right within 0.5 % or their errors."""
    for row in rows:
        if row.unbiased and row.load_error <= NEGLIGIBLE:
            return (
                f"{row.slices} slices are the fewest whose load is right within 0.5 % and that bias no output beyond "
                f"its error (or 0.5 %): {row.rhs_ns:.0f} ns a right-hand side. The scene has {scene.slices}."
            )
    return f"not even {rows[-1].slices} slices keep the load within 0.5 %"


def _draw(rows: Sequence[Row], path: Any) -> None:
    from rbdyn import plots

    plots.slices_at_work(rows, path)
