"""Options of ``rbdyn new``: one table of what each takes, its help, reader, key and remedy; readers; every fault is one sentence."""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from functools import partial
from typing import Any, TypeVar

from rbdyn.base.command import comma_fault, plain_number, valued
from rbdyn.base.faults import LONGEST_NAME, MethodError, one_line
from rbdyn.properties.catalogue import CLEARANCE_CLASSES
from rbdyn.properties.materials import MATERIALS
from rbdyn.properties.oils import NamedOil, oil_named
from rbdyn.scene.lubricant import SUPPLIES

Value = TypeVar("Value")
ROLLER_DIAMETERS, ROLLER_LENGTHS, CLEARANCE_LIMITS = (1.0, 150.0), (0.5, 400.0), (-0.2, 2.0)
CONFORMITIES = (0.501, 0.7)
ROLLER = re.compile(r"\s*([\d.]+)\s*[xX\u00d7*]\s*([\d.]+)\s*(?:mm)?\s*")
POLYAMIDE_NAME = "polyamide"
TEMPERATURE_C, OIL = 70.0, "ISO VG 68"
SLOWEST_RPM = 0.1
LISTED, OF_OWN = "as listed; estimated for own", "only with own"
# Options that write [thermal], and those of one kind of bearing, whatever names it.
HEAT = "--oil-flow", "--oil-inlet", "--ambient"
OF_ROLLERS, OF_BALLS = ("--guidance", "--cage-material", "--lubrication"), ("--preload",)


def _range_fault(value: float, least: float, largest: float, unit: str) -> str | None:
    if not math.isfinite(value):
        return "is not a finite number; write a plain number"
    if least <= value <= largest:
        return None
    kelvin = value - 273.15
    in_kelvin = unit == "C" and least <= kelvin <= largest
    remedy = f"if {value:g} K are meant, write {kelvin:.4g}" if in_kelvin else "fix it"
    return f"must be from {least:g} to {largest:g} {unit}; {remedy}"


def number(least: float, largest: float, unit: str) -> Callable[[str], float]:
    """Reader of a number in a unit, within its limits."""
    fault = partial(_range_fault, least=least, largest=largest, unit=unit)
    return lambda text: plain_number(text, unit, fault)


def count(text: str, least: int = 3, largest: int = 500) -> int:
    """A whole number of rolling elements. Raises MethodError."""

    def fault(value: float) -> str | None:
        valid = value.is_integer() and least <= value <= largest
        return None if valid else f"must be a whole number from {least} to {largest}; fix it"

    return int(plain_number(text, fault=fault))


def roller_size(text: str) -> tuple[float, float]:
    """Diameter and length of a roller [mm] from "7x7" and like spellings. Raises MethodError."""
    if comma := comma_fault(text, roller_size):
        raise MethodError(comma)
    match = ROLLER.fullmatch(text)
    try:
        diameter, length = (float(part) for part in match.groups()) if match else (math.nan, math.nan)
    except ValueError:
        diameter = length = math.nan
    if math.isnan(diameter):
        raise MethodError('is not a diameter x length in mm; write 7x7, or "7 x 7" in quotes')
    for what, value, limits in (("diameter", diameter, ROLLER_DIAMETERS), ("length", length, ROLLER_LENGTHS)):
        if fault := _range_fault(value, *limits, "mm"):
            raise MethodError(f"its {what} {fault}")
    return diameter, length


def clearance_of(text: str) -> str | float:
    """A clearance class as the tables name it, or a diametral clearance [mm]. Raises MethodError."""
    if (name := text.strip().upper()) in CLEARANCE_CLASSES:
        return name

    def fault(value: float) -> str | None:
        sentence = _range_fault(value, *CLEARANCE_LIMITS, "mm")
        um = f"if {value:g} um are meant, write {1e-3 * value:g}"
        return sentence.replace("fix it", um) if sentence and 2.0 < value <= 2000.0 else sentence

    try:
        return plain_number(text, "mm", fault)
    except MethodError as error:
        if not str(error).startswith("is not a number"):
            raise
        classes = ", ".join(CLEARANCE_CLASSES)
        raise MethodError(f"is not a clearance class; choose one of {classes}, or write millimetres, as 0.02") from None


