"""The duty of a study as text."""

import json
from collections.abc import Sequence

from rbdyn.scene.duty import DutyPoint, shares_of_time

POINT = """[[duty]]
name = {name}
share = {share!r} # of the time
set = {set}
"""


def _quoted(value: str | list[str]) -> str:
    """A value in TOML, without the characters that have a meaning in a template."""
    text = json.dumps(value, ensure_ascii=False)
    return "".join(f"\\u{ord(character):04x}" if character in "{}#" else character for character in text)


def duty_text(points: Sequence[DutyPoint]) -> str:
    """The [[duty]] tables of a study, with shares that sum to 1."""
    return "\n".join(
        POINT.format(name=_quoted(point.name), share=share, set=_quoted(point.set))
        for point, share in zip(points, shares_of_time(points), strict=True)
    )
