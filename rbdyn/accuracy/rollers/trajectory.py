"""Stretches of motion with known ends: settled starts, references that two methods agree on, errors of others.

The motion is chaotic: two runs part about 500-fold a shaft turn, so a method can be told from another over part of a
turn only, and every span has its own floor below which the reference itself is not known.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rbdyn.accuracy.report import Table
from rbdyn.accuracy.rollers.methods import DOP853, OURS, Method, Stretch
from rbdyn.arrays import Array, Whole
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.scales import absolute_tolerance, layout_of
from rbdyn.dynamics.run import Run
from rbdyn.faults import InputError
from rbdyn.records.record import Record
from rbdyn.scene import Scene

DEFAULT_TURNS, LONGEST_TURNS = 0.25, 1.0
SPANS = (0.25, 0.5, 1.0)  # shaft turns after which the two references are compared
SETTLE_TURNS = 5.0
STARTS = 3
OUR_REFERENCE_RTOL, THEIR_REFERENCE_RTOL = 1e-12, 1e-13
# An error below this many times what the references differ by says nothing.
RESOLVED = 10.0


class Error(Record):
    """Largest difference of two states: of any position of roller, cage or ring [m], and of any component over its
    scale (the approach or speed of a race contact)."""

    position_m: float
    scaled: float


class Reference(Record):
    """Ends of the stretches by our method, and how far DOP853 is off them after spans of turns."""

    ends: Sequence[Array]
    agreement: dict[float, Error]

    def as_dict(self) -> dict[str, Any]:
        """JSON form: the methods, and how far they are apart."""
        agreement = [{"turns": span, **error.as_dict()} for span, error in self.agreement.items()]
        return {"methods": {OURS.name: OUR_REFERENCE_RTOL, DOP853.name: THEIR_REFERENCE_RTOL}, "agreement": agreement}

    def floor(self, turns: float) -> float:
        """Position error [m] below which a stretch of ``turns`` resolves nothing: that of the next longer span."""
        return RESOLVED * next(e.position_m for span, e in self.agreement.items() if span >= turns)


def starts_after_transient(scene: Scene, turns: float = DEFAULT_TURNS, starts: int = STARTS) -> list[Stretch]:
    """Stretches of so many shaft turns, each from where a replicate of its own has settled.

    Raises InputError for turns outside (0, 1], RunError.
    """
    if not 0.0 < turns <= LONGEST_TURNS:
        raise InputError([f"--trajectory {turns:g}: past a turn no reference holds; give more than 0 and at most 1"])
    bearing = roller_bearing(scene)
    scale = absolute_tolerance(scene, bearing, 1.0)
    # The clock runs exactly in every method; its scale only has to be a number.
    scale[~np.isfinite(scale)] = 1.0
    stretches = []
    for replicate in range(starts):
        run = Run(scene, bearing, replicate, scene.numerics.rtol, Stop())
        run.to(SETTLE_TURNS)
        stretches.append(Stretch(scene, bearing, run.carry.y.copy(), turns, scale))
    return stretches


def positions(scene: Scene) -> Whole:
    """Indices of the positions of rollers, cage and rings [m] in the state."""
    return np.flatnonzero([part.unit == "m" for part in layout_of(scene).components])


def difference(stretch: Stretch, a: Array, b: Array) -> Error:
    """How far two states are apart."""
    apart = np.abs(a - b)
    return Error(float(apart[positions(stretch.scene)].max()), float((apart / stretch.scale).max()))


def worst(errors: Sequence[Error]) -> Error:
    """The largest of each."""
    return Error(max(e.position_m for e in errors), max(e.scaled for e in errors))


def reference(stretches: Sequence[Stretch], step: Callable[[], None] = lambda: None) -> Reference:
    """Integrate every stretch by both reference methods. Raises RunError. ``step()`` is called after each."""
    ends = [end_of(OURS, stretch, OUR_REFERENCE_RTOL) for stretch in stretches]
    apart: dict[float, list[Error]] = {span: [] for span in SPANS}
    for stretch in stretches:
        ours = theirs = stretch.start
        before = 0.0
        for span in SPANS:
            ours, theirs = (
                end_of(method, replace(stretch, start=y, turns=span - before), rtol)
                for method, y, rtol in ((OURS, ours, OUR_REFERENCE_RTOL), (DOP853, theirs, THEIR_REFERENCE_RTOL))
            )
            apart[span].append(difference(stretch, ours, theirs))
            before = span
        step()
    return Reference(ends, {span: worst(errors) for span, errors in apart.items()})


def end_of(method: Method, stretch: Stretch, setting: float) -> Array:
    """State at the end of a stretch. Raises RunError."""
    return method.ready(stretch, setting)().y


def agreement_table(known: Reference) -> Table:
    """How far the references are apart after each span."""
    cells = [(f"{span:g}", f"{e.position_m:.2g}", f"{e.scaled:.2g}") for span, e in known.agreement.items()]
    return Table(
        f"the two references: {OURS.name} at {OUR_REFERENCE_RTOL:g}, {DOP853.name} at {THEIR_REFERENCE_RTOL:g}",
        ("turns", "positions apart [m]", "worst component over its scale"),
        cells,
    )
