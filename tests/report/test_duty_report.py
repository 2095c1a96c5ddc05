"""The duty in the answer: verdicts at each point, worst points, the cost of the compromise, life and energy, in any width."""

import copy

import pytest
from synthetic_study import FACTORS, RESPONSES, summary

from doe.report.files import answer_text, blocks
from doe.report.page import page_data, sections
from doe.report.sections.duty import at_points, duty_figures, gain_stills
from doe.report.summary import Summary, readable
from rbdyn.base import terminal
from rbdyn.base.blocks import Detail, Paragraph, Table

IMPACT, WHIRL, POWER = RESPONSES
GAIN = {"percent": 11.16, "error_percent": 0.65, "goal": "min", "verdict": "better"}
COST = {**GAIN, "percent": 0.5, "verdict": "within error"}


def quantity(value: float) -> dict:
    """A figure with errors, 0.5 together."""
    return {"value": value, "statistical_error": 0.3, "numerical_error": 0.4}


def point(name: str, share: float, power: float) -> dict:
    """A point of the duty where the selected design takes 10 W less."""
    return {
        "name": name,
        "share": share,
        "set": ["operation.inner_speed_rpm=6000"],
        "baseline": {IMPACT: quantity(90.0), POWER: quantity(power)},
        "pick": {IMPACT: quantity(80.0), POWER: quantity(power - 10.0)},
        "gains": {IMPACT: dict(GAIN), POWER: dict(GAIN)},
        "own": {
            "factors": dict.fromkeys(FACTORS, 0.02),
            "responses": {IMPACT: 79.0, POWER: power - 11.0},
            "reason": "the knee",
            "gains_over_pick": {IMPACT: COST, POWER: COST},
        },
        "own_note": "",
        "operating_clearances_mm": {},
    }


def over_duty() -> dict:
    """The made-up record with a duty of three points."""
    lives = {"L10_h": 9000.0, "L10_Mrev": 900.0, "equivalent_load_N": 850.0,
             "point_hours": {"idle": None, "cruise": 10000.0, "take-off": 4000.0},
             "damage": {"idle": 0.0, "cruise": 0.7, "take-off": 0.3}}  # fmt: skip
    record = summary()
    record["duty"] = {
        "points": [point("idle", 0.25, 20.0), point("cruise", 0.7, 160.0), point("take-off", 0.05, 240.0)],
        "aggregate": {IMPACT: "worst_relative", WHIRL: "worst", POWER: "mean"},
        "worst": {
            "baseline": {WHIRL: {"point": "idle", "probability": 0.75}},
            "pick": {
                IMPACT: {"point": "take-off", "probability": 0.98},
                WHIRL: {"point": "cruise", "probability": 0.625},
            },
        },
        "life": {"baseline": lives, "pick": {**lives, "L10_h": 8100.0}},
    }
    for response in record["asked"]["responses"]:
        response |= {"aggregate": record["duty"]["aggregate"][response["name"]], "points": None}
    record["limits"] = {
        f"idle: {POWER}": {"sense": "<=", "bound": 30.0, "value": 10.0, "error": 0.5, "verdict": "kept", "probability": 1.0, "odds": None},
        f"take-off: {POWER}": {"sense": "<=", "bound": 230.0, "value": 230.0, "error": 0.5, "verdict": "undecided", "probability": 0.5, "odds": None},
    }  # fmt: skip
    return record


def sentences(record: dict) -> dict[str, str]:
    """Roles of the sentences on the duty by their text, names in words."""
    clean = Summary.from_dict(record)
    return {block.text: block.role for block in readable(at_points(clean), clean.asked) if isinstance(block, Paragraph)}


def test_without_a_duty_nothing_is_said_of_one():
    """Unit: the answer and the report of a study at one point have no word on a duty."""
    assert sentences(summary()) == {}
    assert "duty" not in answer_text(Summary.from_dict(summary())) and "duty" not in {
        part.key for part in sections(Summary.from_dict(summary()))
    }


def test_each_point_has_its_verdicts():
    """Unit: a row a point, a column a response with a goal, the worst verdict on its limits."""
    table = at_points(Summary.from_dict(over_duty()))[0]
    assert isinstance(table, Table) and list(table.header) == ["point", "share", "impact force", "power loss", "limits"]
    assert [row[0] for row in table.rows] == ["idle", "cruise", "take-off"]
    assert [row[1] for row in table.rows] == ["25 %", "70 %", "5 %"]
    assert [row[-1] for row in table.rows] == ["✓ met", "", "? undecided"]
    assert table.rows[0][2] == "▲ 11.16 ± 0.65 % less"


