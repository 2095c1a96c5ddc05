"""Input of a user and its faults: one sentence each with file, key, value and fix, all of them at once.

First the number types and base classes of input tables, whose keys carry units; then reading and validation of files and of
``key.path=value`` assignments; last the lists of numbers of a command line.
"""

import difflib
import math
import re
import stat
import tomllib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from datetime import date, time
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, ClassVar, Generic, Self, TypeVar, cast

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
    model_validator,
)

from rbdyn.base.words import quantity


def _not_vanishing(value: float) -> float:
    if value < SMALLEST:
        raise ValueError(f"must be at least {SMALLEST:g}; check the unit")
    return value


Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
# Limits of any number, wide enough for all units and narrow enough that no product overflows.
SMALLEST, LARGEST = 1e-12, 1e12
# A ring for rollers of half a millimetre has 7 mg.
LIGHTEST_RING_KG = 1e-6
NotVanishing = AfterValidator(_not_vanishing)
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
# A figure may come from any table, in any unit: its fourth power does not overflow.
Figure = Annotated[float, Field(ge=-1e60, le=1e60)]
Positive = Annotated[float, Field(gt=0.0, le=LARGEST), NotVanishing]
NonNegative = Annotated[float, Field(ge=0.0, le=LARGEST)]
Share = Annotated[float, Field(gt=0.0, le=1.0), NotVanishing]
# A name that heads a column of a table, and is one field of CSV for any reader.
Name = Annotated[str, Field(max_length=100, pattern=r"""^[^\s,;"'\p{C}]([^,;"'\p{C}]*[^\s,;"'\p{C}])?$""")]


N = TypeVar("N")
RPM = math.pi / 30.0  # [rad/s]
TO_SI = {"mm": 1e-3, "um": 1e-6, "g": 1e-3, "g_mm": 1e-6, "kg_mm2": 1e-6, "MPa": 1e6, "mrad": 1e-3}
TO_SI |= {"deg": math.pi / 180.0, "rpm": RPM, "l_min": 1e-3 / 60.0}


class InSI(Generic[N]):
    """SI value of a key with a unit: ``width = SI("mm")`` is ``width_mm`` in metres, also for lists; None stays None."""

    def __init__(self, unit: str) -> None:
        self.unit = unit

    def __set_name__(self, owner: type, name: str) -> None:
        self.key = f"{name}_{self.unit}"

    def __get__(self, table: Any, owner: type) -> N:
        def converted(value: Any) -> Any:
            return [converted(v) for v in value] if isinstance(value, list) else value and value * TO_SI[self.unit]

        return cast(N, converted(getattr(table, self.key)))


SI, OptionalSI = InSI[float], InSI[float | None]


def or_refuse(table: Any, faults: Iterable[str]) -> Any:
    """The table. Raises ValueError with all its faults, one a line."""
    if lines := "\n".join(faults):
        raise ValueError(lines)
    return table


def no_power_of_two(name: str, count: int) -> list[str]:
    """The fault of a number that is no power of two; an empty list for a power of two."""
    return [f"{name}{count}: no power of two; take {2 ** (count.bit_length() - 1)}"] if count & (count - 1) else []


Model = TypeVar("Model", bound=BaseModel)

# Most faults in one message, and most characters of a sentence and of a name in it: about a screen.
MOST_FAULTS, LONGEST_SENTENCE, LONGEST_NAME = 50, 1000, 60
# Faults of a number that its unit may explain.
BOUNDED = {"greater_than", "greater_than_equal", "less_than", "less_than_equal"}
# Least similarity (0 to 1) of a suggested key to the unknown one, and the bonus of a missing key.
LEAST_LIKENESS, MISSING_FIRST = 0.6, 0.1
# Most bytes of a file and deepest nesting of its tables: far above any real input, yet read in seconds.
LARGEST_FILE, DEEPEST = 20_000_000, 20
# A key that takes the TOML parser too long, and a number that it cannot convert.
DOTTED_KEY = re.compile(rf"""(?<![\w"'-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){{{DEEPEST}}}""")
DIGITS = re.compile(r"[0-9][0-9_]{4000}")
# A part of a dotted key with the dot behind it; a dot within quotes ends no part.
PART = r'("[^"]*"|[^."]*)\.'


