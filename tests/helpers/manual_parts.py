"""The manual as it is installed: the parts of both floors, found by what pyproject.toml declares."""

import functools
import tomllib
from importlib.metadata import EntryPoint
from pathlib import Path

from typer.main import get_command

from rbdyn.cli import manual
from rbdyn.cli.app import app
from rbdyn.cli.manual import kinds
from rbdyn.cli.manual.page import drawings, page
from rbdyn.scene.keys import Part

ROOT = Path(__file__).parents[2]


def declared() -> dict[str, str]:
    """Entry points of the manual."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return project["entry-points"][manual.GROUP]


def parts() -> list[Part]:
    """Parts in the order of the page."""
    own = Part("rbdyn", Path(manual.__file__).with_name("prose"), get_command(app), kinds(), drawings, manual.tables)
    return [own, *(EntryPoint(name, value, manual.GROUP).load()() for name, value in declared().items())]


@functools.cache
def whole_page() -> str:
    """The page, made once a process."""
    return page(parts())
