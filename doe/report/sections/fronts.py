"""The Pareto front: every trade-off on the surfaces, the picks, and the fronts that stand beside it."""

from collections.abc import Mapping, Sequence
from typing import Any

from doe.report.sections import plots_of_fronts as plots
from doe.report.sections.answer import record_table, tolerances
from doe.report.sections.blocks import Block, Figures, Section, Table, Widget, Words
from doe.report.sections.plots_of_fronts import Front
from doe.report.sections.record import Record, factors, nearest, part, responses
from doe.report.sections.searches import in_few_runs
from doe.report.words import change
from rbdyn.records.words import chance, counted, label, shown, with_error

# Points of a front that are drawn; more cannot be told apart.
MOST_POINTS = 400


def fronts(summary: Record) -> list[Front]:
    """The front on the surfaces and those beside it, each sorted by the first response and thinned."""
    names = [each["name"] for each in responses(summary)]
    found: list[Front] = []
    for role, words, points in (
        ("front", "on the surfaces", part(summary, "front", "front")),
        ("robust", "with tolerances", part(summary, "front", "tolerance_aware", "front")),
        ("direct", "found in few runs, simulated", part(summary, "adaptive", "front")),
    ):
        whole = [point for point in points or [] if complete(point, summary)]
        if not whole or not names:
            continue
        whole.sort(key=lambda point: point["responses"][names[0]])
        share = max(len(whole) / MOST_POINTS, 1.0)
        kept = [whole[int(number * share)] for number in range(round(len(whole) / share))]
        found.append(Front(role, words, kept, sum(len(each.points) for each in found)))
    return found


def complete(point: Record, summary: Record) -> bool:
    """Whether every factor and response of a point is known, so that it can be drawn."""
    values = [part(point, "factors", each.name) for each in factors(summary)]
    values += [part(point, "responses", each["name"]) for each in responses(summary)]
    return None not in values


def picks(summary: Record) -> dict[str, Record]:
    """Baseline and picks that the front names, by name; "pick" is the one that the study stands by.

    That is the pick of the front, or the one that reckons with tolerances; then the other goes "without tolerances".
    """
    plain = part(summary, "front", "pick")
    named = {"knee": part(summary, "front", "knee")} | (part(summary, "front", "picks") or {})
    named = {name.replace("_", " "): point for name, point in named.items() if point}
    chosen = nearest(summary, part(summary, "pick"), ({"": plain} if plain else {}) | named)
    if chosen and plain:
        overtaken = {name: point for name, point in named.items() if name != chosen}
        named = overtaken | {"without tolerances": plain, "pick": named[chosen]}
    elif plain:
        named["pick"] = plain
    # The surfaces at the pick itself, which stands on the resolution of the drawing.
    if rounded := part(summary, "pick_on_surfaces"):
        named["pick"] = rounded
    baseline = part(summary, "front", "baseline")
    return ({"baseline": baseline} if baseline else {}) | named


