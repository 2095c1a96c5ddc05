"""The gains that tolerances keep, the grades of their parts, and what a gain demands."""

import re
from dataclasses import replace

import numpy as np
import pytest
from chains import chain
from conftest import EXAMPLE
from pareto_cases import TOLERANCES, edited_study
from synthetic_study import summary

from doe.dimension_chain import solve
from doe.report.sections.answer import first_screen
from doe.report.sections.chain import part_sheet
from doe.report.summary import Summary
from doe.study_file.sections import Tolerances
from doe.workflow.confirmation import Confirmed
from doe.workflow.duty import AtPoint, DutyAnswer, LifeOverDuty
from doe.workflow.front import draws_of
from doe.workflow.parts import FINER, Part, PartWidth, SharedTolerance, clearance_parts, grade_of_parts, grades_of
from doe.workflow.runs import Runs
from doe.workflow.surfaces import fit_surfaces
from doe.workflow.tolerances import PickParts
from rbdyn.base.faults import InputError
from rbdyn.base.terminal import text
from rbdyn.scene import Scene
from rbdyn.scene.unknown import inputs_of

# Impact falls by 20 % at guide -0.5, whirl by 10 % at pocket -0.5, loss by 0.6 % at radial -0.5 (coded): each by one factor.
SLOPES = np.array([[0.0, 40.0, 0.0], [0.0, 0.0, 0.2], [1.2, 0.0, 0.0]])
LEVELS = np.array([100.0, 1.0, 100.0])
PICK = np.array([-0.5, -0.5, -0.5])
RADIAL = "bearing.radial_clearance_mm"
IMPACT, WHIRL, LOSS = "impact_force_N", "whirl_deviation_ratio", "power_loss_W"


@pytest.fixture
def planes(tmp_path):
    """The example study, and surfaces of its responses that are planes."""
    study = edited_study(tmp_path, *TOLERANCES)
    coded = study.design.coded
    noise = 1e-9 * np.random.default_rng(1).standard_normal((len(coded), 3))
    values = LEVELS + coded @ SLOPES.T + noise
    return study, fit_surfaces(study, Runs(coded, study.actual(coded), values, np.full_like(values, np.nan)))


def widest(planes, confirmed=None, point=PICK, **settings):
    """The widest tolerances about a point of the planes, with the example's bearing; parts are spread evenly."""
    study, surfaces = planes
    study = study.with_surfaces(surfaces)
    settings = {"distribution": "uniform", "samples": 10_000} | settings
    few = draws_of(study, confirmed, 2)
    return PickParts(
        study, study.actual(point), Tolerances(**settings), confirmed or {}, search_draws=few, scene=Scene.load(EXAMPLE)
    ).widest()


def counted(found):
    """Names of the responses whose gains count."""
    return {name for name, gain in found.by_gain.items() if gain.counts}


def test_unit_small_gains_do_not_count(planes):
    """Unit: by default a gain counts from three times the smallest difference; the range of the others is stated."""
    found = widest(planes)
    assert counted(found) == {IMPACT, WHIRL}
    assert (
        "A gain counts from 3 times the smallest difference that matters, 1 %; power loss 0.60 % less does not."
        in found.sentence
    )
    low, high = found.by_gain[LOSS].parts_percent
    # 1.2 % a coded unit: 95 % of evenly spread parts are within 0.95 of the half width.
    half = 0.95 * 1.2 * found.half_widths[0] / 0.005
    assert (low, high) == pytest.approx((0.6 - half, 0.6 + half), rel=0.02)
    assert counted(widest(planes, smallest_difference_percent=0.19)) == {IMPACT, WHIRL, LOSS}
    assert counted(widest(planes, smallest_difference_percent=5.0)) == {IMPACT}


def test_unit_without_a_large_gain_all_real_ones_count(planes):
    """Unit: then a simulated gain within its error is none, and the sentence says so."""
    study, _ = planes
    assert counted(widest(planes, smallest_difference_percent=50.0)) == {IMPACT, WHIRL, LOSS}
    half = np.array([1.0, 1.0, 0.1])
    values = [LEVELS, LEVELS + SLOPES @ PICK]
    points = [study.baseline, study.actual(PICK)]
    pair = (Confirmed(point, value, half, np.zeros(3)) for point, value in zip(points, values, strict=True))
    found = widest(planes, dict(zip(("baseline", "pick"), pair, strict=True)), smallest_difference_percent=50.0)
    assert counted(found) == {IMPACT, LOSS}
    assert (
        "No gain reaches 3 times the smallest difference that matters, 50 %, so all real gains count." in found.sentence
    )
    assert "Not real: whirl deviation ratio 10.00 % less." in found.sentence


