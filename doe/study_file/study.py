"""STUDY.toml as a whole: its scene, factors, responses, front and chains, checked before anything runs.

A study can also be made from a table alone, of which some columns are factors and others responses.
"""

import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field

from doe.designs.design import to_actual, to_coded
from doe.designs.model import Model
from doe.designs.optimal import Remaining
from doe.study_file import sections
from doe.study_file.table import COUNT, LABELS, done_rows, table_of
from rbdyn.base.arrays import Array
from rbdyn.base.faults import (
    Consistent,
    InputError,
    Name,
    Number,
    Strict,
    assignment_faults,
    one_line,
    read_toml,
    refuse,
    validated,
)
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record
from rbdyn.base.tables.decimal_marks import is_like_number
from rbdyn.base.tables.sheet import DATE, InputColumn, InputTable, listed, quoted, read_sheet, split_path
from rbdyn.result import START_FIGURES
from rbdyn.scene.duty import DutyPoint
from rbdyn.scene.uncertain import DECLARATIONS, RUN_KEYS, SEEDS, Uncertain

MOST_FACTORS = 8
REPLICATES = ("numerics", "replicates")


class SceneFile(Strict):
    """Scene of all runs; ``set`` overrides its keys for the design runs."""

    file: str
    """Name of the scene file, relative to the folder of the study."""
    set: list[str] = []
    """Keys that differ from the scene file in the design runs, as "key=value"; factors and seeds are not allowed."""


class Fitted(Strict):
    """Fit of a surface to a response."""

    model: Model = "quadratic"
    """Terms of the surface. "interaction" has products of two factors, "pure_quadratic" squares, "quadratic" both; "reduced"
    keeps the significant quadratic terms, with their hierarchy."""
    transform: Literal["none", "box_cox"] | Annotated[float, Field(ge=-5.0, le=5.0)] = "none"
    """Transform of Box and Cox before the fit: none, the recommended one, or one with this exponent."""


# Figures of a start by their place in the JSON of a result, such as start.radial_um.least.
PLACES = {f"start.{figure.place}": key for key, figure in START_FIGURES.items()}


class Response(Fitted, sections.OverDuty):
    """A response of the simulation, the fit of its surface, its goal and its limits."""

    name: Annotated[Name, BeforeValidator(lambda name: PLACES.get(name, name) if isinstance(name, str) else name)]
    """Name of the response: a result of the simulation, or a column of the table."""


class PointResponse(Response):
    """A limited ``figure`` of the simulation at one ``point`` of the duty, without a goal."""

    figure: str
    """Name of the result."""
    point: str
    """Name of the point."""

    @classmethod
    def of(cls, response: Response, point: str) -> Self:
        """The limits of a response at a point."""
        keys = response.model_dump(include={*Fitted.model_fields, "lower", "upper"})
        return cls(name=sections.at_point(point, response.name), goal="none", figure=response.name, point=point, **keys)


class Confirmation(Strict):
    """Simulation at the baseline and at the pick."""

    replicates: Annotated[int, Field(ge=2, le=10000)] = 16
    """Replicates of each point that is simulated for confirmation."""
    limit_probability: Annotated[float, Field(ge=0.5, le=0.9999)] = 0.95
    """Probability with which the simulated design must meet each limit. The default leaves 5 % for a violated limit."""
    tries: Annotated[int, Field(ge=1, le=20)] = 4
    """Largest number of points of the front that are simulated until one meets its limits. Each takes a simulation and a
    search, which uses the errors of the surfaces at the earlier points."""
    set: list[str] = []
    """Overrides of the scene's keys, as "key=value"."""


class Reference(Strict):
    """Published table of this design, to compare with."""

    file: str
    """Name of the published table, relative to the folder of the study."""
    label: str
    """Name of the source."""
    why: dict[str, str] = {}
    """Remark on each response, by its name, which is shown with the comparison."""


