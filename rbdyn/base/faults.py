"""Faults in what a user typed: collected all at once, one sentence each, with file, key, value and fix."""

import difflib
import math
import re
import tomllib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from datetime import date, time
from os import PathLike
from pathlib import Path
from typing import Any, Self, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from rbdyn.base.fields import InSI, or_refuse

Model = TypeVar("Model", bound=BaseModel)

# Faults told at once, and characters of a sentence and of a name within one: a screen of them can be read.
MOST_FAULTS, LONGEST_SENTENCE, LONGEST_NAME = 50, 1000, 60
# Likeness of two names, of 1, from which one may be meant for the other; what a missing key is ahead of others alike.
LEAST_LIKENESS, MISSING_FIRST = 0.6, 0.1
# Bytes of a file, and tables within tables: far more than any input of ours has, and still read in seconds.
LARGEST_FILE, DEEPEST = 20_000_000, 20
# What takes the parser of TOML long, and what it cannot convert.
DOTTED_KEY = re.compile(rf"""(?<![\w"'-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){{{DEEPEST}}}""")
DIGITS = re.compile(r"[0-9][0-9_]{4000}")
# A part of a dotted key with the dot behind it; within quotes a dot is no end.
PART = r'("[^"]*"|[^."]*)\.'


class InputError(Exception):
    """Bad input. ``faults`` holds a sentence a fault, each one line; a command prints them and exits with 2.

    Of more than `MOST_FAULTS` it holds the first ones and how many more there are.
    """

    def __init__(self, faults: Iterable[str]) -> None:
        listed = list(faults)
        if len(listed) > MOST_FAULTS:
            more = len(listed) - MOST_FAULTS + 1
            listed = [*listed[: MOST_FAULTS - 1], f"and {more} more faults; fix these first"]
        self.faults = [one_line(fault) for fault in listed]
        super().__init__("\n".join(self.faults))

    def __reduce__(self) -> "tuple[type[InputError], tuple[list[str]]]":
        """How it travels between processes: with its faults, not with their text."""
        return type(self), (self.faults,)


def refuse(faults: Iterable[str]) -> None:
    """Raises InputError if there are faults."""
    if listed := list(faults):
        raise InputError(listed)


def check_all(checks: Iterable[Callable[[], object]]) -> None:
    """Make all the checks. Raises InputError with the faults of every one that does."""
    faults: list[str] = []
    for check in checks:
        try:
            check()
        except InputError as error:
            faults += error.faults
    refuse(dict.fromkeys(faults))


class MethodError(ValueError):
    """A case that a method cannot take; the message is a sentence for a user. Errors of libraries and slips of code are none."""


class RunError(Exception):
    """A run that could not go on; the message says which, where and why. A command exits with 1."""


class Strict(BaseModel):
    """Base of all input tables: frozen, no unknown keys, no silent conversions, no NaN or infinity."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False, ignored_types=(InSI,))

    def __repr_args__(self) -> Iterator[tuple[str, Any]]:
        """What was given: defaults would bury it."""
        return ((name, getattr(self, name)) for name in type(self).model_fields if name in self.model_fields_set)


class Consistent(Strict):
    """A table whose keys must go together: built only where ``faults`` finds none."""

    def faults(self) -> Iterable[str]:
        """A sentence for each way in which valid keys of the table do not go together."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _without_faults(self) -> Self:
        return or_refuse(self, self.faults())


def one_line(text: str, longest: int = LONGEST_SENTENCE) -> str:
    """Text as one line: control characters escaped, and beyond ``longest`` characters the middle left out."""
    ends = text if len(text) <= 2 * longest else text[:longest] + text[-longest:]
    line = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in ends.strip())
    return line if len(line) <= longest else f"{line[: longest - longest // 3 - 3]}...{line[-(longest // 3) :]}"


def path_of(given: Any) -> Path:
    """A path as it was given. Raises InputError for what is none."""
    if isinstance(given, str | PathLike):
        return Path(given)
    raise InputError([f"path = {one_line(repr(given), LONGEST_NAME)}: must be the path of a file; check the call"])


