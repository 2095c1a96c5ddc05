"""The few lines of a study that a person acts on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from doe.report.chain import print_chain
from rbdyn.terminal import print_table

if TYPE_CHECKING:
    from doe.study import Outcome


def print_outcome(outcome: Outcome, quiet: bool) -> None:
    """The end of a study on the terminal: the answer last, where the eye is."""
    study = outcome.study
    if not quiet and outcome.beside and study.file.reference:
        _print_beside(study.file.reference.label, outcome)
    rows = [
        (name, f"{base:.4g}", f"{pick:.4g}")
        for name, base, pick in zip(study.factors, outcome.baseline.point, outcome.pick.point, strict=True)
    ]
    print_table("chosen clearances", ("", "baseline", "pick"), rows)
    gains = []
    for index, gain in enumerate(outcome.gains):
        cells = [_value(each, index) for each in (outcome.baseline, outcome.pick)]
        gains.append((gain.response, *cells, f"{gain.percent:+.2f} ± {gain.error:.2f} %", gain.verdict))
    print_table(
        "confirmed by simulation (95 % intervals)", ("", "baseline", "pick", "improvement", "verdict"), gains
    )
    print(f"pick: {outcome.front.pick_reason}")
    for name, chain in outcome.chains.items():
        print_chain(name, chain)
        print(chain.status)
    if not quiet:
        for note in outcome.runs.notes:
            print(f"note: {note}")


def _print_beside(reference: str, outcome: Outcome) -> None:
    rows = []
    for row in outcome.beside:
        rows.append(
            (row.response, "level: min, mean, max", _three(row.our_range), _three(row.their_range), "")
        )
        for factor, (ours, theirs) in row.effects.items():
            same = "same sign" if ours[0] * theirs[0] > 0.0 else "opposite sign"
            rows.append(("", f"effect of {factor}", _effect(ours), _effect(theirs), same))
        rows.append(("", "rank correlation of the runs", f"{row.rank_correlation:+.2f}", "", ""))
    print_table(f"our runs beside {reference} (* significant at 5 %)", ("", "", "ours", "theirs", ""), rows)
    for row in outcome.beside:
        print(f"{row.verdict} {row.why}".rstrip())


def _value(confirmed: Any, index: int) -> str:
    error = np.hypot(np.nan_to_num(confirmed.statistical[index]), np.nan_to_num(confirmed.numerical[index]))
    return f"{confirmed.values[index]:.5g} ± {error:.2g}"


def _effect(effect: tuple[float, bool]) -> str:
    return f"{effect[0]:+.3g}{'*' if effect[1] else ''}"


def _three(values: tuple[float, float, float]) -> str:
    return ", ".join(f"{x:.4g}" for x in values)
