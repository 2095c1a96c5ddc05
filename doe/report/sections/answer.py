"""The answer an engineer acts on, what was asked, and what simulation confirmed."""

from collections.abc import Mapping, Sequence
from typing import Any

from doe.report.sections.parts import chain_blocks
from doe.report.sections.record import Factor, Record, factors, nearest, part, responses
from doe.report.words import SENSES, change, half_width, of_hundred, rounded_down, share_with_interval
from rbdyn.base.blocks import Block, Bullets, Detail, Paragraph, Section, Table, Tile, Tiles
from rbdyn.base.words import chance, label, quantity, shown, with_error

# What a clearance of the scene is, by its key.
CLEARANCES = {
    "bearing.radial_clearance_mm": "in the bearing diametral",
    "cage.guide_clearance_mm": "of the cage in its guide diametral",
    "cage.pocket_clearance_mm": "in the pocket its width less the roller diameter",
    "cage.pocket_radial_clearance_mm": "at the pocket's lips radial",
}
VERDICTS = {"better": "▲ better", "worse": "▼ worse", "within error": "● within error"}
LIMITS_NOTE = "A limit is kept or broken where it is by more than the error, else undecided. The probability is that of keeping it by that error."
LIMITS = {"kept": "✓ kept", "broken": "✗ broken", "undecided": "? undecided"}


