"""Rolling bearings in REXS files (FVA, versions 1.x and 2.0), as designation and options of ``rbdyn new``.

A file is a list of components with attributes, and of relations between them. Detailed geometry is taken before catalogue values.
"""

import math
import re
import xml.etree.ElementTree as Tree
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from rbdyn.base.faults import LONGEST_NAME, InputError, one_line, read_bytes
from rbdyn.base.records import Record
from rbdyn.base.tables.sheet import is_number
from rbdyn.properties.oils import GRADES

SUFFIX = ".rexs"
MOST_BYTES = 100_000_000
BEARINGS = ("rolling_bearing_with_detailed_geometry", "rolling_bearing_with_catalog_geometry")
ROLLERS = ("cylindrical_roller", "radial_roller")
BALLS = ("grooved_ball", "angular_contact_ball")
OTHERS = ("tapered", "taper", "spherical", "barrel", "toroidal")
# Factors to the units of the options, by the unit of the file.
UNITS = {
    "mm": 1.0,
    "mum": 1e-3,
    "1 / min": 1.0,
    "N": 1.0,
    "kN": 1e3,
    "C": 1.0,
    "°C": 1.0,
    "deg": 1.0,
    "°": 1.0,
    "l / min": 1.0,
    "none": 1.0,
}
SUPPLY = {
    "circulating_oil": "jet",
    "oil_injection": "jet",
    "oil_bath": "bath",
    "oil_spot": "drop",
    "oil_air": "oil_air",
    "grease": "grease",
}
# Attributes that are options of a bearing, by their names in 2.0 and 1.x.
SIZES = {"--bore": ("inner_diameter",), "--outside": ("outer_diameter",), "--width": ("width",)}
POINT = {
    "--speed": ("speed_inner_ring",),
    "--temperature": ("temperature_lubricant",),
    "--oil-flow": ("lubricant_flow_through_bearing",),
}
# Roles of components that belong to a bearing, the shaft in its bore among them.
BEARING_ROLES = ("part", "inner_part")
NAMES = ("catalogue_designation", "name")
COUNT, CIRCLE = "number_of_rolling_elements", "reference_diameter_rolling_bearing"
VISCOSITY = "viscosity_at_40_degree_celsius"
# Width of the viscosity classes of ISO 3448.
CLASS_WIDTH = 0.1
FORCES = ("force_acting_on_inner_component_v", "force_acting_on_inner_component_w")
# Attributes of a bearing that say where and how it stands, not what it is.
PLACES = re.compile(
    r"name|.*vector|.*reference_component.*|.*coordinate.*|.*date|.*number|version|display_color|manufacturer|data_source|bearing_type"
)

# Values of attributes with their units.
Attributes = Mapping[str, tuple[str, float | str | None]]


class Component(Record):
    """A component of a file: its ``number`` there, ``name``, ``kind``, and each attribute with its unit and text."""

    number: str
    name: str
    kind: str
    attributes: Mapping[str, tuple[str, str]]

    def text(self, *names: str) -> str | None:
        """Text of the first attribute of these names that has one."""
        texts = (self.attributes.get(name, ("", ""))[1] for name in names)
        return next(filter(None, texts), None)

    def number_of(self, *names: str) -> float | None:
        """Number of the first attribute of these names that has one, in the unit of an option; None for 0, which means unknown."""
        for name in names:
            unit, text = self.attributes.get(name, ("", ""))
            if is_number(text) and unit in UNITS and (value := float(text) * UNITS[unit]) and math.isfinite(value):
                return value
        return None


class RexsBearing(NamedTuple):
    """A bearing of a file: ``words`` and ``options`` for ``rbdyn new``, names of attributes ``taken`` and ``unread``."""

    title: str
    words: str
    options: Mapping[str, str]
    taken: Sequence[str]
    unread: Sequence[str]

    @property
    def basic(self) -> str:
        """The basic designation that the words begin with: '6305' of '6305-2Z', 'NUP204' of 'NUP204-E-XL-TVP2'."""
        match = re.match(r"\s*(?:[A-Za-z]{1,3}\s?)?\d{3,5}", self.words)
        return match[0].strip() if match else self.words


def is_rexs(words: str) -> bool:
    """Whether the words in place of a designation name a REXS file."""
    return words.strip().lower().endswith(SUFFIX)


