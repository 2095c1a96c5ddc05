"""``doe new``."""

import json
import tomllib
from pathlib import Path
from typing import Annotated, Any

import typer

from rbdyn.base.options import Json
from rbdyn.base.terminal import guarded, print_json

# Name of a clearance in tables, its place in the scene, and its step as a share of its value: the axial runs of a rotatable
# design lie 1.7 steps out, and none may touch zero.
CLEARANCES = (
    ("radial_clearance_mm", "bearing", 0.25),
    ("guide_clearance_mm", "cage", 0.3),
    ("pocket_clearance_mm", "cage", 0.2),
    ("pocket_radial_clearance_mm", "cage", 0.25),
)
RESOLUTION_MM, SMALLEST_STEP_MM = 0.001, 0.002
FACTOR = """[[factor]]
name = "{name}"
key = "{table}.{name}"
centre = {centre} # as the scene has it
step = {step:.6g} # {percent:g} % of it
resolution = 0.001 # of the drawing
"""


def new(
    path: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene whose clearances are to be studied.")],
    as_json: Json = False,
) -> None:
    """Write a commented study of a scene's clearances on standard output."""
    with guarded(as_json):
        from doe.study_file import Study
        from doe.study_file.study import StudyFile
        from doe.workflow.whole import check_study
        from rbdyn.base.faults import read_toml, validated
        from rbdyn.base.options import filled
        from rbdyn.scene import Scene, rollers_only

        rollers_only(Scene.load(path))
        template = Path(__file__).with_name("new_study.toml").read_text(encoding="utf-8")
        factors = "\n".join(_factors(read_toml(path)))
        text = filled(template.replace("{factors}", factors), {"quoted": json.dumps(str(path))})
        data = tomllib.loads(text)
        check_study(Study(Path("study.toml"), validated(StudyFile, data, f"study of {path}")))
        if as_json:
            print_json(data)
        else:
            print(text)


def _factors(scene: dict[str, Any]) -> list[str]:
    """A factor a clearance that the scene's file gives and that something reads."""
    landless = scene["cage"]["guidance"] == "roller" or scene.get("model", {}).get("guide_land") == "off"
    found = []
    for name, table, share in CLEARANCES:
        centre = scene[table].get(name)
        if centre is None or (landless and name == "guide_clearance_mm"):
            continue
        step = max(round(share * abs(centre) / RESOLUTION_MM) * RESOLUTION_MM, SMALLEST_STEP_MM)
        found.append(FACTOR.format(name=name, table=table, centre=float(centre), step=step, percent=100.0 * share))
    return found
