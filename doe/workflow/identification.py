"""What measurements on a rig identify of unknown inputs: the record of ``doe calibrate``, and the evidence behind it."""

from collections import Counter
from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from doe.unknown import inputs as unknown
from doe.unknown.calibration import FAR, MISSED, Explanation, Judgement, Matched, Trial, judge, objections, reweighed
from doe.unknown.posterior import Learnt, contraction, contraction_words, densest_intervals, learnt
from doe.unknown.propagation import ENDS, MEDIAN_FIRST
from doe.unknown.width import Power
from doe.workflow.input_sets import Case, laws_of
from doe.workflow.rig import Rig
from rbdyn.base.arrays import Array
from rbdyn.base.faults import RunError
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record, derived, outside_json, spread
from rbdyn.base.words import quantity, shown
from rbdyn.scene.unknown import Input, value_of

# Verdicts on a calibration.
CALIBRATED, NOT_CALIBRATED, UNDECIDABLE = "calibrated", "not calibrated", "cannot be judged by this design"
# Rows of the posterior sample, its file, and input sets of the prior.
SAMPLE, SAMPLE_FILE, BEFORE = 1000, "posterior.csv", 2000

Quantiles = tuple[float, float, float]


class Design(NamedTuple):
    """The power of a design to judge predictions, and a sentence on one that cannot; empty for another."""

    power: Power
    doubt: str


class OutputAnswer(Record):
    """Whether the simulation explains an output: discrepancy of its level (median, 5 and 95 %), allowed scales, and evidence.

    ``resolution``: the largest offset that would not be seen. ``moves``: by how much it moves each number among the inputs, in the
    units of the scene, and ``moves_sd`` in standard deviations of the posterior. None where nothing is left to sample.
    """

    explained: bool
    discrepancy: Quantiles | None
    allowed: float | None
    accuracy_percent: float
    evidence: float | None
    resolution: float | None
    moves: dict[str, float]
    moves_sd: dict[str, float]


class InputAnswer(Record, kw_only=True):
    """The densest 90 % of an input or more, with its median and its range before; of choices their ``shares``."""

    shares: dict[str, float] | None = None
    low: float | None = None
    median: float | None = None
    high: float | None = None
    before: tuple[float, float] | None = None
    seen: str

    @property
    def after_words(self) -> str:
        """Its densest 90 %, or the shares of its choices."""
        shares = ", ".join(f"{value} {100.0 * share:.0f} %" for value, share in (self.shares or {}).items())
        return shares or f"{shown(self.low)} to {shown(self.high)}"

    @property
    def before_words(self) -> str:
        """Its range before; empty for choices."""
        return " to ".join(map(shown, self.before or ()))


class Cell(Record):
    """A measured value, ``held`` out or not, with its predictions (5, 50, 95 %) before and after the calibration.

    ``residual``: its distance from the prediction by the others, in standard deviations.
    """

    row: int
    output: str
    measured: float
    sd: float
    held: bool
    as_the_scene_says: float
    before: Quantiles
    after: Quantiles | None
    residual: float | None


class Cost(Record):
    """Runs, shaft turns and wall time [s] until the files are written."""

    runs: int
    turns: float
    seconds: float


class Calibration(Record, kw_only=True):
    """What measurements identify of the unknown inputs, and whether the scene may be called calibrated.

    ``made_of``: digest of the question. ``screened``: inputs kept at their values. ``volumes``: share of the prior that is plausible
    after each wave. ``posterior``: file of the sample, None if no input set is left; what follows from it is then empty or None.
    ``without_outliers``: contraction by key without the outliers among the cells. ``evidence``: None where the record was read.
    """

    format: str = derived(lambda self: "doe.calibration/2")
    made_of: str
    scene: str
    data: str
    verdict: str
    reasons: list[str]
    learnt: Learnt = spread()
    discrepancy: dict[str, Quantiles]
    outputs: dict[str, OutputAnswer]
    held_out: Trial | None
    posterior: str | None
    inputs: dict[str, InputAnswer]
    outliers: list[Cell]
    without_outliers: dict[str, float] | None
    cells: list[Cell]
    log_evidence: float | None
    volumes: list[float]
    screened: dict[str, float]
    runs: int
    seed: int
    notes: Notes
    cost: Cost | None = None
    sha256: str | None = None
    evidence: "Evidence | None" = outside_json(default=None)


