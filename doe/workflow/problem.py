"""A study resolved once and handed to every step: goals, design, region, tolerances, its scenes at any point; what it asks."""

import difflib
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from functools import cached_property, partial
from itertools import compress
from string import ascii_uppercase
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from doe.clearance import ADAPTIVE_EXTENDED, ADAPTIVE_SEEDS, CONFIRMATION_SEEDS, FURTHER_SEEDS, points_of, responses_of
from doe.designs import Design
from doe.duty import Duty, DutyScenes, Run, main_scene, scenes_of
from doe.study_file import Study
from doe.study_file.sections import Goal, OverDuty
from doe.workflow.design import design_of
from rbdyn.base.arrays import Array, Mask
from rbdyn.base.faults import LONGEST_NAME, InputError, key_path, refuse
from rbdyn.base.records import Record, spread
from rbdyn.base.tables.sheet import listed
from rbdyn.base.words import label, quantity
from rbdyn.dynamics.figures import switched_off, why_missing
from rbdyn.result import TEMPERATURES
from rbdyn.scene import Scene
from rbdyn.scene.thermal import Near, begun_near, first_guess_faults
from rbdyn.scene.unknown import plain_values
from rbdyn.thermal.losses import gain

if TYPE_CHECKING:
    from doe.pareto import Goals
    from doe.response_surface import Surface


# Gain of the loop of heat in the middle of the region, up to which no design of the region is near losing its balance.
SLIGHT_GAIN = 0.2


class RunPlan(Record):
    """The design runs before their simulation: design, actual factors (n, k), and by run the scene, label and factors."""

    design: Design
    actual: Array
    scenes: list[Run]
    labels: list[str]
    factors: list[dict[str, float]]


