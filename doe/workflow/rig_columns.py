"""Columns of a rig's table, and the tables of a scene that a calibration reads, as ``doe keys`` lists them.

A row of the table is an operating condition. Further columns are named by keys of the scene, such as operation.inner_speed_rpm.
"""

from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from rbdyn.base.faults import Strict
from rbdyn.base.words import quantity
from rbdyn.dynamics.figures import FIGURES, Figure
from rbdyn.scene.uncertain import Calibrate, Uncertain

Positive = Annotated[float, Field(gt=0.0)]
Percent = Annotated[float, Field(ge=0.0, le=100.0)]


class SceneTables(Strict):
    """Tables of a scene for doe uncertainty and doe calibrate; all other tables are described by rbdyn keys."""

    uncertain: Uncertain | None = None
    """Unknown inputs of the scene, with laws or documented ranges: doe uncertainty varies them, doe calibrate estimates them."""
    calibrate: Calibrate | None = None
    """Settings of doe calibrate, which estimates the unknown inputs; no run depends on them."""


class Rows(Strict):
    """Columns of RIG.csv next to those named by keys of the scene and by outputs.

    Of each output NAME_sd is the scatter of the single row, and NAME_accuracy_percent the offset that all rows share."""

    turns: Positive | None = None
    """Shaft turns of the measurement: its scatter is that of a run as long, where no standard deviation is stated."""
    hold: Literal["1", "yes", "true", "0", "no", "false"] | None = None
    """Whether the row is held out of the calibration to test it: 1 for a row that is held out, else 0."""


def _columns(figure: Figure) -> dict[str, Any]:
    """The measured output, its scatter and the accuracy of its sensor."""
    words, heat = quantity(figure.key)[0], figure.kind == "temperature"
    offset = f"standard deviation of one offset of all rows, {figure.accuracy:g} unless stated"
    texts = {
        "": f"Measured {figure.meaning}{', of a scene with [thermal]' if heat else ''}.",
        "_sd": f"Standard deviation of the measured {words}; {'turns do not replace it' if heat else 'or give turns'}.",
        "_accuracy_percent": f"Accuracy of the sensor of the {words}: {offset}.",
    }
    return {
        figure.key + end: ((Percent if "percent" in end else Positive) | None, Field(None, description=text))
        for end, text in texts.items()
    }


_OUTPUTS = {name: column for figure in FIGURES if figure.accuracy for name, column in _columns(figure).items()}
RigTable = create_model("RigTable", __base__=Rows, __module__=__name__, **_OUTPUTS)
