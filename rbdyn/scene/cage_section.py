"""The section of a cage as a scene gives it, and the stiffness of a cross-bar that follows from it."""

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from rbdyn.scene.bearing import SECTION_KEYS, Bearing, Cage, Materials
from rbdyn.scene.mounting import material_of

if TYPE_CHECKING:
    from rbdyn.contact.cage_bar import CageSection

STIFFNESS = "pocket_bar_stiffness_N_m"
# What the stiffness by a section is multiplied by at the ends of its error (unknown_inputs.toml has the reason).
STIFFNESS_ERROR = (0.55, 1.25)
# In roller diameters. A width that is estimated may be that of one roller more or less: only what is far off is refused.
NARROWEST_POCKET = 0.75


def with_bar_stiffness_of_section(scene: Mapping[str, Any]) -> Mapping[str, Any]:
    """Tables of a scene, with the stiffness of a cross-bar by its section where [cage] gives that and [model] no stiffness.

    What a table has wrong is left to its own check.
    """
    laws, cage = scene.get("model", {}), scene.get("cage")
    if not isinstance(laws, Mapping) or STIFFNESS in laws or not isinstance(cage, Mapping):
        return scene
    if not all(f"{key}_mm" in cage for key in SECTION_KEYS):
        return scene
    try:
        drawing = Bearing.model_validate(scene.get("bearing"))
        checked = Cage.model_validate(cage)
        materials = Materials.model_validate(scene.get("materials", {}))
    except ValidationError:
        return scene
    section = section_of(drawing, checked)
    if section is None or any(section_misfits(drawing, checked)):
        return scene
    from rbdyn.contact.cage_bar import Elastic, bar_stiffness

    material = material_of(materials.cage)
    elastic = Elastic(material.elastic_modulus, material.poisson_ratio)
    contact = checked.pocket_contact_length or drawing.effective_length
    return {**scene, "model": {STIFFNESS: bar_stiffness(section, elastic, min(contact, section.bar_length)), **laws}}


def section_of(bearing: Bearing, cage: Cage) -> "CageSection | None":
    """Section of the cage in SI; None where the scene gives none."""
    from rbdyn.contact.cage_bar import CageSection

    width, thickness = cage.bar_width, cage.bar_thickness
    length, ring = cage.bar_length, cage.side_ring_width
    if width is None or thickness is None or length is None or ring is None:
        return None
    return CageSection(width, thickness, length, ring, bearing.pitch_diameter, bearing.rollers)


def section_misfits(bearing: Bearing, cage: Cage) -> Iterator[str]:
    """A sentence for each size of a section that has no room in the bearing."""
    if any(getattr(cage, f"{key}_mm") is None for key in SECTION_KEYS):
        return
    width, thickness, length, _ = (float(getattr(cage, f"{key}_mm")) for key in SECTION_KEYS)
    roller = bearing.roller_diameter_mm
    pocket = math.pi * bearing.pitch_diameter_mm / bearing.rollers - width
    if pocket < NARROWEST_POCKET * roller:
        yield (
            f"cage.bar_width_mm = {width:g}: between {bearing.rollers} such bars pockets have {max(pocket, 0.0):.4g} mm, too narrow "
            f"for rollers of {roller:g} mm; make it narrower"
        )
    if thickness >= roller:
        yield (
            f"cage.bar_thickness_mm = {thickness:g}: a cage between the raceways is thinner than a roller of {roller:g} mm; "
            "make it thinner"
        )
    if length < bearing.roller_length_mm:
        yield (
            f"cage.bar_length_mm = {length:g}: a pocket is no shorter than its roller of {bearing.roller_length_mm:g} mm; "
            "lengthen it"
        )


def section_notes(bearing: Bearing, cage: Cage, stiffness: float | str) -> tuple[str, ...]:
    """A sentence that states a stiffness [N/m] by the section, with its error; none where the scene gives no section."""
    if section_of(bearing, cage) is None or isinstance(stiffness, str):
        return ()
    low, high = (100.0 * (factor - 1.0) for factor in STIFFNESS_ERROR)
    return (f"cage: by their section bars have {stiffness:.3g} N/m (model.{STIFFNESS}), {low:+.0f} to {high:+.0f} %",)
