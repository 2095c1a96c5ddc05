"""Commented TOML from a template whose comments stand behind the keys."""

import string
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

# Where a comment starts beside a key.
COLUMN = 35


def filled(template: str, values: Mapping[str, Any]) -> str:
    """The template with its ``{names}`` filled in, comments in a column.

    A line that asks for a value of None is left out, so is a table without keys, so is an empty comment.
    """
    lines = [_filled(line, values) for line in template.splitlines() if _known(line, values)]
    full = (line for line, after in pairwise([*lines, ""]) if not (line.startswith("[") and not after))
    return "\n".join(full).replace("\n\n\n", "\n\n")


def _known(line: str, values: Mapping[str, Any]) -> bool:
    return all(values[name] is not None for _, name, _, _ in string.Formatter().parse(line) if name)


def _filled(line: str, values: Mapping[str, Any]) -> str:
    given, _, why = (part.format_map(values) for part in line.partition(" # "))
    return f"{given:<{COLUMN}} # {why}" if why else given
