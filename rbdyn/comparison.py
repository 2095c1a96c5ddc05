"""Comparison of two bearings, simulated or saved: the inputs that differ, and each figure with the error of its difference.

The runs are independent, so errors add as squares, statistical ones by Welch. The intervals of all figures of the bearing hold
together with 95 % (Bonferroni), and so do those of its parts. A ball bearing in equilibrium has no scatter, so each difference
beyond the accuracy of the solver counts.
"""

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rbdyn.base.blocks import Column, Sheet, columns_of, within
from rbdyn.base.estimate import errors_of_differences
from rbdyn.base.faults import InputError, RunError, read_text, refuse
from rbdyn.base.notes import Level, Note, Notes, merged
from rbdyn.base.records import Record, finite, leaves, shown, written
from rbdyn.base.words import (
    Brief,
    Figure,
    Notice,
    counted,
    label,
    named,
    part_of,
    quantity,
    signed_with_error,
    value_alone,
)
from rbdyn.base.words import shown as value_text
from rbdyn.result import Quantity, SavedRecord, SimulationResult, arrays_of, full_status
from rbdyn.scene import BallScene, Scene, scene_of
from rbdyn.scene.keys import default_of

if TYPE_CHECKING:
    import pandas as pd

    from rbdyn.dynamics.ensemble import Reporter
    from rbdyn.quasistatic.result import BallResult

# Smaller differences of figures without scatter come from the accuracy of the solver: relative, and in the unit of the figure.
SOLVER, ROUNDING = 1e-6, 1e-9
# Replicates from which Student's quantile for six figures together is small: 3.1 where both have eight, 4.9 where both have three.
ENOUGH = 8
SIGNIFICANT, WITHIN, EQUAL, UNKNOWN = "significant", "within error", "equal", "error unknown"


class Input(Record):
    """A key of the scene with another value in A than in B; None where the scene has no such key.

    ``a_default``, ``b_default``: whether the value is the default of the key.
    """

    key: str = shown("key", meaning="key of the scene, its unit at the end")
    a: Any = shown("A", cell=lambda entry: value_words(entry.a, entry.a_default), text=True, unit="of the key",
                   meaning="its values; empty where the scene has no such key")  # fmt: skip
    b: Any = shown("B", cell=lambda entry: value_words(entry.b, entry.b_default), text=True)
    a_default: bool = written("whether the value is the default")
    b_default: bool = written("")

    @property
    def is_left_out(self) -> bool:
        """Whether only one scene has such a table, and the key there is at its default."""
        return (self.a is None and self.b_default) or (self.b is None and self.a_default)


def value_words(value: Any, is_default: bool) -> str:
    """A value of a key, and whether it is the default."""
    text = "not stated" if value is None else value_text(value, 8)
    return f"{text} (default)" if is_default else text


def input_sheet(inputs: Sequence[Input]) -> Sheet[Input]:
    """A row a key that differs."""
    content = "One row per key that differs, of `rbdyn compare`."
    return Sheet("", columns_of(Input), inputs, file="inputs.csv", content=content)


class Difference(Record):
    """A figure of A and of B, and B less A; None where one of them has no such figure.

    ``error``: half-width of the 95 % interval of the difference alone; ``error_together``: of the interval that holds together
    with those of the other figures of its table. None where an error is unknown. ``verdict``: "significant", "within error" (of
    ``error_together``), "equal", "error unknown", "only in A" or "only in B".
    """

    a: float | None = shown(
        "A", value_alone, error="error_together", unit="of the result", meaning="its values, and B less A"
    )
    b: float | None = shown("B", value_alone, error="error_together")
    difference: float | None = shown("B - A", cell=lambda figure: figure.words)
    error: float | None = written("half width of the 95 % interval of this difference alone", unit="of the result")
    error_together: float | None = written(
        "half width that holds jointly for all results of the bearing, or of the parts", unit="of the result"
    )
    verdict: str = shown(
        "difference",
        text=True,
        meaning="significant, within error (`error_together`), equal, error unknown, only in A or B",
    )

    @property
    def percent(self) -> float | None:
        """B less A over the size of A [%]; None without either, or where A is 0."""
        return None if self.difference is None or not self.a else 100.0 * self.difference / abs(self.a)

    @property
    def words(self) -> str:
        """B less A with its error."""
        if self.difference is None or self.verdict == EQUAL:
            return "" if self.difference is None else "0"
        return signed_with_error(self.difference, self.error_together)


DIFFERENCES: tuple[Column[tuple[str, Difference]], ...] = (
    Column("figure", label, at=0, meaning="name of the result, its unit at the end"),
    *within(1, columns_of(Difference)),
    Column("percent", screen=False, unit="%", at=(1, "percent"), meaning="difference over the size of A"),
)


def difference_sheet(figures: Mapping[str, Difference]) -> Sheet[tuple[str, Difference]]:
    """A row a figure."""
    content = "One row per result of `rbdyn compare`, parts last."
    return Sheet("", DIFFERENCES, tuple(figures.items()), file="differences.csv", content=content)


