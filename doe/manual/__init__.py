"""What ``doe`` adds to the manual that ``rbdyn manual`` writes: its chapters, which stand next to it, its command, its keys."""

from pathlib import Path

from typer.main import get_command

from doe.cli import app
from doe.commands.keys import kinds
from rbdyn.scene.keys import Part


def part() -> Part:
    """The part that the entry point names."""
    return Part("doe", Path(__file__).parent, get_command(app), kinds())
