"""From a designation or boundary dimensions to an estimate of what is inside a bearing.

A designation is kind, series, bore code and suffixes, each of which is read or refused. Suffixes are those of makers' catalogues
(SKF, Schaeffler, NSK, NTN). What one says of another kind of bearing, or of two features at once, is not guessed: a suffix that no
rule here describes is refused.

Catalogues list boundary dimensions, load ratings and of roller bearings a raceway, not what is inside. Each rule here was
compared with what is known; its error stands with it, and with the bearing that it makes.

Cylindrical rollers, over the 46 sizes of ``cylindrical_rollers.csv`` that list both raceways (d, D: bore, outside diameter):
rollers fill half of what is between the raceways, D_w = 0.547 (D - d)/2; they stand 1.22 D_w apart (18 in a NU 215, as
published); their effective length gives C0 by ISO 76, 44 (1 - D_w/d_m) Z L D_w. C by ISO 281 is then 1.00 of the classic
ratings and 0.87 of those that a maker raised by 15 % for cleaner steel; it cannot identify Z, which one more moves by 0.2 %.

Balls: read from the orders of the Timken catalogue's table A-9 (series 60, 62 and 63, 21 sizes: Z = BPFO + BPFI, and D_w/d_m
from BSF) and from C and C0 of NSK's 72 and 73 with 40 degrees (11 sizes, by ISO 281 and ISO 76).

Cages: a window cage that no catalogue draws is one geometry for its mass, its guide lands and the stiffness of its bars.
It is a ring about the pitch circle, as wide as 0.95 of the bearing, with a pocket a roller. How thick it is comes from the masses
of 77 NU bearings with brass cages in a maker's catalogue, less rings and rollers; these are scaled by the 90 of the same series
with polyamide cages, of which they then give the listed mass (they are 1.3 to 4.6 % too heavy otherwise, for chamfers and
undercuts). The median thickness is 0.42 roller diameters in series 10 (26 bearings; four in five lie within -13 and +21 % of it),
0.50 in 22 (16; -30 to +33 %), 0.58 in 2, 3 and 23 (35; -19 to +26 %). Cages of polyamide and of pressed steel take the same
shape, unchecked: their masses are lost in the rounding of the catalogue's.
"""

import math
import re
from collections.abc import Iterator
from typing import NamedTuple

from rbdyn.base.faults import MethodError
from rbdyn.properties import table

SHAPE = re.compile(r"(NUP|NU|NJ|NF|N)?[ -]*(\d{2,5})?(.*)", re.IGNORECASE | re.ASCII)
LONGEST = 100  # characters of a designation
# Between suffixes; a class of clearance or tolerance may also follow another suffix at once, as in ZZC3.
BETWEEN = re.compile(r"[\s/.,-]+")
GLUED = re.compile(r"(.+)(C[0-9N]|P[0-9])")
ROLLERS, DEEP, ANGULAR = "cylindrical_roller", "deep_groove_ball", "angular_contact_ball"
SERIES = {ROLLERS: ("10", "2", "22", "3", "23"), DEEP: ("618", "619", "60", "62", "63"),
          ANGULAR: ("718", "719", "70", "72", "73")}  # fmt: skip
# Cages of cylindrical roller bearings: what guides them, what they are made of.
CAGES = {
    "MA": ("outer", "brass"), "MAS": ("outer", "brass"), "ML": ("outer", "brass"), "MB": ("inner", "brass"),
    "M": ("roller", "brass"), "M1": ("roller", "brass"), "J": ("roller", "aisi_4340"), "F": ("roller", "aisi_4340"),
    "FA": ("outer", "aisi_4340"), "P": ("roller", "polyamide"), "TN": ("roller", "polyamide"),
    "TN9": ("roller", "polyamide"), "TVP": ("roller", "polyamide"), "TVP2": ("roller", "polyamide"),
    "PH": ("roller", "peek"), "PHA": ("outer", "peek"),
}  # fmt: skip
BALL_CAGES = ("M", "MA", "MB", "J", "JP", "F", "Y", "P", "PH", "T", "TN", "TN9", "TNH", "TVP", "TVP2", "TVH", "MP")
# Contact angles [deg].
ANGLES = {"AC": 25.0, "A5": 25.0, "A": 30.0, "B": 40.0, "C": 15.0}
# Groups of suffixes, and why those have no effect in a scene.
WITHOUT_EFFECT = {
    "design": "internal design",
    "ball_cage": "cage, which an equilibrium does not need",
    "pairing": "for pairs, while a scene has one bearing",
    "seal": "seals or shields, whose friction is not modelled",
    "tolerance": "tolerance class, while a scene has nominal sizes",
    "heat_treatment": "rings stabilised for heat",
    "snap_ring": "snap ring groove",
    "lubrication": "holes for oil",
}
GROUPS = {"clearance": "clearance class", "cage": "cage", "angle": "contact angle", **WITHOUT_EFFECT}


