"""The command ``rbdyn new``: a scene of a catalogue bearing or of one's own from its options."""

from dataclasses import Field
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any

import typer

from rbdyn.base.command import ForceFile, Json, OutFile, guarded, hand_out, valued
from rbdyn.base.faults import LONGEST_NAME, InputError, one_line
from rbdyn.draft.options import TABLE, Options, dashed
from rbdyn.draft.text import rexs_text, scene_text
from rbdyn.properties.rexs import is_rexs, read_rexs

Designations = Annotated[
    list[str],
    typer.Argument(
        metavar="DESIGNATION|own|FILE.rexs",
        help="Designation (NU210, NU 1010 M, 6208 C3, 7208B), own for your drawing, or a REXS file.",
    ),
]

BearingOfFile = Annotated[
    str | None, valued("ID", "Number or name of a bearing in the REXS file.", "the only one", "--bearing")
]


def new(
    designation: Designations,
    bearing: BearingOfFile = None,
    out: OutFile = None,
    force: ForceFile = False,
    as_json: Json = False,
    **texts: str | None,
) -> None:
    """Create a commented scene file for a catalogue bearing, a REXS file or your own drawing. Missing dimensions are estimated."""
    with guarded(as_json):
        words, typed = " ".join(designation), {dashed(name): text for name, text in texts.items()}
        if is_rexs(words):
            text = rexs_text(read_rexs(Path(words), bearing), typed)
        elif bearing is not None:
            raise InputError(f"--bearing {one_line(bearing, LONGEST_NAME)}: chooses one of a REXS file; leave it out")
        else:
            text = scene_text(words, Options(typed))
        runs = "rbdyn simulate" if 'kind = "cylindrical_roller"' in text else "rbdyn ball"
        hand_out(text, as_json, out, force, runs)


def _parameter(entry: Field[Any]) -> Parameter:
    """Of the command, as the table declares it."""
    kind = Annotated[str | None, entry.metadata["option"]]
    preset = entry.metadata.get("preset")
    return Parameter(entry.name, Parameter.POSITIONAL_OR_KEYWORD, default=preset, annotation=kind)


named, *output, _ = signature(new).parameters.values()
new.__signature__ = Signature([named, *map(_parameter, TABLE.values()), *output])  # type: ignore[attr-defined]
