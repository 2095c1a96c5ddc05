"""The answer an engineer acts on, the settings of the study, and the points that simulation confirmed.

The sections are blocks of the record of a study; the ``..._record`` functions write that record from results.
"""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from doe.report.sections.chain import estimates_note, grade_cell, refusal_blocks, yield_words
from doe.report.sections.duty import at_points, in_operation, least_words
from doe.report.sections.record import (
    LIMITS,
    SENSES,
    SIGNS_NOTE,
    VERDICTS,
    Factor,
    Record,
    change,
    dimension,
    factors,
    moved,
    nearest,
    of_hundred,
    part,
    responses,
    share_with_interval,
    sign_of,
    signed,
    sizes,
    value_text,
)
from doe.workflow.asked import Response, Settings
from doe.workflow.confirmation import (
    LOSS,
    NOISE,
    REAL,
    Confirmed,
    Gain,
    Limit,
    every_limit,
    limits_of,
    point_words,
    statement,
)
from doe.workflow.problem import Problem
from doe.workflow.surfaces import PredictedGain
from doe.workflow.whole import StudyResult
from rbdyn.base.arrays import Array
from rbdyn.base.blocks import Block, Detail, Paragraph, Role, Section, Table, Tile, Tiles
from rbdyn.base.identity import identity_line
from rbdyn.base.records import finite
from rbdyn.base.words import chance, label, other_ranges, quantity, range_ends, rounded_down, shown, with_error
from rbdyn.result import TEMPERATURES

# Meaning of a clearance of the scene, by its key.
CLEARANCES = {
    "bearing.radial_clearance_mm": "diametral in the bearing",
    "cage.guide_clearance_mm": "diametral between cage and guide",
    "cage.pocket_clearance_mm": "width of the pocket less the roller diameter",
    "cage.pocket_radial_clearance_mm": "radial at the lips of the pocket",
}
# Share of the cases over the unknown inputs from which a verdict counts as good news.
NEARLY_ALL = 0.9
SENTENCE_END = re.compile(r"(?<=\.) (?=[A-Z])")
LIMITS_NOTE = "A limit is kept or broken if the value is on that side of it by more than its error, else undecided. The probability of keeping it follows from that error."