class Problem(Study):
    """A study with all that follows from it alone, computed when it is first asked for.

    A scene is built once; a problem with another region shares the scenes of the one that it came from.
    """

    built: dict[tuple[Any, ...], Scene] = field(default_factory=dict, compare=False, repr=False)
    """Scenes by their class and overrides."""
    surfaces: tuple["Surface", ...] = field(default=(), compare=False, repr=False)
    """Surfaces of its responses, once they are fitted."""
    near: Mapping[str, Near] = field(default_factory=dict, compare=False, repr=False)
    """Heat balance in the middle of its region by point of the duty, "" without one, from which those of its runs begin."""

    def with_surfaces(self, surfaces: "Iterable[Surface]") -> Self:
        """The same with fitted surfaces."""
        return replace(self, surfaces=tuple(surfaces))

    @cached_property
    def goals(self) -> "Goals":
        """Goals and limits of the responses."""
        from doe.pareto.search import BLANK, Goals

        responses = self.file.response
        settings = {key: [getattr(response, key) for response in responses] for key in BLANK}
        return Goals.of([response.goal for response in responses], **settings)

    @cached_property
    def aims(self) -> list[str]:
        """Names of the responses with a goal."""
        return [self.responses[index] for index in self.goals.objectives]

    @cached_property
    def design(self) -> Design:
        """The design in the order of its runs. Raises InputError for impossible settings."""
        return design_of(self)

    @cached_property
    def reach(self) -> Array:
        """Half ranges (k,), in coded units about the centre 0, of the box in which the study searches."""
        return np.full(len(self.factors), self.design.reach)

    @cached_property
    def half_ranges(self) -> Array:
        """The same in factor units."""
        return self.reach * self.step

    @cached_property
    def ends(self) -> Array:
        """Ends (k, 2) of the region, in factor units."""
        return np.column_stack([self.centre - self.half_ranges, self.centre + self.half_ranges])

    def rounded_within(self, point: Array) -> Array:
        """A point (k,) in factor units, rounded to the resolution of the drawing without leaving the region."""
        reach, rounded = self.half_ranges, self.rounded(point)
        finest = np.array([factor.finest or 0.0 for factor in self.file.factor])
        outside = np.abs(rounded - self.centre) > reach * (1.0 + 1e-9)
        inward = self.rounded(rounded + np.sign(self.centre - rounded) * finest)
        return np.where(outside & (np.abs(inward - self.centre) <= reach * (1.0 + 1e-9)), inward, rounded)

    def beyond_runs(self, coded: Array) -> bool:
        """Whether a coded point (k,) lies beyond the region that the runs reach, where the surfaces extrapolate."""
        distance = np.linalg.norm(coded) if self.design.region == "ball" else np.abs(coded).max()
        return bool(distance > self.design.extent * (1.0 + 1e-4))

    @cached_property
    def rigid(self) -> Mask:
        """Factors (k,) without a tolerance: whole numbers."""
        return np.array([factor.whole for factor in self.file.factor])

    @cached_property
    def known_tolerances(self) -> dict[str, float]:
        """Half widths of the factors that have any, in their units: their own, or that of the narrowest chain."""
        half_widths = {}
        for factor in compress(self.file.factor, ~self.rigid):
            closing = [chain.half_width_mm for chain in self.file.chain if chain.factor == factor.name]
            widths = [width for width in closing if width is not None]
            if factor.tolerance is not None or widths:
                half_widths[factor.name] = min(widths) if factor.tolerance is None else factor.tolerance
        return half_widths

    @cached_property
    def coded_tolerances(self) -> Array:
        """Half widths (k,) of all factors in coded units, 0 for factors without a tolerance.

        Raises InputError for each half width that is missing or too wide.
        """
        half_widths = dict.fromkeys(compress(self.factors, self.rigid), 0.0) | self.known_tolerances
        faults = [
            f"{self.path}: factor.tolerance of {name}: missing; the tolerance-aware front needs the half width that can be "
            "manufactured, here or as half_width_mm of a chain that closes on this factor"
            for name in self.factors
            if name not in half_widths
        ]
        faults += [
            f"{self.path}: factor.tolerance of {name} = {half_widths[name]:g}: leaves no space in the region, which reaches "
            f"{limit:g} to either side of the centre; narrow it or widen the design"
            for name, limit in zip(self.factors, self.half_ranges, strict=True)
            if half_widths.get(name, 0.0) >= limit
        ]
        refuse(faults)
        return np.array([half_widths[name] for name in self.factors]) / self.step

    def check_responses(self) -> None:
        """Raises InputError for a response that is no figure of the simulation, or a temperature without a heat balance."""
        heats = any(name in TEMPERATURES for name in self.figures) and self.states("thermal")
        names = responses_of(heats)
        refuse(
            f"{self.path}: response.name = {name!r}: "
            + (
                f"{self.scene.file} has no [thermal], which computes temperatures; add that table there, or name another response"
                if name in TEMPERATURES
                else "wear needs K/H of a rig, which no simulation gives; choose pocket_sliding_N_m_s, to which wear is in proportion"
                if "wear" in name
                else f"the simulation does not give it; {_nearest(name, names)}"
            )
            for name in self.figures
            if name not in responses_of(heats)
        )
        refuse(
            f'{self.path}: response.aggregate of {response.name} = "worst_relative": temperatures in °C have no ratio; write '
            '"worst" or "mean"'
            for response in self.file.response
            if response.name in TEMPERATURES and response.aggregate == "worst_relative"
        )

    def states(self, table: str) -> bool:
        """Whether the study's scene has a table, in its file or by scene.set."""
        return table in self.scene_tables or any(text.startswith(f"{table}.") for text in self.scene.set)

    @cached_property
    def scene_tables(self) -> dict[str, Any]:
        """Tables of the study's scene file. Raises InputError for a missing file, or a factor's key that no scene has."""
        path, data = self.path_of(self.scene.file), self.read(self.scene.file)
        keys = [factor.key for factor in self.file.factor]
        left_out = [
            dotted
            for dotted in keys
            for table, _, key in (dotted.rpartition("."),)
            if not isinstance(data.get(table), dict) or key not in data[table]
        ]
        scene_values: Mapping[str, Any] = {}
        with suppress(InputError):
            scene_values = plain_values(Scene.from_dict(data, str(path), self.scene.set)) if left_out else {}
        refuse(
            f"{self.path}: factor.key = {key!r}: no such key in {path}; write table.key as in that file"
            for key in left_out
            if key not in scene_values
        )
        return data

    @cached_property
    def duty(self) -> Duty | None:
        """The duty; None without one."""
        return Duty.of(self)

    @cached_property
    def duty_with_groups(self) -> Duty | None:
        """The duty with its points that have one scene together; None without a duty. Raises InputError."""
        if self.duty is None:
            return None
        (run,) = self.design_scenes(self.baseline[None])
        keys = [point.key for point in points_of(scenes_of(run), list(self.duty.shares))]
        groups = dict[str, list[str]]()
        for name, key in zip(self.duty.shares, keys, strict=True):
            groups.setdefault(key, []).append(name)
        return replace(self.duty, groups=tuple(map(tuple, groups.values())))

    @cached_property
    def plan(self) -> RunPlan:
        """Every run of the design. Raises InputError for an impossible design, scene or response."""
        self.check_responses()
        design = self.design
        actual = self.actual(design.coded)
        scenes = self.design_scenes(actual, design.order.tolist())
        labels = [f"design run {run}" for run in range(1, len(actual) + 1)]
        return RunPlan(design, actual, scenes, labels, [self.by_factor(point) for point in actual])

    def _design_run(self, point: Array, seed: int, replicates: int | None = None) -> Run:
        """Scenes of a design run, with all their replicates unless another number is given, of which minor points have a part."""

        def scene(overrides: Sequence[str]) -> Scene:
            count = replicates
            if count is not None and (part := self._part_of(overrides)) > 1:
                count = max(count // part, 2)
            effort = [] if count is None else [f"numerics.replicates={count}"]
            return self._scene_in_region(point, seed, [*overrides, *effort])

        return self._begun(self.over_duty(scene, self.baseline_scenes))

    def _part_of(self, overrides: Sequence[str]) -> int:
        """The part of the replicates that the point of the duty with these overrides has: 1 where all judge the class of the cage."""
        return 1 if self.duty is None or self.file.limits.classes else self.duty.minor.get(tuple(overrides), 1)

    @cached_property
    def usual_run(self) -> Run:
        """A design run at the baseline with all its replicates."""
        return self._design_run(self.baseline, self.file.design.seed)

    @property
    def usual_replicates(self) -> int:
        """Replicates of a design run that has all; over a duty, at the point with the largest share of the time."""
        return main_scene(self.usual_run).numerics.replicates

    @cached_property
    def first_replicates(self) -> int:
        """Replicates of a design run at first: all where few are more than half."""
        fewest, usual = self.file.design.fewest_replicates, self.usual_replicates
        alike = all(scene.numerics.replicates == usual for scene in scenes_of(self.usual_run))
        return fewest if alike and 2 * fewest <= usual else usual

    @property
    def further_replicates(self) -> int:
        """Replicates that the first design runs leave out, 0 where they have all."""
        return self.usual_replicates - self.first_replicates

    @property
    def is_limited(self) -> bool:
        """Whether any response has a limit."""
        return any(response.lower is not None or response.upper is not None for response in self.file.response)

    def assignments(self, factors: Array) -> list[str]:
        """Overrides "key=value" of the scene at factor values (k,)."""
        numbers = zip(self.file.factor, map(float, factors), strict=True)
        return [f"{factor.key}={round(x) if factor.whole else x!r}" for factor, x in numbers]

    def scene_at(
        self,
        factors: Array,
        seed: int,
        overrides: Sequence[str] = (),
        kind: type[Scene] = Scene,
        *,
        confirms: bool = False,
    ) -> Scene:
        """The scene at factor values (k,), with a seed and ``overrides`` after those of all runs, of this ``kind``.

        It leaves out what the study does not name; a run that ``confirms`` a design traces its cage all the same. Raises InputError
        for an impossible value.
        """
        left_out = switched_off(self.figures)
        if not (confirms or self.file.limits.classes):
            left_out.append("verdict.trace=false")
        texts = (*self.scene.set, *left_out, *overrides, f"numerics.seed={seed}", *self.assignments(factors))
        if (kind, *texts) not in self.built:
            scene = kind.from_dict(self.scene_tables, str(self.path_of(self.scene.file)), texts)
            keys = [factor.key for factor in self.file.factor]
            refuse(
                f"{self.path}: factor.key = {fault}"
                for fault in first_guess_faults(scene.thermal, scene.lubricant, keys)
            )
            if self.duty is None or not self.duty.origins:
                self._refuse_missing(scene)
            self.built[kind, *texts] = scene
        return self.built[kind, *texts]

    def _refuse_missing(self, scene: Scene, where: str = "") -> None:
        """Raises InputError for figures of the study that a scene has not."""
        refuse(
            f"{self.path}: response.name = {name!r}{where}: {fault}"
            for name in self.figures
            if (fault := why_missing(scene, name))
        )

    def over_duty(
        self,
        scene: Callable[[Sequence[str]], Scene],
        baseline: Mapping[str, Scene] | None = None,
        baseline_errors: bool = False,
    ) -> Run:
        """A run: ``scene`` of no further overrides, or of those at each point of the duty.

        ``baseline`` and ``baseline_errors``: as of `DutyScenes`. Raises InputError, which names the point with an impossible scene.
        """
        if self.duty is None:
            return scene(())
        points, faults = dict[str, Scene](), dict[str, list[str]]()
        for name, overrides in self.duty.overrides.items():
            try:
                points[name] = scene(overrides)
                keys = {".".join(key_path(text) or ()) for text in overrides}
                refuse(first_guess_faults(points[name].thermal, points[name].lubricant, keys))
            except InputError as error:
                faults[name] = error.faults
        # A fault at all points is none of the duty.
        everywhere = (
            set.intersection(*map(set, faults.values())) if len(faults) == len(self.duty.shares) else set[str]()
        )
        at_points = [
            f"{self.path}: duty.set of {name}: {fault}"
            for name, sentences in faults.items()
            for fault in sentences
            if fault not in everywhere
        ]
        refuse([*sorted(everywhere), *at_points])
        if self.duty.origins:
            points = self.duty.started(points)
            for name, at_point in points.items():
                self._refuse_missing(at_point, f" at {name}")
        return DutyScenes(self.duty, points, baseline or {}, baseline_errors)

    @cached_property
    def baseline_scenes(self) -> dict[str, Scene]:
        """Scenes of the confirmation of the original design by point of the duty, if any response compares with them; else none."""
        if self.duty is None or not self.duty.relative:
            return {}
        run = self.over_duty(partial(self._confirmation_scene, self.baseline))
        return dict(run.scenes) if isinstance(run, DutyScenes) else {}

    def design_scenes(self, points: Array, order: Sequence[int] | None = None, further: bool = False) -> list[Run]:
        """Scenes of the design runs (n, k); runs at one point differ only by their seed.

        ``order``: place of each run in the standard order, which sets its seed; by default the order of the points. ``further``: those
        of the replicates that the first runs left out. Raises InputError, which names the point with an impossible value of a factor.
        """
        seed, places = self.file.design.seed + FURTHER_SEEDS * further, range(len(points)) if order is None else order
        few = self.further_replicates if further else self.first_replicates
        count = few if self.further_replicates else None
        return [self._design_run(point, seed + place, count) for place, point in zip(places, points, strict=True)]

    def _begun(self, run: Run) -> Run:
        """The run with heat balances that begin from those in the middle of the region, where they are known."""
        if isinstance(run, Scene):
            return begun_near(run, self.near.get(""))
        scenes = {name: begun_near(scene, self.near.get(name)) for name, scene in run.scenes.items()}
        return replace(run, scenes=scenes)

    def _scene_in_region(self, point: Array, seed: int, overrides: Sequence[str]) -> Scene:
        try:
            return self.scene_at(point, seed, overrides)
        except InputError as error:
            keys = [factor.key for factor in self.file.factor]
            place = ", ".join(f"{name} = {value:.4g}" for name, value in self.by_factor(point).items())
            raise InputError(
                [
                    f"{self.path}: the region of the design reaches {place}, where {fault}, or narrow the region"
                    if any(key in fault for key in keys) and not fault.startswith(f"{self.path}: ")
                    else fault
                    for fault in map(str, error.faults)
                ]
            ) from None

    def confirmation_run(self, point: Array, *, in_brief: bool = False) -> Run:
        """Scenes of a confirmation run: more replicates and companions, with seeds of their own.

        ``in_brief``: as few replicates as a design run, alone, with heat balances that begin as those do. Others measure the gain of
        their own loop, unless that in the middle of the region is slight.
        """
        scene = partial(self._confirmation_scene, point, in_brief=in_brief)
        run = self.over_duty(scene, self.baseline_scenes, baseline_errors=True)
        slight = all(gain(np.array(near.slopes)) <= SLIGHT_GAIN for near in self.near.values())
        # Ratios to the baseline are to the runs that confirm it.
        return self._begun(run) if in_brief or (slight and not self.baseline_scenes) else run

    def confirmation_scene(self, point: Array) -> Scene:
        """Scene of a confirmation run; over a duty, that at the point with the largest share of the time."""
        return main_scene(self.confirmation_run(point))

    def _confirmation_scene(self, point: Array, sets: Sequence[str], in_brief: bool = False) -> Scene:
        settings, seed = self.file.confirmation, self.file.design.seed + CONFIRMATION_SEEDS
        replicates = min(self.first_replicates, settings.replicates) if in_brief else settings.replicates
        if (part := self._part_of(sets)) > 1 or (in_brief and self.file.limits.classes):
            # A class of the cage needs some replicates alike.
            fewest = 2 if part > 1 and in_brief else main_scene(self.usual_run).verdict.limits.fewest_replicates
            replicates = max(replicates // part, min(settings.replicates, fewest))
        effort = [f"numerics.replicates={replicates}", f"numerics.companion={str(not in_brief).lower()}"]
        scene = self.scene_at(point, seed, [*sets, *effort, *settings.set], confirms=True)
        needed = scene.verdict.limits.fewest_replicates
        if self.file.limits.classes and settings.replicates < needed:
            raise InputError(
                f"{self.path}: confirmation.replicates = {settings.replicates}: limits.cage.verdict needs {needed} replicates alike to "
                f"name a class; raise it to {needed}"
            )
        if self.file.limits.classes and scene.cage_sample_s is None:
            raise InputError(
                f"{self.path}: limits.cage.verdict: the scene leaves the verdict out, by verdict.trace, a schedule or a cage "
                "without guide; remove the limit"
            )
        return scene

    def adaptive_scenes(self, points: Array, replicates: Sequence[int], first: int) -> list[Run]:
        """Scenes of runs (n, k) of an adaptive search, numbered from ``first``, each with its own replicates and seed."""
        adaptive, seed = self.file.adaptive, self.file.adaptive.seed + ADAPTIVE_SEEDS + first
        at_baseline = self.over_duty(lambda sets: self.scene_at(self.baseline, adaptive.seed, sets))
        # Runs with drifting figures may become longer by the least factor over the duty.
        usual = min(scene.numerics.extend_limit for scene in scenes_of(at_baseline))
        shared = ["numerics.companion=false", f"numerics.extend_limit={min(usual, ADAPTIVE_EXTENDED)!r}", *adaptive.set]

        def run(number: int, point: Array, count: int) -> Run:
            effort = [f"numerics.replicates={count}", *shared]
            return self._begun(
                self.over_duty(lambda sets: self.scene_at(point, number, [*sets, *effort]), self.baseline_scenes)
            )

        return [run(*numbered) for numbered in zip(range(seed, seed + len(points)), points, replicates, strict=True)]


class Factor(Record):
    """A factor as its study states it: ``centre`` and ``step`` of the coded unit, the region from ``low`` to ``high``.

    ``resolution`` of the drawing; ``tolerance``: half width of its parts; None where the study states none.
    """

    letter: str
    name: str
    key: str
    centre: float
    step: float
    resolution: float | None
    low: float
    high: float
    tolerance: float | None

    @property
    def words(self) -> str:
        """Its name without the unit."""
        return quantity(self.name)[0]

    @property
    def unit(self) -> str:
        return quantity(self.name)[1]

    @property
    def decimals(self) -> int:
        """Decimals of the resolution of the drawing, or of a hundredth of the step."""
        return min(max(-math.floor(math.log10(self.resolution or self.step / 100.0) + 1e-9), 0), 9)

    def text(self, value: float | None, further: int = 0) -> str:
        """A value to the resolution of the drawing, or ``further`` decimals beyond."""
        return "" if value is None else f"{value:.{self.decimals + further}f}"


class PointsOfDuty(Record):
    """How a response follows from its figures at the points of a duty; a limit at one ``point`` is that of its ``figure`` there."""

    aggregate: str
    points: list[str] | None
    figure: str | None = None
    point: str | None = None


class Response(Record):
    """A response with its goal, limits and the ``model`` of its surface; ``over_duty`` is None without a duty."""

    goal: str
    target: float | None
    lower: float | None
    upper: float | None
    weight: float
    model: str
    transform: str | float
    name: str
    over_duty: PointsOfDuty | None = spread(default=None)

    @property
    def is_ratio(self) -> bool:
        """Whether it is the worst ratio to the baseline over a duty."""
        return self.over_duty is not None and self.over_duty.aggregate == "worst_relative"

    @property
    def label(self) -> str:
        """'impact force [N]'; over a duty 'impact force, worst ratio' where it is one."""
        return f"{quantity(self.name)[0]}, worst ratio" if self.is_ratio else label(self.name)

    @property
    def bounds(self) -> list[float]:
        """Its limits, the lower one first."""
        return [bound for bound in (self.lower, self.upper) if bound is not None]


class Asked(Record):
    """Factors and responses in the order of the study."""

    factors: list[Factor]
    responses: list[Response]

    @staticmethod
    def of(study: Problem) -> "Asked":
        """What a study states."""
        reach, widths = study.reach, study.known_tolerances
        low, high = (study.actual(side * reach).tolist() for side in (-1.0, 1.0))
        without = set() if study.shares else set(OverDuty.model_fields) - set(Goal.model_fields)
        return Asked(
            [
                Factor(
                    letter=letter,
                    **factor.model_dump(include={"name", "key", "centre", "step", "resolution"}),
                    low=low[index],
                    high=high[index],
                    tolerance=widths.get(factor.name),
                )
                for index, (letter, factor) in enumerate(zip(ascii_uppercase, study.file.factor, strict=False))
            ],
            [Response.from_dict(response.model_dump(exclude=without)) for response in study.file.response],
        )

    @property
    def names(self) -> list[str]:
        """Names of the responses."""
        return [response.name for response in self.responses]

    @property
    def columns(self) -> list[str]:
        """Names of the factors."""
        return [factor.name for factor in self.factors]

    def response(self, name: str) -> Response:
        """The response of a name."""
        return next(response for response in self.responses if response.name == name)


class Settings(Asked):
    """What a whole study asks: its files, the ``scene`` of its runs, factors and responses, and its runs a point."""

    study_file: str
    scene_file: str
    scene: dict[str, Any]
    replicates: int
    design_replicates: int
    turns: float
    confirmation_replicates: int

    @classmethod
    def of_runs(cls, study: Problem, design_replicates: int) -> Self:
        """What a study with a scene states, and the replicates of its design runs."""
        scene, asked = main_scene(study.usual_run), Asked.of(study)
        return cls.from_attributes(
            asked,
            study_file=study.path.name,
            scene_file=study.scene.file,
            scene=scene.model_dump(mode="json", exclude_none=True),
            replicates=study.usual_replicates,
            design_replicates=design_replicates,
            turns=scene.numerics.turns,
            confirmation_replicates=study.file.confirmation.replicates,
        )


def _nearest(name: str, names: Sequence[str]) -> str:
    """The figures whose names are nearest to one that is none, or else the first of all."""
    near = difflib.get_close_matches(name[:LONGEST_NAME], names, n=2)
    return f"did you mean {' or '.join(near)}?" if near else f"choose one of {listed(names)}"
