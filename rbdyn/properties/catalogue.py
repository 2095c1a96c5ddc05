"""From a designation or boundary dimensions to an estimate of what is inside a bearing.

Catalogues list boundary dimensions, load ratings and of roller bearings a raceway, not what is inside. Each rule here was
compared with what is known; its error stands with it, and with the bearing that it makes.

Cylindrical rollers, over the 46 sizes of ``cylindrical_rollers.csv`` that list both raceways (d, D: bore, outside diameter):
rollers fill half of what is between the raceways, D_w = 0.547 (D - d)/2; they stand 1.22 D_w apart (18 in a NU 215, as
published); their effective length gives C0 by ISO 76, 44 (1 - D_w/d_m) Z L D_w. C by ISO 281 is then 1.00 of the classic
ratings and 0.87 of those that a maker raised by 15 % for cleaner steel; it cannot tell Z, which one more moves by 0.2 %.

Balls: read from the orders of the Timken catalogue's table A-9 (series 60, 62 and 63, 21 sizes: Z = BPFO + BPFI, and D_w/d_m
from BSF) and from C and C0 of NSK's 72 and 73 with 40 degrees (11 sizes, by ISO 281 and ISO 76).
"""

import math
from typing import NamedTuple

from rbdyn.faults import MethodError
from rbdyn.properties.designation import ANGLES, Designation
from rbdyn.properties.tables import table

CLEARANCE_CLASSES = ("C2", "CN", "C3", "C4", "C5")
BORES = {"00": 10.0, "01": 12.0, "02": 15.0, "03": 17.0}
SPACING = 1.22  # of rollers, in diameters
# D_w over (D - d)/2; the effective length over the width, series 10 and the others.
ROLLER_SHARE, NARROW_ROLLER_SHARE = 0.547, 0.5
LENGTH_SHARE, NARROW_LENGTH_SHARE = 0.62, 0.43
# Pitch diameter over the mean of bore and outside diameter.
PITCH_SHARE = 1.01
LARGEST_HALF_MILLIMETRE = 20.0  # rollers up to here are made in steps of half a millimetre, above of whole ones
# D_w over D - d of balls, by diameter series; of deep groove bearings below and above 40 mm of it.
DEEP_GROOVE_SHARES = {"8": 0.27, "9": 0.28, "0": 0.29, "2": 0.295, "3": 0.295}
LARGE_DEEP_GROOVE_SHARE, LARGE_HEIGHT = 0.31, 40.0
ANGULAR_SHARES = {"8": 0.27, "9": 0.29, "0": 0.30, "2": 0.32, "3": 0.32}
BALL_STEP = 25.4 / 64.0
# Balls of a deep groove bearing fill so much of the circle when they are put in between eccentric rings [rad].
FILLING_ANGLE = math.radians(201.0)
# Share of a full circle of balls in angular contact bearings: of 40 degrees, and of spindles.
GENERAL_FILLING, SPINDLE_FILLING = 0.87, 0.80


class Envelope(NamedTuple):
    """Boundary dimensions [mm] with what a catalogue adds: ratings [N], raceways of inner and outer ring [mm], and the
    thermal reference speed [rpm].
    """

    bore: float
    outside: float
    width: float
    dynamic_capacity: float | None = None
    static_capacity: float | None = None
    inner_raceway: float | None = None
    outer_raceway: float | None = None
    reference_speed: float | None = None


class RollerInterior(NamedTuple):
    """Estimated interior of a roller bearing [mm], and where each size comes from, with its error."""

    rollers: int
    roller_diameter: float
    pitch_diameter: float
    effective_length: float
    roller_length: float
    roller_diameter_by: str
    pitch_diameter_by: str
    effective_length_by: str


class BallInterior(NamedTuple):
    """Estimated interior of a ball bearing [mm, deg]; no contact angle for a deep groove bearing, whose clearance gives it."""

    balls: int
    ball_diameter: float
    pitch_diameter: float
    contact_angle: float | None
    balls_by: str
    ball_diameter_by: str
    contact_angle_by: str


def envelope(named: Designation, remedy: str = "add --bore, --outside and --width in mm") -> Envelope:
    """What the catalogue lists of a designation. Raises MethodError, with the remedy in it, where it does not."""
    size, bore = named.series + named.code, BORES.get(named.code, 5.0 * int(named.code))
    rollers = named.kind == "cylindrical_roller"
    for row in table("cylindrical_rollers" if rollers else "ball_bearings"):
        number = {key: float(value) for key, value in row.items() if value and key != "size"}
        box = number["bore"], number["outside"], number["width"]
        if rollers and row["size"] == size:
            raceways = number.get("inner_raceway"), number.get("outer_raceway")
            return Envelope(*box, 1e3 * number["C"], 1e3 * number["C0"], *raceways, number["reference_speed"])
        if not rollers and (row["diameter_series"], box[0]) == (named.diameter_series, bore):
            return Envelope(*box)
    raise MethodError(f"is not in the tables here; {remedy}")