class Side(Record):
    """One of the two: its name, status, resolved scene and versions, and seed and replicates of a roller bearing."""

    name: str
    status: str
    scene: dict[str, Any]
    versions: dict[str, str]
    seed: int | None = None
    replicates: int | None = None


class Comparison(Brief, SavedRecord, kw_only=True):
    """Two bearings side by side: inputs that differ, figures of the bearing and of its parts by name, notes."""

    FORMAT = "rbdyn.comparison/1"
    WHAT = "comparison"
    status: str
    kind: str
    a: Side
    b: Side
    inputs: tuple[Input, ...]
    figures: dict[str, Difference]
    parts: dict[str, Difference]
    notes: Notes

    @property
    def failed(self) -> bool:
        """Whether a bearing has no figures that hold: no equilibrium, or no steady state."""
        return self.status != "ok"

    def brief(self) -> tuple[str, list[Figure]]:
        """Number of inputs that differ; the differences of the figures."""
        figures = [
            Figure(words, figure.difference, figure.error_together, unit)
            for name, figure in self.figures.items()
            for words, unit in (quantity(name),)
        ]
        return f"{self.b.name} less {self.a.name}, {counted(len(self.inputs), 'input')} differ", figures

    def table(self) -> "pd.DataFrame":
        """A row a figure, those of the parts last; units in the names."""
        return difference_sheet(self.figures | self.parts).frame


def compare(
    a: "Scene | BallScene | SimulationResult | BallResult | Path | str",
    b: "Scene | BallScene | SimulationResult | BallResult | Path | str | None" = None,
    overrides: Iterable[str] = (),
    both: Iterable[str] = (),
    workers: int | None = None,
    progress: "Reporter" = None,
    notice: Notice = None,
) -> Comparison:
    """Compare two bearings of one kind, rollers or balls.

    - ``a``, ``b``: a scene, the path of its file, a result, the path of a saved one or of its folder; scenes are simulated
    - ``overrides``: keys of B with other values, such as ``["cage.mass_g=50"]``; without ``b`` B is A with them
    - ``both``: overrides of both, such as ``["numerics.turns=100"]``
    - ``workers``, ``progress``, ``notice``: as of ``rbdyn.simulate``

    Raises InputError for bad input and for a roller bearing against a ball bearing, RunError where a bearing cannot be simulated,
    KeyboardInterrupt.
    """
    overrides, both = list(overrides), list(both)
    if b is None and not overrides:
        raise InputError("B: missing; name a second scene or result, or say by --set what differs from A")
    names = [_name(a, "A"), ", ".join([_name(a if b is None else b, "B"), *overrides])]
    sources = [_resolved(a, both), _resolved(a if b is None else b, [*overrides, *both])]
    kinds = [_kind(source) for source in sources]
    if kinds[0] != kinds[1]:
        raise InputError(
            f"A is a bearing with {kinds[0]} and B one with {kinds[1]}: they have no results in common; compare two of one kind"
        )
    if isinstance(sources[0], Scene | BallScene) and sources[0] == sources[1]:
        sources = sources[:1]
    results: list[Any] = []
    for place, source in enumerate(sources):
        steps, words = part_of(progress, place, len(sources)), named(notice, "AB"[place])
        try:
            results.append(_result(source, workers, steps, words))
        except RunError as error:
            raise RunError(f"{'AB'[place]}, {names[place]}: {error}") from None
    return comparison(results[0], results[-1], *names)


def comparison(a: Any, b: Any, name_a: str = "A", name_b: str = "B") -> Comparison:
    """Compare two results of one kind that are already there."""
    sides = [
        Side(
            name,
            full_status(result),
            result.scene,
            result.versions,
            getattr(result, "seed", None),
            getattr(result, "replicates", None),
        )
        for name, result in ((name_a, a), (name_b, b))
    ]
    from rbdyn.dynamics.figures import repeated

    figures = [_figures(a), _figures(b)]
    repeats = repeated(*figures)
    failed = [f"{place}: {full_status(result)}" for place, result in (("A", a), ("B", b)) if result.status != "ok"]
    return Comparison(
        status="; ".join(failed) or "ok",
        kind=_kind(a),
        a=sides[0],
        b=sides[1],
        inputs=different_inputs(a.scene, b.scene),
        figures=differences(*({key: result[key] for key in result if key not in repeats} for result in figures)),
        parts=differences(*(getattr(result, "part_figures", None) or {} for result in (a, b))),
        notes=tuple(_notes(a, b)),
    )


def differences(first: Mapping[str, Quantity], second: Mapping[str, Quantity]) -> dict[str, Difference]:
    """Every figure of two tables, whose intervals hold together; the count leaves out figures without scatter or errors."""
    common = [name for name in first if name in second]
    ours, theirs = [first[name] for name in common], [second[name] for name in common]
    error, wide = errors_of_differences(arrays_of(ours), arrays_of(theirs))
    found = {
        name: _difference(a_value.value, b_value.value, float(half), float(together))
        for name, a_value, b_value, half, together in zip(common, ours, theirs, error, wide, strict=True)
    }
    for figures, place in ((first, "A"), (second, "B")):
        for name in figures.keys() - found.keys():
            value = figures[name].value
            at_a, at_b = (value, None) if place == "A" else (None, value)
            found[name] = Difference(at_a, at_b, None, None, None, f"only in {place}")
    return {name: found[name] for name in dict.fromkeys([*first, *second])}