class InputError(Exception):
    """Bad input. ``faults`` holds one line for each fault; a command prints them and exits with 2.

    Of more than `MOST_FAULTS` it holds the first ones and the number of the others.
    """

    def __init__(self, faults: str | Iterable[str]) -> None:
        sentences = [faults] if isinstance(faults, str) else list(faults)
        if len(sentences) > MOST_FAULTS:
            more = len(sentences) - MOST_FAULTS + 1
            sentences = [*sentences[: MOST_FAULTS - 1], f"and {more} more faults; fix these first"]
        self.faults = [one_line(sentence) for sentence in sentences]
        super().__init__("\n".join(self.faults))

    def __reduce__(self) -> "tuple[type[InputError], tuple[list[str]]]":
        """Pickle the list of faults, from which another process builds the error anew."""
        return type(self), (self.faults,)


def given(value: N | None) -> N:
    """A value that may be missing elsewhere, where what was validated or asked before says that it is there."""
    assert value is not None
    return value


def refuse(faults: Iterable[str]) -> None:
    """Raises InputError if there are faults."""
    if sentences := list(faults):
        raise InputError(sentences)


def check_all(checks: Iterable[Callable[[], object]]) -> None:
    """Make all checks. Raises InputError with the faults of all of them."""
    faults: list[str] = []
    for check in checks:
        try:
            check()
        except InputError as error:
            faults += error.faults
    refuse(dict.fromkeys(faults))


class MethodError(ValueError):
    """A case that a method cannot treat, with a sentence for the user; never an error of a library or of the code."""


class RunError(Exception):
    """A run that failed; the message says which, where and why. A command exits with 1."""


class Strict(BaseModel):
    """Base of all input tables: frozen, no unknown keys, no silent conversions, no NaN or infinity."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False, ignored_types=(InSI,))

    def __repr_args__(self) -> Iterator[tuple[str, Any]]:
        """The stated keys only: all defaults would hide them."""
        return ((name, getattr(self, name)) for name in type(self).model_fields if name in self.model_fields_set)


class Consistent(Strict):
    """A table whose keys must be consistent: built only where ``faults`` is empty."""

    def faults(self) -> Iterable[str]:
        """A sentence for each contradiction between valid keys of the table."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _without_faults(self) -> Self:
        return or_refuse(self, self.faults())


class Sparse(Strict):
    """A table that leaves out of its saved form those keys of ``UNSAVED`` that have the value there.

    A table that gains such a key is saved as before, so results that are stored under it stay valid.
    """

    UNSAVED: ClassVar[Mapping[str, Any]] = {}

    def unsaved(self) -> Mapping[str, Any]:
        """Keys that the table does not save where they have these values."""
        return self.UNSAVED

    @model_serializer(mode="wrap")
    def _without_unsaved(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        saved: dict[str, Any] = handler(self)
        unsaved = self.unsaved()
        return {key: value for key, value in saved.items() if key not in unsaved or value != unsaved[key]}


def one_line(text: str, longest: int = LONGEST_SENTENCE) -> str:
    """Text as one line: control characters escaped, the middle of a text above ``longest`` characters left out."""
    ends = text if len(text) <= 2 * longest else text[:longest] + text[-longest:]
    line = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in ends.strip())
    return line if len(line) <= longest else f"{line[: longest - longest // 3 - 3]}...{line[-(longest // 3) :]}"


def path_of(argument: Any) -> Path:
    """The argument of a call as a path. Raises InputError where it is none."""
    if isinstance(argument, str | PathLike):
        return Path(argument)
    raise InputError(f"path = {one_line(repr(argument), LONGEST_NAME)}: must be the path of a file; check the call")


