"""Catalogue bearings: designations, boundary dimensions, and an estimate of the interior.

A designation has kind, series, bore code and suffixes. Suffixes follow makers' catalogues (SKF, Schaeffler, NSK, NTN); a suffix
without a rule here is refused, never guessed.

Catalogues list boundary dimensions, load ratings and a raceway of roller bearings, but not the interior. Each rule here was
compared with published interiors and states its error.

Cylindrical rollers, over the 46 sizes of ``cylindrical_rollers.csv`` with both raceways (d, D: bore, outside diameter): the
roller diameter is D_w = 0.547 (D - d)/2, and the spacing is 1.22 D_w (18 rollers in a NU 215, as published). The effective
length gives C0 by ISO 76, 44 (1 - D_w/d_m) Z L D_w. C by ISO 281 is then 1.00 of the classic ratings and 0.87 of those that a
maker raised by 15 % for cleaner steel. C cannot identify Z: one roller more changes it by 0.2 %.

Balls: from the orders in table A-9 of the Timken catalogue (series 60, 62 and 63, 21 sizes: Z = BPFO + BPFI, and D_w/d_m from
BSF) and from C and C0 of NSK's 72 and 73 with 40 degrees (11 sizes, by ISO 281 and ISO 76).

Cages: no catalogue draws them. A window cage has one geometry for its mass, its guide lands and the stiffness of its bars: a
ring about the pitch circle with 0.95 of the bearing's width and a pocket for each roller. Its thickness comes from the masses of
77 NU bearings with brass cages in a maker's catalogue, less rings and rollers. These are scaled so that 90 bearings of the same
series with polyamide cages have the listed mass; without chamfers and undercuts they would be 1.3 to 4.6 % too heavy. The median
thickness is 0.42 roller diameters in series 10 (26 bearings; four in five within -13 and +21 %), 0.50 in 22 (16; -30 to +33 %)
and 0.58 in 2, 3 and 23 (35; -19 to +26 %). Cages of polyamide and pressed steel have the same shape, unchecked: the catalogue
rounds too coarsely for their masses.
"""

import functools
import math
import re
from collections.abc import Iterable
from typing import NamedTuple

from rbdyn.base.faults import MethodError
from rbdyn.properties import table

SHAPE = re.compile(r"(NUP|NU|NJ|NF|N)?((?:HC)?B(?=7)|S(?=7))?[ -]*(\d{2,5})?(.*)", re.IGNORECASE | re.ASCII)
LONGEST = 100  # characters of a designation
BETWEEN = re.compile(r"[\s/.,-]+")  # separators of suffixes, which may also follow each other directly, as in ZZC3
ROLLERS, DEEP, ANGULAR = "cylindrical_roller", "deep_groove_ball", "angular_contact_ball"
SERIES = {ROLLERS: ("10", "2", "22", "3", "23"), DEEP: ("618", "619", "60", "62", "63"),
          ANGULAR: ("718", "719", "70", "72", "73")}  # fmt: skip
# Cages of cylindrical roller bearings: guidance and material. Behind M, M1, F, P and PH an A is for the outer ring, a B for the
# inner one; NSK has W and T, NTN T2, G1 and L1, Timken MA.
STEMS = {"M": "brass", "M1": "brass", "F": "aisi_4340", "P": "polyamide", "PH": "peek"}
CAGES = {
    **{f"{stem}{mark}": (guide, name) for stem, name in STEMS.items()
       for mark, guide in (("", "roller"), ("A", "outer"), ("B", "inner"))},
    "MAS": ("outer", "brass"), "MPA": ("outer", "brass"), "MP1A": ("outer", "brass"), "ML": ("outer", "brass"), "MR": ("roller", "brass"), "G1": ("roller", "brass"), "L1": ("roller", "brass"),
    **dict.fromkeys(("J", "W"), ("roller", "aisi_4340")),
    **dict.fromkeys(("TN", "TN9", "TVP", "TVP2", "TVP3", "T", "T2", "T2X"), ("roller", "polyamide")),
}  # fmt: skip
BALL_CAGES = ("M", "MA", "MB", "J", "JP", "F", "Y", "P", "PH", "T", "TN", "TN9", "TNH", "TVP", "TVP2", "TVH", "MP", "TYN", "TR", "T1", "T1X",
              "T2", "T85", "W")  # fmt: skip
