"""Studies of a mounted bearing: drawn and operating clearances in the answer, the class of a pick, regions where a cage seizes."""

from pathlib import Path

import numpy as np
import pytest
from instant_runs import instantly
from short_studies import SHORT, run_study, short_study, silent

from doe.report.files import answer_text, summary
from doe.workflow.duty import operating_clearances
from doe.workflow.problem import Problem
from doe.workflow.whole import check_study
from rbdyn.base.faults import InputError, MethodError
from rbdyn.properties.catalogue import classes_at

MOUNTING = """
[mounting]
bore_mm = 27.0
outside_diameter_mm = 60.0
housing_diameter_mm = 80.0
inner_interference_um = 5.0
inner_ring_temperature_C = 100.0
outer_ring_temperature_C = 100.0
cage_temperature_C = {cage:g}
"""


def mounted_study(folder: Path, cage: float = 100.0) -> Problem:
    """The example study on a bearing that runs at 100 C."""
    path = short_study(folder, SHORT)
    scene = folder / "cylindrical_roller.toml"
    scene.write_text(scene.read_text(encoding="utf-8") + MOUNTING.format(cage=cage), encoding="utf-8")
    return Problem.load(path)


def test_unit_operating_clearances_of_two_designs(tmp_path):
    """Unit: of every factor that is a clearance what its scene has in operation, and the class of the selected design's radial one."""
    study = mounted_study(tmp_path)
    points = {"baseline": study.baseline, "pick": study.baseline + np.array([0.0, 0.05, 0.1])}
    scenes = {name: study.confirmation_scene(point) for name, point in points.items()}
    found = operating_clearances(study, scenes)
    assert list(found.operating) == ["radial_clearance_mm", "guide_clearance_mm", "pocket_clearance_mm"]
    guide, radial = found.operating["guide_clearance_mm"], found.operating["radial_clearance_mm"]
    assert guide["baseline"] == pytest.approx(0.15 - 0.0272, abs=1e-3)
    assert guide["pick"] == pytest.approx(1e3 * scenes["pick"].clearances["guide"].operating)
    assert guide["pick"] - guide["baseline"] == pytest.approx(0.05, abs=1e-4)
    assert radial["pick"] == pytest.approx(scenes["pick"].mounted_clearance_mm) == radial["baseline"]
    assert found.class_sentence == (
        "ISO 5753-1 at a bore of 27 mm: the selected radial clearance of 20 um falls in C2 (0 to 25 um), also in CN (20 to 45 um)."
    )


@pytest.mark.slow
def test_unit_a_study_shows_drawn_and_operating_clearances(tmp_path, monkeypatch):
    """Unit: summary and answer of a whole study, whose simulations are instant, have both."""
    instantly(monkeypatch.setattr)
    outcome = run_study(mounted_study(tmp_path), tmp_path, 1, lambda title: silent)
    text = answer_text(record := summary(outcome))
    plays = record.operating_clearances_mm
    scene = outcome.study.confirmation_scene(outcome.pick.point)
    assert plays["guide_clearance_mm"]["pick"] == pytest.approx(1e3 * scene.clearances["guide"].operating)
    assert "baseline in operation" in text and f"{plays['pocket_clearance_mm']['pick']:.3f}" in text
    assert record.clearance_class.startswith("ISO 5753-1 at a bore of 27 mm: the selected radial clearance of ")
    assert record.clearance_class in text


def test_unit_without_a_mounting_there_is_nothing_to_show(tmp_path):
    """Unit: no operating clearances and no class without [mounting]."""
    study = Problem.load(short_study(tmp_path))
    found = operating_clearances(study, dict.fromkeys(("baseline", "pick"), study.confirmation_scene(study.baseline)))
    assert found.operating == {} and found.class_sentence == ""


def test_unit_a_region_where_a_cage_seizes_is_refused_before_any_run(tmp_path, monkeypatch):
    """Unit: one sentence that names the study, the point of the region and the figures; nothing has run."""
    ran = instantly(monkeypatch.setattr)
    study = mounted_study(tmp_path, 190.0)
    with pytest.raises(InputError) as refused:
        check_study(study)
    (fault,) = refused.value.faults
    assert fault.startswith(f"{study.path}: the region of the design reaches radial_clearance_mm = ")
    assert "the cage seizes" in fault and fault.endswith("or narrow the region") and ran == []


@pytest.mark.parametrize(
    ("bore", "clearance_um", "names"),
    [
        (50.0, 45.0, ["CN"]), (50.0, 29.0, ["C2"]), (50.0, 56.0, ["C3", "CN"]), (50.0, 52.0, ["CN", "C3"]), (50.0, 64.0, ["C3"]),
        (50.0, -3.0, []), (50.0, 300.0, []), (27.0, 13.0, ["C2"]), (27.0, 20.0, ["C2", "CN"]), (100.0, 70.0, ["CN"]),
    ],
)  # fmt: skip
def test_literature_the_class_of_a_clearance(bore, clearance_um, names):
    """Literature: classes of ISO 5753-1 around a clearance, the nearest middle first; at 50 mm CN is 30 to 60, C3 50 to 80 um."""
    found = classes_at(bore, clearance_um, "cylindrical_roller")
    assert [each.name for each in found] == names
    assert all(each.lower <= clearance_um <= each.upper for each in found)


def test_unit_a_bore_beyond_the_table_has_no_class():
    """Unit: MethodError where the table ends."""
    with pytest.raises(MethodError, match="is listed to a bore of"):
        classes_at(5000.0, 100.0, "cylindrical_roller")
