"""Dimensions of a scene that do not go with the designation it states."""

from rbdyn.properties.catalogue import Designation, Envelope, envelope, read_designation, roller_interior
from rbdyn.scene.bearing import Bearing
from rbdyn.scene.mounting import Mounting

# Relative errors: of raceways that the catalogue lists, of an estimated roller (series 10 within 10 %) and pitch circle.
LISTED, ROLLER, PITCH = 0.01, 0.12, 0.01


def catalogued(bearing: Bearing) -> tuple[Designation, Envelope] | None:
    """The designation of a bearing with its catalogue sizes; None where the scene states none."""
    if bearing.designation is None:
        return None
    named = read_designation(bearing.designation)
    return named, envelope(named)


def catalogue_notes(bearing: Bearing, mounting: Mounting | None) -> tuple[str, ...]:
    """One note on all dimensions that the catalogue has otherwise, none where the scene states no designation."""
    listed = catalogued(bearing)
    if listed is None:
        return ()
    named, sizes = listed
    inside = roller_interior(sizes, named.series == "10")
    known = sizes.inner_raceway is not None and sizes.outer_raceway is not None
    pairs = [
        ("bearing.pitch_diameter_mm", bearing.pitch_diameter_mm, inside.pitch_diameter, LISTED if known else PITCH),
        ("bearing.roller_diameter_mm", bearing.roller_diameter_mm, inside.roller_diameter, LISTED if known else ROLLER),
    ]
    if mounting is not None:
        pairs += [
            ("mounting.bore_mm", mounting.bore_mm, sizes.bore, LISTED),
            ("mounting.outside_diameter_mm", mounting.outside_diameter_mm, sizes.outside, LISTED),
        ]
    other = [
        f"{key} = {given:g} ({expected:g})"
        for key, given, expected, error in pairs
        if given is not None and abs(given - expected) > error * expected
    ]
    if bearing.roller_length_mm > sizes.width:
        other.append(f"bearing.roller_length_mm = {bearing.roller_length_mm:g} (below {sizes.width:g}, the width)")
    if not other:
        return ()
    what = f"bearing.designation = {bearing.designation!r}: its catalogue sizes disagree with {', '.join(other)}"
    return (f"{what}; correct the designation or these keys",)
