"""Unknown inputs: their declaration in a scene or a study, and the documented ranges of keys that drawings rarely state.

``[uncertain]`` holds a law for each key; ``unknown_inputs.toml`` next to this module holds the documented ranges with their
reasons. Neither changes a run: they describe the scenes around it.
"""

import functools
import tomllib
from collections.abc import Iterator, Mapping
from importlib import resources
from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from rbdyn.base.faults import (
    LONGEST_NAME,
    SMALLEST,
    Claims,
    Number,
    Positive,
    Strict,
    assignment_faults,
    key_path,
    no_power_of_two,
    one_line,
    or_refuse,
)
from rbdyn.base.records import Record

# Required keys of each law, and optional ones.
NEEDS = {"uniform": ("low", "high"), "log_uniform": ("low", "high"), "normal": ("mean", "sd"), "choices": ("values",)}
MAY = {"normal": ("low", "high"), "choices": ("weights",)}
NUMBERS = ("low", "high", "mean", "sd", "values", "weights")
MOST_CHOICES = 6
# Settings of the run of an input set: one impact window in each replicate, since more sets help more than longer runs.
RUNS = (
    "numerics.turns=20",
    "numerics.discard_turns=20",
    "numerics.replicates=2",
    "numerics.extend=false",
    "numerics.companion=false",
)
LEFT_OUT = "left out"
# Sizes that no input set varies, for all others follow from them; named as estimates they mark the parts made to them.
MARKING = ("bearing.roller_diameter_mm", "bearing.pitch_diameter_mm")
# Tables of a scene without any property of the bearing, so without unknown inputs.
NO_INPUTS = ("numerics", "uncertain", "calibrate")
# Reasons why ``set`` may not assign a key.
SEEDS = "every run has a seed of its own; leave it out"
DECLARATIONS = "no run depends on it; write it in its own table"
# Keys that can be neither factors of a study nor conditions of a rig.
RUN_KEYS = Claims(
    {
        ("numerics", "seed"): "every run has a seed of its own; choose another key",
        ("numerics", "replicates"): "each kind of run has its own number of them; choose another key",
        ("uncertain",): "no run depends on it; choose another key",
        ("calibrate",): "no run depends on it; choose another key",
    }
)
# Least relative width of a range and of a standard deviation; smaller ones are lost in rounding.
FINEST = 1e-9
# Farthest cut of a normal law from its mean and narrowest range between cuts, in standard deviations.
FARTHEST, NARROWEST = 6.0, 1e-6


class Law(Strict):
    """Distribution of an input: one unknown true value, or a value that varies from case to case."""

    law: Literal["uniform", "log_uniform", "normal", "choices"]
    """Distribution of the input. uniform, log_uniform: between low and high. normal: with mean and sd, optionally truncated at
    low and high. choices: among values."""
    low: Number | None = None
    """Lowest value of the input."""
    high: Number | None = None
    """Highest value of the input."""
    mean: Number | None = None
    """Mean, for law = "normal"."""
    sd: Positive | None = None
    """Standard deviation, for law = "normal"."""
    values: Annotated[list[str | bool | int | Number], Field(min_length=2, max_length=MOST_CHOICES)] | None = None
    """Possible values, for law = "choices"; each law of the model among them is compiled once."""
    weights: list[Positive] | None = None
    """Relative probability of each of the values. Default: equal."""
    times: str | None = None
    """Key whose value, other than 0, multiplies the numbers. The key itself gives a range relative to the scene's value."""
    kind: Literal["unknown", "varies"] = "unknown"
    """unknown: one true value, which a measurement could determine; varies: a value that differs between bearings or days."""

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        required = NEEDS[self.law]
        allowed = (*required, *MAY.get(self.law, ()))
        present = {name for name in NUMBERS if getattr(self, name) is not None}
        faults = [f"{name}: missing; law = '{self.law}' needs it" for name in required if name not in present]
        faults += [
            f"{name}: law = '{self.law}' has none; leave it out"
            for name in NUMBERS
            if name in present and name not in allowed
        ]
        faults += self._choice_faults() if self.law == "choices" else self._range_faults()
        return or_refuse(self, faults or self._normal_faults())

    def _choice_faults(self) -> Iterator[str]:
        values = self.values or []
        if self.weights is not None and len(self.weights) != len(values):
            yield f"weights = {self.weights}: must have one number for each of the values; give as many"
        if any(value in values[:place] for place, value in enumerate(values)):
            yield f"values = {values}: name each value once; weights give its probability"
        if self.times is not None:
            yield f"times = '{self.times}': choices are not numbers and cannot be multiplied; leave it out"

    def _range_faults(self) -> Iterator[str]:
        low, high = self.low, self.high
        if low is not None and high is not None:
            if not low < high:
                yield f"low = {low:g}: not below high = {high:g}; exchange them"
            elif high - low < FINEST * max(abs(low), abs(high)):
                yield f"low = {low!r}: high = {high!r} is too near to it; widen the range"
        if self.law == "log_uniform" and low is not None and low < SMALLEST:
            yield f"low = {low:g}: law = 'log_uniform' needs a positive one, {SMALLEST:g} at least; raise it"

    def _normal_faults(self) -> Iterator[str]:
        """Faults of a normal law that its cuts, or rounding, leave empty."""
        low, high, mean, sd = self.low, self.high, self.mean, self.sd
        if self.law != "normal" or mean is None or sd is None:
            return
        if sd < FINEST * abs(mean):
            yield f"sd = {sd:g}: is lost in rounding compared with mean = {mean:g}; raise it"
        for name, end, beyond in (("low", low, 1.0), ("high", high, -1.0)):
            if end is not None and beyond * (end - mean) > FARTHEST * sd:
                yield f"{name} = {end:g}: is more than {FARTHEST:g} sd beyond mean = {mean:g}, which leaves no values; move it"
        if low is not None and high is not None and high - low < NARROWEST * sd:
            yield f"sd = {sd:g}: is over a million times as wide as low to high; write law = 'uniform'"


