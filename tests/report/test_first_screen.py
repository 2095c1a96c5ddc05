"""The first screen of a study: its order, its tone, and why no better point is the selected design."""

import re
from dataclasses import replace
from datetime import date
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import EXAMPLE, ROOT
from instant_runs import instant_result
from pareto_cases import TOLERANCES, edited_study, table_surfaces
from synthetic_study import RESPONSES, summary
from typer.testing import CliRunner

from doe.report.files import answer_text, blocks
from doe.report.page import html_report
from doe.report.sections.answer import first_screen
from doe.report.summary import Summary
from doe.workflow.confirmation import LOSS, NOISE, REAL, Choice, Confirmed
from doe.workflow.front import find_front
from doe.workflow.obstacles import Forecast, rivals_sentences
from doe.workflow.pick import choices
from doe.workflow.runs import _distinct_notes
from doe.workflow.surfaces import predict_all
from rbdyn.base import terminal
from rbdyn.base.blocks import Detail, Paragraph, Table
from rbdyn.base.notes import Note
from rbdyn.base.records import plain
from rbdyn.cli.app import app

ORDER = (
    "made-up bearing", "Selected clearances", "Limits judged", "Changes confirmed", "Parts to make",
    "Why this point", "note: ",
)  # fmt: skip


def limited(verdict: str = "kept", odds: list[float] | None = None) -> dict:
    """The made-up record with a limit on the power loss, judged so."""
    record = summary()
    limit = {"sense": "<=", "bound": 260.0, "value": 231.0, "error": 1.0, "verdict": verdict, "probability": 0.99}
    for name in ("baseline", "pick"):
        record["confirmation"][name] |= {
            "limits": {RESPONSES[2]: limit},
            "every_limit": [{"response": RESPONSES[2], **limit}],
        }
    if verdict != "kept":
        missed = {"point": None, "excess": 1.0, "relaxed": 261.0, "response": RESPONSES[2], **limit}
        record["obstacles"] = record["obstacles"] | {"limits": [missed]}
    record["limits"] = {RESPONSES[2]: {**limit, "odds": odds}}
    return record | {"status": "ok" if verdict == "kept" else verdict}


def roles(record: dict) -> dict[str, str]:
    """Roles of the sentences of the first screen by their text."""
    return {block.text: block.role for block in first_screen(Summary.from_dict(record)) if isinstance(block, Paragraph)}


@pytest.mark.parametrize("width", [60, 80, 100])
def test_the_order_is_clearances_limits_gains_parts_reason_notes(width):
    """What an engineer acts on comes first, in this order, and the comparison with a table is left to the report."""
    every = [
        Note("unit" if number % 3 == 1 else "remark", f"{number}: {number * 'word '}{'word ' * 30}")
        for number in range(9)
    ]
    record = limited() | {"notes": plain([*every, Note("left-out", "general")])}
    text = terminal.text(blocks(Summary.from_dict(record)), width=width)
    places = [text.index(words) for words in ORDER]
    lines = text.splitlines()
    verdict = " ".join(lines[: 1 + (width < 80)])
    assert verdict == "All 3 responses improve and every limit is met. No danger found; 3 warnings"
    assert lines[1 + (width < 80)].startswith("made-up bearing; 24000 rpm; 2026-01-31")
    assert places == sorted(places)
    assert "6 more notes in the report" in text and "published table" not in text
    # Three made-up warnings take up to three lines each.
    assert width < 80 or len(text.splitlines()) <= 50 + 4 * 2
    assert "Levels" in terminal.text(
        blocks(Summary.from_dict(record)), Detail.ALL
    ) and "Compared with the published" in html_report(Summary.from_dict(record))
    file = answer_text(Summary.from_dict(record))
    assert [file.index(words) for words in ORDER] == sorted(file.index(words) for words in ORDER)


def test_a_limit_has_its_odds_or_the_command_for_them():
    """With odds a column of the table has them; without, the command is named; the gains likewise."""
    unknown, known = (
        answer_text(Summary.from_dict(limited())),
        answer_text(Summary.from_dict(limited(odds=[0.57, 0.51, 0.63]))),
    )
    assert unknown.count("Add --robust for probabilities over unknown inputs.") == 1
    assert answer_text(Summary.from_dict(summary())).count("Add --robust for probabilities") == 1
    assert "57 (51 to 63)" in known and "met over unknown inputs [%]" in known


