"""``python -m rbdyn``."""

from rbdyn.cli import run

run()