def simulated(study, impact):
    """Baseline and selected design as simulated, the latter with another impact than the planes predict."""
    values = [LEVELS, np.array([impact, *(LEVELS + SLOPES @ PICK)[1:]])]
    points = [study.baseline, study.actual(PICK)]
    pair = (Confirmed(point, value, np.full(3, 1e-3), np.zeros(3)) for point, value in zip(points, values, strict=True))
    return dict(zip(("baseline", "pick"), pair, strict=True))


def test_closed_form_of_tolerances_about_a_simulated_design(planes):
    """Closed form: where simulation has 16 % of the predicted 20 %, the slope of the surface reaches 5 % at 0.275 coded units."""
    found = widest(planes, simulated(planes[0], 84.0), at_least={IMPACT: 5.0})
    assert found.by_gain[IMPACT].predicted_percent == pytest.approx(16.0)
    assert found.half_widths[1] == pytest.approx(0.275 / 0.9 * 0.05, rel=0.01)


def test_parts_lie_beyond_the_region_by_the_tolerances_of_their_factors(planes):
    """A design at a bound keeps the tolerance with which it is made, which would be zero within the region."""
    study = planes[0]
    found = widest(planes, point=study.reach * np.array([-1.0, -1.0, 0.0]), gains=[IMPACT])
    own = study.known_tolerances
    assert found.half_widths[:2] == pytest.approx(list(own.values())[:2])
    assert found.widest.at_rim[:2].all() and found.half_widths[2] > list(own.values())[2]


def test_closed_form_of_a_gain_at_least(planes):
    """Closed form: half of 20 % is kept up to -0.25, 5 % up to -0.125; of evenly spread parts 95 % where room + h = 0.95 (2 h)."""
    for settings, room in (
        ({"gains": [IMPACT]}, 0.25),
        ({"at_least": {IMPACT: 5.0}}, 0.375),
        ({"gains": [IMPACT], "keep": 0.25}, 0.375),
    ):
        found = widest(planes, **settings)
        assert counted(found) == {IMPACT} and found.limiting_gain == IMPACT
        # The guide clearance has 0.05 mm a coded unit.
        assert found.half_widths[1] == pytest.approx(room / 0.9 * 0.05, rel=0.01)
    assert "[tolerances] does not name whirl deviation ratio 10.00 % less, power loss 0.60 % less." in found.sentence
    both = widest(planes, gains=[WHIRL], at_least={IMPACT: 5.0})
    assert both.by_gain[IMPACT].at_least_percent == 5.0
    assert both.by_gain[WHIRL].at_least_percent == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("settings", "point", "words"),
    [
        ({"at_least": {LOSS: 5.0}}, PICK, "at_least.power_loss_W = 5 exceeds the gain of 0.6 %; state less."),
        ({"gains": [LOSS]}, -PICK, "the selected design has no gain in power loss to keep; leave it out of [tolerances]."),
        ({}, -PICK, "No tolerances follow, because the selected design has no gain to keep and no response has a limit."),
    ],
)  # fmt: skip
def test_unit_gains_that_the_pick_does_not_have(planes, settings, point, words):
    """Unit: one sentence says which gain is missing, and no factor has a tolerance."""
    found = widest(planes, point=point, **settings)
    assert found.sentence.endswith(words) and not found.any_width
    assert not found.warning or found.warning.startswith("Keeping the gain of power loss leaves no tolerance. Without")


def test_unit_warning_names_the_gain_and_the_width_without_it(planes):
    """Unit: 0.6 % of loss demands raceways of a fine grade; without it the tolerance is that of the other gains."""
    found, without = widest(planes, gains=[IMPACT, WHIRL, LOSS], at_least={LOSS: 0.5}), widest(planes)
    assert found.limiting_gain == LOSS and "radial_clearance_mm" in found.too_fine
    record = found.by_factor["radial_clearance_mm"]
    assert record.without_limiting_gain.gain == LOSS
    assert record.without_limiting_gain.half_width == pytest.approx(without.half_widths[0])
    assert record.without_limiting_gain.grade == without.grades["radial_clearance_mm"].name
    assert found.warning.startswith(
        "Keeping the gain of power loss requires parts finer than IT4: radial clearance within ± 0.0"
    )
    assert f"({record.grade})" in found.warning and "Without this requirement the tolerance could be" in found.warning
    assert re.search(r"Then 95 % of the parts (have power loss|improve power loss by) 0\.", found.warning)
    assert "finer than IT1:" in widest(planes, gains=[LOSS], at_least={LOSS: 0.59}, finest_grade=1).warning


