"""The duty of a study as text."""

import json
from collections.abc import Sequence

from rbdyn.scene.duty import DutyPoint

POINT = """[[duty]]
name = {name}
share = {share!r} # {unit}
set = {set}
"""


def _quoted(value: str | list[str]) -> str:
    """A value in TOML, without the characters that have a meaning in a template."""
    text = json.dumps(value, ensure_ascii=False)
    return "".join(f"\\u{ord(character):04x}" if character in "{}#" else character for character in text)


def duty_text(points: Sequence[DutyPoint], hours: bool) -> str:
    """The [[duty]] tables of a study; ``hours``: whether shares are hours."""
    unit = "h" if hours else "of the time"
    return "\n".join(
        POINT.format(name=_quoted(point.name), share=point.share, unit=unit, set=_quoted(point.set)) for point in points
    )