class Sampled(Record):
    """Distribution of an input of a posterior sample: its sorted ``values``."""

    values: tuple[Any, ...]
    law: Literal["sample"] = "sample"
    times: None = None
    kind: Literal["unknown"] = "unknown"

    def model_dump(self, **_: Any) -> dict[str, Any]:
        """The law as in a record."""
        return {"law": self.law, "rows": len(self.values), "low": self.values[0], "high": self.values[-1]}


class Uncertain(Strict):
    """Unknown inputs: "table.key" = {law = ...} for any key of a scene, and the treatment of all other keys."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Law] = Field(init=False)

    defaults: Literal["documented", "none"] = "documented"
    """Keys that vary in addition to those with a distribution here or named in estimated. documented: keys at their default,
    over the range that rbdyn keys lists, where their law is active. none: no other key."""
    estimated: list[str] = []
    """Keys of the scene whose stated values are estimates. They vary over their documented range, also with defaults = "none".
    bearing.roller_diameter_mm and bearing.pitch_diameter_mm do not vary: named here, they mark the parts that follow from them."""
    points: Annotated[int, Field(ge=16, le=4096)] = 128
    """Initial number of input sets, a power of two. More are added until the spread is accurate enough."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the input sets."""
    inputs: Annotated[int, Field(ge=1, le=30)] = 12
    """Largest number of inputs of an emulator: all declared inputs, and those with the largest main effects. Every unknown
    input varies in every input set; the effects of inputs without an emulator count as scatter. doe calibrate estimates at
    most this number."""
    set: list[str] = list(RUNS)
    """Keys that differ from the scene file in the runs of input sets, as key=value. Your list replaces these keys and keeps
    the other defaults. A key in this list is fixed: it has no distribution and no documented range. A study with a limit on
    the class of the cage lengthens its default of 20 shaft turns to 10 turns of the cage."""
    sample: str | None = None
    """CSV file of a posterior sample, one row per input set, with keys as columns. It replaces the distributions of these
    keys. The path is relative to the folder of this file."""

    @property
    def laws(self) -> Mapping[str, Law]:
        """Law by key."""
        return self.__pydantic_extra__ or {}

    @property
    def assignments(self) -> list[str]:
        """The default assignments of keys that are not in ``set``, then ``set``."""
        paths = [key_path(assignment) for assignment in self.set]
        return [*(default for default in RUNS if key_path(default) not in paths), *self.set]

    def over(self, base: Self) -> dict[str, Any]:
        """A table of these declarations and those of ``base``, key by key.

        What this table states about a key, by a law, in ``estimated`` or in ``set``, replaces what ``base`` states about it.
        """
        upper, lower = ({name: getattr(table, name) for name in table.model_fields_set} for table in (self, base))

        def paths(assignments: list[str]) -> dict[str, str]:
            return {".".join(key_path(assignment)): assignment for assignment in assignments}

        fixed = paths(upper.get("set", []))
        stated = {*self.laws, *self.estimated, *fixed}
        laws = {**{key: law for key, law in base.laws.items() if key not in stated}, **self.laws}
        merged = {key: value for key, value in {**lower, **upper}.items() if key in type(self).model_fields} | laws
        merged["estimated"] = [key for key in base.estimated if key not in stated] + self.estimated
        merged["set"] = [text for key, text in paths(lower.get("set", [])).items() if key not in stated] + [
            *fixed.values()
        ]
        return merged

    @model_validator(mode="before")
    @classmethod
    def _refuse_unquoted_keys(cls, data: Any) -> Any:
        """In TOML a dotted key without quotes is a table within a table."""
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
    def _without_contradictions(self) -> Self:
        names = {key: one_line(key, LONGEST_NAME) for key in self.laws}
        faults = [f'{name}: no key of a scene; write "table.key"' for key, name in names.items() if "." not in key]
        faults += [
            f'"{name}": {key.partition(".")[0]} holds no property of the bearing; remove its law'
            for key, name in names.items()
            if "." in key and key.partition(".")[0] in NO_INPUTS
        ]
        faults += no_power_of_two("points = ", self.points)
        return or_refuse(self, [*faults, *self._overlaps(), *self._set_faults()])

    def _overlaps(self) -> Iterator[str]:
        """Faults of keys with a law whose table has a law too."""
        laws = self.laws
        for key in laws:
            parts = key.split(".")
            for end in range(1, len(parts)):
                if (table := ".".join(parts[:end])) in laws:
                    yield f'"{key}": {table} has a law too, which replaces it; remove one of them'

    def _set_faults(self) -> list[str]:
        laws = [path for key in self.laws if (path := tuple(key.split(".")))[0] not in NO_INPUTS]
        claims = dict.fromkeys(laws, "is an unknown input, which has a law here; keep one of them")
        claims |= {
            tuple(key.split(".")): "is an unknown input, named in estimated; keep one of them" for key in self.estimated
        }
        claims |= {("numerics", "seed"): SEEDS, ("uncertain",): DECLARATIONS, ("calibrate",): DECLARATIONS}
        return assignment_faults("set", self.set, claims)