# Contact angles [deg]; E only behind the prefix B.
ANGLES = {"AC": 25.0, "A5": 25.0, "A": 30.0, "B": 40.0, "C": 15.0, "E": 25.0}
# Groups of suffixes without effect in a scene, and the reason.
WITHOUT_EFFECT = {
    "design": "internal design",
    "generation": "generation of the design",
    "ball_cage": "cage, which an equilibrium does not need",
    "pairing": "for pairs, while a scene has one bearing",
    "seal": "seals or shields, whose friction is not modelled",
    "heat_treatment": "rings treated or stabilised by heat",
    "snap_ring": "snap ring groove or notches",
    "lubrication": "holes for oil",
    "variant": "a manufacturer's variant, whose sizes and clearance may differ",
    "tolerance": "tolerance class, which counts with --shaft and --housing",
}
GROUPS = {
    "clearance": "clearance class",
    "cage": "cage",
    "angle": "contact angle",
    "bore": "tapered bore",
    **WITHOUT_EFFECT,
}
# Groups of suffixes of bearings that a scene cannot represent, and the remedy.
REFUSED = {
    "range": "is a clearance range of its own; leave it out and write --clearance in mm",
    "full": "is a bearing without a cage, which is not modelled; leave it out only if there is a cage",
    "ceramic": "is a bearing with ceramic parts; leave it out and name the material in the table materials",
    "set": "is a set of bearings; leave it out, for a scene has one bearing",
    "grease": "is a grease; leave it out and name the grease with --oil",
}
# Classes of ISO 492 whose bore and outside diameter others share: those of spindle bearings by makers' tables (SKF, Schaeffler).
RING_CLASSES = {"PN": "Normal", "P0": "Normal", "P6X": "Normal", "SP": "P5", "P4A": "P4", "P4C": "P4", "P4S": "P4"}
# Classes that stand apart from what they follow directly; groups of a form that have another name.
CLASSES = ("clearance", "tolerance")
ALIASES = {
    "ball_cage_later": "ball_cage", "pairing_later": "pairing", "pairing_last": "pairing",
    "heat_later": "heat_treatment", "clearance_later": "clearance", "clearance_number": "clearance",
}  # fmt: skip


def _one_of(words: Iterable[str]) -> str:
    return "|".join(sorted(words, key=len, reverse=True))