def _difference(a: float, b: float, error: float, together: float) -> Difference:
    size = abs(b - a)
    if size <= (max(SOLVER * max(abs(a), abs(b)), ROUNDING) if error == 0.0 else 0.0):
        verdict = EQUAL
    elif math.isnan(together):
        verdict = UNKNOWN
    else:
        verdict = SIGNIFICANT if size > together else WITHIN
    return Difference(a, b, b - a, finite(error), finite(together), verdict)


def _name(source: Any, otherwise: str) -> str:
    return str(source) if isinstance(source, str | PathLike) else otherwise


def file_of(path: Path) -> Path:
    """The file of a scene or of a saved result; of a folder its result.json."""
    return path / "result.json" if path.is_dir() else path


def _resolved(source: Any, overrides: Sequence[str]) -> Any:
    """The scene of a source, or the result. Raises InputError for bad input, and for overrides of a result."""
    if isinstance(source, str | PathLike):
        path = Path(source)
        if not path.is_dir() and path.suffix.lower() != ".json":
            return scene_of(path, overrides)
        result = _saved(file_of(path))
    elif isinstance(source, SimulationResult) or type(source).__name__ == "BallResult":
        result = source
    else:
        return scene_of(source, overrides)
    if overrides:
        refuse(
            [
                f"{overrides[0]}: {_name(source, 'a result')} is a saved result, which no key changes; name the file of its scene"
            ]
        )
    return result


def _saved(path: Path) -> Any:
    """The saved result of a roller or ball bearing. Raises InputError for any other file."""
    data = None
    if path.is_file():
        with suppress(ValueError, RecursionError):
            data = json.loads(read_text(path))
    if isinstance(data, dict) and str(data.get("format")).startswith("rbdyn.ball/"):
        from rbdyn.quasistatic.result import BallResult

        return BallResult.load(path)
    return SimulationResult.load(path)


def _kind(source: Any) -> str:
    """'rollers' or 'balls', of a scene or a result."""
    return "rollers" if isinstance(source, Scene | SimulationResult) else "balls"


def _result(source: Any, workers: int | None, progress: "Reporter", notice: Notice) -> Any:
    if isinstance(source, Scene):
        from rbdyn.dynamics.ensemble import plan_of, threads_of
        from rbdyn.dynamics.simulate import simulate

        if notice is not None:
            notice(plan_of(source, threads_of(workers)))
        return simulate(source, workers, progress, notice=notice)
    if isinstance(source, BallScene):
        from rbdyn.quasistatic.bearing import equilibrium

        return equilibrium(source)
    return source


def _figures(result: Any) -> dict[str, Quantity]:
    """Figures of the bearing; those of an equilibrium are exact."""
    if isinstance(result, SimulationResult):
        return result.quantities
    return {name: Quantity(value, 0.0, 0.0, 1.0) for name, value in result.figures.items()}


def _notes(a: Any, b: Any) -> Iterator[Note]:
    """Dangers and warnings of both, and what makes figures of one unlike those of the other besides the inputs."""
    yield from merged({"A": a.notes or (), "B": b.notes or ()}, "of {}", Level.WARNING)
    other = [name for name in a.versions if a.versions[name] != b.versions.get(name)]
    if other:
        change = ", ".join(f"{name} {a.versions[name]} and {b.versions.get(name, 'unknown')}" for name in other)
        yield Note("versions", f"A and B were computed by other versions, which differ too: {change}")
    windows = [getattr(result, "impact_window_turns", None) for result in (a, b)]
    if windows[0] != windows[1]:
        yield Note(
            "windows",
            f"the impact force is the largest in {windows[0]:g} shaft turns of A and in {windows[1]:g} of B, so that it differs "
            "for that alone; make numerics.impact_window_turns and the turns alike",
        )
    replicates = [getattr(result, "replicates", ENOUGH) for result in (a, b)]
    if min(replicates) < ENOUGH:
        yield Note(
            "few-replicates",
            f"intervals rest on {replicates[0]} and {replicates[1]} replicates; with {ENOUGH} of each (--replicates) they are far "
            "narrower",
        )


def different_inputs(a: Mapping[str, Any], b: Mapping[str, Any]) -> tuple[Input, ...]:
    """Keys of two resolved scenes with other values, in their order."""
    # None counts as no value.
    sides = [{key: value for key, value in leaves(scene) if value is not None} for scene in (a, b)]
    found = []
    for key in dict.fromkeys([*sides[0], *sides[1]]):
        default = default_of(key, Scene if "cage" in a else BallScene)
        # A saved scene leaves out some keys at their default.
        ours, theirs = (
            side.get(key, default if any(other.startswith(f"{key.rpartition('.')[0]}.") for other in side) else None)
            for side in sides
        )
        if ours != theirs:
            defaults = [value is not None and value == default for value in (ours, theirs)]
            found.append(Input(key, ours, theirs, *defaults))
    return tuple(found)