def test_worst_points_have_their_probability():
    """Unit: the selected design's worst point of each such response is named with its probability, and the baseline's."""
    (worst,) = (text for text in sentences(over_duty()) if text.startswith("Worst point"))
    assert worst == (
        "Worst point of impact force at the selected design: take-off (probability 0.980). Worst point of whirl deviation ratio at the "
        "selected design: cruise (probability 0.625), at the baseline idle (probability 0.750)."
    )
    record = over_duty()
    record["duty"]["worst"]["pick"][WHIRL]["point"] = "idle"
    assert any(text.endswith("idle (probability 0.625), as at the baseline.") for text in sentences(record))


def test_the_dearest_compromise_is_named_where_it_exceeds_its_errors():
    """Unit: within errors no cost is claimed; beyond them the largest is named; without picks of points nothing is said."""
    assert any(text.startswith("The compromise costs no point more than the errors") for text in sentences(over_duty()))
    record = over_duty()
    record["duty"]["points"][1]["own"]["gains_over_pick"][POWER] = {**COST, "percent": 11.16}
    record["duty"]["points"][2]["own"]["gains_over_pick"][IMPACT] = {**COST, "percent": 15.0}
    (text,) = (text for text in sentences(record) if text.startswith("The compromise"))
    assert text == (
        "The compromise costs most at take-off: a design for that point alone has impact force 15.00 ± 0.65 % less on its surfaces."
    )
    for entry in record["duty"]["points"]:
        entry |= {"own": None, "own_note": f"{entry['name']} alone has no pick"}
    assert not any(text.startswith("The compromise") for text in sentences(record))
    (chapter,) = (part for part in sections(Summary.from_dict(record)) if part.key == "duty")
    assert any("idle alone has no pick" in getattr(block, "text", "") for block in chapter.blocks)


def test_a_loss_at_a_point_warns():
    """Unit: a pick that is better over the duty and worse at a point says so."""
    record = over_duty()
    record["duty"]["points"][0]["gains"][IMPACT] = {**GAIN, "percent": -3.0, "verdict": "worse"}
    (warning,) = (text for text, role in sentences(record).items() if role == "warning")
    assert (
        warning
        == "The selected design is worse than the baseline at some points: impact force 3.00 ± 0.65 % more at idle."
    )


def test_life_and_energy_over_the_duty():
    """Closed form: energy is the power weighted by the shares, its error that of the parts; life with its change and damage."""
    texts = list(sentences(over_duty()))
    assert any(
        text.startswith("Life over the duty, L10r: 9000 h at the baseline, 8100 h at the selected design (-10 %)")
        for text in texts
    )
    assert any("70 % of the damage at cruise" in text for text in texts)
    # 0.25 * 20 + 0.7 * 160 + 0.05 * 240 = 129, and 0.5 * hypot(0.25, 0.7, 0.05) = 0.37.
    assert (
        "Energy lost in an hour of the duty: 129.00 ± 0.37 Wh at the baseline, 119.00 ± 0.37 Wh at the selected design."
        in texts
    )
    record = over_duty()
    for life in record["duty"]["life"].values():
        life["L10_h"] = None
    for entry in record["duty"]["points"]:
        del entry["pick"][POWER]
    assert not any(text.startswith(("Life", "Energy")) for text in sentences(record))


def test_mean_slip_is_weighted_by_the_shares():
    """Closed form: 0.25 * 0.02 + 0.7 * 0.01 + 0.05 * 0.04 = 0.014 at the baseline; errors as of independent parts."""
    record = over_duty()
    for entry, slip in zip(record["duty"]["points"], (0.02, 0.01, 0.04), strict=True):
        entry["baseline"]["cage_slip"] = {"value": slip, "statistical_error": 0.001, "numerical_error": None}
        entry["pick"]["cage_slip"] = {"value": 0.5 * slip, "statistical_error": 0.001, "numerical_error": None}
    (text,) = (text for text in sentences(record) if "Mean cage slip" in text)
    assert text.endswith("Mean cage slip by time fraction: 0.01400 ± 0.00074 (baseline), 0.00700 ± 0.00074 (selected).")