class Evidence(Record):
    """What a calibration rests on.

    ``case``: the scene with its unknown inputs; ``inputs``: the targets; ``screened``: inputs kept at their values.
    ``cells``: (row, output) of each measurement; ``nominal`` (c,): their logarithms at the scene's own inputs; ``before`` (n, c):
    over the prior. ``design``: what the design can judge.
    """

    made_of: str
    case: Case
    rig: Rig
    inputs: list[Input]
    screened: dict[str, float]
    cells: list[tuple[int, str]]
    nominal: Array
    match: Matched
    before: Array
    runs: int
    notes: Notes
    design: Design

    @property
    def keys(self) -> list[str]:
        """Keys of the targets."""
        return [entry.key for entry in self.inputs]

    @property
    def seed(self) -> int:
        """Seed of input sets and samples."""
        return self.case.scene.calibrate.seed

    @property
    def points(self) -> Array:
        """Particles (n, d) of the posterior. Raises RunError without one."""
        if self.match.sampled is None:
            raise RunError("calibration: no input set is left to sample")
        return self.match.sampled.points

    @property
    def quantiles(self) -> Array:
        """Quantiles (n, d) of the inputs, drawn from the posterior."""
        return self.match.quantiles(self.points[np.linspace(0, len(self.points) - 1, SAMPLE).astype(int)])

    @cached_property
    def sample(self) -> list[dict[str, Any]]:
        """Values of each input, and of each key that multiplies one, in the input sets of ``quantiles``."""
        keys = self.keys
        tied = [entry.key for entry in self.case.every if entry.key not in keys and entry.law.times in keys]
        scenes = self.case.scenes(self.inputs, unknown.table_of(laws_of(self.inputs), self.quantiles), 0)
        # A set may be possible at the rig's conditions and impossible in the scene itself.
        return [{key: value_of(scene, key) for key in (*keys, *tied)} for scene in scenes if not isinstance(scene, str)]

    def values(self, place: int, quantiles: Array | Sequence[float]) -> tuple[float, float]:
        """Values of the scene at two quantiles of an input's law."""
        entry = self.inputs[place]
        low, high = (
            self.case.unit(entry) * value for value in unknown.values_of(entry.law, np.asarray(quantiles, float))
        )
        return low, high


def identified(evidence: Evidence) -> Calibration:
    """The answer of a calibration: the posterior of the inputs, the judgement of its predictions, and the objections."""
    match, rig, judgement, gained = evidence.match, evidence.rig, None, None
    contradictions, notes, after, discrepancy = _refuted(evidence), evidence.notes, None, dict[str, Quantiles]()
    if match.sampled is not None:
        judgement = judge(match, [quantity(name)[0] for name in rig.outputs], evidence.seed, evidence.design.power)
        gained = _learnt(evidence)
        contradictions += objections(judgement, has_learned=gained.has_learned, emulated=match.misfit < MISSED)
        after = match.cells.mean(evidence.quantiles)
        narrow = "the posterior lies at an end of its range, which may be too narrow"
        notes = (*notes, *(Note("inputs", f"{key}: {narrow}") for key in gained.narrow))
        taus = np.quantile(match.errors(evidence.points).level, MEDIAN_FIRST, axis=0).T.tolist()
        discrepancy = dict(zip(rig.outputs, taus, strict=False))
    cells = [_cell(evidence, place, judgement, after) for place in range(len(evidence.cells))]
    far = [] if judgement is None else np.flatnonzero(np.abs(judgement.residuals) > FAR).tolist()
    doubts = [evidence.design.doubt] if evidence.design.doubt else []
    return Calibration.from_attributes(
        evidence,
        scene=evidence.case.source,
        data=str(rig.path),
        verdict=NOT_CALIBRATED if contradictions else UNDECIDABLE if doubts else CALIBRATED,
        reasons=[*contradictions, *doubts],
        learnt=Learnt({}, []) if gained is None else gained,
        discrepancy=discrepancy,
        outputs=_outputs(evidence, judgement),
        held_out=None if judgement is None else judgement.trial,
        posterior=None if judgement is None else SAMPLE_FILE,
        inputs={} if gained is None else _inputs(evidence, gained),
        outliers=[cells[place] for place in far],
        without_outliers=None if judgement is None else _without(evidence, judgement, far),
        cells=cells,
        log_evidence=None if match.sampled is None else match.sampled.log_evidence,
        volumes=match.volumes,
        notes=notes,
        evidence=evidence,
    )


def _refuted(evidence: Evidence) -> list[str]:
    """A sentence on cells that no input set predicts."""
    cells = [evidence.cells[place] for place in evidence.match.refuted]
    names = ", ".join(f"{quantity(name)[0]} of row {row}" for row, name in cells)
    sentence = "refuted: no input set within the laws predicts these within the allowed discrepancy"
    return [f"{sentence}: {names}"] if cells else []