def read_text(path: Path) -> str:
    """Text of a file in UTF-8, with or without a byte order mark. Raises InputError for any other."""
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST_FILE + 1)
        text = data.decode("utf-8-sig")
    except FileNotFoundError:
        raise InputError([f"{path}: no such file; check the path"]) from None
    except UnicodeDecodeError as error:
        line, byte = error.object.count(b"\n", 0, error.start) + 1, error.object[error.start]
        raise InputError(
            [f"{path}: cannot be read (line {line}: byte 0x{byte:02x} is no UTF-8); save the file as UTF-8"]
        ) from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError([f"{path}: cannot be read ({why}); check the path"]) from None
    if len(data) > LARGEST_FILE:
        raise InputError([f"{path}: larger than {LARGEST_FILE / 1e6:g} MB; check that it is the file meant"])
    return text


def read_toml(path: Path | str) -> dict[str, Any]:
    """Read a TOML file. Raises InputError when it is missing, unreadable or not TOML, or as `bounded` does."""
    path = path_of(path)
    try:
        return _parsed(read_text(path), str(path))
    except tomllib.TOMLDecodeError as error:
        raise InputError([f"{path}: not valid TOML ({error}); fix that line"]) from None


def bounded(data: dict[str, Any], source: str) -> dict[str, Any]:
    """The data themselves. Raises InputError for tables nested too deep and for integers beyond 64 bits."""
    waiting: list[tuple[tuple[int | str, ...], Any]] = [((), data)]
    faults = []
    for place, value in waiting:
        if len(place) > DEEPEST:
            raise InputError([f"{source}: {_dotted(place[:3])}...: nested more than {DEEPEST} deep; fix the brackets"])
        if isinstance(value, Mapping):
            waiting += [((*place, key), each) for key, each in value.items()]
        elif isinstance(value, list):
            waiting += [((*place, number), each) for number, each in enumerate(value)]
        elif isinstance(value, int) and value.bit_length() > 63:
            faults.append(f"{source}: {_dotted(place)}: a whole number beyond 64 bits; take a smaller one")
    refuse(faults)
    return data


def _parsed(text: str, source: str) -> dict[str, Any]:
    """The tables of a TOML text. Raises TOMLDecodeError, and InputError for what is TOML but absurd."""
    for pattern, what in (
        (DOTTED_KEY, f"a key of more than {DEEPEST} parts; keys here have four at most"),
        (DIGITS, "a number of thousands of digits; take a smaller one"),
    ):
        if absurd := pattern.search(text):
            raise InputError([f"{source}: line {text.count(chr(10), 0, absurd.start()) + 1}: {what}"])
    try:
        return bounded(tomllib.loads(text), source)
    except RecursionError:
        raise InputError([f"{source}: brackets nested more than {DEEPEST} deep; fix them"]) from None