BALL_CAGE = rf"(?P<ball_cage>{_one_of(BALL_CAGES)})?"
LATER_CAGE = BALL_CAGE.replace("ball_cage", "ball_cage_later")
SEAL = r"(?P<seal>[12]RSD|2?RS[12HLR]?|2?HRS|2?BRS|2?RZ|ZZ|2?Z|LL?[BHU]|DDU?|DU|VV)?"
SNAP = r"(?P<snap_ring>NR?|N[12])?"
CERAMIC, GREASE = r"(?P<ceramic>H[CN]\d?)?", r"(?P<grease>V?[LMHW]T\d*|LHT\d*|VT\d+|GJN|GE\d?|L138|L207|5[CK]|2AS)?"
# Classes of clearance and tolerance in either order, sets and preloads, what follows them.
RANGE = r"(?P<range>C[1-9N][HLMP]|C[MT]|CC\d?|C\d?NA)?"
END = (
    r"(?P<clearance>C[0-9]|CN)?"
    r"(?:(?P<tolerance>P6X|P4[ASC]|P[024-6]|PN|SP|UP)(?P<clearance_number>(?<=[4-6])[2-5])?)?"
    r"(?P<set>D[BFT]|T[BFT]T|TBT|QBC|QFC|DG[ABC]|Q?D[BFT]?R?|DUL?)?(?P<clearance_later>C[0-9]|CN)?"
)
TAIL = rf"(?P<heat_later>S[0-4N])?(?P<lubrication>W20|W33X?)?(?P<variant>V[A-Z]\d{{2,4}})?{GREASE}"
PAIRING = r"G[ABCLMN]?|U[AOLMH]|SUL?"
HEAT = r"(?P<heat_treatment>H[AB]\d|S[0-4N])?"
FORMS = {
    ROLLERS: rf"(?P<design>EC|EA|E)?(?P<generation>XL)?(?P<full>CV|V[HP]?)?(?P<bore>K30|K)?{SNAP}(?P<cage>{_one_of(CAGES)})?{CERAMIC}{HEAT}{RANGE}{END}{TAIL}",
    DEEP: rf"(?P<generation>C|XL)|(?P<design>E)?{BALL_CAGE}{SEAL}{SNAP}{LATER_CAGE}{CERAMIC}{HEAT}{RANGE}{END}{TAIL}",
    ANGULAR: rf"(?:(?P<angle>AC|A5|[ABC])(?P<design>[DEB]A?)?(?P<pairing>C[ABC]|G[ABC]?)?)?(?P<generation>XL)?{BALL_CAGE}{SEAL}{CERAMIC}"
    rf"{HEAT}(?P<pairing_later>{PAIRING})?{END}(?P<pairing_last>[LMH]|{PAIRING})?{TAIL}",
}  # fmt: skip
KNOWN = {
    ROLLERS: f"a cage ({', '.join(CAGES)}), EC, XL, K, C2 to C5, P4 to P6, S0 to S4",
    DEEP: "a cage (M, J, TN9), seals (2RS, 2Z), C2 to C5, P4 to P6, S0 to S4",
    ANGULAR: "an angle (AC, A5, A, B, C), seals (2RS), P4 to P6, S0 to S4",
}


class Suffix(NamedTuple):
    """One feature of a suffix: its group of ``GROUPS``, the suffix as written, and the value."""

    group: str
    text: str
    value: str


class Designation(NamedTuple):
    """Parts of a designation: kind of the scene, letters, series, bore code, suffixes as written, and their features."""

    kind: str
    letters: str
    series: str
    code: str
    words: tuple[str, ...] = ()
    suffixes: tuple[Suffix, ...] = ()
    prefix: str = ""

    @property
    def name(self) -> str:
        """The designation as printed in catalogues."""
        return " ".join(filter(None, (self.letters, self.prefix + self.series + self.code, *self.words)))

    @property
    def ring_class(self) -> str:
        """Class of ISO 492 of bore and outside diameter, as ``tolerances.ring_limits`` names it where it is listed."""
        stated = self.value_of("tolerance") or "PN"
        return RING_CLASSES.get(stated, stated)

    @property
    def diameter_series(self) -> str:
        """Diameter series of ISO 15: "8", "9", "0", "2" or "3"."""
        return self.series[-1]

    def without_effect(self, mounted: bool = False) -> str:
        """Suffixes without effect in a scene, with reasons; empty without any. Tolerance classes have one where it is ``mounted``."""
        idle = [suffix for suffix in self.suffixes if suffix.group in WITHOUT_EFFECT]
        idle = [suffix for suffix in idle if not (mounted and suffix.group == "tolerance")]
        return "; ".join(f"{suffix.value}, {WITHOUT_EFFECT[suffix.group]}" for suffix in idle)

    def value_of(self, group: str) -> str | None:
        """The value of a group of suffixes, such as "C3" for clearance; None without such a suffix."""
        return next((suffix.value for suffix in self.suffixes if suffix.group == group), None)


