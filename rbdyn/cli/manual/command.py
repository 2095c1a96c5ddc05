"""The command ``rbdyn manual``."""

from pathlib import Path
from typing import Annotated

import typer

from rbdyn.base.options import Json, folder_option
from rbdyn.base.terminal import guarded, hand_over

# Entry points by which packages that stand on this one add their part: functions that return a ``Part``.
GROUP = "rbdyn.manual"


def manual(
    context: typer.Context,
    out: Annotated[Path, folder_option("Write manual.html here.")] = Path("manual"),
    as_json: Json = False,
) -> None:
    """Write the manual as one page that opens from disk: own bearing, keys, commands, equations, what is left out."""
    with guarded(as_json):
        from importlib.metadata import entry_points

        from rbdyn.cli.keys import kinds
        from rbdyn.cli.manual.page import page
        from rbdyn.result import whole_file
        from rbdyn.scene.keys import Part

        out.mkdir(parents=True, exist_ok=True)  # before the page, which takes seconds
        own = Part("rbdyn", Path(__file__).with_name("prose"), context.find_root().command, kinds())
        text = page([own, *(each.load()() for each in sorted(entry_points(group=GROUP)))])
        path = out / "manual.html"
        with whole_file(path) as new:
            new.write_text(text, encoding="utf-8")
        hand_over(lambda: {"status": "ok", "page": str(path)}, as_json, lambda: None, out, [path.name])
