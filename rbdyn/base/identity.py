"""The identity of a result: its bearing and operating point in words, the date of its run, the version, hashes of its input files.

``identity_of`` makes it of the tables of a resolved scene, as they stand in every record; ``identity_line`` is its sentence for
the first screen, ``identity_table`` its table for a page.
"""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from datetime import date
from pathlib import Path
from types import MappingProxyType
from typing import Any

from rbdyn.base.blocks import Detail, Paragraph, Table
from rbdyn.base.faults import InputError, read_bytes
from rbdyn.base.files import digest_of, version_of
from rbdyn.base.records import Record
from rbdyn.base.words import all_of, quantity

# Digits of a SHA-256 that are shown.
DIGITS = 12
# Words of a bearing by its kind in a scene.
KINDS = {
    "cylindrical_roller": "cylindrical roller bearing",
    "angular_contact_ball": "angular contact ball bearing",
    "deep_groove_ball": "deep groove ball bearing",
    "double_decker_ball": "double-decker ball bearing",
}
# Names of the components of a load.
DIRECTIONS = ("radial", "across", "axial")


class Identity(Record):
    """What a result is about and where it comes from.

    command : such as "rbdyn simulate"
    bearing : its designation, or else its ``drawing``; empty without a scene, as of a dimension chain
    drawing : kind, rolling elements and pitch diameter in words
    point : speeds, loads, oil and its temperature in words
    date : of the run, YYYY-MM-DD
    version : of rbdyn
    files : the first digits of the SHA-256 of each input file, by its name
    """

    command: str
    bearing: str
    drawing: str
    point: str
    date: str
    version: str
    files: dict[str, str]

    @property
    def title(self) -> str:
        """Title of a page: the bearing, or else the first input file, and the command."""
        subject = self.bearing or next(iter(self.files), "")
        return ": ".join(filter(None, (subject[:1].upper() + subject[1:] if self.bearing else subject, self.command)))


def identity_of(
    command: str,
    scene: Mapping[str, Any],
    files: Iterable[Path],
    day: str = "",
    swept: Mapping[str, Sequence[float]] = MappingProxyType({}),
) -> Identity:
    """Identity of a result that is computed now.

    scene : tables of a resolved scene in the form of JSON; empty for a result without a bearing.
    files : input files; one that cannot be read is left out.
    day : date of the run; empty for today.
    swept : values of the dotted keys of the scene over which the results run.
    """
    bearing = scene.get("bearing") or {}
    drawing = drawing_words(bearing) if bearing else ""
    return Identity(
        command=command,
        bearing=bearing.get("designation") or drawing,
        drawing=drawing,
        point=point_words(scene, swept) if scene.get("operation") else "",
        date=day or date.today().isoformat(),
        version=version_of("rbdyn"),
        files=_hashes(files),
    )


def identity_line(identity: Identity, detail: Detail = Detail.LEAST) -> Paragraph:
    """The bearing, its operating point and the date in one line; without a bearing the input files and the date."""
    words = (identity.bearing or ", ".join(identity.files), identity.point, identity.date)
    return Paragraph("; ".join(filter(None, words)), detail=detail)


def identity_table(identity: Identity, detail: Detail = Detail.USUAL) -> Table:
    """All of the identity, a row each."""
    rows = [
        ("bearing", identity.bearing),
        ("drawing", identity.drawing if identity.drawing != identity.bearing else ""),
        ("operating point", identity.point),
        ("command", identity.command),
        ("date of the run", identity.date),
        ("rbdyn", identity.version),
        *((f"SHA-256 of {name}", digits) for name, digits in identity.files.items()),
    ]
    return Table("Identity", ("", ""), [row for row in rows if row[1]], text_columns=(1,), detail=detail)


def drawing_words(bearing: Mapping[str, Any]) -> str:
    """'cylindrical roller bearing, 16 rollers 7 x 7 mm, pitch diameter 60 mm', of the table ``bearing`` of a scene."""
    kind = KINDS.get(str(bearing.get("kind")), "bearing")
    if "rollers" in bearing:
        size = f"{bearing['roller_diameter_mm']:g} x {bearing['roller_length_mm']:g} mm"
        return f"{kind}, {bearing['rollers']} rollers {size}, pitch diameter {bearing['pitch_diameter_mm']:g} mm"
    if "inner" in bearing:
        return f"{kind}, {_balls(bearing['inner'])} inside, {_balls(bearing['outer'])} outside"
    return f"{kind}, {_balls(bearing)}"