def read_rexs(path: Path, bearing: str | None = None) -> RexsBearing:
    """The bearing of a file, by its number or name where there are several.

    Raises InputError for a file that is none, has no bearing or several without a choice, and for a bearing of another kind.
    """
    components, inside = _components(path)
    found = [component for component in components.values() if component.kind in BEARINGS]
    listed = ", ".join(
        f"{component.number} ({component.name or component.text('name', 'catalogue_designation')})"
        for component in found
    )
    if not found:
        raise InputError(f"{path}: has no rolling bearing; export the bearings of the gear unit too")
    if bearing is not None:
        chosen = [component for component in found if bearing in (component.number, component.name)]
        if not chosen:
            raise InputError(f"--bearing {one_line(bearing, LONGEST_NAME)}: is none of {path}; choose one of {listed}")
    elif len(found) > 1:
        raise InputError(f"{path}: has {len(found)} bearings; choose one by --bearing: {listed}")
    else:
        chosen = found
    parts = [components[number] for number in inside.get(chosen[0].number, ()) if number in components]
    oils = [component for component in components.values() if component.kind == "lubricant"]
    # Parts of the parts: rolling elements of a row.
    smaller = [components[number] for part in parts for number in inside.get(part.number, ()) if number in components]
    return _read(path, chosen[0], [*parts, *smaller, *(oils if len(oils) == 1 else ())])


def _components(path: Path) -> tuple[dict[str, Component], dict[str, list[str]]]:
    """Components by number, and numbers of the parts of each. Raises InputError for what is no REXS."""
    data = read_bytes(path)
    try:
        if len(data) > MOST_BYTES or b"<!ENTITY" in data:
            raise ValueError("too large, or with entities")
        root = Tree.fromstring(data)
    except (Tree.ParseError, ValueError):
        raise InputError(f"{path}: no REXS file, or one with entities; export it again as XML") from None
    if root.tag.rpartition("}")[2] != "model":
        raise InputError(
            f"{path}: no REXS file, since it begins with <{one_line(root.tag, LONGEST_NAME)}>; name another one"
        )
    components = {}
    for element in root.iter():
        if element.tag.rpartition("}")[2] == "component":
            attributes = {
                item.get("id", ""): (item.get("unit", "none"), (item.text or "").strip())
                for item in element
                if item.tag.rpartition("}")[2] == "attribute"
            }
            number = element.get("id", "")
            components[number] = Component(number, element.get("name", ""), element.get("type", ""), attributes)
    inside: dict[str, list[str]] = {}
    for relation in root.iter():
        if relation.tag.rpartition("}")[2] == "relation":
            refs = {ref.get("role", ""): ref.get("id", "") for ref in relation}
            for role, number in refs.items():
                if role in BEARING_ROLES:
                    inside.setdefault(refs.get("assembly", ""), []).append(number)
    return components, inside


class _Options:
    """Options that are collected, with the names of the attributes that gave them."""

    def __init__(self) -> None:
        self.texts, self.taken = dict[str, str](), list[str]()

    def take(self, option: str, owner: Component | None, *names: str, write: str = "{:.10g}") -> None:
        """Take an option from the first of these attributes of a component that has a number."""
        value = None if owner is None else owner.number_of(*names)
        if value is not None and owner is not None:
            self.put(option, write.format(value), *filter(owner.text, names))

    def put(self, option: str, text: str, *names: str) -> None:
        """Put an option that these attributes give."""
        self.texts[option] = text
        self.taken += names


def _read(path: Path, bearing: Component, parts: Sequence[Component]) -> RexsBearing:
    kind = bearing.text("bearing_type") or ""
    title = f"bearing {bearing.number}{f' ({bearing.name})' if bearing.name else ''}"
    rollers = any(name in kind for name in ROLLERS) and not any(other in kind for other in OTHERS)
    if kind.startswith("axial") or not (rollers or any(name in kind for name in BALLS)):
        words = kind.replace("_", " ") or "bearing of unknown type"
        raise InputError(f"{path}: {title} is a {words}; rbdyn reads cylindrical roller and ball bearings")
    by_kind = {part.kind: part for part in reversed(parts)}
    options = _Options()
    words = "own" if _interior(options, by_kind, rollers) else bearing.text(*NAMES) or bearing.name
    options.taken += [] if words == "own" else [name for name in NAMES if bearing.text(name)][:1]
    _point(options, bearing, by_kind)
    for option, names in SIZES.items():
        options.take(option, bearing, *names)
    unread = [
        name
        for name, (_, text) in bearing.attributes.items()
        if text and name not in options.taken and not PLACES.fullmatch(name)
    ]
    return RexsBearing(f"{path.name}, {title}", words, options.texts, options.taken, unread)


