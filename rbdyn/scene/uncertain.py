"""Inputs that nobody knows: how a scene or a study declares them, and the documented ranges of what drawings leave open.

``[uncertain]`` holds a law a key; ``unknown_inputs.toml`` next to this module the ranges of keys with their reasons. Neither
changes a run: they show how the scenes around it differ.
"""

import functools
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, field_validator, model_validator

from rbdyn.base.faults import LONGEST_NAME, Claims, Strict, assignment_faults, key_path, one_line
from rbdyn.base.fields import SMALLEST, Number, Positive, no_power_of_two, or_refuse

# What each law needs next to its name, and what it may have.
NEEDS = {
    "uniform": ("low", "high"),
    "log_uniform": ("low", "high"),
    "triangular": ("low", "mode", "high"),
    "normal": ("mean", "sd"),
    "choices": ("values",),
}
MAY = {"normal": ("low", "high"), "choices": ("weights",)}
NUMBERS = ("low", "high", "mode", "mean", "sd", "values", "weights")
MOST_CHOICES = 6
# How an input set is run: one window of the impact a replicate, for sets show more than turns.
RUNS = (
    "numerics.turns=20",
    "numerics.discard_turns=20",
    "numerics.replicates=2",
    "numerics.extend=false",
    "numerics.companion=false",
)
LEFT_OUT = "left out"
# Tables of a scene that say nothing of the bearing, so that nobody can fail to know them.
NO_INPUTS = ("numerics", "uncertain", "calibrate")
# What decides keys that ``set`` of any list must leave alone.
SEEDS = "every run has a seed of its own; leave it out"
DECLARATIONS = "no run depends on it; write it in its own table"
# Keys that neither factors of a study nor conditions of a rig can be.
RUN_KEYS = Claims(
    {
        ("numerics", "seed"): "every run has a seed of its own; choose another key",
        ("numerics", "replicates"): "each kind of run has its own number of them; choose another key",
        ("uncertain",): "no run depends on it; choose another key",
        ("calibrate",): "no run depends on it; choose another key",
    }
)
# Ends of a range that are nearer than this share of them are lost in rounding, as is a deviation of less.
FINEST = 1e-9
# Standard deviations from the mean beyond which an end leaves nothing of a normal law, and the narrowest cut of one.
FARTHEST, NARROWEST = 6.0, 1e-6


class Law(Strict):
    """How an input is distributed: one true value that nobody knows, or one that differs from case to case."""

    law: Literal["uniform", "log_uniform", "triangular", "normal", "choices"]
    """Distribution: uniform or log_uniform between low and high, triangular about mode, normal of mean and sd (cut at low
    and high where given), or choices among values."""
    low: Number | None = None
    """Lowest value."""
    high: Number | None = None
    """Highest value."""
    mode: Number | None = None
    """Likeliest value, of law = "triangular"."""
    mean: Number | None = None
    """Mean, of law = "normal"."""
    sd: Positive | None = None
    """Standard deviation, of law = "normal"."""
    values: Annotated[list[str | bool | int | Number], Field(min_length=2, max_length=MOST_CHOICES)] | None = None
    """What there is to choose from, of law = "choices"; laws of the model are compiled once each."""
    weights: list[Positive] | None = None
    """How likely each of the values is, in proportion; equally where left out."""
    times: str | None = None
    """Key whose value the numbers multiply, a number other than 0; the key itself for a range about what the scene has
    there."""
    kind: Literal["unknown", "varies"] = "unknown"
    """unknown: one true value, worth measuring; varies: differs from bearing to bearing or from day to day."""
    measurable: Positive | None = None
    """Standard deviation with which the value could be measured, in its unit."""

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        needed = NEEDS[self.law]
        may = (*needed, *MAY.get(self.law, ()))
        given = {name for name in NUMBERS if getattr(self, name) is not None}
        faults = [f"{name}: missing; law = '{self.law}' needs it" for name in needed if name not in given]
        faults += [
            f"{name}: law = '{self.law}' has none; leave it out"
            for name in NUMBERS
            if name in given and name not in may
        ]
        faults += self._choice_faults() if self.law == "choices" else self._range_faults()
        return or_refuse(self, faults or self._normal_faults())

    def _choice_faults(self) -> Iterator[str]:
        values = self.values or []
        if self.weights is not None and len(self.weights) != len(values):
            yield f"weights = {self.weights}: not one for each of the values; give as many"
        if any(value in values[:place] for place, value in enumerate(values)):
            yield f"values = {values}: name each value once; weights give how likely it is"
        if self.times is not None:
            yield f"times = '{self.times}': choices are no numbers to multiply; leave it out"
        if self.measurable is not None:
            yield f"measurable = {self.measurable:g}: a choice is not measured to a deviation; leave it out"

    def _range_faults(self) -> Iterator[str]:
        low, high, mode = self.low, self.high, self.mode
        if low is not None and high is not None:
            if not low < high:
                yield f"low = {low:g}: not below high = {high:g}; exchange them"
            elif high - low < FINEST * max(abs(low), abs(high)):
                yield f"low = {low!r}: high = {high!r} is too near to it; widen the range"
            elif mode is not None and not low <= mode <= high:
                yield f"mode = {mode:g}: not between low = {low:g} and high = {high:g}; put it there"
        if self.law == "log_uniform" and low is not None and low < SMALLEST:
            yield f"low = {low:g}: law = 'log_uniform' needs a positive one, {SMALLEST:g} at least; raise it"

    def _normal_faults(self) -> Iterator[str]:
        """Whether the ends of a normal law leave enough of it, and rounding its deviation."""
        low, high, mean, sd = self.low, self.high, self.mean, self.sd
        if self.law != "normal" or mean is None or sd is None:
            return
        if sd < FINEST * abs(mean):
            yield f"sd = {sd:g}: is lost in rounding next to mean = {mean:g}; raise it"
        for name, end, beyond in (("low", low, 1.0), ("high", high, -1.0)):
            if end is not None and beyond * (end - mean) > FARTHEST * sd:
                yield f"{name} = {end:g}: is more than {FARTHEST:g} sd beyond mean = {mean:g}, where nothing is left; move it"
        if low is not None and high is not None and high - low < NARROWEST * sd:
            yield f"sd = {sd:g}: is over a million times as wide as low to high; write law = 'uniform'"