class StudyFile(Consistent):
    """The whole file."""

    scene: SceneFile | None = None
    """Scene of all runs. Leave it out if all runs come from a table."""
    duty: list[DutyPoint] = []
    """Operating points at which every run is simulated, up to 12. Default: the operating point of the scene file."""
    normalise_shares: bool = False
    """Whether the shares can have any sum, such as hours. If true, each share is divided by the sum."""
    factor: Annotated[list[sections.Factor], Field(min_length=1, max_length=MOST_FACTORS)]
    """Factors that the study varies."""
    response: Annotated[list[Response], Field(min_length=1)]
    """Responses that the study fits and optimises."""
    limits: sections.OtherLimits = sections.OtherLimits()
    """Limits on the class of the cage: limits.cage.verdict = "held|circling"."""
    design: sections.Design = sections.Design()
    """Experimental design of the runs."""
    front: sections.Front = sections.Front()
    """Search of the Pareto front on the response surfaces."""
    adaptive: sections.Adaptive = sections.Adaptive()
    """Search with emulators, used with --adaptive."""
    robust: sections.Robust = sections.Robust()
    """Comparison of the designs over unknown inputs, with --robust or if this table is present."""
    uncertain: Uncertain | None = None
    """Unknown inputs of the scene. They replace the unknown inputs of the scene file."""
    tolerances: sections.Tolerances | None = None
    """Search for the widest tolerances of the factors about the selected design. Default: no search."""
    confirmation: Confirmation = Confirmation()
    """Simulation of the baseline and the selected design."""
    baseline: dict[str, Number] = {}
    """Values of the baseline design by factor. Default: the centre."""
    chain: list[sections.StudyChain] = []
    """Dimension chains whose closing links are clearances of the selected design."""
    reference: Reference | None = None
    """Published table of this design, to compare with."""

    def faults(self) -> list[str]:
        names, responses = [factor.name for factor in self.factor], [response.name for response in self.response]
        keys = [factor.key for factor in self.factor if factor.key]
        faults: list[str] = []
        if self.scene is not None:
            faults += [f"factor[{n}].key: missing; add it" for n, factor in enumerate(self.factor, 1) if not factor.key]
            faults += ["factor: simulations need two factors; add another"] * (len(names) == 1)
        for kind, names_of_kind in (
            ("factor.name", names),
            ("factor.key", keys),
            ("response.name", responses),
            ("chain.name", [chain.name for chain in self.chain]),
        ):
            repeated = [name for name, count in Counter(names_of_kind).items() if count > 1]
            faults += [f"{kind} = {name!r}: used more than once; name each once" for name in repeated]
        reserved_names = {COUNT, *LABELS, *(f"{name}_error" for name in responses)}
        for kind, names_of_kind, others in (
            ("factor", names, reserved_names | set(responses)),
            ("response", responses, reserved_names),
        ):
            repeated_names = [name for name in names_of_kind if name in others]
            faults += [
                f"{kind}.name = {name!r}: is another column of a table of runs; rename it" for name in repeated_names
            ]
        choices = ", ".join(names)
        faults += [
            f"baseline.{key}: no such factor; name one of {choices}" for key in self.baseline if key not in names
        ]
        faults += [
            f"chain.factor = {chain.factor!r}: no such factor; name one of {choices}"
            for chain in self.chain
            if chain.factor not in names
        ]
        named = {response.name: response for response in self.response}
        claims = _claims(keys) | {REPLICATES: "each kind of run has its own number of them; leave it out"}
        faults += sections.duty_faults(self.duty, named, self.normalise_shares, claims, self.scene is not None)
        return [*faults, *self._gain_faults(), *self._key_faults(keys), *self._set_faults(keys)]

    def _gain_faults(self) -> Iterator[str]:
        """Faults of the gains that parts must keep."""
        if self.tolerances is None:
            return
        goals = {response.name: response.goal for response in self.response}
        choices = ", ".join(name for name, goal in goals.items() if goal != "none")
        named = [("gains", name) for name in self.tolerances.gains or []]
        repeated = [key for key, count in Counter(named).items() if count > 1]
        for key, name in dict.fromkeys([*named, *(("at_least", name) for name in self.tolerances.at_least)]):
            if name not in goals:
                yield f"tolerances.{key} = {name!r}: no such response; name one of {choices}"
            elif goals[name] == "none":
                yield f'tolerances.{key} = {name!r}: goal = "none" has no gain; name one of {choices}'
        yield from (f"tolerances.{key} = {name!r}: used more than once; name each once" for key, name in repeated)

    def _key_faults(self, keys: Sequence[str]) -> Iterator[str]:
        """Faults of keys whose values no run would have."""
        tables = {tuple(path[:end]) for path in (key.split(".") for key in keys) for end in range(1, len(path))}
        for key in keys:
            path = tuple(key.split("."))
            if reason := RUN_KEYS.reason_for(path):
                yield f"factor.key = {key!r}: {reason}"
            elif path in tables:
                yield f"factor.key = {key!r}: replaces the table of another factor's key; take one of them out"

    def _set_faults(self, keys: Sequence[str]) -> list[str]:
        """Faults of overrides that no run would have."""
        claims = _claims(keys)
        own_claims: dict[str, dict[tuple[str, ...], str]] = {
            "confirmation": {REPLICATES: "confirmation.replicates says it; write it there"},
            "adaptive": {REPLICATES: "the search chooses it for each run; leave it out"},
        }
        faults = assignment_faults("scene.set", self.scene.set, claims) if self.scene else []
        for name, more in own_claims.items():
            faults += assignment_faults(f"{name}.set", getattr(self, name).set, claims | more)
        return faults