def _interior(options: _Options, parts: Mapping[str, Component], rollers: bool) -> bool:
    """Take number, size and circle of the rolling elements; whether all of them are there."""
    row, element = parts.get("rolling_bearing_row"), parts.get("rolling_element")
    if row is None or element is None:
        return False
    diameter, length = (element.number_of(f"{name}_of_rolling_element") for name in ("diameter", "length"))
    if not (diameter and row.number_of(COUNT) and row.number_of(CIRCLE)):
        return False
    options.take("--rollers" if rollers else "--balls", row, COUNT, write="{:.0f}")
    options.take("--pitch", row, CIRCLE)
    if rollers:
        names = "diameter_of_rolling_element", "length_of_rolling_element"
        options.put("--roller", f"{diameter:.10g}x{length or diameter:.10g}", *names)
    else:
        options.take("--ball", element, "diameter_of_rolling_element")
        options.take("--contact-angle", row, "pressure_angle")
    return True


def _point(options: _Options, bearing: Component, parts: Mapping[str, Component]) -> None:
    """Take speed, load, temperature, clearance, seats, oil and its supply."""
    for option, names in POINT.items():
        options.take(option, bearing, *names)
    if "--speed" not in options.texts:
        options.take("--speed", parts.get("shaft"), "rotational_speed")
    forces = [bearing.number_of(name) for name in FORCES]
    if any(force is not None for force in forces):
        options.put("--load", f"{math.hypot(*(force or 0.0 for force in forces)):.10g}", *FORCES)
    if (grade := bearing.text("radial_clearance_class")) is not None:
        options.put("--clearance", {"C0": "CN"}.get(grade, grade), "radial_clearance_class")
    options.take("--clearance", bearing, "radial_bearing_clearance", "radial_backlash")
    for option, name in {"--shaft": "shaft_tolerance_class", "--housing": "casing_bore_tolerance_class"}.items():
        if zone := bearing.text(name):
            options.put(option, zone, name)
    if supply := SUPPLY.get(bearing.text("lubrication_type") or ""):
        options.put("--lubrication", supply, "lubrication_type")
    if oil := _oil(parts.get("lubricant")):
        options.put("--oil", oil, VISCOSITY)


def _oil(lubricant: Component | None) -> str | None:
    """Name of an oil of a viscosity class of ISO 3448, which its viscosity at 40 C is within 10 % of; None for any other."""
    if lubricant is None or lubricant.text("kind") == "grease":
        return None
    unit, text = lubricant.attributes.get(VISCOSITY, ("", ""))
    viscosity = float(text) if unit == "mm^2 / s" and is_number(text) else 0.0
    grade = next((grade for grade in GRADES if abs(viscosity / grade - 1.0) <= CLASS_WIDTH), None)
    base = " ".join(lubricant.text(name) or "" for name in lubricant.attributes if name.startswith("lubricant_type"))
    return None if grade is None else f"ISO VG {grade}{' PAO' if 'pao' in base or 'polyalfaolefin' in base else ''}"


def write_rexs(
    path: Path, name: str, bearing: Attributes, row: Attributes, element: Attributes, lubricant: Attributes
) -> None:
    """Write a REXS 2.0 file of one bearing with detailed geometry. Values that are None are left out."""
    from importlib.metadata import version

    model = Tree.Element("model", applicationId="rbdyn", applicationVersion=version("rbdyn"), version="2.0")
    relations, components = Tree.SubElement(model, "relations"), Tree.SubElement(model, "components")
    parts = {"rolling_bearing_row": row, "rolling_element": element, "lubricant": lubricant}
    kinds = {"rolling_bearing_with_detailed_geometry": bearing, **parts}
    for number, (kind, attributes) in enumerate(kinds.items(), 1):
        component = Tree.SubElement(
            components, "component", id=str(number), name=name if number == 1 else "", type=kind
        )
        for key, (unit, value) in attributes.items():
            if value is not None:
                text = value if isinstance(value, str) else f"{value:.10g}"
                Tree.SubElement(component, "attribute", id=key, unit=unit).text = text
    for assembly, part in ((1, 2), (2, 3)):
        relation = Tree.SubElement(relations, "relation", id=str(10 + assembly), type="assembly")
        Tree.SubElement(relation, "ref", id=str(assembly), role="assembly")
        Tree.SubElement(relation, "ref", id=str(part), role="part")
    Tree.indent(model)
    path.write_bytes(Tree.tostring(model, encoding="utf-8", xml_declaration=True))