@pytest.mark.parametrize(
    ("record", "words", "role"),
    [
        (limited(), "The selected design meets every limit.", "statement"),
        (limited(odds=[0.57, 0.51, 0.63]), "The selected design does not meet every limit over", "warning"),
        (limited(odds=[0.97, 0.93, 0.99]), "The selected design meets every limit and over the unknown inputs.", "statement"),
    ],
)  # fmt: skip
def test_a_limit_is_good_news_only_where_it_is_kept_over_the_unknown_inputs_too(record, words, role):
    (judged,) = [role for text, role in roles(record).items() if text.startswith(words)]
    assert judged == role


@pytest.mark.parametrize("verdict", ["broken", "undecided"])
def test_the_sentence_on_a_missed_limit_does_not_repeat_the_danger(verdict):
    text = answer_text(Summary.from_dict(limited(verdict)))
    assert (
        "at the selected design. " not in text and {"broken": "✗ violated", "undecided": "? undecided"}[verdict] in text
    )
    assert "Add --robust for probabilities over unknown inputs." in text


@pytest.mark.parametrize(
    ("verdicts", "words", "role"),
    [
        ("better better better", REAL, "statement"),
        ("better better worse", LOSS, "warning"),
        ("better better within", f"{REAL}; {NOISE}", ""),
        ("better better better", f"{REAL}; {NOISE}", ""),
        ("within within within", NOISE, "warning"),
    ],
)
def test_a_loss_or_no_gain_is_no_good_news(verdicts, words, role):
    record = summary()
    for gain, verdict in zip(RESPONSES, verdicts.split(), strict=True):
        record["gains"][gain] = record["gains"][gain] | {
            "percent": {"better": 11.0, "worse": -11.0, "within": 0.1}[verdict]
        }
    record["statement"] = f"Simulated changes: {words}."
    assert roles(record)[record["statement"]] == role


def test_a_chain_that_misses_warns():
    record = summary()
    missed = {"mode": "worst_case", "below_mm": 0.0, "above_mm": 0.01, "width_mm": 0.0, "yield_short": None}
    record["chains"]["pocket"] |= {"status": "refused: the sizes are too large", "missed": missed}
    warnings = [text for text, role in roles(record).items() if role == "warning"]
    assert any("pocket violates its limits" in text and "0.0100 mm" in text for text in warnings)
    assert not any("misses" in text for text in roles(summary()))


@pytest.fixture(scope="module")
def predicted(tmp_path_factory):
    """A study of the published table, its surfaces, its front with tolerances and the points to be simulated."""
    study = edited_study(
        tmp_path_factory.mktemp("rivals"), *TOLERANCES, ("[front]\n", '[front]\ntolerance_aware = "quantile"\n')
    )
    surfaces = table_surfaces(study)
    front = find_front(study.with_surfaces(surfaces))
    return study, surfaces, front, {"baseline": Choice(study.baseline, ""), **choices(study, front, None)}


def simulated(study, surfaces, points, shares, error=1e-6):
    """Points as the surfaces predict them, each times its share, with a relative error."""
    confirmed = {}
    for name, choice in points.items():
        values = predict_all(surfaces, study.coded(choice.point)[None])[0] * shares.get(name, 1.0)
        confirmed[name] = Confirmed(choice.point, values, error * np.abs(values), 0.0 * values)
    return confirmed


def test_without_a_better_point_there_is_nothing_to_explain(predicted):
    study, surfaces, front, points = predicted
    forecast = Forecast(study.with_surfaces(surfaces), front, None, None)
    assert (
        rivals_sentences(
            forecast,
            simulated(study, surfaces, points, {"weights": 2.0, "without_tolerances": 2.0, "desirability": 2.0}),
        )
        == []
    )


def test_a_better_point_was_predicted_worse_at_the_ends_of_its_tolerances(predicted):
    """Exact: the robust costs of both points by the surfaces, in which the explained one is worse in what is named."""
    study, surfaces, front, points = predicted
    name = next(name for name in points if name not in ("baseline", "pick"))
    confirmed = simulated(study, surfaces, points, {name: 0.1})
    forecast = Forecast(study.with_surfaces(surfaces), front, None, None)
    (sentence,) = rivals_sentences(forecast, confirmed)
    assert sentence.startswith(
        f"Point {'design selected without tolerances' if name == 'without_tolerances' else name} is better than"
    )
    here, pick = (forecast.at(points[which].point) for which in (name, "pick"))
    worse = here.costs > pick.costs
    assert worse.any() and "at the ends of its tolerances the surfaces predict" in sentence
    responses = [study.responses[index] for index in study.goals.objectives]
    percent = 100.0 * np.abs((pick.costs - here.costs) / confirmed["pick"].values[study.goals.objectives])
    for response, change, loss in zip(responses, percent, worse, strict=True):
        assert (
            f"{response.rpartition('_')[0].replace('_', ' ')} {change:.2f} % more" in sentence
        ) == loss or "ratio" in response
    assert "within the error" not in sentence
    (doubtful,) = rivals_sentences(forecast, simulated(study, surfaces, points, {name: 0.1}, 2.0))
    assert "only within the error" in doubtful