class Calibrate(Strict):
    """Settings of doe calibrate, which estimates inputs from measurements."""

    discrepancy: dict[str, Annotated[float, Field(gt=0.0, le=1.0)]] | Literal["none"] = {}
    """Relative model error of each output, by its name. Default: a tenth of the standard deviation of the output over the unknown
    inputs at a condition, in the first wave of input sets. Such an error leaves the effects of the inputs visible. It suits a cage
    speed that varies by 0.3 % as well as a loss that varies by 50 %. A larger error has a small prior probability and is reported.
    "none": the simulation counts as exact, which gives intervals that are far too narrow where it is not."""
    waves: Annotated[int, Field(ge=1, le=8)] = 4
    """Largest number of waves of input sets."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of input sets and samples."""


class Documented(Strict):
    """Documented range of a key: its law and the conditions of its use.

    ``times``: the numbers multiply the value of that key. ``plus``: they are added to it. ``on_request``: the range applies only
    where a scene names the key.
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
    on_request: bool = False
    reason: str

    @property
    def as_law(self) -> Law:
        """The law as declared in a scene."""
        names = ("law", "low", "high", "values", "weights", "times")
        return Law(**{name: getattr(self, name) for name in names})

    def about(self, value: float, limits: tuple[float, float]) -> Self:
        """The range about the ``value`` of the key in ``plus``, within the ``limits`` of the key."""
        least, most = limits
        ends = {"low": max(value + (self.low or 0.0), least), "high": min(value + (self.high or 0.0), most)}
        return self.model_copy(update={**ends, "plus": None})

    @property
    def words(self) -> str:
        """The range in words."""
        if self.law == "choices":
            return f"choices {', '.join(self.values or ())}"
        law = f"{self.law.replace('_', '-')} from {self.low:g} to {self.high:g}"
        if self.plus is not None:
            return f"{law} added to {'the value' if self.plus == self.key else self.plus}"
        if self.times is not None:
            return f"{law} times {'the value' if self.times == self.key else self.times}"
        return law

    def counts(self, values: Mapping[str, Any]) -> bool:
        """Whether the range applies to a scene with these values by dotted key, elastic moduli of its parts included."""
        on = all(values.get(key, LEFT_OUT) in allowed for key, allowed in self.when.items())
        on = on and all(values[key] >= least for key, least in self.at_least.items())
        on = on and all(values[key] < limit for key, limit in self.below.items())
        return on and not any(values.get(key, LEFT_OUT) in barred for key, barred in self.unless.items())


@functools.cache
def documented() -> tuple[Documented, ...]:
    """The documented ranges, in the order of the file."""
    return tuple(Documented.model_validate(table) for table in _file()["input"])


@functools.cache
def exact() -> Mapping[str, str]:
    """Keys whose default is no assumption, each with the reason."""
    return {key: group["reason"] for group in _file()["exact"] for key in group["keys"]}


def _file() -> dict[str, Any]:
    return tomllib.loads(resources.files("rbdyn.scene").joinpath("unknown_inputs.toml").read_text("utf-8"))
