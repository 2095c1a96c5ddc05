"""Options of ``rbdyn new`` as they are typed: numbers with their limits, clearances, choices; every fault is one sentence."""

import math
import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, TypeVar

from rbdyn.base.command import comma_fault, plain_number
from rbdyn.base.faults import LONGEST_NAME, MethodError, one_line

if TYPE_CHECKING:
    from rbdyn.cli.new_scene import Heat

Value = TypeVar("Value")
# Limits of a number that is typed, and its unit.
LIMITS = {
    "--speed": (-1e6, 1e6, "rpm"),
    "--load": (0.0, 1e7, "N"),
    "--preload": (-1e8, 1e8, "N"),
    "--temperature": (-60.0, 220.0, "C"),
    "--oil-flow": (1e-4, 1e3, "L/min"),
    "--oil-inlet": (-60.0, 220.0, "C"),
    "--ambient": (-60.0, 220.0, "C"),
    "--bore": (1.0, 2000.0, "mm"),
    "--outside": (2.0, 4000.0, "mm"),
    "--width": (0.5, 1000.0, "mm"),
    "--pitch": (2.0, 1200.0, "mm"),
    "--ball": (0.5, 200.0, "mm"),
    "--contact-angle": (0.0, 85.0, "degrees"),
}
COUNTS = {"--rollers": (3, 500), "--balls": (3, 500)}
ROLLER_DIAMETERS, ROLLER_LENGTHS, CLEARANCES = (1.0, 150.0), (0.5, 400.0), (-0.2, 2.0)
CONFORMITIES = (0.501, 0.7)
ROLLER = re.compile(r"\s*([\d.]+)\s*[xX\u00d7*]\s*([\d.]+)\s*(?:mm)?\s*")
GUIDANCES = ("outer", "inner", "roller")
# Options that keys of the scene come from.
OPTIONS_OF_KEYS = {
    "operation.inner_speed_rpm": "--speed",
    "operation.radial_load_N": "--load",
    "operation.preload_N": "--preload",
    "lubricant.temperature_C": "--temperature",
    "lubricant.oil_flow_l_min": "--oil-flow",
    "lubricant.oil_inlet_temperature_C": "--oil-inlet",
    "thermal.ambient_C": "--ambient",
    "bearing.radial_clearance_mm": "--clearance",
    "mounting.inner_interference_um": "--shaft",
    "mounting.outer_interference_um": "--housing",
}
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
# Options of one kind of bearing, whatever names it.
OF_ROLLERS, OF_BALLS = ("--guidance", "--cage-material", "--lubrication"), ("--preload",)
# Options that write [thermal].
HEAT = "--oil-flow", "--oil-inlet", "--ambient"
SLOWEST_RPM = 0.1
# A fault of a key of the scene: source, key, value, what is wrong.
KEYED = re.compile(r"[^=]*: ([\w.]+) = [^:]*: (.*)")


class Typed:
    """Texts of options by name, None of those left out; reading them gathers ``faults``."""

    def __init__(self, texts: Mapping[str, str | None]) -> None:
        self.texts, self.faults = texts, list[str]()

    def __getitem__(self, option: str) -> str | None:
        return self.texts[option]

    def listing(self, *options: str) -> list[str]:
        """Those of the options that are typed, with their values: "--pitch 60"."""
        return [self.words(option) for option in options if self.texts[option] is not None]

    def words(self, option: str) -> str:
        """An option with its value on one line."""
        return f"{option} {one_line(self.texts[option] or '', LONGEST_NAME)}".strip()

    def note(self, sentence: str) -> None:
        """Note a fault, once however often it shows."""
        if sentence not in self.faults:
            self.faults.append(sentence)

    def fault(self, option: str, sentence: str) -> None:
        """Note what is wrong with an option."""
        self.note(f"{self.words(option)}: {sentence}")

    def read(self, option: str, reader: Callable[[str], Value]) -> Value | None:
        """What a reader makes of an option; None where it is left out, or refused by a MethodError, which is noted."""
        text = self.texts[option]
        if text is None:
            return None
        try:
            return reader(text)
        except MethodError as error:
            self.fault(option, str(error))
            return None

    def number(self, option: str) -> float | None:
        """A number within its limits; None where it is left out or refused."""
        text = self.texts[option]
        if text is None:
            return None
        try:
            value = plain_number(text, LIMITS[option][2], lambda value: _range_fault(value, *LIMITS[option]))
        except MethodError as error:
            self.fault(option, str(error))
            return None
        if (sentence := _range_fault(value, *LIMITS[option])) is None:
            return value
        self.note(f"{option} {value:g}: {sentence}")
        return None

    def read_numbers(self) -> None:
        """Note what is wrong with any number, also one that nothing reads."""
        for option in LIMITS:
            self.number(option)
        for option in COUNTS:
            self.count(option)

    def count(self, option: str) -> int | None:
        """A whole number of rolling elements; None where it is left out or refused."""
        return self.read(option, lambda text: _whole_number(text, *COUNTS[option]))


