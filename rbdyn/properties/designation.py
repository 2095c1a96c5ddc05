"""Designations of bearings: kind, series, bore code and suffixes, each of which is read or refused.

Suffixes are those of makers' catalogues (SKF, Schaeffler, NSK, NTN). What one says of another kind of bearing, or of two
features at once, is not guessed: a suffix that no rule here describes is refused.
"""

import re
from collections.abc import Iterator
from typing import NamedTuple

from rbdyn.faults import MethodError

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
    rollers = "NU, NJ, NUP, N or NF with series 10, 2, 22, 3 or 23 (NU210)"
    balls = "a deep groove ball bearing of series 60, 62, 63, 618, 619 (6208) or an angular contact one"
    raise MethodError(f"is no designation known here; write {rollers}, {balls} of 70, 72, 73, 718, 719 (7208B)")


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
            what = f"suffixes {other.text} and {each.text} both state the {GROUPS[each.group].partition(',')[0]}"
            raise MethodError(f"{what}; leave one out")
