"""What ``doe`` adds to the manual that ``rbdyn manual`` writes: its chapters, which stand next to it, its command, its keys, its drawing of a dimension chain."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from typer.main import get_command

from doe.cli import app
from doe.commands.functions import kinds
from doe.report.files import confirmation_sheet, reference_sheet
from doe.report.sections.calibration import cell_sheet
from doe.report.sections.chain import part_sheet
from doe.report.sections.chain import share_sheet as chain_shares
from doe.report.sections.design import run_sheet
from doe.report.sections.duty import DUTY_POINTS
from doe.report.sections.fit import ANOVA, RUNS, TERMS
from doe.report.sections.unknown import DECIDERS, input_sheet, range_sheet, set_sheet, share_sheet
from doe.workflow.parts import clearance_parts
from rbdyn.base.blocks import Column, Sheet
from rbdyn.plots.sketches import WIDTH, Canvas, Sketch
from rbdyn.scene.keys import Part

if TYPE_CHECKING:
    from rbdyn.scene import Scene

# Margins, height, the row of the first link, and the step to the next row.
LEFT, RIGHT, HEIGHT, FIRST, STEP = 20.0, 20.0, 196.0, 44.0, 56.0
CLOSING = 30.0  # length of the closing link


def part() -> Part:
    """The part that the entry point names."""
    return Part("doe", Path(__file__).parent, get_command(app), kinds(), drawings, tables)


def tables() -> dict[str, list[Sheet[Any]]]:
    """The files of tables that the commands write."""
    factors, responses = ["{factor}"], ["{response}"]
    front = (
        *Column[Any]("{}", unit="of the name", meaning="point, and its prediction").of([*factors, *responses]),
        *Column[Any](
            "{}_error", unit="of the response", meaning="half width of its 95 % interval, with `--adaptive`"
        ).of(responses),
    )
    study: list[Sheet[Any]] = [
        run_sheet(factors, responses),
        ANOVA,
        TERMS,
        RUNS,
        Sheet("", front, file="front.csv", content="One row per point of the front."),
        confirmation_sheet(factors),
        DUTY_POINTS,
        part_sheet({}),
        chain_shares({}),
        reference_sheet(factors, responses),
    ]
    unknown = [
        set_sheet(["{key}"], responses),
        range_sheet(()),
        share_sheet(()),
        input_sheet(()),
        DECIDERS,
        cell_sheet(()),
    ]
    return {"Tables of a study": study, "Tables of unknown inputs": unknown}


def drawings(scene: "Scene") -> dict[str, Sketch]:
    """The drawings by the names that chapters use."""
    return {"chain": chain(scene)}


def chain(scene: "Scene") -> Sketch:
    """Links as arrows head to tail, to the right where they widen the clearance; what remains is the closing link."""
    group = clearance_parts(scene)["radial_clearance_mm"]
    first, *others = group.parts
    scale = (WIDTH - LEFT - RIGHT - CLOSING) / sum(-part.coefficient * part.nominal for part in others)
    canvas = Canvas(HEIGHT)
    tail, row = WIDTH - RIGHT, FIRST + STEP
    canvas.arrow([(LEFT, FIRST), (tail, FIRST)], "axis")
    canvas.words((0.5 * WIDTH, FIRST - 9.0), f"+ {_words(first.name)} {first.nominal:.7g}")
    canvas.line([(tail, FIRST - 14.0), (tail, row + 14.0)], "thin")
    for part, side in zip(others, (-9.0, 20.0), strict=True):  # words above and below the row
        tip = tail + scale * part.coefficient * part.nominal
        times = f"{-part.coefficient:g} × " if part.coefficient != -1.0 else ""
        canvas.arrow([(tail, row), (tip, row)], "axis")
        canvas.words((0.5 * (tail + tip), row + side), f"− {_words(part.name)} {times}{part.nominal:.7g}")
        canvas.line([(tip, row - 14.0), (tip, row + 6.0)], "thin")
        tail = tip
    row += STEP
    canvas.line([(LEFT, FIRST - 14.0), (LEFT, row + 14.0)], "thin")
    canvas.line([(tail, row - STEP), (tail, row + 14.0)], "thin")
    canvas.arrow([(LEFT, row), (tail, row)], "measure")
    canvas.words((tail + 10.0, row + 5.0), f"closing link: radial clearance {group.clearance:.4g}", "measured", "start")
    caption = (
        "A dimension chain: arrows to the right are links with the coefficient +1, arrows to the left are taken away. What closes "
        f"the loop is the closing link, here the radial clearance of the {scene.bearing.designation}, all in mm on the diameter. "
        f"The closing link is drawn {_round(CLOSING / (scale * group.clearance)):g} times as long as the parts are."
    )
    return Sketch(canvas.svg(), caption)


def _words(name: str) -> str:
    return name.replace("_", " ")


def _round(factor: float) -> float:
    return float(f"{factor:.2g}")