def answer(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """What an engineer acts on, in the order of a first screen."""
    return Section("answer", "The answer", first_screen(summary))


def first_screen(summary: Record) -> list[Block]:
    """Bearing, point and date, the chosen clearances, the verdicts on limits, the gains, the parts to make, and why this point.

    Over a duty the verdicts at each of its points follow the gains.
    """
    return [
        identity_line(summary.identity),
        *_clearances(summary),
        *_judged(summary),
        *_gained(summary),
        *at_points(summary),
        *_parts_to_make(summary),
        *_reasons(summary),
    ]


def _judged(summary: Record) -> list[Block]:
    """Limits with their verdicts and the odds of keeping them over the unknown inputs, or the command that computes these."""
    limits = list((part(summary, "limits") or {}).values())
    odds = [limit["odds"][0] for limit in limits if limit.get("odds")]
    kept = summary.status in ("ok", "missed") and all(limit.get("verdict") == "kept" for limit in limits)
    sentence = part(summary, "limits_sentence") or ""
    if not kept or min(odds, default=1.0) < NEARLY_ALL:
        return [_limits_judged(summary), Paragraph(sentence, "warning")]
    everywhere = " and over the unknown inputs" if odds else ""
    verdict = Paragraph(f"Every limit is kept at the pick{everywhere}.", "statement")
    return [_limits_judged(summary), *([verdict, _command_for_odds(summary)] if sentence else ())]


def _command_for_odds(summary: Record) -> Paragraph:
    """The command that states the odds, where these are unknown."""
    command = f"doe study {summary.asked.study_file} --robust"
    return Paragraph("" if summary.robust else f"{command} states the odds over the unknown inputs.")


def _gained(summary: Record) -> list[Block]:
    """The gains with their verdicts, and the odds of them over the unknown inputs or the command that computes these."""
    text = gains_statement(summary)
    robust = summary.robust
    sentences = robust.sentences if robust else []
    # Only the first two sentences are verdicts: the odds of the gains, and what decides.
    first: Role = "statement" if robust and robust.better.all.value >= NEARLY_ALL else "warning"
    second: Role = "warning" if robust and robust.undecided else ""
    further: list[Role] = [""] * len(sentences)
    return [
        _gains(summary),
        Paragraph(text, _role_of_gains(summary, text)),
        *(Paragraph(sentence, role) for sentence, role in zip(sentences, [first, second, *further], strict=False)),
        _robust_points(summary),
        *([] if part(summary, "limits_sentence") or not text else [_command_for_odds(summary)]),
        Paragraph(part(summary, "whirl_sentence") or "", "warning"),
    ]


def _role_of_gains(summary: Record, text: str) -> Role:
    """Good news only where every gain is real; a loss, or no gain at all, is bad news."""
    verdicts = {gain.get("verdict") for gain in (part(summary, "gains") or {}).values()} or {"better"}
    if "worse" in verdicts or LOSS in text or "better" not in verdicts or (NOISE in text and REAL not in text):
        return "warning"
    return "" if "within error" in verdicts or NOISE in text else "statement"


def _reasons(summary: Record) -> list[Block]:
    """Why this point and no other one, what limits it, and where it lies."""
    reason = part(summary, "confirmation", "pick", "reason") or part(summary, "front", "pick", "reason")
    search = part(summary, "adaptive", "sentences") or [""]
    return [
        Paragraph(f"Why this point: {reason}." if reason else ""),
        Paragraph(search[0]),
        *(Paragraph(sentence) for sentence in part(summary, "rivals_sentences") or []),
        Paragraph(part(summary, "adaptive", "held") or ""),
        Paragraph(_edge(summary)),
    ]


def _edge(summary: Record) -> str:
    """Where the pick lies in the region; the change beyond a bound is in the section of the confirmation."""
    bounds = [
        f"the {bound['side']} bound of {name}, {shown(bound['bound'])} {quantity(name)[1]}".rstrip()
        for name, bound in (part(summary, "edge", "factors") or {}).items()
    ]
    whole = part(summary, "edge", "sentence") or ""
    if bounds:
        return f"The pick is at {' and '.join(bounds)}: a wider design may find more."
    return f"{whole.partition('; ')[0].rstrip('.')}." if whole else ""


def _parts_to_make(summary: Record) -> list[Block]:
    """Parts of every dimension chain, and what a refused one takes and needs; all else is in a section of its own."""
    chains = part(summary, "chains") or {}
    parts = {name: sizes(chain, "parts") or sizes(chain) for name, chain in chains.items()}
    rows = [
        (label(name), label(chain_name), dimension(size), grade_cell(size), moved(size))
        for chain_name, of_chain in parts.items()
        for name, size in of_chain.items()
    ]
    header = ("part", "chain", "dimension [mm]", "grade", "moved [mm]")
    shares = (f"{label(name)}: {words}" for name, chain in chains.items() if (words := yield_words(chain)))
    table = Table("Parts to make", header, rows, "; ".join(shares), text_columns=(1, 3))
    estimates = estimates_note({name: size for of_chain in parts.values() for name, size in of_chain.items()})
    return [
        table,
        Paragraph(estimates, "warning"),
        *(block for name, chain in chains.items() for block in refusal_blocks(name, chain)),
    ]


def _clearances(summary: Record) -> list[Block]:
    """The pick with its tolerances next to the baseline, the meaning of its clearances, and the class of the bearing."""
    pick = part(summary, "pick") or {}
    tiles = [_tile(summary, factor, pick) for factor in factors(summary) if factor.name in pick]
    plays = [CLEARANCES[factor.key] for factor in factors(summary) if factor.key in CLEARANCES]
    meaning = f"Clearances: {', '.join(plays)}." if tiles and plays else ""
    if meaning and part(summary, "operating_clearances_mm"):
        meaning += " Clearances in operation include the effects of fits, heat and rotation."
        meaning += least_words(summary)
    sentence = part(summary, "tolerances_sentence")
    return [
        Tiles("Chosen clearances", "pick", tiles),
        Paragraph(part(summary, "clearance_class") or ""),
        Paragraph(meaning, "small"),
        *_temperatures(summary),
        Paragraph(
            "" if part(summary, "obstacles", "tolerances") else part(summary, "tolerances_warning") or "", "warning"
        ),
        Paragraph(f"Tolerances: {' '.join(SENTENCE_END.split(sentence)[:2])}" if sentence else ""),
    ]


def _temperatures(summary: Record) -> list[Block]:
    """Steady temperatures at baseline and pick, and what the inputs of the heat balance leave open; nothing without a balance."""
    baseline, pick = (part(summary, "confirmation", name, "temperatures_C") or {} for name in ("baseline", "pick"))
    ranges = part(summary, "confirmation", "pick", "thermal", "ranges")
    rows = [
        (
            quantity(name)[0],
            _plain(baseline.get(name)),
            _plain(figure),
            range_ends(ranges[TEMPERATURES[name]]) if ranges else "",
        )
        for name, figure in pick.items()
    ]
    header = ("steady state [°C]", "baseline", "pick", "pick over inputs (90 %)")
    note = "Inputs: unknown conductances, shares of the heat and level of the loss. Errors: of the simulation (95 %)."
    others = [Paragraph(f"The pick {other_ranges(ranges)}.", "small")] if ranges else []
    return [Table("Temperatures", header, rows, note), *others] if rows else []


def _plain(figure: Record | None) -> str:
    return with_error(figure["value"], figure["error"]) if figure else ""


def _robust_points(summary: Record) -> Table:
    """Pick and points of the robust front: the gain that holds over the unknown inputs, and in how many cases there is one."""
    names = [response["name"] for response in responses(summary)]
    front = summary.robust and summary.robust.front
    rows = [
        [
            point.name.removeprefix("robust "),
            *(factor.text(point.factors[factor.name], 1) for factor in factors(summary)),
            *(_gain_and_share(point.gains.get(name), point.better.gains.get(name)) for name in names),
            _gain_and_share(None, point.better.all),
        ]
        for point in (front.confirmed if front else ())
    ]
    header = ("", *(label(factor.name) for factor in factors(summary)), *(quantity(name)[0] for name in names), "all")
    note = "Gain over the baseline that holds over the unknown inputs, and in how many of 100 cases there is a gain."
    return Table("Over the unknown inputs", header, rows, note)


def _gain_and_share(gain: float | None, share: Sequence[float] | None) -> str:
    gain_text = "" if gain is None else f"{100.0 * gain:.1f} %, "
    return "" if share is None else f"{gain_text}{of_hundred(share)}"


def _tile(summary: Record, factor: Factor, pick: Record) -> Tile:
    before = part(summary, "confirmation", "baseline", "factors") or part(summary, "front", "baseline", "factors") or {}
    tolerance = tolerance_of(summary, factor)
    further = {
        "tolerance": f"± {rounded_down(tolerance)}" if tolerance else "",
        "baseline": factor.text(before.get(factor.name)),
        "in operation": factor.text(in_operation(summary, factor, "pick")[0]),
        "baseline in operation": factor.text(in_operation(summary, factor, "baseline")[0]),
    }
    entries = [entry for entry in further.items() if entry[1]]
    grade = part(summary, "made", factor.name, "grade") or part(summary, "tolerances", factor.name, "grade")
    remarks = [("grade of the parts", grade)] if grade else []
    return Tile(factor.words, factor.text(pick[factor.name]), factor.unit, entries, remarks)


def tolerance_of(summary: Record, factor: Factor) -> float | None:
    """Half-width of the tolerance of a factor: that its parts are made to, else the widened one of the pick, else as stated."""
    return (
        part(summary, "made", factor.name, "half_width")
        or part(summary, "tolerances", factor.name, "half_width")
        or factor.tolerance
    )


def gains_statement(summary: Record) -> str:
    """Whether the gain is real, in words."""
    if summary.statement:
        return str(summary.statement)
    verdicts = [gain.get("verdict") for gain in (part(summary, "gains") or {}).values()]
    if not verdicts:
        return ""
    counts = [f"{verdicts.count(verdict)} {verdict}" for verdict in VERDICTS if verdict in verdicts]
    return f"Of {len(verdicts)} responses, compared with their 95 % errors: {', '.join(counts)}."


def _gains(summary: Record) -> Table:
    gains = part(summary, "gains") or {}
    before, after = (part(summary, "confirmation", name, "responses") or {} for name in ("baseline", "pick"))
    rows = [
        (label(name), value_text(before.get(name)), value_text(after.get(name)), signed(gain))
        for name, gain in gains.items()
    ]
    header = ("response", "baseline", "pick", "change")
    where = " over the duty" if part(summary, "duty") else ""
    return Table(f"Changes{where} confirmed by simulation (95 % intervals)", header, rows, SIGNS_NOTE)


def limits(summary: Record) -> Table:
    """Limits judged by simulation at every confirmed point."""
    rows = [
        (point_words(name), _bound(limit), with_error(limit.get("value"), limit.get("error")), *_verdict(limit))
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
                with_error(limit.get("value"), limit.get("error")),
                *_verdict(limit),
                of_hundred(odds) if odds else "",
                f"{_verdict(base)[0][:1]} {with_error(base.get('value'), base.get('error'))}".strip(),
            )
        )
    shares = "kept in 100 cases of unknown inputs"
    header = ("limit", "pick", "verdict", "probability", shares, "baseline")
    return Table("Limits judged by simulation", header, rows, text_columns=(2,))


