"""The design of a study: its points, and what its models need of them."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import NamedTuple, Self

import numpy as np

from doe import designs
from doe.designs import Design
from doe.designs.model import Evaluation, Model, Terms, evaluate, lost_terms, model_terms
from doe.study_file import Study
from doe.study_file.sections import KEYS_OF
from doe.study_file.sections import Design as DesignSettings
from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError, MethodError, refuse
from rbdyn.base.notes import Note
from rbdyn.base.records import Record
from rbdyn.base.words import are, counted

OPTIMAL = {f"{criterion}_optimal": partial(designs.optimal, criterion=criterion) for criterion in ("d", "i")}
MAKERS: dict[str, Callable[..., Design]] = {
    **OPTIMAL,
    **{kind: getattr(designs, kind) for kind in KEYS_OF if kind not in OPTIMAL},
}
SEEDED = {"latin_hypercube", "sobol", *OPTIMAL}
# Most whole numbers of a factor from which an optimal design chooses; evenly spread if there are more.
MOST_LEVELS = 41
Values = tuple[float, ...]


class OptimalBasis(NamedTuple):
    """The basis of an optimal design beyond its settings: the terms, and coded levels of each factor (None: any value)."""

    terms: Terms
    levels: tuple[Values | None, ...]


def terms_of(study: Study, model: Model) -> Terms:
    """Terms of a model in the factors of the study."""
    return model_terms(len(study.factors), model)


def design_of(study: Study) -> Design:
    """The design in the order of its runs; whole numbers are rounded.

    Raises InputError for impossible settings.
    """
    settings = study.file.design
    basis = _optimal_basis(study) if settings.kind in OPTIMAL else None
    try:
        design = _design(settings.model_dump_json(exclude_unset=True), len(study.factors), basis)
    except MethodError as error:
        raise InputError(f"{study.path}: design.{error}") from None
    return replace(design, coded=realised(study, design.coded, design.reach))


def realised(study: Study, coded: Array, reach: float) -> Array:
    """Coded points (n, k) with whole numbers rounded."""
    integer, half = np.array([factor.whole for factor in study.file.factor]), reach * study.step
    rounded = _integers(study.actual(coded), study.centre, study.centre - half, study.centre + half)
    return np.where(integer, study.coded(rounded), coded)


def _integers(actual: Array, centre: Array, low: Array, high: Array) -> Array:
    """The nearest whole numbers, halves outward, that do not lie beyond the ends of the region."""
    nearest = np.where(actual < centre, np.ceil(actual - 0.5), np.floor(actual + 0.5))
    slack = 1e-9 * (high - low)
    return nearest.clip(np.ceil(low - slack), np.floor(high + slack))


@cache
def _design(text: str, factors: int, basis: OptimalBasis | None) -> Design:
    """The design of settings in JSON; cached, because several steps of a study ask for it and some designs are slow."""
    settings = DesignSettings.model_validate_json(text)
    seed, basis_keys = {"seed"} if settings.kind in SEEDED else set(), {} if basis is None else basis._asdict()
    keys = settings.model_dump(include=KEYS_OF[settings.kind] | seed)
    design = MAKERS[settings.kind](factors, centre_replicates=settings.centres, **keys, **basis_keys)
    return design.by_blocks(settings.seed if settings.order == "random" else None)


def all_terms(study: Study) -> Terms:
    """Terms of all response models together."""
    return tuple(dict.fromkeys(term for response in study.file.response for term in terms_of(study, response.model)))


def _optimal_basis(study: Study) -> OptimalBasis:
    levels: list[Values | None] = []
    for factor in study.file.factor:
        if factor.whole:
            low, high = math.ceil(factor.centre - factor.step - 1e-9), math.floor(factor.centre + factor.step + 1e-9)
            numbers = np.unique(np.rint(np.linspace(low, high, min(high - low + 1, MOST_LEVELS))))
            levels.append(tuple(((numbers - factor.centre) / factor.step).tolist()))
        else:
            levels.append(None)
    return OptimalBasis(all_terms(study), tuple(levels))


def check_runs(study: Study, design: Design) -> None:
    """Raises InputError with every response whose model needs more or other runs."""
    runs = len(design.coded)

    def inseparable_terms(model: Model) -> list[str]:
        return lost_terms(design.coded, terms_of(study, model), design.block)

    def least_runs(model: Model) -> int:
        return len(terms_of(study, model)) + design.blocks

    def simpler_fix(model: Model) -> str:
        others: tuple[Model, ...] = "pure_quadratic", "interaction", "linear"
        smaller = [candidate for candidate in others if set(terms_of(study, candidate)) < set(terms_of(study, model))]
        fitting = [
            candidate for candidate in smaller if runs >= least_runs(candidate) and not inseparable_terms(candidate)
        ]
        return f"choose a simpler model{' (' + ' or '.join(fitting) + ')' if fitting else ''}"

    faults = []
    for number, response in enumerate(study.file.response, 1):
        model, needed = response.model, least_runs(response.model)
        where = f"{study.path}: response[{number}].model = {model!r}"
        if runs < needed:
            effects = f", {counted(design.blocks - 1, 'block effect')}" if design.blocks > 1 else ""
            key = "runs" if "runs" in KEYS_OF[study.file.design.kind] else "centre_replicates"
            enlargement = "enlarge the design" if key != "runs" and inseparable_terms(model) else f"raise design.{key}"
            faults.append(
                f"{where}: the {counted(runs, 'run')} of the design {are(runs)} too few; it needs {needed} "
                f"({needed - design.blocks} terms{effects} and one to judge the fit): {enlargement} or {simpler_fix(model)}"
            )
        elif names := inseparable_terms(model):
            faults.append(
                f"{where}: the runs of the design cannot separate {', '.join(names)} from the other terms; add levels "
                f"or centre points, or {simpler_fix(model)}"
            )
    refuse(faults)


def evaluation(study: Study, design: Design) -> Evaluation:
    """Quality of the design for the largest model of a response, with the name of the model. Raises InputError if the runs are too few."""
    check_runs(study, design)
    model = max(
        (response.model for response in study.file.response), key=lambda candidate: len(terms_of(study, candidate))
    )
    figures = evaluate(design.coded, terms_of(study, model), design.block, region=design.region, reach=design.extent)
    return replace(figures, model=model)


class DesignRun(Record):
    """A run of a design, numbered in its order from 1, in coded and in actual units."""

    run: int
    kind: str
    block: int
    coded: dict[str, float]
    factors: dict[str, float]
    seed: int


class StandardRun(DesignRun):
    """A run with its place in the standard order, from 1."""

    standard: int


class DesignResult(Record, kw_only=True):
    """A design of the ``factors``, whose coded values ``reach`` so far, and how good it is."""

    kind: str
    factors: list[str]
    reach: float
    runs: list[StandardRun]
    evaluation: Evaluation
    notes: list[Note] | None = None

    @property
    def is_blocked(self) -> bool:
        """Whether there are several blocks."""
        return self.evaluation.blocks is not None

    @classmethod
    def of(cls, study: Study, design: Design, notes: Sequence[Note] = ()) -> Self:
        """The design of a study. Raises InputError if its runs are too few."""
        runs = zip(design_runs(study, design), design.order.tolist(), strict=True)
        return cls(
            kind=study.file.design.kind,
            factors=study.factors,
            reach=design.reach,
            runs=[StandardRun.from_attributes(run, standard=place + 1) for run, place in runs],
            evaluation=evaluation(study, design),
            notes=list(notes) or None,
        )


def design_runs(study: Study, design: Design) -> list[DesignRun]:
    """Runs in their order."""
    actual = study.actual(design.coded)
    rows = zip(design.order.tolist(), design.kind, design.block_numbers, design.coded, actual, strict=True)
    return [
        DesignRun(
            number,
            kind,
            block,
            coded=study.by_factor(coded),
            factors=study.by_factor(values),
            seed=study.file.design.seed + place,
        )
        for number, (place, kind, block, coded, values) in enumerate(rows, 1)
    ]
