"""Drawings of the manual, of the bearings that its pages are about; a roller bearing and a ball bearing of the catalogue."""

import tomllib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rbdyn.draft.options import OIL, TEMPERATURE_C, Options
from rbdyn.draft.text import scene_text
from rbdyn.plots.sketches import Sketch, ball_axes, clearances, roller_axes

if TYPE_CHECKING:
    from rbdyn.scene import Scene

ROLLERS, BALLS = "NU210", "7210B"


def roller_bearing() -> "Scene":
    """The roller bearing that the manual takes from its name to clearances."""
    from rbdyn.scene import Scene

    return Scene.from_dict(scene_of(ROLLERS), ROLLERS)


def drawings(scene: "Scene") -> Mapping[str, Sketch]:
    """The drawings by the names that chapters use; those of rollers are of the scene."""
    from rbdyn.scene.ball import SingleRowScene

    balls = SingleRowScene.from_dict(scene_of(BALLS), BALLS)
    return {"clearances": clearances(scene), "roller_axes": roller_axes(scene), "ball_axes": ball_axes(balls)}


def scene_of(designation: str, options: Mapping[str, str] | None = None) -> dict[str, Any]:
    """The scene that ``rbdyn new`` writes of a designation and options."""
    texts: dict[str, str | None] = {"--oil": OIL, "--temperature": f"{TEMPERATURE_C:g}", **(options or {})}
    return tomllib.loads(scene_text(designation, Options(texts)))