def _balls(row: Mapping[str, Any]) -> str:
    """A row of balls in words."""
    words = f"{row['balls']} balls {row['ball_diameter_mm']:g} mm, pitch diameter {row['pitch_diameter_mm']:g} mm"
    angle = row.get("contact_angle_deg")
    return words if angle is None else f"{words}, contact angle {angle:g}°"


def point_words(scene: Mapping[str, Any], swept: Mapping[str, Sequence[float]] = MappingProxyType({})) -> str:
    """'12000 rpm, 2000 N radial, MIL-L-7808 at 100 °C', of the tables of a scene; ``swept`` keys with their range.

    A schedule is named, not listed.
    """
    operation = {key: value for key, value in scene["operation"].items() if f"operation.{key}" not in swept}
    scheduled = operation.get("schedule") or {}
    inner, outer = (operation.get(f"{ring}_speed_rpm") for ring in ("inner", "outer"))
    return ", ".join(
        filter(
            None,
            (
                f"{_number(inner)} rpm" if inner is not None else "",
                f"outer ring {_number(outer)} rpm" if outer else "",
                _loads(operation),
                "speed or load over time by a schedule" if scheduled else "",
                _oil(scene.get("lubricant") or {}, scene.get("thermal")),
                *(_range(key, values) for key, values in swept.items()),
            ),
        )
    )


def _loads(operation: Mapping[str, Any]) -> str:
    """The loads that are not zero, in the order x, y, z; then what is added to them."""
    forces = operation.get("load_N") or (
        operation.get("radial_load_N") or 0.0,
        0.0,
        operation.get("axial_load_N") or 0.0,
    )
    words = [f"{_number(force)} N {name}" for force, name in zip(forces, DIRECTIONS, strict=True) if force]
    if any(operation.get("moment_Nm") or ()):
        words.append("moments of " + all_of(_number(moment) for moment in operation["moment_Nm"]) + " N m")
    if operation.get("rotating_load_N"):
        words.append(f"{_number(operation['rotating_load_N'])} N rotating")
    for key, unit in (("preload_N", "N"), ("preload_um", "µm")):
        if operation.get(key):
            words.append(f"preload {_number(operation[key])} {unit}")
    return ", ".join(words)


def _range(key: str, values: Sequence[float]) -> str:
    """'radial load 60 to 1300 N', of a dotted key."""
    name, unit = quantity(key.rpartition(".")[2])
    ends = " to ".join(dict.fromkeys((_number(min(values)), _number(max(values)))))
    return f"{name} {ends} {unit}".rstrip()


def _oil(lubricant: Mapping[str, Any], thermal: Mapping[str, Any] | None) -> str:
    """The oil and its temperature, or what cools it where a heat balance computes that; empty where the scene has none."""
    if not lubricant:
        return ""
    name = lubricant.get("oil")
    oil = "oil by data sheet" if name in (None, "data_sheet") else str(name)
    if thermal is None:
        return f"{oil} at {_number(lubricant['temperature_C'])} °C"
    flow, inlet = lubricant.get("oil_flow_l_min"), lubricant.get("oil_inlet_temperature_C")
    if flow is None or inlet is None:
        return f"{oil}, heat balance at {_number(thermal['ambient_C'])} °C around"
    return f"{oil}, heat balance with {_number(flow)} L/min at {_number(inlet)} °C"


def _number(value: float) -> str:
    """A number as it was typed, without an exponent."""
    return f"{value:.8g}"


def _hashes(files: Iterable[Path]) -> dict[str, str]:
    """The shortened hash of each file by its name, or by its path where two have one name."""
    hashes: dict[str, str] = {}
    for path in dict.fromkeys(files):
        with suppress(InputError):
            hashes[str(path) if path.name in hashes else path.name] = digest_of(read_bytes(path))[:DIGITS]
    return hashes
