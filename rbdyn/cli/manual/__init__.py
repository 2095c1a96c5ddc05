"""``rbdyn keys``, every key of a scene, and ``rbdyn manual``, one page that opens from disk.

- ``prose``: the chapters in Markdown, in the order of their file names
- ``page``: chapters, keys, commands, equations and library as HTML, from docstrings and from the commands themselves; sketches of
  clearances, axes and signs, which a chapter names as a picture

Packages that build on ``rbdyn`` add their part by an entry point; their prose is in them.
"""

from pathlib import Path
from typing import Annotated, Any

import typer
from pydantic import BaseModel

from rbdyn.base.blocks import Column, Sheet
from rbdyn.base.command import Force, Json, folder_option, guarded, hand_over
from rbdyn.base.folder import output_folder
from rbdyn.scene.keys import AsSchema, Word, run

# Entry points of such packages: functions that return a ``Part``.
GROUP = "rbdyn.manual"
PAGE = "manual.html"


def manual(
    context: typer.Context,
    out: Annotated[Path, folder_option("Write manual.html to this folder.", True)] = Path("manual"),
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write the manual as one HTML file that works offline."""
    with guarded(as_json), output_folder(out, "rbdyn manual", (PAGE,), force=force) as folder:
        from importlib.metadata import entry_points

        from rbdyn.cli.manual.page import drawings, page
        from rbdyn.scene.keys import Part

        folder.claim()
        part = Part("rbdyn", Path(__file__).with_name("prose"), context.find_root().command, kinds(), drawings, tables)
        text = page([part, *(entry.load()() for entry in sorted(entry_points(group=GROUP)))])
        folder.write(lambda stage: (stage / PAGE).write_text(text, encoding="utf-8"))
        hand_over(lambda: {"status": "ok", "page": str(out / PAGE)}, as_json, lambda: None, out, [PAGE])


def describe_keys(word: Word = None, as_schema: AsSchema = False, as_json: Json = False) -> None:
    """Explain every key of a scene file: meaning, unit, range and default."""
    with guarded(as_json):
        run(kinds(), word, as_schema, as_json)


def kinds() -> dict[str, type[BaseModel]]:
    """The kinds of scenes."""
    from rbdyn.scene import Scene
    from rbdyn.scene.ball import DoubleDeckerScene, SingleRowScene

    return {"roller bearing": Scene, "ball bearing": SingleRowScene, "double-decker": DoubleDeckerScene}


def tables() -> dict[str, list[Sheet[Any]]]:
    """The files of tables that the commands write; those of ``rbdyn accuracy`` have the columns that its report explains."""
    from rbdyn.cli.stiffness import stiffness_sheet
    from rbdyn.comparison import difference_sheet, input_sheet
    from rbdyn.dynamics.duty_simulation import points_sheet
    from rbdyn.dynamics.figures import FIGURES
    from rbdyn.dynamics.motion import history_sheet
    from rbdyn.dynamics.slip_map import map_sheet
    from rbdyn.life import life_sheet
    from rbdyn.quasistatic.result import ball_sheet
    from rbdyn.quasistatic.runout.lots import race_sheet
    from rbdyn.quasistatic.runout.turn import RUNOUT
    from rbdyn.quasistatic.sweep import SWEEPS
    from rbdyn.result import figure_sheet, start_sheet

    figures = ("{figure}",)
    named = [Column[Any](figure.key, meaning=figure.meaning) for figure in FIGURES]
    sheets: list[Sheet[Any]] = [
        figure_sheet({}), history_sheet(("{j}",)), start_sheet(), map_sheet((), figures), life_sheet(()), points_sheet((), figures), stiffness_sheet(()), input_sheet(()),
        difference_sheet({}), ball_sheet({}), SWEEPS, RUNOUT, race_sheet(),
    ]  # fmt: skip
    return {
        "Tables of rbdyn": sheets,
        "Results of a roller bearing": [Sheet("", named, (), file="{figure}", content="Results of a run, by name.")],
    }
