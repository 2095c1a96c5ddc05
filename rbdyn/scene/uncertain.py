"""Inputs that nobody knows: how a scene or a study declares them, and the documented ranges of what drawings leave open.

``[uncertain]`` holds a law a key; ``unknown_inputs.toml`` beside this module the ranges of keys with their reasons. Neither
changes a run: they tell how the scenes around it differ.
"""

import functools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from rbdyn.faults import Strict
from rbdyn.fields import no_power_of_two, or_refuse

# What each law needs beside its name, and what it may have.
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
# How an input set is run.
RUNS = (
    "numerics.turns=40",
    "numerics.discard_turns=20",
    "numerics.replicates=2",
    "numerics.extend=false",
    "numerics.companion=false",
)
LEFT_OUT = "left out"


class Law(Strict):
    """How an input is distributed: one true value that nobody knows, or one that differs from case to case."""

    law: Literal["uniform", "log_uniform", "triangular", "normal", "choices"]
    """Distribution: uniform or log_uniform between low and high, triangular about mode, normal of mean and sd (cut at low
    and high where given), or choices among values."""
    low: float | None = None
    """Lowest value."""
    high: float | None = None
    """Highest value."""
    mode: float | None = None
    """Likeliest value, of law = "triangular"."""
    mean: float | None = None
    """Mean, of law = "normal"."""
    sd: Annotated[float, Field(gt=0.0)] | None = None
    """Standard deviation, of law = "normal"."""
    values: Annotated[list[str | bool | int | float], Field(min_length=2, max_length=MOST_CHOICES)] | None = None
    """What there is to choose from, of law = "choices"; laws of the model are compiled once each."""
    weights: list[Annotated[float, Field(gt=0.0)]] | None = None
    """How likely each of the values is, in proportion; equally where left out."""
    times: str | None = None
    """Key whose value the numbers multiply; the key itself for a range about what the scene has there."""
    kind: Literal["unknown", "varies"] = "unknown"
    """unknown: one true value, worth measuring; varies: differs from bearing to bearing or from day to day."""
    measurable: Annotated[float, Field(gt=0.0)] | None = None
    """Standard deviation with which the value could be measured, in its unit."""

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        needed = NEEDS[self.law]
        may = (*needed, *MAY.get(self.law, ()))
        given = {name for name in NUMBERS if getattr(self, name) is not None}
        found = [f"{name}: missing; law = '{self.law}' needs it" for name in needed if name not in given]
        found += [
            f"{name}: law = '{self.law}' has none; leave it out"
            for name in NUMBERS
            if name in given and name not in may
        ]
        low, high, mode = self.low, self.high, self.mode
        if low is not None and high is not None and not low < high:
            found.append(f"low = {low:g}: not below high = {high:g}; exchange them")
        elif None not in (low, high, mode) and not low <= mode <= high:  # type: ignore[operator]
            found.append(f"mode = {mode:g}: not between low = {low:g} and high = {high:g}; mend it")
        if self.law == "log_uniform" and low is not None and low <= 0.0:
            found.append(f"low = {low:g}: law = 'log_uniform' needs a positive one; raise it")
        if self.weights is not None and len(self.weights) != len(self.values or ()):
            found.append(f"weights = {self.weights}: not one for each of the values; mend them")
        if self.times is not None and self.law == "choices":
            found.append(f"times = '{self.times}': choices are no numbers to multiply; leave it out")
        if self.measurable is not None and self.law == "choices":
            found.append(f"measurable = {self.measurable:g}: a choice is not measured to a deviation; leave it out")
        return or_refuse(self, found)


@dataclass(frozen=True)
class Sampled:
    """How an input of a posterior sample is distributed: its ``values``, sorted."""

    values: tuple[Any, ...]
    law: Literal["sample"] = "sample"
    times: None = None
    kind: Literal["unknown"] = "unknown"
    measurable: None = None

    def model_dump(self, **_: Any) -> dict[str, Any]:
        """As a declared law is told in a record."""
        return {"law": self.law, "rows": len(self.values), "low": self.values[0], "high": self.values[-1]}


class Correlation(Strict):
    """Inputs that go together."""

    keys: Annotated[list[str], Field(min_length=2, max_length=2)]
    """The two keys."""
    rank: Annotated[float, Field(gt=-1.0, lt=1.0)]
    """Their rank correlation (Spearman's)."""


class Uncertain(Strict):
    """What is not known: "table.key" = {law = ...} of any key of a scene, and how much of the rest varies."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Law] = Field(init=False)

    defaults: Literal["documented", "none"] = "documented"
    """documented: keys left at their default, or named in estimated, vary over their documented range where their law is
    switched on (rbdyn keys tells the ranges); none: only what is named here."""
    estimated: list[str] = []
    """Keys of the scene whose values are estimates: they vary over their documented range."""
    points: Annotated[int, Field(ge=16, le=4096)] = 128
    """Input sets to start from, a power of two; more are added until the spread is known."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the input sets."""
    inputs: Annotated[int, Field(ge=1, le=30)] = 12
    """Most inputs that vary: of more documented ones a screening keeps those that matter; declared ones all stay."""
    set: list[str] = list(RUNS)
    """Keys of the scene that are otherwise in the runs of input sets, as key=value: many short runs tell more of inputs
    than few long ones."""
    sample: str | None = None
    """CSV of a posterior sample, a row an input set, whose columns are keys; replaces their laws. Its path is from the
    folder of this file."""
    correlation: list[Correlation] = []
    """Rank correlations of inputs."""

    @property
    def laws(self) -> Mapping[str, Law]:
        """Law by key."""
        return self.__pydantic_extra__ or {}

    @model_validator(mode="after")
    def _known(self) -> Self:
        found = [f'{key}: no key of a scene; write "table.key"' for key in self.laws if "." not in key]
        found += no_power_of_two("points = ", self.points)
        found += [
            f"correlation.keys: {key} has no law here; give it one"
            for pair in self.correlation
            for key in pair.keys
            if key not in self.laws
        ]
        return or_refuse(self, found)


class Calibrate(Strict):
    """How inputs are found from measurements by doe calibrate."""

    discrepancy: dict[str, Annotated[float, Field(gt=0.0, le=1.0)]] | Literal["none"] = {}
    """By how much the simulation itself may err in an output, as a share, by the output's name (0.1 where not named); "none":
    it is taken as exact, and intervals are far too narrow where it is not."""
    waves: Annotated[int, Field(ge=1, le=8)] = 4
    """Waves of input sets at most."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of input sets and samples."""


class Documented(Strict):
    """Documented range of a key: its law and the circumstances in which it counts."""

    key: str
    law: Literal["uniform", "log_uniform", "choices"]
    low: float | None = None
    high: float | None = None
    values: list[str] | None = None
    weights: list[float] | None = None
    times: str | None = None
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

    @property
    def words(self) -> str:
        """The range in words."""
        if self.law == "choices":
            return f"choices {', '.join(self.values or ())}"
        of = "" if self.times is None else " times the value" if self.times == self.key else f" times {self.times}"
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
