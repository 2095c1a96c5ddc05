"""The chapter on unknown inputs of ``doe study --robust``: inputs with ranges and sources, odds, what decides; and its tables."""

from collections.abc import Mapping, Sequence
from typing import Any

from doe.report.sections.record import SENSES, Record, of_hundred, part
from rbdyn.base.blocks import Block, Bullets, Paragraph, Section, Table
from rbdyn.base.words import counted, quantity, shown, with_error

INPUTS, DECIDES = "unknown_inputs.csv", "decides.csv"
# Words of the laws of inputs.
LAWS = {
    "uniform": "evenly",
    "log_uniform": "evenly by ratio",
    "triangular": "most likely near the middle",
    "normal": "normal",
    "choices": "one of these",
    "sample": "by a sample of measurements",
}


def unknown(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Odds that the pick is better, the inputs that decide it, and every unknown input with its range and source."""
    robust = part(summary, "robust")
    if not robust:
        return None
    blocks: list[Block] = [
        Bullets(robust.get("sentences") or []),
        _odds(robust),
        _limits(summary),
        _decides(robust),
        Paragraph(robust.get("undecided") or ""),
        Paragraph(_effort(robust), "small"),
        _inputs(robust),
    ]
    return Section("unknown", "Unknown inputs", blocks)


def _odds(robust: Record) -> Table:
    """Probability of each gain, and the share of its variance over the inputs that the emulators explain."""
    explained = robust.get("foretold") or {}
    rows = [
        (quantity(name)[0], of_hundred(share), _percent(explained.get(name)))
        for name, share in (robust.get("better") or {}).items()
    ]
    if robust.get("all"):
        rows.append(("all of these", of_hundred(robust["all"]), ""))
    header = ("response", "pick better in 100 cases", "explained by the inputs")
    return Table("Odds that the pick is better than the original", header, rows)


def _limits(summary: Record) -> Table:
    """Odds that each limit is kept over the unknown inputs."""
    limits = part(summary, "limits") or {}
    rows = [
        (
            quantity(name)[0],
            f"{SENSES.get(str(limit.get('sense')), '')} {shown(limit.get('bound'))}",
            of_hundred(limit["odds"]),
        )
        for name, limit in limits.items()
        if isinstance(limit, Mapping) and limit.get("odds")
    ]
    return Table("Limits over the unknown inputs", ("response", "limit", "kept in 100 cases"), rows, text_columns=(1,))


def _decides(robust: Record) -> Table:
    """By input: what measuring it is worth, and the value at which the choice flips."""
    rows = [
        (
            decider["key"],
            of_hundred((decider["worth"], *decider["worth_interval"])),
            shown(decider.get("flip"), 3),
            _interval(decider.get("flip_interval")),
            "above" if decider.get("pick_above") else "below",
        )
        for decider in robust.get("decides") or []
        if decider.get("worth_interval")
    ]
    header = ("input", "points of chance gained by measuring it", "flips at", "95 % interval", "pick is better")
    note = "Points: by how much of 100 the chance of the right choice rises."
    return Table("Inputs that decide", header, rows, note, text_columns=(3, 4))


def _inputs(robust: Record) -> Table:
    """Each input with its range and the source of that; a screened one with its largest share of a variance."""
    screened = robust.get("screened") or {}
    rows = [
        (
            entry["key"],
            law_words(entry["law"]),
            str(entry.get("reason") or "stated in the file"),
            _percent(screened.get(entry["key"])),
        )
        for entry in robust.get("inputs") or []
    ]
    header = ("input", "range", "source of the range", "screened, share of a variance")
    return Table("Inputs, ranges and sources", header, rows, text_columns=(1, 2))


def _effort(robust: Record) -> str:
    """How many inputs varied in how many runs."""
    inputs, pairs, runs = (robust.get(key) for key in ("inputs", "pairs", "runs"))
    if not inputs or pairs is None:
        return ""
    return f"{counted(len(inputs), 'input')} varied together in {counted(pairs, 'input set')}, {counted(runs or 0, 'run')}."


def law_words(law: Mapping[str, Any]) -> str:
    """'0.3 to 3 (evenly by ratio)', of a law as JSON."""
    times = f" times {law['times']}" if law.get("times") else ""
    kind = LAWS.get(str(law.get("law")), str(law.get("law") or ""))
    if law.get("mean") is not None:
        return f"{with_error(law['mean'], law.get('sd'))} (1 sd){times} ({kind})"
    if law.get("low") is not None and law.get("high") is not None:
        return f"{shown(law['low'])} to {shown(law['high'])}{times} ({kind})"
    if law.get("law") == "choices":
        return f"{', '.join(map(str, law.get('values') or ()))} ({kind})"
    return kind


def robust_tables(robust: Record) -> dict[str, list[dict[str, Any]]]:
    """Rows of the inputs and of what decides."""
    return {
        INPUTS: [
            {
                "input": entry["key"],
                **{key: entry["law"].get(key) for key in ("law", "low", "high", "times")},
                "range": law_words(entry["law"]),
                "source": entry.get("reason"),
            }
            for entry in robust["inputs"]
        ],
        DECIDES: [
            {
                "input": decider["key"],
                "worth": decider["worth"],
                **_ends("worth", decider["worth_interval"]),
                "flip": decider["flip"],
                **_ends("flip", decider["flip_interval"]),
                "pick_above": decider["pick_above"],
            }
            for decider in robust["decides"]
        ],
    }


def _ends(name: str, interval: Sequence[float] | None) -> dict[str, float | None]:
    low, high = interval or (None, None)
    return {f"{name}_low": low, f"{name}_high": high}


def _interval(interval: Sequence[float] | None) -> str:
    return " to ".join(shown(end, 3) for end in interval) if interval else ""


def _percent(share: float | None) -> str:
    return "" if share is None else f"{shown(100.0 * share, 2)} %"