# Device and number of each file that a command has read; content of the pipes among them, which can be read only once.
_reads: ContextVar[set[tuple[int, int]] | None] = ContextVar("reads", default=None)
_pipes: dict[tuple[int, int], bytes] = {}


@contextmanager
def recorded_reads() -> Iterator[None]:
    """Record all files that are read inside."""
    token = _reads.set(set(files_read()))
    try:
        yield
    finally:
        _reads.reset(token)


def files_read() -> set[tuple[int, int]]:
    """Device and number of each file that was read since ``recorded_reads`` began."""
    reads = _reads.get()
    return set() if reads is None else reads


def record_read(path: Path) -> None:
    """Record a file as read before it is; one that is missing is left out."""
    with suppress(OSError, ValueError):
        status = path.stat()
        files_read().add((status.st_dev, status.st_ino))


def read_bytes(path: Path) -> bytes:
    """Bytes of a file. Raises InputError where it cannot be read or is too large."""
    try:
        status = path.stat()
        place = status.st_dev, status.st_ino
        files_read().add(place)
        if place in _pipes:
            return _pipes[place]
        with path.open("rb") as file:
            data = file.read(LARGEST_FILE + 1)
        if stat.S_ISFIFO(status.st_mode):
            _pipes[place] = data
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; check the path") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be read ({reason}); check the path") from None
    if len(data) > LARGEST_FILE:
        raise InputError(f"{path}: larger than {LARGEST_FILE / 1e6:g} MB; check that it is the right file")
    return data


def read_text(path: Path) -> str:
    """Text of a UTF-8 file, with or without a byte order mark. Raises InputError where it cannot be read."""
    data = read_bytes(path)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise not_utf_8(path, data, error) from None


def not_utf_8(path: Path, data: bytes, error: UnicodeDecodeError) -> InputError:
    """The fault of a file that is no UTF-8, with the first such byte."""
    line, byte = data.count(b"\n", 0, error.start) + 1, error.object[error.start]
    return InputError(f"{path}: cannot be read (line {line}: byte 0x{byte:02x} is not UTF-8); save the file as UTF-8")


def read_toml(path: Path | str) -> dict[str, Any]:
    """Read a TOML file. Raises InputError where it is missing, unreadable or not TOML, or as `check_bounds` does."""
    path = path_of(path)
    try:
        return _parsed(read_text(path), str(path))
    except tomllib.TOMLDecodeError as error:
        fix = "a key or table is there twice; remove one" if str(error).startswith("Cannot") else "fix that line"
        raise InputError(f"{path}: not valid TOML ({error}); {fix}") from None


def check_bounds(data: dict[str, Any], source: str) -> dict[str, Any]:
    """The same data. Raises InputError for tables nested too deep and for integers beyond 64 bits."""
    waiting: list[tuple[tuple[int | str, ...], Any]] = [((), data)]
    faults = []
    for place, value in waiting:
        if len(place) > DEEPEST:
            raise InputError(f"{source}: {_dotted(place[:3])}...: nested more than {DEEPEST} deep; fix the brackets")
        if isinstance(value, Mapping):
            waiting += [((*place, key), item) for key, item in value.items()]
        elif isinstance(value, list):
            waiting += [((*place, number), item) for number, item in enumerate(value)]
        elif isinstance(value, int) and value.bit_length() > 63:
            faults.append(f"{source}: {_dotted(place)}: a whole number beyond 64 bits; take a smaller one")
    refuse(faults)
    return data