@dataclass(frozen=True)
class Sampled:
    """How an input of a posterior sample is distributed: its ``values``, sorted."""

    values: tuple[Any, ...]
    law: Literal["sample"] = "sample"
    times: None = None
    kind: Literal["unknown"] = "unknown"
    measurable: None = None

    def model_dump(self, **_: Any) -> dict[str, Any]:
        """A declared law in a record."""
        return {"law": self.law, "rows": len(self.values), "low": self.values[0], "high": self.values[-1]}


class Correlation(Strict):
    """Inputs that go together."""

    keys: Annotated[list[str], Field(min_length=2, max_length=2)]
    """The two keys, each pair once."""
    rank: Annotated[float, Field(gt=-1.0, lt=1.0)]
    """Their rank correlation (Spearman's)."""


class Uncertain(Strict):
    """Unknown inputs: "table.key" = {law = ...} of any key of a scene, and how much of the rest varies."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Law] = Field(init=False)

    defaults: Literal["documented", "none"] = "documented"
    """documented: keys left at their default, or named in estimated, vary over their documented range where their law is
    switched on (rbdyn keys lists the ranges); none: only what is named here, in estimated or with a law."""
    estimated: list[str] = []
    """Keys of the scene whose values are estimates: they vary over their documented range, whatever defaults says."""
    points: Annotated[int, Field(ge=16, le=4096)] = 128
    """Input sets to start from, a power of two; more are added until the spread is known."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the input sets."""
    inputs: Annotated[int, Field(ge=1, le=30)] = 12
    """Most inputs of an emulator, those with the largest main effects and all declared ones. Every unknown input varies in every
    input set; what the others do counts as scatter. doe calibrate looks for no more than so many."""
    set: list[str] = list(RUNS)
    """Keys of the scene that differ in the runs of input sets, as key=value. A list replaces single keys of the default
    and keeps the others. A key in it is known: it has neither a law nor its documented range."""
    sample: str | None = None
    """CSV of a posterior sample, a row an input set, whose columns are keys; replaces their laws. Its path is from the
    folder of this file."""
    correlation: list[Correlation] = []
    """Rank correlations of inputs."""

    @property
    def laws(self) -> Mapping[str, Law]:
        """Law by key."""
        return self.__pydantic_extra__ or {}

    @field_validator("set")
    @classmethod
    def _merged(cls, given: list[str]) -> list[str]:
        """The default's assignments of keys that the list leaves alone, then the list."""
        paths = [key_path(each) for each in given]
        return [*(each for each in RUNS if key_path(each) not in paths), *given]

    @model_validator(mode="before")
    @classmethod
    def _quoted(cls, data: Any) -> Any:
        """A dotted key without quotes is a table within a table in TOML."""
        tables = data.items() if isinstance(data, Mapping) else ()
        faults = [
            f'{table}.{key}: write the key in quotes, "{table}.{key}" = {{law = ...}}'
            for table, keys in tables
            if table not in cls.model_fields and isinstance(keys, Mapping) and "law" not in keys
            for key, law in keys.items()
            if isinstance(law, Mapping)
        ]
        return or_refuse(data, map(one_line, faults))

    @model_validator(mode="after")
    def _known(self) -> Self:
        names = {key: one_line(key, LONGEST_NAME) for key in self.laws}
        faults = [f'{name}: no key of a scene; write "table.key"' for key, name in names.items() if "." not in key]
        faults += [
            f'"{name}": {key.partition(".")[0]} holds nothing that can be unknown of a bearing; take its law out'
            for key, name in names.items()
            if "." in key and key.partition(".")[0] in NO_INPUTS
        ]
        faults += no_power_of_two("points = ", self.points)
        return or_refuse(self, [*faults, *self._overlaps(), *self._correlation_faults(), *self._set_faults()])

    def _overlaps(self) -> Iterator[str]:
        """Laws of keys of which one is a table that holds the other."""
        laws = self.laws
        for key in laws:
            parts = key.split(".")
            for end in range(1, len(parts)):
                if (table := ".".join(parts[:end])) in laws:
                    yield f'"{key}": {table} has a law too, which replaces it; take one of them out'

    def _correlation_faults(self) -> Iterator[str]:
        laws, pairs = self.laws, set[frozenset[str]]()
        for keys in (pair.keys for pair in self.correlation):
            yield from (f"correlation.keys: {key} has no law here; give it one" for key in keys if key not in laws)
            pair = frozenset(keys)
            if len(pair) == 1:
                yield f"correlation.keys = {keys}: a key always goes with itself; name two"
            elif pair in pairs:
                yield f"correlation.keys = {keys}: this pair is given twice; keep one"
            pairs.add(pair)

    def _set_faults(self) -> list[str]:
        laws = [path for key in self.laws if (path := tuple(key.split(".")))[0] not in NO_INPUTS]
        claims = dict.fromkeys(laws, "is an unknown input, which has a law here; keep one of them")
        claims |= {
            tuple(key.split(".")): "is an unknown input, named in estimated; keep one of them" for key in self.estimated
        }
        claims |= {("numerics", "seed"): SEEDS, ("uncertain",): DECLARATIONS, ("calibrate",): DECLARATIONS}
        return assignment_faults("set", self.set, claims)