def _range_fault(value: float, least: float, largest: float, unit: str) -> str | None:
    if not math.isfinite(value):
        return "is not a finite number; write a plain number"
    if least <= value <= largest:
        return None
    kelvin = value - 273.15
    in_kelvin = unit == "C" and least <= kelvin <= largest
    remedy = f"if {value:g} K are meant, write {kelvin:.4g}" if in_kelvin else "fix it"
    return f"must be from {least:g} to {largest:g} {unit}; {remedy}"


def _whole_number(text: str, least: int, largest: int) -> int:
    def fault(value: float) -> str | None:
        whole = value.is_integer() and least <= value <= largest
        return None if whole else f"must be a whole number from {least} to {largest}; fix it"

    value = plain_number(text, fault=fault)
    if sentence := fault(value):
        raise MethodError(sentence)
    return int(value)


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
        raise MethodError('is no diameter x length in mm; write 7x7, or "7 x 7" in quotes')
    for what, value, limits in (("diameter", diameter, ROLLER_DIAMETERS), ("length", length, ROLLER_LENGTHS)):
        if fault := _range_fault(value, *limits, "mm"):
            raise MethodError(f"its {what} {fault}")
    return diameter, length


def clearance_of(text: str) -> str | float:
    """A clearance class as the tables name it, or a diametral clearance [mm]. Raises MethodError."""
    from rbdyn.properties.catalogue import CLEARANCE_CLASSES

    name = text.strip().upper()
    if name in CLEARANCE_CLASSES:
        return name

    def fault(value: float) -> str | None:
        sentence = _range_fault(value, *CLEARANCES, "mm")
        um = f"if {value:g} um are meant, write {1e-3 * value:g}"
        return sentence.replace("fix it", um) if sentence and 2.0 < value <= 2000.0 else sentence

    try:
        value = plain_number(text, "mm", fault)
    except MethodError as error:
        if not str(error).startswith("is no number"):
            raise
        classes = ", ".join(CLEARANCE_CLASSES)
        raise MethodError(f"is no clearance class; choose one of {classes}, or write millimetres, as 0.02") from None
    if sentence := fault(value):
        raise MethodError(sentence)
    return value


def conformity_of(text: str) -> tuple[float, float]:
    """Radii of the inner and the outer groove over the ball's diameter, from one number or two with a slash. Raises MethodError."""
    least, largest = CONFORMITIES
    words = f"must be groove radius over ball diameter, from {least} to {largest}; write 0.52, or 0.515/0.525 for inner and outer"
    parts = text.split("/")
    factors = [plain_number(part, fault=lambda value: None if least <= value <= largest else words) for part in parts]
    if len(factors) > 2 or not all(least <= factor <= largest for factor in factors):
        raise MethodError(words)
    return factors[0], factors[-1]