@pytest.mark.parametrize(
    ("size", "width", "grade"),
    [
        (50.0, 0.025, "IT7"), (50.0, 0.0249, "IT6"), (50.1, 0.030, "IT7"), (9.0, 0.004, "IT4"), (9.0, 0.0003, FINER),
        (80.0, 0.046, "IT8"), (3.0, 0.0012, "IT2"), (120.0, 0.0039, "IT1"), (120.0, 0.004, "IT2"), (500.0, 0.02, "IT4"),
    ],
)  # fmt: skip
def test_literature_grades_of_iso_286(size, width, grade):
    """Literature: standard tolerances of ISO 286-1, Table 1: the widest grade within a width."""
    assert SharedTolerance((Part("ring", 1.0, size, "drawing"),)).grade(width).name == grade


def test_unit_parts_share_a_tolerance():
    """Unit: land and cage of 50 mm have IT6, 16 um each, of 32 um; a graded part takes its own first."""
    pair = (Part("land", 1.0, 50.0, "drawing"), Part("cage", -1.0, 49.8, "drawing"))
    grade = SharedTolerance(pair).grade(0.032)
    assert grade.name == "IT6" and grade.parts == {"land": PartWidth(50.0, 0.016), "cage": PartWidth(49.8, 0.016)}
    assert SharedTolerance(pair, (0.004,)).grade(0.032).name == "IT5"


def test_unit_parts_are_those_of_the_chain_or_the_scene(tmp_path):
    """Unit: the pocket's chain states both parts as free; raceways and rollers of one lot come from the scene."""
    study, scene = edited_study(tmp_path), Scene.load(EXAMPLE)
    (tmp_path / "bearing_chains.toml").write_text(
        (EXAMPLE.parent / "bearing_chains.toml").read_text(encoding="utf-8"), encoding="utf-8"
    )
    grades = grades_of(study, scene, study.baseline, np.array([0.0105, 0.016, 0.004]))
    # 21 um less 4 um of rollers: raceways of 52.5 and 34.5 mm have 8 + 7 um in IT4.
    assert (grades["radial_clearance_mm"].name, grades["guide_clearance_mm"].name) == ("IT4", "IT6")
    assert set(grades["pocket_clearance_mm"].parts) == {"pocket_width", "roller_diameter"}
    assert grades["pocket_clearance_mm"].name == "IT4"
    assert not grades["radial_clearance_mm"].finer_than(4) and grades["radial_clearance_mm"].finer_than(5)
    assert "radial_clearance_mm" not in grades_of(study, scene, study.baseline, np.array([np.nan, 0.016, 0.004]))


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ('gains = ["impact"]', "tolerances.gains = 'impact': no such response; name one of impact_force_N, whirl_deviation_ratio, power_loss_W"),
        ("at_least = {loss = 1.0}", "tolerances.at_least = 'loss': no such response"),
        ('gains = ["impact_force_N", "impact_force_N"]', "tolerances.gains = 'impact_force_N': used more than once; name each once"),
        ("gains = []", "tolerances.gains"),
        ("at_least = {power_loss_W = -1.0}", "tolerances.at_least.power_loss_W"),
        ("smallest_difference_percent = 0.0", "tolerances.smallest_difference_percent"),
        ("finest_grade = 0", "tolerances.finest_grade"),
        ("finest_grade = 4.5", "tolerances.finest_grade"),
    ],
)  # fmt: skip
def test_unit_keys_of_tolerances_are_refused(tmp_path, keys, words):
    """Unit: one sentence with the key and the fix."""
    finest = "finest_grade = 4 "
    replacement = (finest, f"{keys}\n# ") if "finest" in keys else ("keep = 0.5", f"keep = 0.5\n{keys}")
    if "smallest" in keys:
        replacement = ("smallest_difference_percent = 1.0", keys)
    with pytest.raises(InputError) as refused:
        edited_study(tmp_path, replacement)
    assert len(refused.value.faults) == 1 and words in refused.value.faults[0]


