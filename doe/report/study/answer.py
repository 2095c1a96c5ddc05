"""The few lines of a study that a person acts on."""

import io
from contextlib import redirect_stdout
from typing import Any

from doe.report.steps.chain import print_chain
from doe.report.steps.robust import print_robust_front, robust_sentences
from doe.report.steps.search_words import search_sentences
from doe.report.words import of_hundred, rounded_down
from doe.running.failure import grouped
from doe.study.confirmation import statement
from doe.study.limits import every_limit
from doe.study.whole import StudyResult
from rbdyn.cli.terminal import print_table
from rbdyn.records.words import improvement, with_error


def print_outcome(outcome: StudyResult, quiet: bool) -> None:
    """The end of a study on the terminal: the answer last, where the eye is."""
    study = outcome.study
    if not quiet and outcome.beside and study.file.reference:
        _print_beside(study.file.reference.label, outcome)
    if not quiet:
        _print_other_points(outcome)
    _print_answer(outcome)
    if not quiet:
        for note in outcome.notes:
            print(f"note: {note}")


def print_verdict(outcome: StudyResult) -> None:
    """Whether the pick is better over what is not known, and what became of the limits: the first that is to be read."""
    if outcome.robust is not None:
        print("\n".join(robust_sentences(outcome.robust, outcome.study.factors)))
    if outcome.limits_sentence:
        print(outcome.limits_sentence)


def answer_text(outcome: StudyResult) -> str:
    """The answer as it is printed."""
    with redirect_stdout(io.StringIO()) as text:
        print_verdict(outcome)
        _print_answer(outcome)
    return text.getvalue()


def _print_answer(outcome: StudyResult) -> None:
    study = outcome.study
    for sentence in search_sentences(outcome):
        print(sentence)
    _print_clearances(outcome)
    rows = []
    for gain in outcome.gains["pick"]:
        index = study.responses.index(gain.response)
        cells = [_value(each, index) for each in (outcome.baseline, outcome.pick)]
        rows.append((gain.response, *cells, improvement(gain.percent, gain.error, gain.goal), gain.verdict))
    print_table("confirmed by simulation (95 % intervals)", ("", "baseline", "pick", "change", "verdict"), rows)
    print(statement(outcome.gains["pick"]))
    if outcome.whirl_sentence:
        print(outcome.whirl_sentence)
    if outcome.robust is not None:
        print_robust_front(outcome.robust, study.factors)
    _print_limits(outcome)
    print(f"pick: {outcome.pick.reason}")
    print(outcome.edge.sentence)
    for name, chain in outcome.chains.items():
        print_chain(name, chain)
        if chain.refused:
            print(chain.status)
    for group in grouped(outcome.failures):
        print(f"failed ({len(group['labels'])}): {', '.join(group['labels'])}: {group['cause']}")


def _print_limits(outcome: StudyResult) -> None:
    """Every limit at the baseline and at the pick, judged by simulation; the odds are those of all limits of a response."""
    rows, odds = [], {} if outcome.robust is None else outcome.robust.odds
    judged = (every_limit(outcome.study, each) for each in (outcome.baseline, outcome.pick))
    for base, limit in zip(*judged, strict=True):
        values = [(with_error(each.value, each.error), each.verdict) for each in (base, limit)]
        over = [of_hundred(odds[limit.response])] if odds else []
        rows.append((f"{limit.response} {limit.sense} {limit.bound:g}", *values[0], *values[1], *over))
    if rows:
        header = (
            "",
            "baseline",
            "verdict",
            "pick",
            "verdict",
            *(["kept in 100 cases of unknown inputs"] if odds else []),
        )
        print_table("limits judged by simulation", header, rows)


def _print_clearances(outcome: StudyResult) -> None:
    found = outcome.tolerances
    half_widths = [None] * len(outcome.study.factors) if found is None else found.half_widths.tolist()
    points = outcome.baseline.point, outcome.pick.point
    running = outcome.clearances
    rows = []
    for name, base, pick, half in zip(outcome.study.factors, *points, half_widths, strict=True):
        widest = [] if half is None else ["" if half != half else f"± {rounded_down(half)}"]
        rows.append((name, f"{base:.4g}", f"{pick:.4g}", *widest))
        if plays := running.operating.get(name):
            rows.append(
                (
                    "  in operation",
                    *(f"{plays[point]:.4g}" for point in ("baseline", "pick")),
                    *([""] if widest else []),
                )
            )
    header = ("", "baseline", "pick", *([] if found is None else ["widest tolerance"]))
    print_table("chosen clearances", header, rows)
    if running.class_sentence:
        print(running.class_sentence)
    if found is not None:
        print(f"tolerances: {found.sentence}")


def _print_other_points(outcome: StudyResult) -> None:
    """Confirmed points beside the pick."""
    study = outcome.study
    others = {name: each for name, each in outcome.confirmed.items() if name not in ("baseline", "pick")}
    if not others:
        return
    rows = [
        (
            name.replace("_", " "),
            *(f"{x:.4g}" for x in each.point),
            *(improvement(gain.percent, gain.error, gain.goal) for gain in outcome.gains[name]),
        )
        for name, each in others.items()
    ]
    wanted = [gain.response for gain in outcome.gains["pick"]]
    print_table("other points, changes confirmed by simulation", ("", *study.factors, *wanted), rows)


def _print_beside(reference: str, outcome: StudyResult) -> None:
    rows = []
    for row in outcome.beside:
        rows.append((row.response, "level: min, mean, max", _three(row.our_range), _three(row.their_range), ""))
        for factor, effect in row.effects.items():
            same = "same sign" if effect.same_sign else "opposite sign"
            ours = _effect(effect.ours, effect.ours_significant)
            rows.append(("", f"effect of {factor}", ours, _effect(effect.theirs, effect.theirs_significant), same))
        rows.append(("", "rank correlation of the runs", f"{row.rank_correlation:+.2f}", "", ""))
    print_table(f"our runs beside {reference} (* significant at 5 %)", ("", "", "ours", "theirs", ""), rows)
    for row in outcome.beside:
        print(f"{row.verdict} {row.why}".rstrip())


def _value(confirmed: Any, index: int) -> str:
    return with_error(float(confirmed.values[index]), float(confirmed.error[index]))


def _effect(effect: float, significant: bool) -> str:
    return f"{effect:+.3g}{'*' if significant else ''}"


def _three(values: tuple[float, float, float]) -> str:
    return ", ".join(f"{x:.4g}" for x in values)