def conformity_of(text: str) -> tuple[float, float]:
    """Radii of the inner and the outer groove over the ball's diameter, from one number or two with a slash. Raises MethodError."""
    least, largest = CONFORMITIES
    words = f"must be groove radius over ball diameter, from {least} to {largest}; write 0.52, or 0.515/0.525 for inner and outer"
    parts = text.split("/")
    factors = [plain_number(part, fault=lambda value: None if least <= value <= largest else words) for part in parts]
    if len(factors) > 2:
        raise MethodError(words)
    return factors[0], factors[-1]


def choice(refusal: str, *names: str) -> Callable[[str], str]:
    """Reader of one of the names, however it is written."""

    def read(text: str) -> str:
        name = text.strip().lower()
        if (name := name.replace("-", "_")) not in names:
            raise MethodError(f"{refusal}; choose one of {', '.join(names)}")
        return name

    return read


MILLIMETRES, CELSIUS = partial(number, unit="mm"), number(-60.0, 220.0, "C")
guidance_of = choice("guides no cage", "outer", "inner", "roller")
cage_material_of = choice("is not a known material", *MATERIALS, POLYAMIDE_NAME)
supply_of = choice("is not a known lubrication method", *SUPPLIES)


def option(
    metavar: str, help: str, default: str | bool, reader: Callable[[str], Any] = str, key: str = "", **more: str
) -> Any:
    """Entry of the table: metavar, help, the value without the option, what reads its text, and the key of the scene that takes it.

    ``remedy``: what to write where it is missing. ``preset``: its text where it is left out.
    """
    return field(default=None, metadata={"option": valued(metavar, help, default), "reader": reader, "key": key} | more)