def test_unit_a_response_without_a_goal_has_no_gain(tmp_path):
    """Unit: it is watched only."""
    watched = (
        'name = "power_loss_W"\nmodel = "quadratic"\ngoal = "min"',
        'name = "power_loss_W"\nmodel = "quadratic"\ngoal = "none"',
    )
    with pytest.raises(
        InputError, match=r"tolerances.gains = 'power_loss_W': goal = \"none\" has no gain; name one of impact"
    ):
        edited_study(tmp_path, watched, ("keep = 0.5", 'keep = 0.5\ngains = ["power_loss_W"]'))


def test_unit_a_tolerance_has_the_grades_of_the_parts_to_make():
    """Unit: slack goes to one of two raceways, whose grade then differs; the card and the table of parts state the same."""
    sides = {"position": "symmetric"}
    links = chain(
        [(1.0, 85.0, sides), (-1.0, 75.0, sides)], (9.993, 10.007), method="iso286", grades=True, spend_slack=True
    )
    solved = solve(links)
    grade = grade_of_parts(solved.parts)
    # IT3 takes 6 + 5 um of 14, IT4 10 + 8: the smaller raceway may have the wider grade.
    assert [part.grade for part in solved.parts] == ["IT3", "IT4"]
    assert (grade.name, grade.place) == ("IT3 and IT4", 4) and grade.finer_than(4) and not grade.finer_than(3)
    record = summary()
    record["made"] = {"radial_clearance_mm": {"half_width": 0.007, "grade": grade.name, "chain": "radial"}}
    record["operating_clearances_mm"] = {"radial_clearance_mm": {"baseline": 9.95, "pick": 8.95}}
    record["asked"]["factors"][0]["resolution"] = 0.001
    points = [
        AtPoint(name, 0.5, [], {}, {}, {}, None, "", {"radial_clearance_mm": {"baseline": play, "pick": play - 1.0}})
        for name, play in (("cruise", 9.95), ("take-off", 9.75))
    ]
    life = LifeOverDuty(None, None, None, {}, {})
    duty = DutyAnswer(points, {}, {"baseline": {}, "pick": {}}, {"baseline": life, "pick": life})
    screen = text(first_screen(replace(Summary.from_dict(record), duty=duty)))
    card = next(line for line in screen.splitlines() if line.strip().startswith("radial clearance"))
    assert "± 0.0070 " in card and card.rstrip().endswith("IT3 and IT4") and " 8.750 " in card
    assert "They are the least over the duty: at take-off." in screen


def test_unit_estimates_of_a_scene_mark_its_parts():
    """Unit: a land that no drawing states, and a pitch diameter named as an estimate, mark the parts that follow from them."""
    tables = Scene.load(EXAMPLE)._tables
    plain = clearance_parts(Scene.from_dict(tables))
    marked = {name: [part.name for part in group.parts if part.estimated] for name, group in plain.items()}
    assert marked == {
        "radial_clearance_mm": [],
        "guide_clearance_mm": ["guide_land", "cage_outside"],
        "pocket_clearance_mm": [],
    }
    stated = {**tables, "cage": {**tables["cage"], "land_diameter_mm": 49.5}}
    unsure = {**stated, "uncertain": {"estimated": ["bearing.pitch_diameter_mm"]}}
    by_factor = clearance_parts(Scene.from_dict(unsure))
    assert not any(part.estimated for part in by_factor["guide_clearance_mm"].parts)
    assert [part.estimated for part in by_factor["radial_clearance_mm"].parts] == [True, True, False]
    assert {"bearing.pitch_diameter_mm"}.isdisjoint(
        one.key for one in inputs_of(Scene.from_dict(unsure), unsure, Scene.from_dict(unsure).uncertain)
    )


def test_unit_an_estimate_is_marked_on_drawing_table_and_report():
    """Unit: of a link that says so, its size on the drawing begins with a mark, the CSV has it, and a sentence asks for the size."""
    sides = {"position": "symmetric"}
    solved = solve(chain([(1.0, 61.333, sides | {"estimated": True}), (-1.0, 61.0, sides)], (0.303, 0.363)))
    first, second = solved.parts
    assert first.text.startswith("≈ 61.333 ") and not second.text.startswith("≈")
    rows = part_sheet({"guide": solved}).records
    assert [row["estimated"] for row in rows] == [True, False]
    shown = text(first_screen(Summary.from_dict(summary() | {"chains": {"guide": solved.as_dict()}})))
    assert f"≈ estimated: {first.name} 61.333 mm; state it before the part is drawn." in shown