def test_a_better_point_that_speaks_for_itself_is_recommended(predicted):
    """Where nothing is known against a point, the sentence says so rather than to invent a reason."""
    study, surfaces, _, points = predicted
    name = next(name for name in points if name not in ("baseline", "pick"))
    swapped = points | {"pick": points[name], name: points["pick"]}
    forecast = SimpleNamespace(
        study=study, searched=None, with_tolerances=True, source="the surfaces predict",
        at=lambda point: SimpleNamespace(costs=np.zeros(3), keeps=True),
    )  # fmt: skip
    (sentence,) = rivals_sentences(forecast, simulated(study, surfaces, swapped, {name: 0.1}))
    assert sentence.endswith("the study found no reason to reject it: consider it.")
    forecast.at, forecast.searched = (lambda point: None), SimpleNamespace(name="adaptive")
    (sentence,) = rivals_sentences(forecast, simulated(study, surfaces, swapped, {name: 0.1}))
    assert "not a point of the adaptive front, from which the design is selected" in sentence


def test_a_simulation_begins_with_bearing_point_and_date(monkeypatch):
    """Then its figures with their errors."""

    def simulate(scene, *rest, **more):
        return replace(instant_result(scene), cost={"wall_s": 1.0, "compile_s": 0.0})

    monkeypatch.setattr("rbdyn.dynamics.simulate.simulate", simulate)
    shown = CliRunner().invoke(app, ["simulate", str(EXAMPLE)]).stdout
    verdict, first, *_ = shown.splitlines()
    bearing, point, day = first.split("; ")
    assert (
        verdict == "No danger found"
        and bearing == "cylindrical roller bearing, 10 rollers 9 x 5 mm, pitch diameter 43.5 mm"
    )
    assert point == "24000 rpm, 1300 N radial, MIL-L-7808 at 100 °C" and date.fromisoformat(day)
    assert shown.index("power loss [W]") < shown.index("raceway loads")


def test_balls_have_their_figures_before_the_table_of_all_balls():
    shown = CliRunner().invoke(app, ["ball", str(ROOT / "examples" / "angular_contact_ball.toml")]).stdout
    assert shown.splitlines()[1].startswith("angular contact ball bearing, ")
    assert shown.index("life L10r") < shown.index("stiffness: ") < shown.index("azimuth")


def test_notes_of_runs_stand_in_the_order_of_their_mean_place():
    """Unit: what comes first where it occurs stays first, though the first run lacks it; numbers make no difference."""
    drifted, dent, heat = Note("drift", "drifted"), Note("dent", "dented by 5 MPa"), Note("heat", "too hot")
    whirl, left_out = (partial(Note, "jitter"), partial(Note, "left-out"))
    runs = [
        (heat, whirl("whirl: 0.8 um"), left_out("left out: 13 W")),
        (heat, drifted, dent, whirl("whirl: 0.7 um"), left_out("left out: 14 W")),
        (heat, whirl("whirl: 0.8 um"), left_out("left out: 13 W")),
    ]
    notes = _distinct_notes(runs)
    assert [note.level for note in notes] == ["danger", "warning", "note", "warning", "note"]
    assert notes == [
        "too hot",
        "drifted",
        "whirl: 0.8 um (in 3 of 3 runs; values of the first)",
        "dented by 5 MPa (in 1 of 3 runs)",
        "left out: 13 W (in 3 of 3 runs; values of the first)",
    ]


def words(text: str) -> list[str]:
    """Words and numbers of a text, without lone signs."""
    return [word for word in text.split() if re.search(r"\w", word)]


def prose(summary: Summary) -> str:
    """The first screen of a study without its tables."""
    return terminal.text([block for block in blocks(summary) if not isinstance(block, Table)])