def _parsed(text: str, source: str) -> dict[str, Any]:
    """The tables of a TOML text. Raises TOMLDecodeError, and InputError for absurd but valid TOML."""
    for pattern, fault in (
        (DOTTED_KEY, f"a key of more than {DEEPEST} parts; keys here have four at most"),
        (DIGITS, "a number of thousands of digits; take a smaller one"),
    ):
        if absurd := pattern.search(text):
            raise InputError(f"{source}: line {text.count(chr(10), 0, absurd.start()) + 1}: {fault}")
    try:
        return check_bounds(tomllib.loads(text), source)
    except RecursionError:
        raise InputError(f"{source}: brackets nested more than {DEEPEST} deep; fix them") from None


def validated(model: type[Model], data: Mapping[str, Any], source: str) -> Model:
    """Build ``model`` from ``data``; ``source`` names the file in the messages.

    Raises InputError with every fault at once.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        errors: Sequence[Any] = error.errors(include_url=False)
    refuse(_other_kind(model, data, source))
    faults = _sentences(model, errors, data, source)
    # A table with a bad key is not checked as a whole; without that key it may show more faults.
    bad = {fault["loc"] for fault in errors}
    try:
        model.model_validate(_without(data, bad))
    except ValidationError as error:
        contradictions = [fault for fault in error.errors(include_url=False) if fault["type"] == "value_error"]
        names = {str(place[-1]) for fault in errors[:MOST_FAULTS] if (place := _place(fault, data))}
        # A bad key was not left out, even if it is missing now.
        faults += [
            fault
            for fault in _sentences(model, contradictions, data, source)[:MOST_FAULTS]
            if not any(_states_absence(fault, name) for name in names)
        ]
    raise InputError(dict.fromkeys(faults))


# A key that only files of one kind have, with the kind and what reads it.
KINDS = {
    "bearing": ("scene", "rbdyn simulate, rbdyn ball or doe new"),
    "factor": ("study", "doe study"),
    "closing_link": ("dimension chain", "doe chain"),
    "chain": ("file of dimension chains", "doe chain"),
}


def _other_kind(model: type[BaseModel], data: Any, source: str) -> list[str]:
    """The fault of a file of another kind, each key of which would be a fault of its own."""
    expected, found = (next((key for key in KINDS if key in keys), None) for keys in (model.model_fields, data))
    if expected is None or found is None or expected in data:
        return []
    kind, readers = KINDS[found]
    return [f"{source}: this is a {kind}, not a {KINDS[expected][0]}; give it to {readers}"]


def _states_absence(fault: str, name: str) -> bool:
    """Whether a sentence on a table says that a key of that ``name`` is missing."""
    return name in fault and (
        ": missing; " in fault or re.search(rf"(needs|without) [^:;]*\b{re.escape(name)}\b", fault) is not None
    )


def set_key(data: dict[str, Any], assignment: str, name: str = "--set") -> None:
    """Apply one ``key.path=value`` assignment (the value in TOML syntax, or a bare word) to a nested dict.

    ``name``: the option or key that holds the assignment. Raises InputError for an assignment without ``=``, with a path through
    a plain value, or with more than one value.
    """
    path, sign, text = assignment.partition("=")
    source = f"{name} {one_line(assignment, 2 * LONGEST_NAME)}"
    if not sign:
        raise InputError(f"{source}: write it as key.path=value")
    try:
        parsed = _parsed(f"value = {text}", source)
    except tomllib.TOMLDecodeError:
        parsed = {"value": text.strip()}
    if len(parsed) > 1:
        raise InputError(f"{source}: more than one value; write one assignment for each key")
    put_key(data, path, parsed["value"], source)


def put_key(data: dict[str, Any], path: str, value: Any, source: str) -> None:
    """Put a value under a dotted ``path`` of nested tables. Raises InputError for an invalid path or one through a value."""
    keys = _parts(path)
    if not keys:
        raise InputError(f"{source}: write it as key.path=value")
    table = data
    for key in keys[:-1]:
        table = table.setdefault(key, {})
        if not isinstance(table, dict):
            raise InputError(f"{source}: {one_line(key, LONGEST_NAME)} is a value, not a table; check the key path")
    table[keys[-1]] = value


def key_path(assignment: str) -> tuple[str, ...]:
    """Names along the path of a ``key.path=value`` assignment; empty for any other text."""
    path, sign, _ = assignment.partition("=")
    return _parts(path) if sign else ()


def _parts(path: str) -> tuple[str, ...]:
    """Names of a dotted path, without their quotes; empty for any other text."""
    keys = tuple(key.strip().strip('"') for key in re.findall(PART, f"{path}."))
    return keys if all(keys) and len(keys) <= DEEPEST and re.fullmatch(f"({PART})+", f"{path}.") else ()


class Claims:
    """Keys that may not be set, each with the reason; the claim on a table covers its keys, and the reverse."""

    def __init__(self, reasons: Mapping[tuple[str, ...], str]) -> None:
        self._reasons = reasons
        self._within = {path[:end]: reason for path, reason in reasons.items() for end in range(1, len(path))}

    def reason_for(self, path: tuple[str, ...]) -> str | None:
        """Reason of the claim on a key, a table around it or a key within it; None without a claim."""
        reasons = (self._reasons[path[:end]] for end in range(1, len(path) + 1) if path[:end] in self._reasons)
        return next(reasons, self._within.get(path))


def assignment_faults(name: str, assignments: Sequence[str], claims: Mapping[tuple[str, ...], str]) -> list[str]:
    """Faults of the ``key.path=value`` assignments of the key ``name``, whatever their values.

    ``claims``: keys that they may not set, each with the reason and the fix. Two assignments of one key are a fault too.
    """
    faults, claimed, before = list[str](), Claims(claims), set[tuple[str, ...]]()
    for assignment in assignments:
        path = key_path(assignment)
        reason = claimed.reason_for(path) if path else "write it as key.path=value"
        if path in before:
            reason = "replaces an earlier assignment of this list; keep one of them"
        if reason:
            faults.append(f"{name} = {_toml(assignment)}: {reason}")
        before |= {path[:end] for end in range(1, len(path) + 1)}
    return faults


def _without(data: Any, bad: set[tuple[int | str, ...]], place: tuple[str, ...] = ()) -> Any:
    if not isinstance(data, Mapping):
        return data
    return {key: _without(item, bad, (*place, key)) for key, item in data.items() if (*place, key) not in bad}


def _sentences(model: type[BaseModel], errors: Sequence[Any], data: Any, source: str) -> list[str]:
    sentences: list[str] = []
    fixes, units = dict[str, list[str]](), dict[str, str]()
    missing = {_place(fault, data) for fault in errors if fault["type"] == "missing"}
    for fault in errors:
        kind, value, place = fault["type"], fault["input"], _place(fault, data)
        # Where a key may be of several kinds, each kind complains: keep the complaint that fits the stated value.
        alien = "model_type" if isinstance(value, str) else "literal_error" if isinstance(value, Mapping) else ""
        if kind == alien and place == _place({**fault, "loc": fault["loc"][:-1]}, data):
            continue
        key = _dotted(place)
        if kind == "extra_forbidden":
            # A search for the nearest key takes a millisecond: only for reported faults.
            fix = _nearest(model, place, missing) if len(sentences) < MOST_FAULTS else "remove it"
            sentences.append(f"{source}: {key}: unknown key; {fix}")
        elif kind == "missing":
            sentences.append(f"{source}: {key}: missing; add it")
        elif kind == "value_error":
            # A validator of a whole table may find several faults: one a line.
            where = f"{key} = {_toml(value)}: " if key and not isinstance(value, Mapping | BaseModel) else ""
            for line in str(fault["ctx"]["error"]).splitlines():
                # A kind of table with several places names its keys without their path.
                path = "" if where or not key or line.startswith(key.split(".")[0]) else f"{key}."
                sentences.append(f"{source}: {where}{path}{line}")
        elif isinstance(value, float) and not math.isfinite(value):
            sentences.append(f"{source}: {key} = {value}: is not a finite number; write a plain number")
        else:
            head = f"{source}: {key} = {_toml(value)}"
            fixes.setdefault(head, []).append(_fix(kind, fault))
            units[head] = f"; check its unit, {unit}" if kind in BOUNDED and (unit := quantity(key)[1]) else ""
    return sentences + [f"{head}: {', or '.join(dict.fromkeys(fix))}{units[head]}" for head, fix in fixes.items()]


def _place(fault: Any, data: Any) -> tuple[int | str, ...]:
    """Keys and numbers along the path to a fault, without the names of kinds, which are not in the data."""
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
        "too_short": "must have at least {min_length} item(s)",
        "too_long": "must have at most {max_length} item(s)",
        "string_too_short": "must have at least {min_length} character(s)",
        "string_too_long": "must have at most {max_length} characters",
        "string_pattern_mismatch": "must have no commas, semicolons, quotes, line breaks or outer spaces",
    }
    return bounds[kind].format(**limits) if kind in bounds else str(fault["msg"])


def _dotted(location: tuple[int | str, ...]) -> str:
    text = ""
    for part in location:
        name = one_line(str(part), LONGEST_NAME)
        text += f"[{part + 1}]" if isinstance(part, int) else f".{name}" if text else name
    return text


def _toml(value: Any) -> str:
    """A value as written in TOML, shortened where it is long."""
    text = str(value) if isinstance(value, date | time) else repr(value)
    text = text.lower() if isinstance(value, bool) else text
    return text if len(text) <= LONGEST_NAME else text[: LONGEST_NAME - 3] + "..."


def _nearest(
    model: type[BaseModel], location: tuple[int | str, ...], missing: Collection[tuple[int | str, ...]]
) -> str:
    """A suggestion for an unknown key: the most similar key of its table, ``missing`` ones first."""
    names, key = _fields_at(model, location[:-1]), str(location[-1])[:LONGEST_NAME].lower()
    matcher = difflib.SequenceMatcher(b=key)
    likeness: dict[str, float] = {}
    for name in names:
        matcher.set_seq1(name.lower())
        absent = (*location[:-1], name) in missing
        part_of = absent and set(key.split("_")) <= set(name.lower().split("_"))
        if part_of or matcher.ratio() >= LEAST_LIKENESS:
            likeness[name] = matcher.ratio() + MISSING_FIRST * absent
    if likeness:
        return f"did you mean {max(likeness, key=lambda name: likeness[name])}?"
    return f"known keys here: {', '.join(sorted(names))}" if names else "remove it"


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


# Most values of an axis: each is a run whose result stays in memory.
MOST_VALUES = 10_000


def axis_values(text: str, option: str) -> list[float]:
    """Values of ``start:stop:count`` (evenly spaced) or ``a,b,c``. Raises InputError naming ``option``."""
    fix = "write start:stop:count or values with commas, rising"
    values = number_list(text, f"{option} {text}", fix, 0, MOST_VALUES)
    if not values or not all(map(math.isfinite, values)) or any(b <= a for a, b in pairwise(values)):
        raise InputError(f"{option} {text}: the values must rise; {fix}")
    return values


def number_list(text: str, name: str, fix: str, fewest: int, most: int) -> list[float]:
    """The same in any order, with ``fewest`` to ``most`` values. Raises InputError naming ``name`` before it allocates any."""
    try:
        if ":" not in text:
            return [float(value) for value in text.split(",")]
        start, stop, count = text.split(":")
        if int(count) > most:
            raise InputError(f"{name}: {count} values are more than the {most} that memory has room for; take fewer")
        if int(count) >= fewest:
            import numpy as np

            return [float(value) for value in np.linspace(float(start), float(stop), int(count))]
    except ValueError:
        pass
    raise InputError(f"{name}: not a list of numbers; {fix}")