def radial_clearance(bore: float, name: str, kind: str) -> tuple[float, float]:
    """Limits of a class of ISO 5753-1 [um] of a cylindrical roller or a deep groove ball bearing. Raises MethodError."""
    if name not in CLEARANCE_CLASSES:
        raise MethodError(f"{name} is no clearance class here; choose one of {', '.join(CLEARANCE_CLASSES)}")
    listed = [row for row in table("clearance_classes") if row["kind"] == kind and row[f"{name}_min"]]
    for row in listed:
        if bore <= float(row["bore"]):
            return float(row[f"{name}_min"]), float(row[f"{name}_max"])
    reach = f"{name} is listed to a bore of {listed[-1]['bore']} mm, not of {bore:g} mm"
    raise MethodError(f"{reach}; take a smaller bearing or another class")


class ClearanceClass(NamedTuple):
    """A class of ISO 5753-1 and its limits [um]."""

    name: str
    lower: float
    upper: float


def classes_at(bore: float, clearance: float, kind: str) -> list[ClearanceClass]:
    """Classes of ISO 5753-1 that hold a radial clearance [um] at a bore [mm], the one whose middle is nearest first.

    Neighbours overlap; beyond C2 and C5 there is none. Raises MethodError where the table does not reach the bore.
    """
    classes = [ClearanceClass(name, *radial_clearance(bore, name, kind)) for name in CLEARANCE_CLASSES]
    around = [each for each in classes if each.lower <= clearance <= each.upper]
    return sorted(around, key=lambda each: abs(clearance - 0.5 * (each.lower + each.upper)))


def roller_interior(sizes: Envelope, narrow: bool) -> RollerInterior:
    """Interior of a cylindrical roller bearing; ``narrow``: of series 10. Raises MethodError for impossible dimensions."""
    height = 0.5 * (sizes.outside - sizes.bore)
    if sizes.inner_raceway is not None and sizes.outer_raceway is not None:
        diameter = 0.5 * (sizes.outer_raceway - sizes.inner_raceway)
        pitch = 0.5 * (sizes.outer_raceway + sizes.inner_raceway)
        by = "half of what both raceways of the catalogue leave"
        around = "mean of both raceways of the catalogue"
    else:
        share = NARROW_ROLLER_SHARE if narrow else ROLLER_SHARE
        diameter = _rounded(share * height, 0.5 if share * height < LARGEST_HALF_MILLIMETRE else 1.0)
        by = f"estimated: {share:g} (D - d)/2, +-{10 if narrow else 3} %"
        if sizes.inner_raceway is not None:
            pitch, around = sizes.inner_raceway + diameter, "inner raceway of the catalogue plus one roller"
        else:
            pitch, around = 0.5 * PITCH_SHARE * (sizes.outside + sizes.bore), "estimated: 1.01 (d + D)/2, +-0.3 %"
    rollers = round(math.pi * pitch / (SPACING * diameter)) if diameter > 0.0 else 0
    if rollers < 3 or not sizes.bore < pitch - diameter < pitch + diameter < sizes.outside:
        raise MethodError("leaves no room for rings and rollers; check --bore and --outside")
    if sizes.static_capacity is not None:
        length = sizes.static_capacity / (44.0 * (1.0 - diameter / pitch) * rollers * diameter)
        along = "estimated: gives the catalogue's C0 by ISO 76, +-6 % as the rollers are +-1"
    else:
        share, error = (NARROW_LENGTH_SHARE, 30) if narrow else (LENGTH_SHARE, 20)
        length, along = share * sizes.width, f"estimated: {share:g} of the width, +-{error} %"
    whole = min(length + 0.1 * diameter, 0.95 * sizes.width)
    lengths = round(min(length, whole), 3), round(whole, 3)
    return RollerInterior(rollers, diameter, round(pitch, 3), *lengths, by, around, along)


def ball_interior(sizes: Envelope, named: Designation) -> BallInterior:
    """Interior of a ball bearing. Raises MethodError for impossible dimensions."""
    deep = named.kind == "deep_groove_ball"
    pitch, height = 0.5 * (sizes.bore + sizes.outside), sizes.outside - sizes.bore
    usual = named.diameter_series in "23"
    share = (DEEP_GROOVE_SHARES if deep else ANGULAR_SHARES)[named.diameter_series]
    if deep and usual and height >= LARGE_HEIGHT:
        share = LARGE_DEEP_GROOVE_SHARE
    diameter = _rounded(share * height, BALL_STEP)
    if not 0.0 < diameter < pitch or diameter > 2.0 * sizes.width:
        raise MethodError("leaves no room for rings and balls; check --bore, --outside and --width")
    apart = 2.0 * math.asin(diameter / pitch)
    by = f"estimated: {share:g} (D - d) in 64ths of an inch, +-{5 if usual else 10} %"
    if deep:
        many = "estimated: what can be filled in between eccentric rings, over 201 degrees, +-1"
        return BallInterior(1 + int(FILLING_ANGLE / apart), diameter, pitch, None, many, by, "")
    suffix = named.stated("angle")
    lead = suffix or ("B" if usual else "C")
    filling = GENERAL_FILLING if usual else SPINDLE_FILLING
    many = f"estimated: {filling:g} of a full circle, {'+-1' if usual else '+-2, and fewer where it is made for speed'}"
    turned = f"of suffix {lead}" if suffix else f"no suffix given; usual ({lead})"
    return BallInterior(round(filling * 2.0 * math.pi / apart), diameter, pitch, ANGLES[lead], many, by, turned)


def _rounded(value: float, step: float) -> float:
    return round(round(value / step) * step, 4)