def test_gains_are_drawn_at_each_point_and_over_the_duty():
    """Unit: a picture a response with a goal, a row a point and one over the duty; long names are cut."""
    record = over_duty()
    record["duty"]["points"][0]["name"] = "idle " * 20
    first, second = gain_stills(Summary.from_dict(record))
    assert first.words == "Gain in impact force at 3 points of the duty" and first.height == second.height
    svg = first.svg()
    assert all(f">{name}<" in svg for name in ("cruise", "take-off", "over the duty"))
    assert svg.count('class="mark"') == 4 and "idle " * 20 not in svg
    assert gain_stills(Summary.from_dict(summary())) == []


def test_clearances_in_operation_stand_at_each_point():
    """Unit: where temperatures change them each point has its own, at baseline and pick; else no such table."""
    record = over_duty()
    assert "Clearances in operation" not in str(sections(Summary.from_dict(record)))
    for entry, play in zip(record["duty"]["points"], (0.01, 0.02, 0.03), strict=True):
        entry["operating_clearances_mm"] = {FACTORS[0]: {"baseline": play, "pick": play + 0.001}}
    (chapter,) = (part for part in sections(Summary.from_dict(record)) if part.key == "duty")
    (table,) = (
        block for block in chapter.blocks if getattr(block, "caption", "").startswith("Clearances in operation")
    )
    assert [row[1:] for row in table.rows] == [["0.0100", "0.0110"], ["0.0200", "0.0210"], ["0.0300", "0.0310"]]


def test_a_ratio_has_no_unit_anywhere():
    """Unit: tables, headings and pictures call a worst ratio one; a limit at a point keeps its unit."""
    record = over_duty()
    record["limits"] = {f"idle: {IMPACT}": record["limits"][f"idle: {POWER}"]}
    (limit,) = record["limits"].values()
    every = [{"response": f"idle: {IMPACT}", **limit}]
    for name in ("baseline", "pick"):
        record["confirmation"][name] |= {"limits": record["limits"], "every_limit": every}
    whole = terminal.text(blocks(Summary.from_dict(record)), Detail.ALL, 200)
    assert "impact force, worst ratio" in whole and "idle: impact force [N] ≤ 30" in whole
    assert "impact force [N]" not in whole.replace("idle: impact force [N]", "")
    named = {entry["name"]: entry for entry in page_data(Summary.from_dict(record), {})["responses"]}
    assert named[IMPACT]["unit"] == "" and named[POWER]["unit"] == "W"
    assert "impact force [N]" in terminal.text(blocks(Summary.from_dict(summary())), Detail.ALL, 200)


def test_the_table_has_a_row_a_response_at_a_point():
    """Unit: duty_points.csv has baseline, pick, gain, cost of the compromise and verdict on limits of each."""
    rows = duty_figures(Summary.from_dict(over_duty())).records
    assert [(row["point"], row["response"]) for row in rows[:3]] == [
        ("idle", IMPACT),
        ("idle", POWER),
        ("cruise", IMPACT),
    ]
    assert rows[1] == {
        "point": "idle", "share": 0.25, "response": POWER, "baseline": 20.0, "pick": 10.0, "baseline_error": 0.5,
        "pick_error": 0.5, "improvement_percent": 11.16, "improvement_error_percent": 0.65, "verdict": "better",
        "own_pick_percent": 0.5, "own_pick_error_percent": 0.65, "limit_verdict": "kept",
    }  # fmt: skip


@pytest.mark.parametrize("width", [80, 60, 40])
def test_no_word_of_a_header_is_broken(width):
    """Report: at any width each word of a header of the duty's tables stands whole in a line, and no line is longer."""
    clean = Summary.from_dict(over_duty())
    (chapter,) = (part for part in sections(clean) if part.key == "duty")
    tables = [
        block for block in [*readable(at_points(clean), clean.asked), *chapter.blocks] if isinstance(block, Table)
    ]
    assert len(tables) == 4
    for table in tables:
        lines = terminal.text([copy.copy(table)], Detail.ALL, width).splitlines()
        assert max(map(len, lines)) <= width
        words = {word for line in lines for word in line.split()}
        assert {word for head in table.header for word in head.split()} <= words
