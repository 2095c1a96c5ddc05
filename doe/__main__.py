"""``python -m doe``."""

from doe.cli import run

run()
