"""Options and templates that several commands share."""

import string
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from rbdyn.base.faults import InputError
from rbdyn.base.terminal import guarded


def flag(*names: str, says: str, **more: Any) -> Any:
    """An option without a value; help shows no type for it."""
    return typer.Option(*names, metavar="", help=says, **more)


def valued(metavar: str, says: str, default: str, *names: str, **more: Any) -> Any:
    """An option with a value; ``default`` says what holds without it, where that is no plain value."""
    return typer.Option(*names, metavar=metavar, help=says, show_default=default, **more)


def refusing(former: Mapping[str, str]) -> type[TyperCommand]:
    """A kind of command, for ``cls``, that refuses options it had once by what took their place."""

    class Refusing(TyperCommand):
        def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
            """Refuse former options before any other."""
            option = next((name for word in args if (name := word.partition("=")[0]) in former), None)
            if option is not None:
                with guarded("--json" in args):
                    raise InputError([f"{option}: is no option any more; {former[option]}"])
            return super().parse_args(ctx, args)

    return Refusing


def folder_option(says: str, default: str = "nothing is written") -> Any:
    """``--out`` of a command that writes other files than ``Out`` says."""
    return valued("DIR", says, default, "--out")


def verbose_flag(says: str) -> Any:
    """``--verbose`` of a command that shows other things than ``Verbose`` says."""
    return flag("--verbose", "-v", says=says)


def _tell_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(f"rbdyn {version('rbdyn')}")
        raise typer.Exit()


Version = Annotated[bool, flag("--version", says="Print the version.", callback=_tell_version, is_eager=True)]
SceneFile = Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene to simulate.")]
Set = Annotated[
    list[str] | None, valued("KEY.PATH=VALUE", "Replace a key; repeatable.", "the scene as it stands", "--set")
]
Turns = Annotated[float | None, valued("N", "Counted shaft turns.", "numerics.turns of the scene")]
Replicates = Annotated[int | None, valued("N", "Seeded replicates.", "numerics.replicates of the scene")]
Seed = Annotated[int | None, valued("N", "Seed of all random starts and spreads.", "numerics.seed of the scene")]
Workers = Annotated[int | None, valued("N", "Threads.", "all processors", min=1)]
Out = Annotated[Path | None, folder_option("Write result.json, history.csv and pictures here.")]
Json = Annotated[bool, flag("--json", says="Print one JSON object and nothing else.")]
Quiet = Annotated[bool, flag("--quiet", "-q", says="No progress, no notes.")]
Verbose = Annotated[bool, verbose_flag("Also print power terms and cost.")]


# Where a comment starts next to a key.
COLUMN = 35


def filled(template: str, values: Mapping[str, Any]) -> str:
    """The template with its ``{names}`` filled in, comments in a column.

    A line that asks for a value of None is left out, so is a table without keys, so is an empty comment.
    """
    lines = [_filled(line, values) for line in template.splitlines() if _known(line, values)]
    full = (line for line, after in pairwise([*lines, ""]) if not (line.startswith("[") and not after))
    return "\n".join(full).replace("\n\n\n", "\n\n")


def _known(line: str, values: Mapping[str, Any]) -> bool:
    return all(values[name] is not None for _, name, _, _ in string.Formatter().parse(line) if name)


def _filled(line: str, values: Mapping[str, Any]) -> str:
    given, _, why = (part.format_map(values) for part in line.partition(" # "))
    return f"{given:<{COLUMN}} # {why}" if why else given