def _one_of(words: tuple[str, ...] | dict[str, object]) -> str:
    return "|".join(sorted(words, key=len, reverse=True))


BALL_CAGE = rf"(?P<ball_cage>{_one_of(BALL_CAGES)})?"
SEAL = r"(?P<seal>2?RS[12HLR]?|[12]RSD|2?RZ|2?Z|ZZ|LL?[BHU]|DDU?|DU|VV)"
COMMON = (
    r"(?P<clearance>C[0-9]|CN)",
    r"(?P<tolerance>P[024-6]|PN|P6X|P4[AS])",
    r"(?P<tolerance>P[4-6])(?P<clearance_number>[2-5])",
    r"(?P<heat_treatment>S[0-4N])",
    r"(?P<snap_ring>NR?)",
    r"(?P<lubrication>W20|W33X?)",
)
FORMS = {
    ROLLERS: (rf"(?P<design>EC|E)?(?P<cage>{_one_of(dict(CAGES))})?", *COMMON),
    DEEP: (rf"(?P<design>E)?{BALL_CAGE}", SEAL, *COMMON),
    ANGULAR: (
        rf"(?P<angle>{_one_of(dict(ANGLES))})(?P<design>[DEB])?(?P<pairing>C[ABC]|G[ABC]?)?{BALL_CAGE}",
        rf"{BALL_CAGE}", r"(?P<pairing>G[ABC]?|UL|SUL?)", SEAL, *COMMON,
    ),
}  # fmt: skip
KNOWN = {
    ROLLERS: f"a cage ({', '.join(CAGES)}), EC, C2 to C5, P2 to P6, S0 to S4",
    DEEP: "a cage (M, J, TN9), seals (2RS, 2Z), C2 to C5, P2 to P6, S0 to S4",
    ANGULAR: f"an angle ({', '.join(ANGLES)}), seals (2RS), P2 to P6, S0 to S4",
}
# Suffixes that change what a scene would need, and what to do.
REFUSED = (
    (r"C[1-9N][HLMP]|C[MT]", "is a clearance range of its own; leave it out and put the clearance into the scene"),
    (r"K|K30", "is a tapered bore, whose clearances are not listed; leave it out and put the clearance into the scene"),
    (r"V|CV|VH|VP", "is a bearing without a cage, which is not modelled; leave it out only if there is a cage"),
    (r"HC\d?|HN\d?", "is a bearing with ceramic parts; leave it out and name the material in the table materials"),
    (r"D[BFT]|T[BFT]T|TBT|QBC|QFC|Q?D[BFT]?R?", "is a set of bearings; leave it out, for a scene has one bearing"),
    (r"V?[LMHW]T\d*|LHT\d*|VT\d+|GJN|GE\d?", "is a grease; leave it out and name the grease with --oil"),
)


class Suffix(NamedTuple):
    """One feature that a suffix states: its group, of ``GROUPS``, what was written, and the value in it."""

    group: str
    text: str
    value: str


class Designation(NamedTuple):
    """A designation taken apart: kind of the scene, its letters, series, bore code, suffixes as written, what they state."""

    kind: str
    letters: str
    series: str
    code: str
    words: tuple[str, ...] = ()
    suffixes: tuple[Suffix, ...] = ()

    @property
    def name(self) -> str:
        """As catalogues print it."""
        return " ".join(filter(None, (self.letters, self.series + self.code, *self.words)))

    @property
    def diameter_series(self) -> str:
        """Of ISO 15: "8", "9", "0", "2" or "3"."""
        return self.series[-1]

    @property
    def without_effect(self) -> str:
        """Suffixes that change nothing in a scene, and why; empty where there is none."""
        idle = [each for each in self.suffixes if each.group in WITHOUT_EFFECT]
        return "; ".join(f"{each.value}, {WITHOUT_EFFECT[each.group]}" for each in idle)

    def stated(self, group: str) -> str | None:
        """The value of a group of suffixes: "C3" of clearance; None where the designation leaves it open."""
        return next((each.value for each in self.suffixes if each.group == group), None)