def _claims(keys: Sequence[str]) -> dict[tuple[str, ...], str]:
    """Keys of a scene that no override may set, with the reason; ``keys`` are those of factors."""
    factors = {tuple(key.split(".")): "is a factor, whose value each run has; leave it out" for key in keys}
    return factors | {("numerics", "seed"): SEEDS, ("uncertain",): DECLARATIONS, ("calibrate",): DECLARATIONS}


class Study(Record):
    """A checked study and the path of its file; paths in it are relative to its folder."""

    path: Path
    file: StudyFile
    remaining: Remaining | None = field(default=None, compare=False)
    """What remains of the region where runs failed; None while none has."""
    tables: dict[Path, dict[str, Any]] = field(default_factory=dict, compare=False, repr=False)
    """Tables of the TOML files that it names, each read once."""

    def __post_init__(self) -> None:
        """Put a response for each limit at a point of the duty in the place of the limits of its figure."""
        responses = [*self._responses_over_duty()]
        if len(responses) > len(self.file.response):
            object.__setattr__(self, "file", self.file.model_copy(update={"response": responses}))

    def _responses_over_duty(self) -> Iterator[Response]:
        points, limits = self.file.duty, list[Response]()
        same = sections.alike(points)
        for response in self.file.response:
            limited = response.lower is not None or response.upper is not None
            # Where all points are one, its limits are those of the response, unless that is a ratio.
            apart = limited and points and not (same and response.aggregate != "worst_relative")
            if isinstance(response, PointResponse) or not apart:
                yield response
                continue
            yield response.model_copy(update={"lower": None, "upper": None})
            names = [point.name for point in points]
            limits += [PointResponse.of(response, name) for name in sorted(response.points or names)]
        yield from limits

    @property
    def shares(self) -> dict[str, float]:
        """Shares of the time by point of the duty, in the order of their names; empty without a duty."""
        return sections.shares_of(self.file.duty)

    def with_responses(self, names: Collection[str]) -> Self:
        """The study with the responses of these names alone."""
        return self.with_file(response=[response for response in self.file.response if response.name in names])

    def with_file(self, **tables: Any) -> Self:
        """The study with other tables in its file, which are not checked."""
        return replace(self, file=self.file.model_copy(update=tables))

    @property
    def asks_robust(self) -> bool:
        """Whether its file asks for the judgement over unknown inputs, by a table [robust]."""
        return "robust" in self.file.model_fields_set

    @property
    def figures(self) -> list[str]:
        """Figures of the simulation behind the responses, each once: a limit at a point is one of a response's own."""
        return [response.name for response in self.file.response if not isinstance(response, PointResponse)]

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Read STUDY.toml. Raises InputError with all faults at once."""
        path = Path(path)
        return cls(path, validated(StudyFile, read_toml(path), str(path)))

    @property
    def scene(self) -> SceneFile:
        """Scene of the runs. Raises InputError for a study without one."""
        if self.file.scene is None:
            raise InputError(
                f"{self.path}: scene: missing; add [scene] with its file, or give fit or front the runs by --data "
                "TABLE.csv"
            )
        return self.file.scene

    @property
    def factors(self) -> list[str]:
        """Factor names in order."""
        return [factor.name for factor in self.file.factor]

    @property
    def responses(self) -> list[str]:
        """Response names in order."""
        return [response.name for response in self.file.response]

    @property
    def centre(self) -> Array:
        """Factor values at coded 0."""
        return np.array([factor.centre for factor in self.file.factor])

    @property
    def step(self) -> Array:
        """Factor values per coded unit."""
        return np.array([factor.step for factor in self.file.factor])

    @property
    def baseline(self) -> Array:
        """Baseline in factor units; by default the centre."""
        return np.array([self.file.baseline.get(factor.name, factor.centre) for factor in self.file.factor])

    def coded(self, points: Array) -> Array:
        """Coded values of points (..., k) in factor units."""
        return to_coded(points, self.centre, self.step)

    def actual(self, coded: Array) -> Array:
        """Factor values of coded points (..., k)."""
        return to_actual(coded, self.centre, self.step)

    def by_factor(self, point: Array) -> dict[str, float]:
        """Values (k,) by name of the factor."""
        return dict(zip(self.factors, point.tolist(), strict=True))

    def rounded(self, point: Array) -> Array:
        """A point with each factor rounded to its resolution."""
        values = []
        for fine, x in zip((factor.finest for factor in self.file.factor), point.tolist(), strict=True):
            values.append(x if fine is None else round(round(x / fine) * fine, 12))
        return np.array(values)

    def path_of(self, name: str) -> Path:
        """Path of a file that the study names."""
        return self.path.parent / name

    def read(self, name: str) -> dict[str, Any]:
        """Tables of a TOML file that the study names, which is read once. Raises InputError."""
        path = self.path_of(name)
        if path not in self.tables:
            self.tables[path] = read_toml(path)
        return self.tables[path]

    def chain_table(
        self, chain: sections.StudyChain, value: float, half_width: float | None = None
    ) -> Mapping[str, Any]:
        """Contents of CHAIN.toml for a chain at a picked value [mm].

        ``half_width`` [mm] is used if the chain states none. Raises InputError without either, or if the chain is not in its
        file.
        """
        half = chain.half_width_mm if chain.half_width_mm is not None else half_width
        if half is None:
            raise InputError(
                f"chain {chain.name}: half_width_mm: missing, and no tolerance of {chain.factor} is known; add it"
            )
        limits = {"lower_mm": value - half, "upper_mm": value + half}
        if chain.file is not None:
            table = self._chain_of_file(chain.name, chain.file)
            return {**{key: content for key, content in table.items() if key != "name"}, "closing_link": limits}
        selective = {} if chain.selective is None else {"selective": chain.selective}
        parts = {"link": chain.link, "allocate": chain.allocate, "monte_carlo": chain.monte_carlo}
        return {"closing_link": limits, **parts, **selective}

    def _chain_of_file(self, name: str, file: str) -> Mapping[str, Any]:
        """Table of the chain of that name in a file of chains."""
        chains = self.read(file).get("chain", [])
        for chain in chains if isinstance(chains, list) else []:
            if isinstance(chain, dict) and chain.get("name") == name:
                return chain
        raise InputError(f"{self.path_of(file)}: no chain is named {name}; name it [[chain]] name = {name!r}")


# Beginning of a text that is nearly a number.
NEARLY_NUMBER = re.compile(r"\W{0,3}\d")
# Most responses that are fitted without being named: each takes about a second.
MOST_UNNAMED = 100


def study_of_table(path: Path, factors: list[str], responses: list[str], model: str) -> tuple[Study, Notes]:
    """The study of the named columns of a table, without a scene, and notes on columns that it leaves out.

    If only factors or only responses are named, the other kind is all further columns of numbers. Coded -1 and 1 are the
    ends of a factor's range in the table.

    Raises InputError for a name that is no column, a column with only some numbers, a constant factor, and a table that
    cannot be read.
    """
    sheet = done_rows(read_sheet(path))
    has = f"it has {listed(sheet.places)}"
    refuse(
        f"--{kind} {one_line(name)}: is not a column of {path}; {has}"
        for kind, names in (("factor", factors), ("response", responses))
        for name in names
        if name not in sheet
    )
    if not factors and not responses:
        raise InputError(f"{path}: name its factors by --factor NAME and its responses by --response NAME; {has}")
    notes = list[Note]()
    if not factors or not responses:
        numbers, notes = _rest(sheet, {*factors, *responses}, responses)
        factors, responses = factors or numbers, responses or numbers
    if not factors or not responses:
        raise InputError([*notes, f"{path}: has no further column of numbers; {has}"])
    for kind, names, limit in (("factor", factors, MOST_FACTORS), ("response", responses, MOST_UNNAMED)):
        if len(names) > limit:
            raise InputError(f"{path}: has {len(names)} columns for {kind}s; name {limit} at most by --{kind} NAME")
    actual = table_of(sheet, factors, responses, path).actual
    low, high = actual.min(axis=0), actual.max(axis=0)
    constants = [(factors[place], low[place]) for place in np.flatnonzero(low == high).tolist()]
    refuse(f"--factor {name}: is {value:g} in every row of {path}; leave it out" for name, value in constants)
    scales = zip(factors, (0.5 * (low + high)).tolist(), (0.5 * (high - low)).tolist(), strict=True)
    data = {
        "factor": [{"name": name, "centre": centre, "step": step} for name, centre, step in scales],
        "response": [{"name": name, "model": model} for name in responses],
    }
    # The file stands for the study where its folder of results is identified.
    return Study(split_path(path)[0], validated(StudyFile, data, str(path))), tuple(notes)


def _rest(sheet: InputTable, excluded: Collection[str], responses: Sequence[str]) -> tuple[list[str], list[Note]]:
    """Columns of numbers that are not in ``excluded``, and notes on other columns.

    Columns of errors belong to ``responses``, or else to the rest. A column of nearly numbers is one of them, and its
    reader refuses the other cells.
    """
    candidates = [name for name in sheet.places if name not in {COUNT, *LABELS, *excluded}]
    owners = set(responses or candidates)
    errors = {f"{name}_error" for name in owners}
    idle_errors = {f"{name}_error" for name in sheet.places if name not in owners}
    error_columns = errors | idle_errors
    words = {name: _words(sheet.column(name)) for name in candidates if name not in error_columns}
    numbers = [name for name, label in words.items() if label is None]
    labels = [label for label in words.values() if label is not None]
    unused = [name for name in candidates if name in idle_errors and name not in errors]
    reasons = [("no numbers", labels), ("errors of no response", unused)]
    reasons.append(("without a name", [f"column {number}" for number in sheet.nameless]))
    left_out = (f"{sheet.path}: left out as {reason}: {listed(names)}" for reason, names in reasons if names)
    return numbers, [Note("table", sentence) for sentence in left_out]


def _words(column: InputColumn) -> str | None:
    """Name and first text of a column that is clearly not one of numbers; None for any other."""
    texts = [text for text in column.texts if text]
    if any(is_like_number(text) or (NEARLY_NUMBER.match(text) and not DATE.match(text)) for text in texts):
        return None
    return f"{column.name} ({quoted(texts[0]) if texts else 'empty'})"