def _limits_of(point: Record) -> list[Record]:
    """Limits at a confirmed point, the lower and the upper one of a response apart where the record has both."""
    every: list[Record] | None = point.get("every_limit")
    return every or [{"response": name, **limit} for name, limit in (point.get("limits") or {}).items()]


def _bound(limit: Record) -> str:
    return f"{label(str(limit['response']))} {SENSES.get(str(limit.get('sense')), '')} {shown(limit.get('bound'))}"


def _verdict(limit: Record) -> tuple[str, str]:
    """The verdict with its sign, and the probability of keeping the limit."""
    probability = limit.get("probability")
    return LIMITS.get(str(limit.get("verdict")), ""), "" if probability is None else chance(probability)


def settings(summary: Record, motion: Mapping[str, Any]) -> Section:
    """Factors, responses and scene as the study states them."""
    asked: Settings = summary.asked
    effort = (
        f"{shown(asked.replicates)} replicates per design run, {shown(asked.turns)} counted shaft turns per replicate, "
        f"{shown(asked.confirmation_replicates)} replicates per confirmed point"
    )
    rows = [
        (
            f"{factor.letter}: {label(factor.name)}",
            factor.key,
            factor.text(factor.centre),
            shown(factor.step),
            f"{factor.text(factor.low)} to {factor.text(factor.high)}",
            shown(factor.resolution),
            f"± {shown(factor.tolerance)}" if factor.tolerance else "",
        )
        for factor in asked.factors
    ]
    header = ("factor", "key of the scene", "centre", "step", "region", "resolution", "tolerance")
    goals = [(label(response.name), *_goal(response)) for response in asked.responses]
    columns = ("response", "goal", "limits", "weight", "model")
    values = [
        (f"{table}.{key}", shown(value, 6))
        for table, keys in asked.scene.items()
        if isinstance(keys, Mapping)
        for key, value in keys.items()
        if value is not None and not isinstance(value, Mapping)
    ]
    blocks: list[Block] = [
        Paragraph(f"Study {asked.study_file}, scene {asked.scene_file}; {effort}."),
        Table("Factors", header, rows, text_columns=(1,)),
        Table("Responses", columns, goals, text_columns=(1, 4)),
        Table("Scene: the bearing and its operation", ("key", "value"), values, folded=True),
    ]
    return Section("asked", "What was asked", blocks)