def answer(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """The verdict over the unknown inputs and the limits, then what an engineer acts on."""
    return Section("answer", "The answer", [*verdict(summary), *advice(summary)])


def verdict(summary: Record) -> list[Block]:
    """Whether the pick is better over the unknown inputs, and what became of the limits: the first that is to be read."""
    sentences = [*(part(summary, "robust", "sentences") or []), part(summary, "limits_sentence") or ""]
    return [Paragraph(sentence, "statement") for sentence in sentences]


def advice(summary: Record) -> list[Block]:
    """Clearances, gains, whether they are real, limits, why this point, what lies beyond, and the parts to make."""
    searched = part(summary, "adaptive", "sentences") or [""]
    reason = part(summary, "confirmation", "pick", "reason") or part(summary, "front", "pick", "reason")
    why = f"Why this point: {reason}." if reason else ""
    return [
        Paragraph(searched[0], "statement"),
        Bullets(searched[1:]),
        *_clearances(summary),
        _gains(summary),
        Paragraph(statement(summary), "statement"),
        Paragraph(part(summary, "whirl_sentence") or "", "statement"),
        _robust_points(summary),
        _limits_judged(summary),
        Paragraph(why),
        Paragraph(part(summary, "edge", "sentence") or ""),
        *_parts_to_make(summary),
    ]


def _parts_to_make(summary: Record) -> list[Block]:
    """Every dimension chain; what only a careful reader asks for stands in a section of its own."""
    chains = part(summary, "chains") or {}
    whole = [block for name, chain in chains.items() for block in chain_blocks(name, chain)]
    return [block for block in whole if block.detail < Detail.ALL]


def _clearances(summary: Record) -> list[Block]:
    """The pick with its tolerances next to the baseline, what its clearances are, and the bearing's class."""
    pick = part(summary, "pick") or {}
    tiles = [_tile(summary, each, pick) for each in factors(summary) if each.name in pick]
    plays = [CLEARANCES[each.key] for each in factors(summary) if each.key in CLEARANCES]
    means = f"Clearances: {', '.join(plays)}." if tiles and plays else ""
    if means and part(summary, "operating_clearances_mm"):
        means += " Those in operation are what fits, heat and rotation leave."
    tolerated = part(summary, "tolerances_sentence")
    return [
        Tiles("Chosen clearances", "pick", tiles),
        Paragraph(means, "small"),
        Paragraph(part(summary, "clearance_class") or "", "small"),
        Paragraph(f"Tolerances: {tolerated}" if tolerated else ""),
    ]


def _robust_points(summary: Record) -> Table:
    """Pick and points of the robust front over the unknown inputs: the gain that they keep, and in how many cases it is one."""
    names = [each["name"] for each in responses(summary)]
    rows = [
        [
            point["name"].removeprefix("robust "),
            *(each.text(part(point, "factors", each.name), 1) for each in factors(summary)),
            *(_kept(part(point, "gains", name), part(point, "better", name)) for name in names),
            _kept(None, point["all"]),
        ]
        for point in part(summary, "robust", "front", "confirmed") or []
    ]
    header = ("", *(label(each.name) for each in factors(summary)), *(quantity(name)[0] for name in names), "all")
    note = "Gain over the baseline that is kept over the unknown inputs, and in how many of 100 cases it is one."
    return Table("Over the unknown inputs", header, rows, note)


def _kept(gain: float | None, share: Sequence[float] | None) -> str:
    kept = "" if gain is None else f"{100.0 * gain:.1f} %, "
    return "" if share is None else f"{kept}{of_hundred(share)}"


def _tile(summary: Record, factor: Factor, pick: Record) -> Tile:
    running = part(summary, "operating_clearances_mm", factor.name) or {}
    before = part(summary, "confirmation", "baseline", "factors") or part(summary, "front", "baseline", "factors") or {}
    tolerance = tolerance_of(summary, factor)
    further = {
        "baseline": factor.text(before.get(factor.name)),
        "in operation": factor.text(running.get("pick")),
        "baseline in operation": factor.text(running.get("baseline")),
        "tolerance": f"± {rounded_down(tolerance)}" if tolerance else "",
    }
    return Tile(
        factor.words, factor.text(pick[factor.name]), factor.unit, [each for each in further.items() if each[1]]
    )


def tolerance_of(summary: Record, factor: Factor) -> float | None:
    """Half-width of the tolerance of a factor: the one found for the pick, else the one asked for."""
    return part(summary, "tolerances", factor.name, "half_width") or factor.tolerance


def statement(summary: Record) -> str:
    """Whether the gain is real, in words."""
    if summary.get("statement"):
        return str(summary["statement"])
    verdicts = [gain.get("verdict") for gain in (part(summary, "gains") or {}).values()]
    if not verdicts:
        return ""
    counts = [f"{verdicts.count(verdict)} {verdict}" for verdict in VERDICTS if verdict in verdicts]
    return f"Of {len(verdicts)} responses, by more than their 95 % errors or within them: {', '.join(counts)}."


def _gains(summary: Record) -> Table:
    gains = part(summary, "gains") or {}
    columns = [part(summary, "confirmation", name, "responses") or {} for name in ("baseline", "pick")]
    rows = [
        (label(name), *(_value(column.get(name)) for column in columns), change(gain), sign_of(gain))
        for name, gain in gains.items()
    ]
    header = ("response", "baseline", "pick", "change", "verdict")
    return Table("Changes confirmed by simulation (95 % intervals)", header, rows, text_columns=(4,))


def limits(summary: Record) -> Table:
    """Limits judged by simulation at every confirmed point."""
    rows = [
        (name.replace("_", " "), _bound(limit), with_error(limit.get("value"), limit.get("error")), *_judged(limit))
        for name, point in (part(summary, "confirmation") or {}).items()
        for limit in _limits_of(point)
    ]
    header = ("point", "limit", "simulated", "verdict", "probability")
    return Table("Limits judged by simulation, every point", header, rows, LIMITS_NOTE, text_columns=(1, 3))


def _limits_judged(summary: Record) -> Table:
    """Every limit at the baseline and at the pick, and the odds that the pick keeps all those of a response."""
    before, after = (_limits_of(part(summary, "confirmation", name) or {}) for name in ("baseline", "pick"))
    rows = []
    for place, limit in enumerate(after):
        base = before[place] if place < len(before) else {}
        odds = part(summary, "limits", str(limit["response"]), "odds")
        rows.append(
            (
                _bound(limit),
                with_error(base.get("value"), base.get("error")),
                _judged(base)[0],
                with_error(limit.get("value"), limit.get("error")),
                *_judged(limit),
                of_hundred(odds) if odds else "",
            )
        )
    shares = "kept in 100 cases of the unknown inputs"
    header = ("limit", "baseline", "verdict", "pick", "verdict", "probability", shares)
    return Table("Limits judged by simulation", header, rows, LIMITS_NOTE, text_columns=(2, 4))


def _limits_of(point: Record) -> list[Record]:
    """Limits at a confirmed point, a lower and an upper one of a response each by itself where the record tells both."""
    every: list[Record] | None = point.get("every_limit")
    return every or [{"response": name, **limit} for name, limit in (point.get("limits") or {}).items()]


def _bound(limit: Record) -> str:
    return f"{label(str(limit['response']))} {SENSES.get(str(limit.get('sense')), '')} {shown(limit.get('bound'))}"


def _judged(limit: Record) -> tuple[str, str]:
    """The verdict with its sign, and the probability of keeping the limit."""
    probability = limit.get("probability")
    return LIMITS.get(str(limit.get("verdict")), ""), "" if probability is None else chance(probability)


def sign_of(gain: Record) -> str:
    """With a sign that is told without colour."""
    return VERDICTS.get(str(gain.get("verdict")), str(gain.get("verdict") or ""))


def settings(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Factors, responses and scene as they were given."""
    record = part(summary, "asked")
    if not record:
        return None
    given = factors(summary)
    blocks: list[Block] = []
    effort = [
        f"{shown(record[key])} {words}"
        for key, words in (
            ("replicates", "replicates a design run"),
            ("turns", "counted shaft turns each"),
            ("confirmation_replicates", "replicates to confirm a point"),
        )
        if record.get(key) is not None
    ]
    files = [f"study {record['study_file']}"] if record.get("study_file") else []
    files += [f"scene {record['scene_file']}"] if record.get("scene_file") else []
    if text := "; ".join([", ".join(files), ", ".join(effort)]).strip("; "):
        blocks.append(Paragraph(text[0].upper() + text[1:] + "."))
    rows = [
        (
            f"{each.letter}: {label(each.name)}",
            each.key or "",
            each.text(each.centre),
            shown(each.step),
            f"{each.text(each.low)} to {each.text(each.high)}" if each.low is not None else "",
            shown(each.resolution),
            f"± {shown(each.tolerance)}" if each.tolerance else "",
        )
        for each in given
    ]
    header = ("factor", "key of the scene", "centre", "step", "region", "resolution", "tolerance")
    blocks.append(Table("Factors", header, rows, text_columns=(1,)))
    wishes = [(label(each["name"]), *_wish(each)) for each in responses(summary)]
    columns = ("response", "goal", "limits", "weight", "model")
    blocks.append(Table("Responses", columns, wishes, text_columns=(1, 4)))
    if scene := record.get("scene"):
        settings = [
            (f"{table}.{key}", shown(value, 6))
            for table, keys in scene.items()
            if isinstance(keys, Mapping)
            for key, value in keys.items()
            if value is not None and not isinstance(value, Mapping)
        ]
        blocks.append(Table("Scene: the bearing and its operation", ("key", "value"), settings, folded=True))
    return Section("asked", "What was asked", blocks)


def _wish(response: Record) -> tuple[str, str, str, str]:
    asked = str(response.get("goal") or "")
    goal = {"min": "small", "max": "large", "none": "watched"}.get(asked, asked)
    if response.get("target") is not None:
        goal = f"at {shown(response['target'])}"
    limits = [
        f"{sign} {shown(response[key])}"
        for key, sign in (("lower", "≥"), ("upper", "≤"))
        if response.get(key) is not None
    ]
    return goal, ", ".join(limits), shown(response.get("weight")), str(response.get("model") or "")


def confirmation(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Simulated responses at every confirmed point next to what the surfaces predicted."""
    points = part(summary, "confirmation")
    if not points:
        return None
    given = [
        each
        for each in factors(summary)
        if any(part(point, "factors", each.name) is not None for point in points.values())
    ]
    names = [each["name"] for each in responses(summary)]
    header = ["point", *(label(each.name) for each in given), *map(label, names)]
    rows = [
        [
            name.replace("_", " "),
            *(each.text(part(point, "factors", each.name)) for each in given),
            *(_value(part(point, "responses", response)) for response in names),
        ]
        for name, point in points.items()
    ]
    blocks: list[Block] = [Table("Simulated with fresh seeds (95 % intervals)", header, rows)]
    if predicted := part(summary, "front", "predicted_gains"):
        # The surfaces predict the gains of their own pick, which another may have overtaken.
        name = nearest(summary, part(summary, "front", "pick", "factors"), points) or "pick"
        found = part(points, name, "gains") or (part(summary, "gains") if name == "pick" else None) or {}
        rows = [
            [label(each), change(gain), change(found.get(each) or {}), sign_of(found.get(each) or {})]
            for each, gain in predicted.items()
        ]
        columns = ("response", "on the surfaces", "simulated", "verdict")
        caption = f"What the surfaces promised and the simulation kept, {name.replace('_', ' ')}"
        blocks.append(Table(caption, columns, rows, text_columns=(3,)))
    blocks.append(changes(summary))
    blocks.append(limits(summary))
    reasons = [(name.replace("_", " "), point["reason"]) for name, point in points.items() if point.get("reason")]
    blocks.append(Table("Why these points", ("point", "reason"), reasons, text_columns=(1,)))
    return Section("confirmation", "Confirmation", blocks)


def changes(summary: Record) -> Table:
    """Gains over the baseline at every confirmed point that has any."""
    names = [each["name"] for each in responses(summary)]
    rows = [
        [
            name.replace("_", " "),
            *(each.text(part(point, "factors", each.name)) for each in factors(summary)),
            *(_signed(point["gains"].get(each)) for each in names),
        ]
        for name, point in (part(summary, "confirmation") or {}).items()
        if point.get("gains")
    ]
    caption = "Changes from the baseline at every confirmed point"
    note = "▲ better, ▼ worse, ● within its 95 % error."
    header = ("point", *(label(each.name) for each in factors(summary)), *(quantity(each)[0] for each in names))
    return Table(caption, header, rows, note, detail=Detail.USUAL)


def _signed(gain: Record | None) -> str:
    """A gain with the sign of its verdict."""
    return f"{sign_of(gain)[:1]} {change(gain)}" if gain else ""


def _value(found: Record | None) -> str:
    return with_error(found.get("value"), half_width(found)) if found else ""


def tolerances(summary: Record) -> Table:
    """The widest tolerances that keep the gain."""
    found = part(summary, "tolerances") or {}
    names = {each.name for each in factors(summary)}
    rows = [
        (
            label(name),
            f"± {rounded_down(each.get('half_width') or 0.0)}",
            "" if each.get("probability") is None else share_with_interval(each["probability"], each.get("interval")),
            label(each.get("limited_by") or ""),
        )
        for name, each in found.items()
        if name in names and isinstance(each, Mapping)
    ]
    header = ("factor", "tolerance", "share of the parts (95 %)", "limited by")
    return Table("Widest tolerances that keep the gain", header, rows, text_columns=(3,))