def test_the_verdict_comes_first_and_every_warning_has_a_number():
    """Unit: gains and limits in the first line, warnings of blocks and of notes in one numbered list behind the answer; no sentence says
    again what a table says, and at most 210 words are outside tables.
    """
    record = limited() | {"tolerances_warning": "Radial clearance requires parts finer than IT4. Try a wider design.",
                          "whirl_sentence": "Do not choose by the whirl deviation ratio: the cage does not whirl."}  # fmt: skip
    record["statement"] = "Simulated changes from the baseline: impact force: real."
    record["notes"] = plain([Note("few-samples", "statistical error: uncertain"), Note("remark", "a remark")])
    study = Summary.from_dict(record)
    lines = answer_text(study).splitlines()
    assert lines[0] == "All 3 responses improve and every limit is met. No danger found; 3 warnings"
    first = lines.index("Warnings")
    assert [line.partition(". ")[0] for line in lines[first + 1 : first + 4]] == ["1", "2", "3"]
    assert lines[first + 3] == "3. statistical error: uncertain" and lines[first + 4] == "note: a remark"
    assert not any(line.lower().startswith("warning:") for line in lines)
    said = prose(study)
    assert record["statement"] not in said and "meets every limit" not in said
    assert len(words(said)) <= 210
    page = html_report(study)
    assert record["statement"] in page and "meets every limit" in page
    assert "No danger found; 3 warnings" in page
    quiet = terminal.text(blocks(study), Detail.LEAST)
    assert "Warning: Do not choose" in quiet and "Warnings" not in quiet


@pytest.mark.parametrize(
    ("percents", "said"),
    [
        ((11.0, 11.0, 11.0), "All 3 responses improve. "),
        ((11.0, 11.0, 0.1), "Impact force and whirl deviation ratio improve (2 of 3 responses). "),
        ((11.0, 0.1, 0.1), "Impact force improves (1 of 3 responses). "),
        ((0.1, 0.1, 0.1), "No response improves by more than its error. "),
    ],
)
def test_the_verdict_names_the_gains_that_are_real(percents, said):
    """Unit: of fewer than three by name; it says so where no gain is real."""
    record = summary()
    for name, percent in zip(RESPONSES, percents, strict=True):
        record["gains"][name] = record["gains"][name] | {"percent": percent}
    text = answer_text(Summary.from_dict(record))
    assert text.splitlines()[0] == f"{said}No danger found"


def check_warnings(text: str) -> None:
    """Assert that all warnings of a screen are numbered behind the answer, and that no warning or note repeats another.

    Two say the same where their first words and first numbers are equal.
    """
    assert not re.search("^warning: ", text, re.MULTILINE | re.IGNORECASE)
    lines = text.partition("\nWarnings\n")[2].partition("\n\n")[0].splitlines()
    numbers = [int(found[1]) for line in lines if (found := re.match(r"(\d+)\. ", line))]
    assert len(numbers) > 1 and numbers == list(range(1, len(numbers) + 1))
    said = [found[1] for line in lines if (found := re.match(r"(?:\d+\.|note:) (.*)", line))]
    subjects = [
        (tuple(re.findall("[a-z]+", each.lower())[:2]), (re.findall(r"[\d.]*\d", each) or [""])[0]) for each in said
    ]
    assert len(set(subjects)) == len(subjects), subjects


@pytest.mark.parametrize("case", ["study", "study_robust", "study_adaptive"])
def test_a_stored_screen_numbers_its_warnings_and_repeats_none(case):
    """Golden: the screens that are kept begin with the verdict and have every warning once."""
    text = (ROOT / "tests" / "golden" / "outputs" / case / "screen.txt").read_text("utf-8")
    assert "No danger found; " in text.splitlines()[0]
    check_warnings(text)


@pytest.mark.slow
def test_the_example_study_has_a_short_first_screen(tmp_path):
    """Command line: the shipped study improves four responses with a held cage, in at most 210 words outside tables."""
    import doe

    answer = doe.study(ROOT / "examples" / "clearance_study.toml", tmp_path)
    text, said = (tmp_path / "answer.txt").read_text("utf-8"), prose(answer.summary)
    assert text.startswith("All 4 responses improve and every limit is met. No danger found; ")
    assert all(line in text for line in said.splitlines()) and len(words(said)) <= 210
    assert {gain["verdict"] for gain in answer["gains"].values()} == {"better"}
    assert answer["gains"]["pocket_impact_power_W"]["percent"] == pytest.approx(28.0, abs=2.0)
    assert text.count("(held 16/16)") == 2
    check_warnings(text)