def read_designation(text: str) -> Designation:
    """Parse a designation.

    Raises MethodError for another kind of bearing, and for a suffix that is unknown, contradicts another or describes a bearing
    that a scene cannot represent.
    """
    plain = " ".join(text.split())
    shape = SHAPE.fullmatch(plain) if len(plain) <= LONGEST else None
    letters, prefix, digits, ending = ((shape.group(k) or "").upper() for k in (1, 2, 3, 4)) if shape else [""] * 4
    series, code = digits[:-2], digits[-2:]
    if prefix.startswith("HC"):
        raise MethodError(f"prefix {prefix} {REFUSED['ceramic']}")
    for kind, series_of_kind in SERIES.items():
        if bool(letters) == (kind == ROLLERS) and series in series_of_kind:
            form = FORMS[kind].replace("[ABC]", "[ABCE]", 1) if prefix == "B" else FORMS[kind]
            read = [_read(word, kind, form) for word in BETWEEN.split(ending) if word]
            suffixes = tuple(suffix for _, features in read for suffix in features)
            suffixes += (Suffix("seal", prefix, prefix),) if prefix == "S" else ()
            _check(suffixes)
            words = tuple(part for parts, _ in read for part in parts)
            return Designation(kind, letters, series, code, words, suffixes, prefix)
    raise MethodError(
        "is not a known designation; write NU, NJ, NUP, N or NF with series 10, 2, 22, 3 or 23 (NU210), a deep "
        "groove ball bearing of series 60, 62, 63, 618, 619 (6208) or an angular contact one of 70, 72, 73, 718, "
        "719 (7208B)"
    )


def _read(word: str, kind: str, form: str) -> tuple[list[str], list[Suffix]]:
    """The parts of a suffix, classes apart from what they follow, and its features. Raises MethodError."""
    match = re.fullmatch(form, word)
    # CM is a clearance of electric motors, not a contact angle C and a cage M.
    if match is None or word == "CM":
        raise MethodError(f"suffix {word} is not known; leave it out, or write {KNOWN[kind]}")
    parts, features, joined = list[str](), list[Suffix](), False
    for name, value in sorted(match.groupdict().items(), key=lambda item: match.start(item[0])):
        if not value:
            continue
        group = ALIASES.get(name, name)
        if group in REFUSED:
            raise MethodError(f"suffix {value} {REFUSED[group]}")
        features.append(Suffix(group, word, f"C{value}" if name == "clearance_number" else value))
        if name == "clearance_number" or (joined and group not in CLASSES):
            parts[-1] += value
        else:
            parts.append(value)
        joined = group not in CLASSES
    return parts, features


def _check(suffixes: tuple[Suffix, ...]) -> None:
    """Raises MethodError for two suffixes of one group."""
    first: dict[str, Suffix] = {}
    for suffix in suffixes:
        if (other := first.setdefault(suffix.group, suffix)) is not suffix and suffix.group != "pairing":
            feature = GROUPS[suffix.group].partition(",")[0]
            raise MethodError(f"suffixes {other.text} and {suffix.text} both state the {feature}; leave one out")


CLEARANCE_CLASSES = ("C2", "CN", "C3", "C4", "C5")
BORES = {"00": 10.0, "01": 12.0, "02": 15.0, "03": 17.0}
SPACING = 1.22  # of rollers, in roller diameters
# D_w over (D - d)/2; the effective length over the width, series 10 and the others.
ROLLER_SHARE, NARROW_ROLLER_SHARE = 0.547, 0.5
LENGTH_SHARE, NARROW_LENGTH_SHARE = 0.62, 0.43
# Pitch diameter over the mean of bore and outside diameter.
PITCH_SHARE = 1.01
LARGEST_HALF_MILLIMETRE = 20.0  # largest roller in steps of half a millimetre; larger ones are in whole millimetres
# D_w over D - d of balls, by diameter series; another share for deep groove bearings with D - d from 40 mm.
DEEP_GROOVE_SHARES = {"8": 0.27, "9": 0.28, "0": 0.29, "2": 0.295, "3": 0.295}
LARGE_DEEP_GROOVE_SHARE, LARGE_HEIGHT = 0.31, 40.0
ANGULAR_SHARES = {"8": 0.27, "9": 0.29, "0": 0.30, "2": 0.32, "3": 0.32}
BALL_STEP = 25.4 / 64.0
# Angle that the balls of a deep groove bearing fill during assembly between eccentric rings [rad].
FILLING_ANGLE = math.radians(201.0)
# Balls of an angular contact bearing as a share of a full circle: bearings of 40 degrees, and spindle bearings.
GENERAL_FILLING, SPINDLE_FILLING = 0.87, 0.80


