"""What one floor of the house adds to the manual."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel


class Part(NamedTuple):
    """A package with its chapters, its command and the kinds of its input files."""

    package: str
    prose: Path  # folder of chapters, NN_name.md
    commands: Any  # group of commands, as typer makes it
    kinds: Mapping[str, type[BaseModel]]