def validated(model: type[Model], data: Mapping[str, Any], source: str) -> Model:
    """Build ``model`` from ``data``; ``source`` names the file in the messages.

    Raises InputError with every fault at once.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        errors: Sequence[Any] = error.errors(include_url=False)
    faults = _sentences(model, errors, data, source)
    # A table with a bad key is not checked as a whole: without that key it may show more faults.
    bad = {fault["loc"] for fault in errors}
    try:
        model.model_validate(_without(data, bad))
    except ValidationError as error:
        rest = [fault for fault in error.errors(include_url=False) if fault["type"] == "value_error"]
        names = {str(place[-1]) for fault in errors[:MOST_FAULTS] if (place := _place(fault, data))}
        # What is bad was not left out, even if it is missed now.
        faults += [
            fault
            for fault in _sentences(model, rest, data, source)[:MOST_FAULTS]
            if ": missing; " not in fault or not any(name in fault for name in names)
        ]
    raise InputError(dict.fromkeys(faults))


def set_key(data: dict[str, Any], assignment: str, name: str = "--set") -> None:
    """Apply one ``key.path=value`` assignment (the value in TOML syntax, or a bare word) to a nested dict.

    ``name``: of the option or key that has it. Raises InputError when the assignment has no ``=``, its path runs through a
    plain value, or it is not one value.
    """
    path, sign, text = assignment.partition("=")
    source = f"{name} {one_line(assignment, 2 * LONGEST_NAME)}"
    if not sign:
        raise InputError([f"{source}: write it as key.path=value"])
    try:
        given = _parsed(f"value = {text}", source)
    except tomllib.TOMLDecodeError:
        given = {"value": text.strip()}
    if len(given) > 1:
        raise InputError([f"{source}: more than one value; give each an assignment of its own"])
    put_key(data, path, given["value"], source)


def put_key(data: dict[str, Any], path: str, value: Any, source: str) -> None:
    """Put a value under the dotted ``path`` of nested tables. Raises InputError when that is none, or runs through a value."""
    keys = _parts(path)
    if not keys:
        raise InputError([f"{source}: write it as key.path=value"])
    table = data
    for key in keys[:-1]:
        table = table.setdefault(key, {})
        if not isinstance(table, dict):
            raise InputError([f"{source}: {one_line(key, LONGEST_NAME)} is a value, not a table; check the key path"])
    table[keys[-1]] = value


def key_path(assignment: str) -> tuple[str, ...]:
    """Names on the way to the key that a ``key.path=value`` assignment replaces; none where it is no assignment."""
    path, sign, _ = assignment.partition("=")
    return _parts(path) if sign else ()


def _parts(path: str) -> tuple[str, ...]:
    """Names of a dotted path, without their quotes; none where it is no path."""
    keys = tuple(key.strip().strip('"') for key in re.findall(PART, f"{path}."))
    return keys if all(keys) and len(keys) <= DEEPEST and re.fullmatch(f"({PART})+", f"{path}.") else ()


class Claims:
    """Keys that something else decides, each with the reason; a table and a key within it claim the same."""

    def __init__(self, reasons: Mapping[tuple[str, ...], str]) -> None:
        self._reasons = reasons
        self._within = {path[:end]: reason for path, reason in reasons.items() for end in range(1, len(path))}

    def on(self, path: tuple[str, ...]) -> str | None:
        """Why a key, a table around it or a key within it is claimed; None where none is."""
        whole = (self._reasons[path[:end]] for end in range(1, len(path) + 1) if path[:end] in self._reasons)
        return next(whole, self._within.get(path))


def assignment_faults(name: str, assignments: Sequence[str], claims: Mapping[tuple[str, ...], str]) -> list[str]:
    """What is wrong with the ``key.path=value`` assignments of the key ``name``, whatever their values.

    ``claims``: keys that they must leave alone, each with the reason and the fix. An assignment that a later one undoes is a
    fault too.
    """
    faults, claimed, before = list[str](), Claims(claims), set[tuple[str, ...]]()
    for each in assignments:
        path = key_path(each)
        reason = claimed.on(path) if path else "write it as key.path=value"
        if path in before:
            reason = "replaces what stands before it in this list; keep one of them"
        if reason:
            faults.append(f"{name} = {_shown(each)}: {reason}")
        before |= {path[:end] for end in range(1, len(path) + 1)}
    return faults


def _without(data: Any, bad: set[tuple[int | str, ...]], place: tuple[str, ...] = ()) -> Any:
    if not isinstance(data, Mapping):
        return data
    return {key: _without(each, bad, (*place, key)) for key, each in data.items() if (*place, key) not in bad}


def _sentences(model: type[BaseModel], errors: Sequence[Any], data: Any, source: str) -> list[str]:
    sentences: list[str] = []
    fixes: dict[str, list[str]] = {}
    missing = {_place(fault, data) for fault in errors if fault["type"] == "missing"}
    for fault in errors:
        kind, value, place = fault["type"], fault["input"], _place(fault, data)
        # Where a key may be of several kinds, each kind complains: keep what fits the value given.
        alien = "model_type" if isinstance(value, str) else "literal_error" if isinstance(value, Mapping) else ""
        if kind == alien and place == _place({**fault, "loc": fault["loc"][:-1]}, data):
            continue
        key = _dotted(place)
        if kind == "extra_forbidden":
            # To look for the nearest key takes a millisecond; beyond what is reported nobody reads it.
            fix = _nearest(model, place, missing) if len(sentences) < MOST_FAULTS else "remove it"
            sentences.append(f"{source}: {key}: unknown key; {fix}")
        elif kind == "missing":
            sentences.append(f"{source}: {key}: missing; add it")
        elif kind == "value_error":
            # A validator of a whole table may find several faults: one a line.
            where = f"{key} = {_shown(value)}: " if key and not isinstance(value, Mapping | BaseModel) else ""
            for line in str(fault["ctx"]["error"]).splitlines():
                # A table that may stand in several places names its keys without the path.
                path = "" if where or not key or line.startswith(key.split(".")[0]) else f"{key}."
                sentences.append(f"{source}: {where}{path}{line}")
        elif isinstance(value, float) and not math.isfinite(value):
            sentences.append(f"{source}: {key} = {value}: is not a finite number; write a plain number")
        else:
            fixes.setdefault(f"{source}: {key} = {_shown(value)}", []).append(_fix(kind, fault))
    return sentences + [f"{head}: {', or '.join(dict.fromkeys(fix))}" for head, fix in fixes.items()]


def _place(fault: Any, data: Any) -> tuple[int | str, ...]:
    """The keys and numbers on the way to a fault, without the kinds that a key may be of: those stand not in the data."""
    place: list[int | str] = []
    for part in fault["loc"]:
        if (isinstance(data, Mapping) and part in data) or (isinstance(data, list) and isinstance(part, int)):
            place.append(part)
            data = data[part]
    return (*place, fault["loc"][-1]) if fault["type"] == "missing" else tuple(place)


def _fix(kind: str, fault: Any) -> str:
    limits = fault.get("ctx", {})
    bounds = {
        "greater_than": "must be greater than {gt}",
        "greater_than_equal": "must be at least {ge}",
        "less_than": "must be less than {lt}",
        "less_than_equal": "must be at most {le}",
        "literal_error": "choose one of {expected}",
        "int_type": "must be a whole number without quotes",
        "int_from_float": "must be a whole number",
        "float_type": "must be a number without quotes",
        "bool_type": "must be true or false",
        "string_type": "must be text in quotes",
        "model_type": "must be a table of keys",
        "model_attributes_type": "must be a table of keys",
        "list_type": "must be a list",
        "string_too_short": "must have at least {min_length} character(s)",
        "string_too_long": "must have at most {max_length} characters",
        "string_pattern_mismatch": "must have no commas, semicolons, quotes, line breaks or spaces about it",
    }
    return bounds[kind].format(**limits) if kind in bounds else str(fault["msg"])


def _dotted(location: tuple[int | str, ...]) -> str:
    text = ""
    for part in location:
        name = one_line(str(part), LONGEST_NAME)
        text += f"[{part + 1}]" if isinstance(part, int) else f".{name}" if text else name
    return text


def _shown(value: Any) -> str:
    """A value as it is written in TOML, cut where it is long."""
    text = str(value) if isinstance(value, date | time) else repr(value)
    text = text.lower() if isinstance(value, bool) else text
    return text if len(text) <= LONGEST_NAME else text[: LONGEST_NAME - 3] + "..."


def _nearest(
    model: type[BaseModel], location: tuple[int | str, ...], missing: Collection[tuple[int | str, ...]]
) -> str:
    """What the unknown key may have meant: the key most like it, one that is ``missing`` in its table before others."""
    known, key = _fields_at(model, location[:-1]), str(location[-1])[:LONGEST_NAME].lower()
    matcher = difflib.SequenceMatcher(b=key)
    likeness: dict[str, float] = {}
    for name in known:
        matcher.set_seq1(name.lower())
        wanted = (*location[:-1], name) in missing
        part_of = wanted and set(key.split("_")) <= set(name.lower().split("_"))
        if part_of or matcher.ratio() >= LEAST_LIKENESS:
            likeness[name] = matcher.ratio() + MISSING_FIRST * wanted
    if likeness:
        return f"did you mean {max(likeness, key=lambda name: likeness[name])}?"
    return f"known keys here: {', '.join(sorted(known))}" if known else "remove it"


def _fields_at(model: type[BaseModel], location: tuple[int | str, ...]) -> list[str]:
    for part in location:
        if isinstance(part, int) or part not in model.model_fields:
            continue
        field = model.model_fields[str(part)]
        for candidate in (field.annotation, *getattr(field.annotation, "__args__", ())):
            if isinstance(candidate, type) and issubclass(candidate, BaseModel):
                model = candidate
                break
    return [field.alias or name for name, field in model.model_fields.items()]