class Calibrate(Strict):
    """How inputs are found from measurements by doe calibrate."""

    discrepancy: dict[str, Annotated[float, Field(gt=0.0, le=1.0)]] | Literal["none"] = {}
    """By how much the simulation itself may err in an output, as a share, by the output's name. Where not named: a tenth of
    the standard deviation that the unknown inputs give the output at a condition, by the first wave of input sets. An error
    as small leaves the patterns of the inputs visible, and fits a cage speed that varies by 0.3 % as well as a loss that
    varies by 50 %. A larger error is given a small chance and is reported. "none": the simulation is taken as exact, and
    intervals are far too narrow where it is not."""
    waves: Annotated[int, Field(ge=1, le=8)] = 4
    """Waves of input sets at most."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of input sets and samples."""


class Documented(Strict):
    """Documented range of a key: its law and the circumstances in which it counts.

    ``times``: the numbers multiply the value of that key; ``plus``: they are added to it.
    """

    key: str
    law: Literal["uniform", "log_uniform", "choices"]
    low: float | None = None
    high: float | None = None
    values: list[str] | None = None
    weights: list[float] | None = None
    times: str | None = None
    plus: str | None = None
    when: dict[str, list[str | bool | float]] = {}
    unless: dict[str, list[str | bool | float]] = {}
    at_least: dict[str, float] = Field({}, alias="from")
    below: dict[str, float] = {}
    asked: bool = False
    reason: str

    @property
    def as_law(self) -> Law:
        """The law as a scene would declare it."""
        names = ("law", "low", "high", "values", "weights", "times")
        return Law(**{name: getattr(self, name) for name in names})

    def about(self, value: float) -> Self:
        """The range about what the key of ``plus`` is worth."""
        ends = {"low": value + (self.low or 0.0), "high": value + (self.high or 0.0)}
        return self.model_copy(update={**ends, "plus": None})

    @property
    def words(self) -> str:
        """The range in words."""
        if self.law == "choices":
            return f"choices {', '.join(self.values or ())}"
        of = "" if self.times is None else " times the value" if self.times == self.key else f" times {self.times}"
        if self.plus is not None:
            of = f" added to {'the value' if self.plus == self.key else self.plus}"
        return f"{self.law.replace('_', '-')} from {self.low:g} to {self.high:g}{of}"

    def counts(self, values: Mapping[str, Any]) -> bool:
        """Whether the range counts for a scene of these values by dotted key, with the elastic moduli of its parts."""
        on = all(values.get(key, LEFT_OUT) in allowed for key, allowed in self.when.items())
        on = on and all(values[key] >= least for key, least in self.at_least.items())
        on = on and all(values[key] < limit for key, limit in self.below.items())
        return on and not any(values.get(key, LEFT_OUT) in barred for key, barred in self.unless.items())


@functools.cache
def documented() -> tuple[Documented, ...]:
    """The documented ranges, in the order of the file."""
    return tuple(Documented.model_validate(each) for each in _file()["input"])


@functools.cache
def exact() -> Mapping[str, str]:
    """Keys with a default that is no assumption, and why."""
    return {key: group["reason"] for group in _file()["exact"] for key in group["keys"]}


def _file() -> dict[str, Any]:
    return tomllib.loads(resources.files("rbdyn.scene").joinpath("unknown_inputs.toml").read_text("utf-8"))