class Envelope(NamedTuple):
    """Boundary dimensions [mm] and further entries of a catalogue: ratings [N], raceways of inner and outer ring [mm], thermal
    reference speed [rpm].
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
    """Estimated interior of a roller bearing [mm], with the source and the error of each size."""

    rollers: int
    roller_diameter: float
    pitch_diameter: float
    effective_length: float
    roller_length: float
    roller_diameter_by: str
    pitch_diameter_by: str
    effective_length_by: str
    rollers_by: str = "estimated: 1.22 roller diameters apart, +-1"
    roller_length_by: str = "estimated: 0.1 diameters longer, +-5 %"
    bar_width_by: str = "width between the pockets at the pitch circle; rollers +-1 make it +-40 %"


class BallInterior(NamedTuple):
    """Estimated interior of a ball bearing [mm, deg], with sources; the clearance of a deep groove bearing gives its angle."""

    balls: int
    ball_diameter: float
    pitch_diameter: float
    contact_angle: float | None
    balls_by: str
    ball_diameter_by: str
    contact_angle_by: str
    pitch_diameter_by: str = "estimated: (d + D)/2, +-1 %"


def envelope(named: Designation, remedy: str = "add --bore, --outside and --width in mm") -> Envelope:
    """Catalogue entry of a designation. Raises MethodError with the remedy for a size that is not listed."""
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


# D - d of diameter series 4 over that of series 3, whose geometric mean separates them: 2.56/1.92 by the general plan of ISO 15
# (from memory).
HEAVY_RATIO = 2.56 / 1.92


@functools.cache
def diameter_series(bore: float, outside: float) -> str:
    """Diameter series of ISO 15 nearest to a ball bearing of this bore and outside diameter [mm]: "8", "9", "0", "2", "3" or "4".

    The nearest is that of the closest D/d - 1 at the listed bore next to this one. Series 4 is not listed: it lies above 3.
    """
    nearest: dict[str, tuple[float, float]] = {}
    for row in table("ball_bearings"):
        listed, across = float(row["bore"]), float(row["outside"])
        distance = abs(math.log(listed / bore))
        if distance < nearest.get(row["diameter_series"], (math.inf, 0.0))[0]:
            nearest[row["diameter_series"]] = distance, across / listed - 1.0
    height = outside / bore - 1.0
    if height > nearest["3"][1] * math.sqrt(HEAVY_RATIO):
        return "4"
    return min(nearest, key=lambda series: abs(math.log(nearest[series][1] / height)))


def radial_clearance(bore: float, name: str, kind: str) -> tuple[float, float]:
    """Limits of a class of ISO 5753-1 [um] of a cylindrical roller or a deep groove ball bearing. Raises MethodError."""
    if name not in CLEARANCE_CLASSES:
        raise MethodError(f"{name} is not a clearance class; choose one of {', '.join(CLEARANCE_CLASSES)}")
    listed = [row for row in table("clearance_classes") if row["kind"] == kind and row[f"{name}_min"]]
    for row in listed:
        if bore <= float(row["bore"]):
            return float(row[f"{name}_min"]), float(row[f"{name}_max"])
    raise MethodError(
        f"{name} is listed to a bore of {listed[-1]['bore']} mm, not of {bore:g} mm; take a smaller bearing, "
        "another class, or give the clearance in mm"
    )


class ClearanceClass(NamedTuple):
    """A class of ISO 5753-1 and its limits [um]."""

    name: str
    lower: float
    upper: float


def classes_at(bore: float, clearance: float, kind: str) -> list[ClearanceClass]:
    """Classes of ISO 5753-1 that contain a radial clearance [um] at a bore [mm], sorted by distance from their middle.

    Neighbours overlap; beyond C2 and C5 the list is empty. Raises MethodError for a bore beyond the table.
    """
    classes = [ClearanceClass(name, *radial_clearance(bore, name, kind)) for name in CLEARANCE_CLASSES]
    matches = [limits for limits in classes if limits.lower <= clearance <= limits.upper]
    return sorted(matches, key=lambda limits: abs(clearance - 0.5 * (limits.lower + limits.upper)))


def roller_interior(sizes: Envelope, narrow: bool) -> RollerInterior:
    """Interior of a cylindrical roller bearing; ``narrow``: series 10. Raises MethodError for impossible dimensions."""
    height = 0.5 * (sizes.outside - sizes.bore)
    if sizes.inner_raceway is not None and sizes.outer_raceway is not None:
        diameter = 0.5 * (sizes.outer_raceway - sizes.inner_raceway)
        pitch = 0.5 * (sizes.outer_raceway + sizes.inner_raceway)
        by = "half the difference between both raceway diameters of the catalogue"
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
        along = "estimated: gives the catalogue's C0 by ISO 76, +-5 % as the rollers are +-1"
    else:
        share, error = (NARROW_LENGTH_SHARE, 30) if narrow else (LENGTH_SHARE, 20)
        length, along = share * sizes.width, f"estimated: {share:g} of the width, +-{error} %"
    overall = min(length + 0.1 * diameter, 0.95 * sizes.width)
    lengths = round(min(length, overall), 3), round(overall, 3)
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
    suffix = named.value_of("angle")
    lead = suffix or ("B" if usual else "C")
    filling = GENERAL_FILLING if usual else SPINDLE_FILLING
    many = f"estimated: {filling:g} of a full circle, {'+-1' if usual else '+-2; fewer in high-speed designs'}"
    turned = f"of suffix {lead}" if suffix else f"no suffix given; usual ({lead})"
    return BallInterior(round(filling * 2.0 * math.pi / apart), diameter, pitch, ANGLES[lead], many, by, turned)


def _rounded(value: float, step: float) -> float:
    return round(round(value / step) * step, 4)


# Width of a cage as a share of the bearing's width; pocket clearance and end play of a roller in roller diameters.
CAGE_WIDTH, POCKET_CLEARANCE, END_PLAY = 0.95, 0.03, 0.02
SMALLEST_CLEARANCE_MM, SMALLEST_PLAY_MM, NARROWEST_RING_MM = 0.05, 0.1, 0.5
# A side ring has at least this share of a bar's length; what is wider than a bar of so many roller diameters is a block.
NARROWEST_RING_SHARE, WIDEST_BAR = 0.03, 2.0
# Radial thickness in roller diameters, by series; the series of a drawing.
NO_SERIES = ""
THICKNESS, USUAL_THICKNESS = {"10": 0.42, "22": 0.50}, 0.58


class CageEstimate(NamedTuple):
    """Estimated dimensions of a cage [mm], volume [mm^3], thickness in roller diameters."""

    pocket_clearance: float
    bar_width: float
    bar_thickness: float
    bar_length: float
    side_ring_width: float
    volume: float
    thickness_share: float


def cage_estimate(
    series: str, width: float, rollers: int, roller_diameter: float, roller_length: float, pitch_diameter: float
) -> CageEstimate:
    """Cage of a bearing of these dimensions [mm]; ``series``: "10", "2", "22", "3", "23" or ``NO_SERIES``."""
    clearance = max(round(POCKET_CLEARANCE * roller_diameter, 2), SMALLEST_CLEARANCE_MM)
    share = THICKNESS.get(series, USUAL_THICKNESS)
    thickness = round(share * roller_diameter, 3)
    circumference = math.pi * pitch_diameter
    gap = round(circumference / rollers - roller_diameter - clearance, 3)
    bar = min(gap, round(WIDEST_BAR * roller_diameter, 3))
    length = round(roller_length + max(END_PLAY * roller_diameter, SMALLEST_PLAY_MM), 3)
    narrowest = max(NARROWEST_RING_MM, round(NARROWEST_RING_SHARE * length, 3))
    ring = max(round(0.5 * (CAGE_WIDTH * width - length), 3), narrowest)
    volume = thickness * (2.0 * ring * circumference + rollers * gap * length)
    return CageEstimate(clearance, bar, thickness, length, ring, volume, share)