def front(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Pictures that answer to the pointer, the picks, and what stands beside."""
    record = part(summary, "front")
    if not record:
        return None
    sets = fronts(summary)
    names = [each["name"] for each in responses(summary)]
    marks = picks(summary)
    blocks: list[Block] = []
    if sets and len(names) > 1:
        confirmed = part(summary, "confirmation") or {}
        drawn = {name: point for name, point in marks.items() if complete(point, summary)}
        blocks.append(Widget("front"))
        pairs = plots.pairs(names, sets, drawn, confirmed, bounds(summary))
        blocks.append(Figures([*pairs, plots.legend_of(sets, drawn, confirmed, bool(bounds(summary)))], "", "pairs"))
        caption = "Each line is a point of the front: its clearances to the left, its responses to the right."
        blocks.append(Figures([plots.parallel(factors(summary), names, sets, drawn)], caption, "parallel"))
    if marks:
        blocks.append(_picks(summary, names, marks))
    where = "of the pick without tolerances" if "without tolerances" in marks else "of the pick"
    if gains := record.get("predicted_gains"):
        rows = [(label(name), change(gain), str(gain.get("verdict") or "")) for name, gain in gains.items()]
        header = ("response", "change", "verdict")
        blocks.append(Table(f"Changes on the surfaces {where}", header, rows, text_columns=(2,)))
    blocks.append(Words(record.get("statement") or ""))
    blocks += [_limits(record, where), tolerances(summary)]
    blocks.append(Words(part(summary, "tolerances_sentence") or ""))
    blocks += _search(record)
    blocks += _beside(summary)
    return Section("front", "Pareto front", blocks)


def bounds(summary: Record) -> dict[str, list[float]]:
    """Limits of every response that has any."""
    given = {each["name"]: [each.get("lower"), each.get("upper")] for each in responses(summary)}
    return {name: [x for x in ends if x is not None] for name, ends in given.items() if ends != [None, None]}


def _picks(summary: Record, names: Sequence[str], marks: Mapping[str, Record]) -> Table:
    given = factors(summary)
    rows = [
        [
            name,
            *(each.text(part(point, "factors", each.name), 1) for each in given),
            *(with_error(part(point, "responses", response), part(point, "errors", response)) for response in names),
        ]
        for name, point in marks.items()
    ]
    header = ["point", *(label(each.name) for each in given), *map(label, names)]
    return Table("Picks on the surfaces", header, rows)


def _limits(record: Record, where: str) -> Table:
    rows = [
        (
            f"{label(limit['response'])} {limit['sense']} {shown(limit['limit'])}",
            with_error(limit["value"], limit.get("error")),
            shown(limit.get("kept")),
            "" if limit.get("probability") is None else chance(limit["probability"]),
            shown(limit.get("demanded_probability")),
        )
        for limit in record.get("constraints") or []
        if {"response", "sense", "limit", "value"} <= set(limit)
    ]
    header = ("limit", "value", "kept by the value", "probability of keeping it", "demanded")
    return Table(f"Limits on the surfaces {where}", header, rows)


def _search(record: Record) -> list[Block]:
    known = [
        f"{words} {shown(record[key])}"
        for key, words in (("generations", "generations"), ("evaluations", "evaluations"), ("seed", "seed"),
                           ("hypervolume", "hypervolume"), ("archive", "points in the archive"), ("feasible_share", "feasible share"))
        if record.get(key) is not None
    ]  # fmt: skip
    blocks: list[Block] = [Words(f"NSGA-II: {', '.join(known)}.", "note")] if known else []
    history = [value for value in record.get("hypervolume_history") or [] if value is not None]
    if len(history) > 2:
        blocks.append(Figures([plots.hypervolume(history)], "Hypervolume by generation: flat at the end means found."))
    return blocks


def _beside(summary: Record) -> list[Block]:
    """How sure the pick is, and the fronts found in other ways."""
    blocks: list[Block] = []
    aware = part(summary, "front", "tolerance_aware")
    if sure := part(summary, "front", "pick_dominates_baseline"):
        chance = with_error(sure.get("probability"), 1.96 * (sure.get("standard_error") or 0.0))
        pick = "the pick without tolerances" if aware else "the pick"
        words = f"On surfaces drawn from their errors {pick} dominates the baseline with probability"
        blocks.append(Words(f"{words} {chance} (error of the draws alone)."))
    if aware:
        blocks += _with_tolerances(aware, [each["name"] for each in responses(summary)])
    return [*blocks, *in_few_runs(summary)]


def _with_tolerances(aware: Record, names: Sequence[str]) -> list[Block]:
    kind = str(aware.get("kind") or "").replace("_", " ")
    level = f" {shown(aware['quantile'])}" if aware.get("quantile") is not None and kind == "quantile" else ""
    number = len(aware.get("front") or [])
    blocks: list[Block] = [
        Words(f"Front with tolerances: {kind}{level} over the tolerance box, {counted(number, 'point')}.")
    ]
    points = {
        "baseline": aware.get("baseline_robust"),
        "plain pick": aware.get("plain_pick_robust"),
        "pick with tolerances": part(aware, "pick", "robust"),
    }
    rows = [(point, *(shown(values.get(name)) for name in names)) for point, values in points.items() if values]
    blocks.append(Table("What manufacture leaves of the responses", ["point", *map(label, names)], rows))
    costs = {key: aware.get(key) for key in ("survival", "nominal_loss_percent", "robust_gain_percent")}
    blocks.append(record_table("What the tolerances cost", costs))
    return blocks