@dataclass
class Options:
    """What the texts of options say: None of what is left out, or refused by a sentence in ``faults``. ``texts``: by option, "--pitch"."""

    texts: Mapping[str, str | None]
    # fmt: off
    rollers: int | None = option("Z", "Number of rollers.", OF_OWN, count, remedy="write the number of rollers, as 16")
    roller: tuple[float, float] | None = option(
        "DxL", "Diameter x length of a roller in mm: 7x7.", OF_OWN, roller_size,
        remedy="write diameter x length of a roller in mm, as 7x7")
    balls: int | None = option("Z", "Number of balls.", OF_OWN, count, remedy="write the number of balls, as 16")
    ball: float | None = option(
        "MM", "Diameter of a ball.", OF_OWN, MILLIMETRES(0.5, 200.0), remedy="write the diameter of a ball in mm, as 9.525")
    pitch: float | None = option(
        "MM", "Diameter of the circle through the centres of rollers or balls.", OF_OWN, MILLIMETRES(2.0, 1200.0),
        remedy="write the diameter of the circle through the centres in mm, as 60")
    contact_angle: float | None = option("DEG", "Contact angle of the balls.", OF_OWN, number(0.0, 85.0, "degrees"))
    conformity: tuple[float, float] | None = option(
        "SHARE", "Groove radius over ball diameter, or INNER/OUTER: 0.515/0.525.", "0.52/0.53, only with own", conformity_of)
    speed: float | None = option(
        "RPM", "Speed of the inner ring.", "half the reference speed", number(-1e6, 1e6, "rpm"), "operation.inner_speed_rpm")
    load: float | None = option("N", "Radial load.", "0.1 C", number(0.0, 1e7, "N"), "operation.radial_load_N")
    preload: float | None = option(
        "N", "Axial preload of a ball bearing.", "loads half of the balls", number(-1e8, 1e8, "N"), "operation.preload_N")
    oil: NamedOil = option(  # noqa: RUF009
        "NAME", 'Lubricant: "ISO VG 32 PAO", "grease VG 100", 23699 or "Jet Oil II".', True, oil_named, preset=OIL)
    temperature: float | None = option(
        "C", "Oil temperature.", f"{TEMPERATURE_C:g}, or by the heat balance of --ambient", CELSIUS, "lubricant.temperature_C")
    oil_flow: float | None = option(
        "L_MIN", "Oil flow in L/min; a heat balance computes the temperatures.", "no flow", number(1e-4, 1e3, "L/min"),
        "lubricant.oil_flow_l_min")
    oil_inlet: float | None = option(
        "C", "Oil inlet temperature.", "no flow", CELSIUS, "lubricant.oil_inlet_temperature_C")
    ambient: float | None = option(
        "C", "Ambient temperature of housing and shaft; writes the heat balance.", "20 with --oil-flow", CELSIUS, "thermal.ambient_C")
    clearance: str | float | None = option(
        "CLASS|MM", "Clearance class C2, CN, C3, C4 or C5, or diametral clearance in mm.", "of DESIGNATION, otherwise CN", clearance_of, "bearing.radial_clearance_mm")
    lubrication: str | None = option(
        "HOW", "Lubrication method: bath, drop, jet, oil_air or grease.", "bath; grease if --oil is one, jet with --oil-flow", supply_of)
    guidance: str | None = option(
        "PART", "Part that guides the cage: outer, inner or roller.", "of DESIGNATION, otherwise outer", guidance_of)
    cage_material: str | None = option(
        "NAME", "Material of the cage: brass, peek, polyamide.", "of DESIGNATION, otherwise brass", cage_material_of)
    bore: float | None = option("MM", "Bore, if the bearing is not in the table.", LISTED, MILLIMETRES(1.0, 2000.0))
    outside: float | None = option("MM", "Outside diameter.", LISTED, MILLIMETRES(2.0, 4000.0))
    width: float | None = option("MM", "Width.", LISTED, MILLIMETRES(0.5, 1000.0))
    shaft: str | None = option(
        "CLASS", "Tolerance class of the shaft, such as k5. Writes the table mounting.", "not mounted", str, "mounting.inner_interference_um")
    housing: str | None = option(
        "CLASS", "Tolerance class of the housing, such as H7. Writes the table mounting.", "not mounted", str, "mounting.outer_interference_um")
    # fmt: on
    faults: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        for entry in TABLE.values():
            setattr(self, entry.name, self.read(dashed(entry.name), entry.metadata["reader"]))

    def __getitem__(self, name: str) -> str | None:
        return self.texts.get(name)

    def typed(self, *names: str) -> list[str]:
        """Those of the options that are typed, with their values: "--pitch 60"."""
        return [self.words(name) for name in names if self[name] is not None]

    def words(self, name: str) -> str:
        """An option with its value on one line."""
        return f"{name} {one_line(self[name] or '', LONGEST_NAME)}".strip()

    def note(self, sentence: str) -> None:
        """Note a fault, once however often it shows."""
        if sentence not in self.faults:
            self.faults.append(sentence)

    def fault(self, name: str, sentence: str) -> None:
        """Note what is wrong with an option."""
        self.note(f"{self.words(name)}: {sentence}")

    def read(self, name: str, reader: Callable[[str], Value]) -> Value | None:
        """What a reader makes of an option; None where it is left out, or refused by a MethodError, which is noted."""
        try:
            return None if (text := self[name]) is None else reader(text)
        except MethodError as error:
            self.fault(name, str(error))
            return None

    def require(self, *names: str) -> None:
        """Note what is missing."""
        for name in names:
            if self[name] is None:
                self.fault(name, f"missing; {TABLE[name].metadata['remedy']}")

    @property
    def heat(self) -> list[str]:
        """Options that ask for a heat balance, with their values."""
        return self.typed(*HEAT)

    @property
    def mounted(self) -> list[str]:
        """Options that write the table mounting, with their values."""
        return self.typed("--shaft", "--housing", *HEAT)

    @property
    def supply(self) -> str:
        """How the bearing gets its oil, as typed or as the oil says."""
        usual = "grease" if self.oil and self.oil.grease else "bath" if self["--oil-flow"] is None else "jet"
        return self.lubrication or usual

    @property
    def oil_temperature(self) -> float | None:
        """Of the oil [C]; None where a heat balance computes it."""
        return None if self.heat else TEMPERATURE_C if self.temperature is None else self.temperature

    def check_kind(self, rollers: bool) -> None:
        """Note options that this kind of bearing has no use for, and options that contradict each other."""
        kind, alien = ("ball", OF_BALLS) if rollers else ("cylindrical roller", OF_ROLLERS)
        for words in self.typed(*(name for name in alien if not (self.heat and name == "--lubrication"))):
            self.note(f"{words}: is one of {kind} bearings; leave it out")
        if rollers and self.speed is not None and abs(self.speed) < SLOWEST_RPM:
            self.fault("--speed", f"a run is counted in shaft turns; give at least {SLOWEST_RPM:g}")
        if (rollers or self.heat) and self.oil and self.lubrication:
            self._check_supply(self.lubrication, self.oil.grease)
        if self.heat:
            self._check_heat()

    def _check_supply(self, supply: str, grease: bool) -> None:
        oil = self.words("--oil") if self["--oil"] else f"--oil {OIL}"
        if grease and supply != "grease":
            self.fault("--lubrication", f"contradicts the grease of {oil}; leave one out")
        elif supply == "grease" and not grease:
            self.fault("--lubrication", f'{oil} is not a grease; write --oil "grease VG 100" with its base oil')

    def _check_heat(self) -> None:
        flow, inlet = self["--oil-flow"], self["--oil-inlet"]
        if flow is None and inlet is not None:
            self.fault("--oil-inlet", "has no effect without a flow; add --oil-flow in L/min, as 0.4, or leave it out")
        if flow is not None and inlet is None:
            self.fault("--oil-flow", "needs the temperature at which the oil flows in; add --oil-inlet in C, as 60")
        if self["--temperature"] is not None:
            self.fault("--temperature", f"{' '.join(self.heat)} computes the temperatures; leave it out")
        if flow is not None and self.supply == "grease":
            self.fault("--oil-flow", "contradicts a grease, which does not flow; leave one out")
        if flow is None and self.supply == "jet":
            self.fault("--lubrication", "with --ambient it needs --oil-flow in L/min and --oil-inlet in C; add them")

    def of_scene(self, fault: str) -> str:
        """A fault of the scene as one of the option that its key comes from, where that was typed."""
        match = KEYED.fullmatch(fault)
        key, sentence = match.groups() if match else ("", "")
        if key in SEIZED_KEYS and (classes := " ".join(self.typed("--shaft", "--housing"))):
            return f"{classes}: {key}: {sentence}; leave the classes out, or widen it in a scene without them and add [mounting]"
        usual = next((name for name, entry in TABLE.items() if key and entry.metadata["key"] == key), "")
        name, sentence = ESTIMATED_KEYS.get(key, (usual, sentence))
        if name == "--clearance" and self[name] is None:
            return f"{name}: missing; the usual class: {sentence.replace('check its unit', 'write it in mm, as 0.01')}"
        return fault if self[name] is None else f"{self.words(name)}: {sentence}"


def dashed(name: str) -> str:
    """The option of a field."""
    return f"--{name.replace('_', '-')}"


# The fields of the options, by option.
TABLE = {dashed(entry.name): entry for entry in fields(Options) if entry.metadata}
# Estimated clearances that heat and rotation may take away where the bearing is mounted.
SEIZED_KEYS = ("cage.guide_clearance_mm", "cage.pocket_radial_clearance_mm")
# Options that an estimated key comes from, with what to say of it.
ESTIMATED_KEYS = {
    "model.pocket_bar_stiffness_N_m": (
        "--rollers",
        "leaves bars of a cage that are too slender for such rollers; take fewer or shorter ones",
    ),
    "cage.side_ring_width_mm": ("--width", "leaves side rings of a cage out of proportion to such rollers; narrow it"),
}
# A fault of a key of the scene: source, key, value, what is wrong.
KEYED = re.compile(r"[^=]*: ([\w.]+) = [^:]*: (.*)")