def _learnt(evidence: Evidence) -> Learnt:
    """Learned inputs by the posterior, and by the prior before it."""
    match, inputs = evidence.match, evidence.inputs
    quantiles = match.quantiles(evidence.points)
    prior = match.quantiles(np.random.default_rng(1).standard_normal((BEFORE, len(inputs))))
    return learnt(evidence.keys, quantiles, _logarithms(inputs, quantiles), _logarithms(inputs, prior))


def _logarithms(inputs: Sequence[Input], quantiles: Array) -> Array:
    """Logarithms (n, d) of inputs that are positive numbers; NaN of the others."""
    logarithms = np.full(quantiles.shape, np.nan)
    for place, unknown_input in enumerate(inputs):
        if unknown_input.law.law != "choices":
            values = np.array(unknown.values_of(unknown_input.law, quantiles[:, place]))
            if (values > 0.0).all():
                logarithms[:, place] = np.log(values)
    return logarithms


def _outputs(evidence: Evidence, judgement: Judgement | None) -> dict[str, OutputAnswer]:
    refuted = {evidence.cells[place][1] for place in evidence.match.refuted}
    accuracies = {name: 100.0 * evidence.rig.accuracies[name] for name in evidence.rig.outputs}
    if judgement is None:
        return {
            name: OutputAnswer(False, None, None, accuracy, None, None, {}, {}) for name, accuracy in accuracies.items()
        }
    return {
        name: _output(evidence, explanation, accuracy, name in refuted)
        for (name, accuracy), explanation in zip(accuracies.items(), judgement.outputs, strict=True)
    }


def _output(evidence: Evidence, explanation: Explanation, accuracy: float, refuted: bool) -> OutputAnswer:
    unseen, scores = explanation.unseen, evidence.points[:, : len(evidence.inputs)]
    moves, shares = dict[str, float](), dict[str, float]()
    if unseen is not None:
        centre, sds = scores.mean(axis=0), scores.std(axis=0)
        quantiles = evidence.match.quantiles(np.array([centre, centre + unseen.moves]))
        for place, entry in enumerate(evidence.inputs):
            if entry.law.law != "choices":
                low, high = evidence.values(place, quantiles[:, place])
                moves[entry.key], shares[entry.key] = high - low, float(unseen.moves[place] / sds[place])
    return OutputAnswer.from_attributes(
        explanation,
        explained=explanation.explained and not refuted,
        discrepancy=tuple(np.expm1(explanation.bias).tolist()),
        accuracy_percent=accuracy,
        resolution=None if unseen is None else float(np.expm1(unseen.offset)),
        moves=moves,
        moves_sd=shares,
    )


def _inputs(evidence: Evidence, gained: Learnt) -> dict[str, InputAnswer]:
    answers, ends = dict[str, InputAnswer](), densest_intervals(evidence.match.quantiles(evidence.points))
    for place, entry in enumerate(evidence.inputs):
        column = [row[entry.key] for row in evidence.sample]
        seen = contraction_words(gained.learned[entry.key])
        if entry.law.law == "choices":
            shares = {str(value): count / len(column) for value, count in Counter(column).items()}
            answers[entry.key] = InputAnswer(shares=shares, seen=seen)
        else:
            low, high = evidence.values(place, ends[:, place])
            before = evidence.values(place, (ENDS[0], ENDS[-1]))
            median = float(np.median(column))
            answers[entry.key] = InputAnswer(low=low, median=median, high=high, before=before, seen=seen)
    return answers


def _cell(evidence: Evidence, place: int, judgement: Judgement | None, after: Array | None) -> Cell:
    (row, name), measured = evidence.cells[place], evidence.match.measured
    value = float(np.exp(measured.values[place]))
    return Cell(
        row=row,
        output=name,
        measured=value,
        sd=value * float(np.sqrt(measured.variances[place])),
        held=bool(measured.validation[place]),
        as_the_scene_says=float(np.exp(evidence.nominal[place])),
        before=_quantiles(evidence.before[:, place]),
        after=None if after is None else _quantiles(after[:, place]),
        residual=None if judgement is None else float(judgement.residuals[place]),
    )


def _quantiles(logarithms: Array) -> Quantiles:
    low, middle, high = np.exp(np.quantile(logarithms, ENDS)).tolist()
    return low, middle, high


def _without(evidence: Evidence, judgement: Judgement, outliers: Sequence[int]) -> dict[str, float] | None:
    """Contraction by key without the outliers among the cells; None without outliers or without other cells."""
    learnt_cells = evidence.match.measured.learnt
    cells = np.setdiff1d(learnt_cells, outliers)
    if cells.size in (0, learnt_cells.size):
        return None
    points = reweighed(judgement.particles, cells, evidence.seed)
    return dict(zip(evidence.keys, contraction(evidence.match.quantiles(points)).tolist(), strict=True))
