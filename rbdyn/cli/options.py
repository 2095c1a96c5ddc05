"""Arguments and options that several commands share. Help tells the default of each: ``show_default`` where it is None."""

from pathlib import Path
from typing import Annotated, Any

import typer


def flag(*names: str, says: str, **more: Any) -> Any:
    """An option without a value; help shows no type for it."""
    return typer.Option(*names, metavar="", help=says, **more)


def folder_option(says: str, default: str = "nothing is written") -> Any:
    """``--out`` of a command that writes other files than ``Out`` says."""
    return typer.Option("--out", metavar="DIR", help=says, show_default=default)


def verbose_flag(says: str) -> Any:
    """``--verbose`` of a command that tells other things than ``Verbose`` says."""
    return flag("--verbose", "-v", says=says)


def study_flag(name: str, studies: str) -> Any:
    """A flag that asks for another study than the usual one."""
    return flag(name, says=f"{studies}, instead.")


def count_option(least: int, says: str, default: int) -> Any:
    """A number of things to run."""
    return typer.Option(min=least, max=100_000, metavar="N", help=says, show_default=str(default))


def scene_option(key: str, says: str) -> Any:
    """An option for a key of the scene."""
    return typer.Option(help=says, show_default=f"{key} of the scene")


def _tell_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(f"rbdyn {version('rbdyn')}")
        raise typer.Exit()


Version = Annotated[bool, flag("--version", says="Print the version.", callback=_tell_version, is_eager=True)]
SceneFile = Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene to simulate.")]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY.PATH=VALUE", help="Replace a key; repeatable.", show_default="the scene as it stands"
    ),
]
Turns = Annotated[float | None, scene_option("numerics.turns", "Counted shaft turns.")]
Replicates = Annotated[int | None, scene_option("numerics.replicates", "Seeded replicates.")]
Seed = Annotated[int | None, scene_option("numerics.seed", "Seed of all random starts and spreads.")]
Workers = Annotated[int | None, typer.Option(min=1, metavar="N", help="Threads.", show_default="all processors")]
Out = Annotated[Path | None, folder_option("Write result.json, history.csv and pictures here.")]
Json = Annotated[bool, flag("--json", says="Print one JSON object and nothing else.")]
Quiet = Annotated[bool, flag("--quiet", "-q", says="No progress, no notes.")]
Verbose = Annotated[bool, verbose_flag("Also print power terms and cost.")]