def read_designation(text: str) -> Designation:
    """Take a designation apart. Raises MethodError for what is none of the kinds known here, and for a suffix that is unknown,
    changes what is not modelled, or contradicts another.
    """
    plain = " ".join(text.split())
    shape = SHAPE.fullmatch(plain) if len(plain) <= LONGEST else None
    letters, digits, rest = ((shape.group(k) or "").upper() for k in (1, 2, 3)) if shape else ("", "", "")
    series, code = digits[:-2], digits[-2:]
    for kind, known in SERIES.items():
        if bool(letters) == (kind == ROLLERS) and series in known:
            words = tuple(part for word in BETWEEN.split(rest) if word for part in _parts(word, kind))
            suffixes = tuple(suffix for word in words for suffix in _read(word, kind))
            _check(suffixes)
            return Designation(kind, letters, series, code, words, suffixes)
    raise MethodError(
        "is no designation known here; write NU, NJ, NUP, N or NF with series 10, 2, 22, 3 or 23 (NU210), a deep "
        "groove ball bearing of series 60, 62, 63, 618, 619 (6208) or an angular contact one of 70, 72, 73, 718, "
        "719 (7208B)"
    )


def _parts(word: str, kind: str) -> list[str]:
    """A suffix, and classes that follow it without a mark between."""
    rules = (*FORMS[kind], *(pattern for pattern, _ in REFUSED))
    if (glued := GLUED.fullmatch(word)) is None or any(re.fullmatch(rule, word) for rule in rules):
        return [word]
    return [*_parts(glued[1], kind), glued[2]]


def _read(word: str, kind: str) -> Iterator[Suffix]:
    """What a suffix states of a kind of bearing. Raises MethodError."""
    for form in FORMS[kind]:
        if match := re.fullmatch(form, word):
            for group, value in match.groupdict().items():
                if value is not None:
                    numbered = group == "clearance_number"
                    yield Suffix("clearance" if numbered else group, word, f"C{value}" if numbered else value)
            return
    for pattern, why in REFUSED:
        if re.fullmatch(pattern, word):
            raise MethodError(f"suffix {word} {why}")
    raise MethodError(f"suffix {word} is not known; leave it out, or write {KNOWN[kind]}")


def _check(suffixes: tuple[Suffix, ...]) -> None:
    """Raises MethodError for two suffixes of one group."""
    first: dict[str, Suffix] = {}
    for each in suffixes:
        if (other := first.setdefault(each.group, each)) is not each:
            raise MethodError(
                f"suffixes {other.text} and {each.text} both state the {GROUPS[each.group].partition(',')[0]}; leave "
                "one out"
            )


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
    raise MethodError(
        f"{name} is listed to a bore of {listed[-1]['bore']} mm, not of {bore:g} mm; take a smaller bearing or "
        "another class"
    )


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


# Share of the bearing's width; pocket clearance and end play of a roller in its pocket in roller diameters.
CAGE_WIDTH, POCKET_CLEARANCE, END_PLAY = 0.95, 0.03, 0.02
SMALLEST_CLEARANCE_MM, SMALLEST_PLAY_MM, NARROWEST_RING_MM = 0.05, 0.1, 0.5
# Radial thickness in roller diameters, by series, and its error by the catalogue [%].
THICKNESS, USUAL_THICKNESS = {"10": (0.42, 20), "22": (0.50, 35)}, (0.58, 25)


class CageEstimate(NamedTuple):
    """Dimensions of a cage [mm] and its volume [mm^3]; thickness in roller diameters, error of thickness and volume [%]."""

    pocket_clearance: float
    bar_width: float
    bar_thickness: float
    bar_length: float
    side_ring_width: float
    volume: float
    thickness_share: float
    cage_error: int


def cage_estimate(
    series: str, width: float, rollers: int, roller_diameter: float, roller_length: float, pitch_diameter: float
) -> CageEstimate:
    """Cage of a bearing of these dimensions [mm]; ``series``: "10", "2", "22", "3" or "23"."""
    clearance = max(round(POCKET_CLEARANCE * roller_diameter, 2), SMALLEST_CLEARANCE_MM)
    share, error = THICKNESS.get(series, USUAL_THICKNESS)
    thickness = round(share * roller_diameter, 3)
    circumference = math.pi * pitch_diameter
    bar = round(circumference / rollers - roller_diameter - clearance, 3)
    length = round(roller_length + max(END_PLAY * roller_diameter, SMALLEST_PLAY_MM), 3)
    ring = max(round(0.5 * (CAGE_WIDTH * width - length), 3), NARROWEST_RING_MM)
    volume = thickness * (2.0 * ring * circumference + rollers * bar * length)
    return CageEstimate(clearance, bar, thickness, length, ring, volume, share, error)
