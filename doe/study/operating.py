"""Clearances of baseline and pick in operation, next to the drawn ones that factors and chains speak of."""

from collections.abc import Mapping

from doe import clearance
from doe.arrays import Array
from doe.study_file import Study
from rbdyn.faults import MethodError
from rbdyn.properties.catalogue import classes_at
from rbdyn.records.record import Record
from rbdyn.scene import Scene
from rbdyn.scene.notes import catalogued

RADIAL = "bearing.radial_clearance_mm"
# Which clearance of a scene a key holds as drawn.
CLEARANCES = {RADIAL: "radial", "cage.guide_clearance_mm": "guide", "cage.pocket_clearance_mm": "pocket"}


class OperatingClearances(Record):
    """Factors that are clearances, at the baseline and at the pick.

    ``operating``: by name of the factor the clearance in operation [mm] by name of the point; empty without [mounting], which
    alone makes it differ. ``class_sentence``: into which class of ISO 5753-1 the pick's radial clearance falls; empty where
    that is no factor or the bore is unknown.
    """

    operating: dict[str, dict[str, float]]
    class_sentence: str


def operating_clearances(study: Study, points: Mapping[str, Scene]) -> OperatingClearances:
    """Of scenes by name of their point, "pick" among them."""
    operating = {
        factor.name: {name: _operating_mm(scene, factor.key) for name, scene in points.items()}
        for factor in study.file.factor
        if factor.key in CLEARANCES and all(_changes(scene, factor.key) for scene in points.values())
    }
    radial = any(factor.key == RADIAL for factor in study.file.factor)
    pick = points["pick"]
    bore, drawn_um = bore_of(pick), 1e3 * pick.bearing.radial_clearance_mm
    named = "" if bore is None or not radial else class_sentence(bore, drawn_um, pick.bearing.kind)
    return OperatingClearances(operating, named)


def scenes_of(study: Study, baseline: Array, pick: Array) -> dict[str, Scene]:
    """The scenes of both points (k,)."""
    return {
        "baseline": clearance.confirmation_scene(study.at(()), baseline),
        "pick": clearance.confirmation_scene(study, pick),
    }


def bore_of(scene: Scene) -> float | None:
    """Bore of the bearing [mm]; None where the scene does not state it."""
    if scene.mounting is not None:
        return scene.mounting.bore_mm
    listed = catalogued(scene.bearing)
    return None if listed is None else listed[1].bore


def class_sentence(bore: float, drawn_um: float, kind: str) -> str:
    """Which classes of ISO 5753-1 hold a drawn radial clearance [um] at a bore [mm]; empty beyond the table of bores."""
    where = f"ISO 5753-1 at a bore of {bore:g} mm: the pick's radial clearance of {drawn_um:.3g} um"
    try:
        classes = classes_at(bore, drawn_um, kind)
    except MethodError:
        return ""
    if not classes:
        return f"{where} falls in no class."
    first, *others = (f"{each.name} ({each.lower:g} to {each.upper:g} um)" for each in classes)
    return f"{where} falls in {first}{f', also in {others[0]}' if others else ''}."


def _changes(scene: Scene, key: str) -> bool:
    return scene.mounting is not None and scene.clearances[CLEARANCES[key]] is not None


def _operating_mm(scene: Scene, key: str) -> float:
    play = scene.clearances[CLEARANCES[key]]
    assert play is not None
    return 1e3 * play.operating
