"""The answer an engineer acts on, what was asked, and what simulation confirmed."""

from collections.abc import Mapping, Sequence
from typing import Any

from doe.report.sections.blocks import Block, Bullets, Section, Table, Tile, Tiles, Words
from doe.report.sections.record import Factor, Record, factors, nearest, part, responses, scalars
from doe.report.words import change, dimension, half_width, moved, of_hundred, rounded_down, share_with_interval
from rbdyn.records.words import chance, label, quantity, shown, with_error

# Characters above which a value is a sentence, to be broken.
LONG = 40
# What a clearance of the scene is, by its key.
CLEARANCES = {
    "bearing.radial_clearance_mm": "in the bearing diametral",
    "cage.guide_clearance_mm": "of the cage in its guide diametral",
    "cage.pocket_clearance_mm": "in the pocket its width less the roller diameter",
    "cage.pocket_radial_clearance_mm": "at the pocket's lips radial",
}
VERDICTS = {"better": "▲ better", "worse": "▼ worse", "within error": "● within error"}
LIMITS = {"kept": "✓ kept", "broken": "✗ broken", "undecided": "? undecided"}


def answer(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Clearances, gains, whether they are real, and the parts to make."""
    robust = part(summary, "robust") or {"sentences": []}
    blocks: list[Block] = [Words(each, "statement") for each in robust["sentences"]]
    blocks.append(Words(part(summary, "limits_sentence") or "", "statement"))
    searched = part(summary, "adaptive", "sentences") or [""]
    blocks.append(Words(searched[0], "statement"))
    if pick := part(summary, "pick"):
        blocks.append(Tiles([_tile(summary, each, pick) for each in factors(summary) if each.name in pick]))
        if plays := [CLEARANCES[each.key] for each in factors(summary) if each.key in CLEARANCES]:
            drawn = (
                " Those in operation are what fits, heat and rotation leave."
                if part(summary, "operating_clearances_mm")
                else ""
            )
            blocks.append(Words(f"Clearances: {', '.join(plays)}.{drawn}", "note"))
        blocks.append(Words(part(summary, "clearance_class") or "", "note"))
    blocks += [Words(statement(summary), "statement"), Words(part(summary, "whirl_sentence") or "", "statement")]
    blocks += [_gains(summary), limits(summary, ("baseline", "pick"))]
    blocks.append(_held(summary))
    blocks += [Words(part(summary, "edge", "sentence") or ""), Bullets(searched[1:]), part_dimensions(summary)]
    reason = part(summary, "confirmation", "pick", "reason") or part(summary, "front", "pick", "reason")
    if reason:
        blocks.append(Words(f"Why this point: {reason}.", "note"))
    return Section("answer", "The answer", blocks)


def _held(summary: Record) -> Table:
    """Pick and points of the robust front over what is not known: the gain that they keep, and in how many cases it is one."""
    names = [each["name"] for each in responses(summary)]
    rows = [
        [
            point["name"],
            *(each.text(part(point, "factors", each.name), 1) for each in factors(summary)),
            *(_kept(part(point, "gains", name), part(point, "better", name)) for name in names),
            _kept(None, point["all"]),
        ]
        for point in part(summary, "robust", "front", "confirmed") or []
    ]
    header = ("", *(label(each.name) for each in factors(summary)), *(quantity(name)[0] for name in names), "all")
    note = "Gain over the baseline that is kept over what is not known, and in how many of 100 cases it is one."
    return Table("Over what is not known", header, rows, note)


def _kept(gain: float | None, share: Sequence[float] | None) -> str:
    kept = "" if gain is None else f"{100.0 * gain:.1f} %, "
    return "" if share is None else f"{kept}{of_hundred(share)}"


def _tile(summary: Record, factor: Factor, pick: Record) -> Tile:
    beneath = []
    if running := part(summary, "operating_clearances_mm", factor.name):
        beneath.append(f"in operation {factor.text(running.get('pick'))} {factor.unit}".strip())
    if tolerance := tolerance_of(summary, factor):
        beneath.append(f"± {rounded_down(tolerance)} {factor.unit}".strip())
    baseline = part(summary, "confirmation", "baseline", "factors") or part(summary, "front", "baseline", "factors")
    if baseline and factor.name in baseline:
        beneath.append(f"baseline {factor.text(baseline[factor.name])} {factor.unit}".strip())
    return Tile(factor.words, factor.text(pick[factor.name]), factor.unit, beneath)


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
        (label(name), *(_value(column.get(name)) for column in columns), change(gain), verdict(gain))
        for name, gain in gains.items()
    ]
    header = ("response", "baseline", "pick", "change", "verdict")
    return Table("Changes confirmed by simulation (95 % intervals)", header, rows, text_columns=(4,))


def limits(summary: Record, names: Sequence[str] = ()) -> Table:
    """Limits judged by simulation at the points of these names, at every confirmed point without any."""
    points = part(summary, "confirmation") or {}
    rows = [
        (
            name.replace("_", " "),
            f"{label(response)} {limit.get('sense') or ''} {shown(limit.get('bound'))}",
            with_error(limit.get("value"), limit.get("error")),
            LIMITS.get(str(limit.get("verdict")), ""),
            "" if limit.get("probability") is None else chance(limit["probability"]),
            of_hundred(odds) if name == "pick" and (odds := part(summary, "limits", response, "odds")) else "",
        )
        for name in names or points
        for response, limit in (part(points, name, "limits") or {}).items()
    ]
    note = "Kept or broken by more than the error; between the two a limit is undecided. The probability is that of keeping it "
    note += "by that error; over the unknown inputs, in how many of 100 cases the pick keeps it."
    header = ("point", "limit", "simulated", "verdict", "probability", "over unknown inputs")
    return Table("Limits judged by simulation", header, rows, note, text_columns=(1, 3))


def verdict(gain: Record) -> str:
    """With a sign that is told without colour."""
    return VERDICTS.get(str(gain.get("verdict")), str(gain.get("verdict") or ""))


def part_dimensions(summary: Record) -> Table:
    """Parts of every chain."""
    rows = []
    chains = part(summary, "chains") or {}
    for name, chain in chains.items():
        for each, dimensions in allocation(chain).items():
            told = (dimension(dimensions), dimensions.get("grade") or "", moved(dimensions))
            rows.append((label(each), *told, label(name)))
    header = ("part", "dimension [mm]", "grade", "nominal moved [mm]", "chain")
    return Table("Part dimensions", header, rows, _yields(chains), text_columns=(2, 4))


def allocation(chain: Record) -> dict[str, Any]:
    """Parts of a chain whose dimensions are known."""
    wanted = {"nominal_mm", "upper_mm", "lower_mm"}
    return {name: each for name, each in (chain.get("allocation") or {}).items() if wanted <= set(each)}


def _yields(chains: Record) -> str:
    """Yield of each chain that is not refused, and which are."""
    refused = [name for name, chain in chains.items() if str(chain.get("status")).startswith("refused")]
    known = [
        f"{label(name)} {share:.6f}"
        for name, chain in chains.items()
        if name not in refused and (share := part(chain, "yield", "as_given")) is not None
    ]
    said = [f"Yield: {', '.join(known)}."] if known else []
    if refused:
        said.append(f"Refused: {', '.join(map(label, refused))}; the parts shown are the nearest that fit.")
    return " ".join(said)


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
        blocks.append(Words(text[0].upper() + text[1:] + "."))
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
    """Simulated responses at every confirmed point beside what the surfaces said."""
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
        # The surfaces foretell the gains of their own pick, which another may have overtaken.
        name = nearest(summary, part(summary, "front", "pick", "factors"), points) or "pick"
        found = part(points, name, "gains") or (part(summary, "gains") if name == "pick" else None) or {}
        rows = [
            [label(each), change(gain), change(found.get(each) or {}), verdict(found.get(each) or {})]
            for each, gain in predicted.items()
        ]
        columns = ("response", "on the surfaces", "simulated", "verdict")
        caption = f"What the surfaces promised and the simulation kept, {name.replace('_', ' ')}"
        blocks.append(Table(caption, columns, rows, text_columns=(3,)))
    gained = {name.replace("_", " "): point["gains"] for name, point in points.items() if point.get("gains")}
    if gained:
        rows = [[name, *(_signed(gains.get(each)) for each in names)] for name, gains in gained.items()]
        caption = "Changes from the baseline at every confirmed point"
        note = "▲ better, ▼ worse, ● within its 95 % error."
        blocks.append(Table(caption, ["point", *(quantity(each)[0] for each in names)], rows, note))
    blocks.append(limits(summary))
    reasons = [(name.replace("_", " "), point["reason"]) for name, point in points.items() if point.get("reason")]
    blocks.append(Table("Why these points", ("point", "reason"), reasons, text_columns=(1,)))
    return Section("confirmation", "Confirmation", blocks)


def _signed(gain: Record | None) -> str:
    """A gain with the sign of its verdict."""
    return f"{verdict(gain)[:1]} {change(gain)}" if gain else ""


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


def record_table(caption: str, record: Record | None, folded: bool = False) -> Table:
    """Everything in nested tables, a row each."""
    rows = list(scalars(record or {}))
    prose = (1,) if any(len(value) > LONG for _, value in rows) else ()
    return Table(caption, ("", "value"), rows, folded=folded, text_columns=prose)
