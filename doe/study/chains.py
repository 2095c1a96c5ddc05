"""The dimension chains of a study, solved at the pick: from clearances with tolerances to parts."""

from functools import partial

import numpy as np

from doe.arrays import Array
from doe.dimension_chain import Chain, ChainResult, chain_from, solve
from doe.pareto.tolerance import WidestTolerances
from doe.study.goals import region_of
from doe.study_file import Study
from doe.study_file.sections import chain_table
from rbdyn.faults import InputError, check_all


def check_chains(study: Study) -> None:
    """Raises InputError for a chain that has no solution at the centre, or whose half width nothing gives.

    One whose half width is still to be found is tried with the widest that the region allows.
    """
    computed_later = study.file.tolerances is not None
    half_widths = region_of(study) * study.step if computed_later else np.full(study.step.size, np.nan)
    numbers = range(len(study.file.chain))
    check_all(partial(_chain, study, number, study.centre, half_widths) for number in numbers)


def solve_chains(
    study: Study, pick: Array, tolerances: WidestTolerances | None
) -> tuple[dict[str, ChainResult], list[str]]:
    """Every chain by name at the picked point (k,), and why any has no parts."""
    half_widths = np.full(pick.size, np.nan) if tolerances is None else tolerances.half_widths
    solved, notes = {}, []
    for number, chain in enumerate(study.file.chain):
        if (place := study.factors.index(chain.factor)) in study.inactive:
            notes.append(f"chain {chain.name}: not solved, since {chain.factor} means nothing at the pick's categories")
            continue
        widest, given = half_widths[place], chain.half_width_mm
        if given is not None and given > widest:
            why = f"wider than the {widest:.3g} within which the gains are kept as [tolerances] asks"
            where = f"{study.path}: chain {chain.name}: half_width_mm = {given:g}"
            notes.append(f"{where}: {why}; narrow it, or keep less")
        try:
            parts = _chain(study, number, pick, half_widths)
            solved[chain.name] = solve(parts, source=f"{study.path}: chain {chain.name}")
        except InputError as error:
            notes += error.faults
    return solved, notes


def _chain(study: Study, number: int, point: Array, half_widths: Array) -> Chain:
    chain = study.file.chain[number]
    factor = study.factors.index(chain.factor)
    half_width = float(half_widths[factor]) if half_widths[factor] > 0.0 else None
    source = f"{study.path}: chain {chain.name}"
    try:
        table = chain_table(chain, study.path.parent, float(point[factor]), half_width)
    except InputError as error:
        raise InputError([f"{study.path}: {fault}" for fault in error.faults]) from None
    return chain_from(table, source)