def _goal(response: Response) -> tuple[str, str, str, str]:
    goal = {"min": "small", "max": "large", "none": "watched"}.get(response.goal, response.goal)
    if response.target is not None:
        goal = f"at {shown(response.target)}"
    ends = ((response.lower, "≥"), (response.upper, "≤"))
    limits = [f"{sign} {shown(bound)}" for bound, sign in ends if bound is not None]
    return goal, ", ".join(limits), shown(response.weight), response.model


def confirmation(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Simulated responses at every confirmed point compared with those that the surfaces predicted."""
    points = part(summary, "confirmation")
    if not points:
        return None
    inputs = [
        factor
        for factor in factors(summary)
        if any(part(point, "factors", factor.name) is not None for point in points.values())
    ]
    names = [response["name"] for response in responses(summary)]
    header = ["point", *(label(factor.name) for factor in inputs), *map(label, names)]
    rows = [
        [
            point_words(name),
            *(factor.text(part(point, "factors", factor.name)) for factor in inputs),
            *(value_text(part(point, "responses", response)) for response in names),
        ]
        for name, point in points.items()
    ]
    blocks: list[Block] = [Table("Simulated with fresh seeds (95 % intervals)", header, rows)]
    if predictions := part(summary, "front", "predicted_gains"):
        # The surfaces predict the gains of their own pick, which another may have overtaken.
        name = nearest(summary, part(summary, "front", "pick", "factors"), points) or "pick"
        simulated = part(points, name, "gains") or (part(summary, "gains") if name == "pick" else None) or {}
        rows = [
            [
                label(response),
                change(gain),
                change(simulated.get(response) or {}),
                sign_of(simulated.get(response) or {}),
            ]
            for response, gain in predictions.items()
        ]
        columns = ("response", "on the surfaces", "simulated", "verdict")
        caption = f"Gains predicted by the surfaces and simulated, {point_words(name)}"
        blocks.append(Table(caption, columns, rows, text_columns=(3,)))
    blocks += [changes(summary), limits(summary), Paragraph(part(summary, "edge", "sentence") or "")]
    reasons = [(point_words(name), point["reason"]) for name, point in points.items() if point.get("reason")]
    blocks.append(Table("Why these points", ("point", "reason"), reasons, text_columns=(1,)))
    return Section("confirmation", "Confirmation", blocks)


def changes(summary: Record) -> Table:
    """Gains over the baseline at every confirmed point that has any."""
    names = [response["name"] for response in responses(summary)]
    rows = [
        [
            point_words(name),
            *(factor.text(part(point, "factors", factor.name)) for factor in factors(summary)),
            *(signed(point["gains"].get(response)) for response in names),
        ]
        for name, point in (part(summary, "confirmation") or {}).items()
        if point.get("gains")
    ]
    caption = "Changes from the baseline at every confirmed point"
    header = ("point", *(label(factor.name) for factor in factors(summary)), *(quantity(name)[0] for name in names))
    return Table(caption, header, rows, SIGNS_NOTE, detail=Detail.ALL)


def tolerances(summary: Record) -> Table:
    """The widest tolerances that keep the gain."""
    widths = part(summary, "tolerances") or {}
    names = {factor.name for factor in factors(summary)}
    rows = [
        (
            label(name),
            f"± {rounded_down(width.get('half_width') or 0.0)}",
            ""
            if width.get("probability") is None
            else share_with_interval(width["probability"], width.get("interval")),
            _grade(width),
            label(width.get("limited_by") or ""),
        )
        for name, width in widths.items()
        if name in names and isinstance(width, Mapping)
    ]
    header = ("factor", "tolerance", "share of the parts (95 %)", "grade of the parts, their widths", "limited by")
    return Table("Widest tolerances that keep the gains", header, rows, text_columns=(3, 4))


def _grade(width: Record) -> str:
    """'IT6: guide land 16 µm, cage outside 16 µm' of a tolerance."""
    parts = [f"{label(name)} {shown(1e3 * size['width_mm'])} µm" for name, size in (width.get("parts") or {}).items()]
    return ": ".join(filter(None, (width.get("grade") or "", ", ".join(parts))))


def confirmation_record(outcome: StudyResult) -> dict[str, Any]:
    """Every confirmed point by name, with its gains over the baseline and whether they are real."""
    return {
        name: {
            "factors": outcome.study.by_factor(point.point),
            "reason": point.reason,
            "responses": _quantities(outcome.study, point),
            "power_terms_W": dict(point.power_terms),
            "limits": limits_record(limits_of(outcome.study, point)),
            "every_limit": [
                {"response": limit.response, **_limit(limit)} for limit in every_limit(outcome.study, point)
            ],
        }
        | ({} if point.friction_check is None else {"friction_check": dict(point.friction_check)})
        | (
            {}
            if point.temperatures is None
            else {"temperatures_C": temperatures_record(point), "thermal": {"ranges": point.temperature_ranges}}
        )
        | {
            key: record(outcome.gains[name])
            for key, record in (("gains", gains_record), ("statement", statement))
            if name in outcome.gains
        }
        for name, point in outcome.confirmed.items()
    }


def temperatures_record(point: Confirmed) -> dict[str, Any]:
    """Steady temperatures by response, each with its value and its 95 % error."""
    figures = point.temperatures or {}
    return {
        name: {"value": figures[node].value, "error": figures[node].stated_error} for name, node in TEMPERATURES.items()
    }


def judged_limits_record(outcome: StudyResult) -> dict[str, Any]:
    """Limits at the pick, each with the ``odds`` [p, low, high] that the pick keeps all limits of that response over the unknown
    inputs; None where that was not asked for."""
    odds = {} if outcome.robust is None else outcome.robust.odds
    record = limits_record(outcome.limits)
    return {name: {**limit, "odds": list(odds[name]) if name in odds else None} for name, limit in record.items()}


def limits_record(limits: Sequence[Limit]) -> dict[str, Any]:
    """Limits judged by simulation, by response: of a lower and an upper one that with the worse verdict, or less room."""
    return {limit.response: _limit(limit) for limit in limits}


def _limit(limit: Limit) -> dict[str, Any]:
    values = {key: getattr(limit, key) for key in ("bound", "sense", "value", "verdict")}
    return values | {"error": finite(limit.error), "probability": finite(limit.probability)}


def gains_record(gains: Sequence[Gain | PredictedGain]) -> dict[str, Any]:
    """JSON of gains, simulated or predicted, by response."""
    return {gain.response: gain.as_dict() for gain in gains}


def _quantities(study: Problem, confirmed: Confirmed) -> Mapping[str, Any]:
    columns = (confirmed.values.tolist(), confirmed.statistical, confirmed.numerical)
    return {
        response: {"value": value, "statistical_error": finite(statistical), "numerical_error": finite(numerical)}
        for response, value, statistical, numerical in zip(study.responses, *columns, strict=True)
    }


def point_record(study: Problem, point: Array, values: Array, errors: Array) -> dict[str, Any]:
    """Factors (k,), responses (m,) and their 95 % half widths (m,) of a point, by name."""
    return {
        "factors": study.by_factor(point),
        "responses": dict(zip(study.responses, values.tolist(), strict=True)),
        "errors": dict(zip(study.responses, map(finite, errors), strict=True)),
    }