def supply_of(typed: Typed) -> str:
    """How the bearing gets its oil, as typed or as the oil says; what contradicts the oil is noted."""
    from rbdyn.properties.oils import oil_named
    from rbdyn.scene.lubricant import SUPPLIES

    oil, text = typed.read("--oil", oil_named), typed["--lubrication"]
    usual = "grease" if oil is not None and oil.grease else "bath" if typed["--oil-flow"] is None else "jet"
    if text is None:
        return usual
    supply, name = text.strip().lower().replace("-", "_"), typed.words("--oil")
    if supply not in SUPPLIES:
        typed.fault("--lubrication", f"is no lubrication known here; choose one of {', '.join(SUPPLIES)}")
    elif oil is not None and oil.grease and supply != "grease":
        typed.fault("--lubrication", f"contradicts the grease of {name}; leave one out")
    elif oil is not None and supply == "grease" and not oil.grease:
        typed.fault("--lubrication", f'{name} is no grease; write --oil "grease VG 100" with its base oil')
    return supply


def heat_of(typed: Typed) -> "Heat | None":
    """The heat balance that the options ask for, its contradictions noted; None without one of them."""
    from rbdyn.cli.new_scene import Heat

    if not typed.listing(*HEAT):
        return None
    heat = Heat(*(typed.number(option) for option in HEAT))
    flow, inlet = typed["--oil-flow"], typed["--oil-inlet"]
    if flow is None and inlet is not None:
        typed.fault("--oil-inlet", "has no effect without a flow; add --oil-flow in L/min, as 0.4, or leave it out")
    if flow is not None and inlet is None:
        typed.fault("--oil-flow", "needs the temperature at which the oil flows in; add --oil-inlet in C, as 60")
    if typed["--temperature"] is not None:
        typed.fault("--temperature", f"{' '.join(typed.listing(*HEAT))} computes the temperatures; leave it out")
    supply = supply_of(typed)
    if flow is not None and supply == "grease":
        typed.fault("--oil-flow", "contradicts a grease, which does not flow; leave one out")
    if flow is None and supply == "jet":
        typed.fault("--lubrication", "with --ambient it needs --oil-flow in L/min and --oil-inlet in C; add them")
    return heat


def kind_faults(typed: Typed, rollers: bool) -> None:
    """Note options that this kind of bearing has no use for, and a shaft that stands still or an oil that contradicts its supply."""
    alien: tuple[str, ...] = OF_BALLS if rollers else OF_ROLLERS
    kind = "ball" if rollers else "cylindrical roller"
    if typed.listing(*HEAT):
        alien = tuple(option for option in alien if option != "--lubrication")
    for words in typed.listing(*alien):
        typed.note(f"{words}: is one of {kind} bearings; leave it out")
    speed = typed.number("--speed")
    if rollers and speed is not None and abs(speed) < SLOWEST_RPM:
        typed.note(f"--speed {speed:g}: a run is counted in shaft turns; give at least {SLOWEST_RPM:g}")
    if rollers:
        supply_of(typed)


def typed_fault(typed: Typed, fault: str) -> str:
    """A fault of the scene as one of the option that its key comes from, where that was typed."""
    match = KEYED.fullmatch(fault)
    key, sentence = match.groups() if match else ("", "")
    if key in SEIZED_KEYS and (classes := " ".join(typed.listing("--shaft", "--housing"))):
        return f"{classes}: {key}: {sentence}; leave the classes out, or widen it in a scene without them and add [mounting]"
    option, sentence = ESTIMATED_KEYS.get(key, (OPTIONS_OF_KEYS.get(key), sentence))
    if option == "--clearance" and typed[option] is None:
        return f"{option}: missing; that of the usual class is {sentence.replace('check its unit', 'write it in mm, as 0.01')}"
    return fault if option is None or typed[option] is None else f"{typed.words(option)}: {sentence}"


def guidance_of(text: str) -> str:
    """What guides the cage. Raises MethodError."""
    name = text.strip().lower()
    if name not in GUIDANCES:
        raise MethodError(f"guides no cage; choose one of {', '.join(GUIDANCES)}")
    return name


def cage_material_of(text: str) -> str:
    """Name of a material of a cage. Raises MethodError."""
    from rbdyn.cli.new_scene import POLYAMIDE_NAME
    from rbdyn.properties.materials import MATERIALS

    name = text.strip().lower()
    if name != POLYAMIDE_NAME and name not in MATERIALS:
        raise MethodError(f"is no material known here; choose one of {', '.join([*MATERIALS, POLYAMIDE_NAME])}")
    return name
