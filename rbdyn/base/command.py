"""Shared parts of the commands, without any physics: exit codes, messages, JSON, the output folder, progress, options, templates."""

import errno
import json
import logging
import os
import re
import shlex
import string
import sys
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import reduce
from inspect import Parameter, Signature, signature
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, NamedTuple, NoReturn, cast, get_args

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from rbdyn.base.blocks import Block, Detail
from rbdyn.base.faults import LONGEST_NAME, InputError, MethodError, RunError, one_line, refuse
from rbdyn.base.folder import OutputFolder, output_folder
from rbdyn.base.html import write_with_report
from rbdyn.base.identity import Identity, identity_line
from rbdyn.base.loading import INTERRUPTED
from rbdyn.base.notes import DANGER, Note, condensed, of_level
from rbdyn.base.records import plain
from rbdyn.base.streams import FAILED, escaped, styled
from rbdyn.base.terminal import show

# Exit code of a command whose input is at fault.
BAD_INPUT = 2
# Whole numbers that numba and matplotlib read of the environment, with their ends.
VARIABLES = {"NUMBA_NUM_THREADS": (1, 10_000), "SOURCE_DATE_EPOCH": (0, 253_402_300_799)}

# The time left looks back so long [s]: in a shorter time a slow run would not end even once.
LOOK_BACK_S = 86400.0


@contextmanager
def guarded(as_json: bool) -> Iterator[None]:
    """Turn faults into sentences on standard error and an exit code; with ``--json`` also into one object."""
    try:
        refuse(_environment_faults())
        yield
    except InputError as error:
        _leave(as_json, BAD_INPUT, error.faults)
    except RunError as error:
        _leave(as_json, FAILED, [str(error)])
    except KeyboardInterrupt as error:
        _leave(as_json, INTERRUPTED, [f"interrupted; {str(error) or 'nothing was saved'}"])
    except MemoryError as error:
        _leave(as_json, FAILED, [f"out of memory: {error or 'none is free'}; ask for fewer points, samples or turns"])
    except OSError as error:
        sentence = f"{error.filename or 'output'}: {error.strerror}; check the path, its permissions and the disk"
        _leave(as_json, FAILED if error.errno == errno.ENOSPC else BAD_INPUT, [sentence])


def _environment_faults() -> Iterator[str]:
    """Sentences on variables of the environment that end a library in the middle of a command."""
    for name, (least, most) in VARIABLES.items():
        value = os.environ.get(name, "").strip() or str(least)
        if not (value.isdecimal() and value.isascii() and least <= int(value[:LONGEST_NAME]) <= most):
            shown = one_line(value, LONGEST_NAME)
            yield f"environment variable {name} = {shown}: must be a whole number from {least} to {most}; unset it"


def _leave(as_json: bool, code: int, sentences: Sequence[str]) -> NoReturn:
    """Print the sentences and end with the exit code."""
    for sentence in sentences:
        print(sentence, file=sys.stderr)
    failed = {"status": "interrupted" if code == INTERRUPTED else f"failed: {sentences[0]}"}
    if as_json:
        print_json({"status": "refused", "faults": sentences} if code == BAD_INPUT else failed)
    raise typer.Exit(code)


def print_json(record: dict[str, Any]) -> None:
    """One JSON object on standard output."""
    print(json.dumps(record, indent=1, allow_nan=False))


def hand_out(
    text: str, as_json: bool, path: Path | None, force: bool, following: str, reads: Sequence[Path] = ()
) -> None:
    """Print a TOML file, or its JSON; with a ``path`` write it there whole instead, and print what is ``following``.

    Raises InputError where a file is there already, unless ``force``, for one that the command ``reads``, and for a path where no
    file can be.
    """
    if path is not None:
        from rbdyn.base.files import whole_file

        check_out(path, force, reads)
        with whole_file(path) as new:
            new.write_text(f"{text}\n", encoding="utf-8")
    if as_json:
        print_json(tomllib.loads(text))
    else:
        print(text if path is None else f"written to {path}; next: {following} {shlex.quote(str(path))}")


def check_out(path: Path | None, force: bool, reads: Sequence[Path]) -> None:
    """Raise the InputError of ``hand_out`` before anything is computed."""
    if path is not None:
        from rbdyn.base.files import place_of_file

        if path.is_file() and not force:
            raise InputError(f"--out {path}: exists; add --force to write over it, or name another file")
        if any(path.exists() and path.samefile(read) for read in reads):
            raise InputError(f"--out {path}: is a file that this command reads; name another file")
        place_of_file(path)


def hand_over(
    record: Callable[[], dict[str, Any]],
    as_json: bool,
    answer: Callable[[], None],
    folder: Path | None = None,
    files: Sequence[str] = (),
) -> None:
    """Print the ``record`` as JSON, else let ``answer`` print and list the ``files`` written to the ``folder``."""
    if as_json:
        printed = plain(record())
        print_json(printed)
        alarm(printed.get("notes", ()))
        return
    answer()
    if folder:
        print(f"written to {folder}: {', '.join(files)}")


class Delivery(NamedTuple):
    """What a command ends with: identity of the result, its JSON form, its blocks, what writes its files, and whether it failed.

    Without an identity there is no report. ``closing`` prints what follows the result.
    """

    identity: Identity | None
    record: Callable[[], dict[str, Any]]
    blocks: Callable[[], Sequence[Block]]
    write: Callable[[Path], object]
    failed: bool = False
    closing: Callable[[], object] = lambda: None


class Console(NamedTuple):
    """The console of a command: where its files go, and what it says meanwhile."""

    folder: OutputFolder
    as_json: bool
    quiet: bool

    def progress(self, title: str) -> AbstractContextManager[Callable[[int, int], None]]:
        """The bar of progress."""
        return progress_bar(title, self.quiet or self.as_json)

    @property
    def notice(self) -> Callable[[str], None] | None:
        """Function that prints a note at once; None for a quiet command."""
        return notice(self.quiet)

    def deliver(self, delivery: Delivery, detail: Detail) -> None:
        """Write the files of a result with their report, then print the result."""
        identity, blocks, folder = delivery.identity, delivery.blocks, self.folder
        files = write_with_report(folder, identity, blocks, delivery.write)
        head = [] if identity is None else [identity_line(identity)]
        hand_over(delivery.record, self.as_json, lambda: show([*head, *blocks()], detail), folder.path, files)
        delivery.closing()


def result_command(
    title: str, files: Sequence[str], out: str, verbose: str = "", keeps: Sequence[str] = ()
) -> Callable[[Callable[..., Delivery]], Callable[..., None]]:
    """A command from a function of a console and of its own options; with --out, --force, --json, --quiet and, if it has a help, --verbose.

    title : name of the command in its folder, where it writes ``files`` and ``keeps`` some from run to run
    out, verbose : help of these options
    """
    more = {"out": Annotated[Path | None, folder_option(out)], "force": Force, "as_json": Json, "quiet": Quiet}
    more |= {"verbose": Annotated[bool, verbose_flag(verbose)]} if verbose else {}

    def made(run: Callable[..., Delivery]) -> Callable[..., None]:
        def command(
            out: Path | None, force: bool, as_json: bool, quiet: bool, verbose: bool = False, **options: Any
        ) -> None:
            with guarded(as_json), output_folder(out, title, files, keeps, force) as folder:
                console = Console(folder, as_json, quiet)
                notice(quiet)
                delivery = run(console, **options)
                console.deliver(delivery, Detail.of(quiet, verbose))
            if delivery.failed:
                raise typer.Exit(FAILED)

        _, *options = signature(run).parameters.values()
        return as_command(command, run.__name__, run.__doc__, [*options, *map(option_of, more, more.values())])

    return made


def as_command(function: Any, name: str, about: str | None, parameters: Sequence[Parameter]) -> Callable[..., None]:
    """The function with the name, the help and the parameters of a command, those that must be stated first."""
    stated = sorted(parameters, key=lambda parameter: parameter.default is not Parameter.empty)
    function.__signature__, function.__name__, function.__doc__ = Signature(stated), name, about
    function.__annotations__ = {parameter.name: parameter.annotation for parameter in stated}
    return cast(Callable[..., None], function)


def option_of(key: str, annotation: Any) -> Parameter:
    """The parameter of an annotation: by default False of a flag, None of what may be left out, nothing of what must be stated."""
    kind = get_args(annotation)[0]
    default = False if kind is bool else None if type(None) in get_args(kind) else Parameter.empty
    return Parameter(key, Parameter.POSITIONAL_OR_KEYWORD, default=default, annotation=annotation)


def alarm(notes: Iterable[Note | Mapping[str, Any]]) -> None:
    """Print every danger among notes or their JSON forms on standard error."""
    for note in of_level(condensed(map(Note.of, notes)), DANGER):
        print(f"danger: {escaped(note)}", file=sys.stderr)


@contextmanager
def checkpoint_message(path: Path | None) -> Iterator[None]:
    """Let the message of Ctrl-C name the ``path`` that holds the finished parts, once it exists."""
    try:
        yield
    except KeyboardInterrupt:
        if path is None or not path.exists():
            raise
        raise KeyboardInterrupt(f"finished parts are saved in {path}; start the command again to resume") from None


@contextmanager
def progress_bar(title: str, quiet: bool) -> Iterator[Callable[[int, int], None]]:
    """Show progress with the time left on a terminal, nothing elsewhere; yields ``progress(count, total)``."""
    if quiet or not sys.stderr.isatty():
        yield lambda count, total: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    with Progress(
        TextColumn(title),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(elapsed_when_finished=True),
        console=Console(file=styled(sys.stderr)),
        transient=True,
        speed_estimate_period=LOOK_BACK_S,
    ) as bar:
        task = bar.add_task(title, total=None)
        yield lambda count, total: bar.update(task, completed=count, total=total)


def notice(quiet: bool) -> Callable[[str], None] | None:
    """Function that prints a note to standard error at once; None for a quiet command. Any other also prints what is logged."""
    logger = logging.getLogger("rbdyn")
    logger.setLevel(logging.NOTSET if quiet else logging.INFO)
    logger.handlers = [] if quiet else [_StandardError()]
    return None if quiet else lambda sentence: print(f"note: {escaped(sentence)}", file=sys.stderr, flush=True)


class _StandardError(logging.Handler):
    """Lines on what is standard error at the time, above a bar of progress."""

    def emit(self, record: logging.LogRecord) -> None:
        print(record.getMessage(), file=sys.stderr, flush=True)


def flag(*names: str, help: str, **more: Any) -> Any:
    """An option without a value."""
    return typer.Option(*names, help=help, **more)


def valued(metavar: str, help: str, default: str | bool, *names: str, **more: Any) -> Any:
    """An option with a value; ``default`` describes the value without the option, True where that is its default."""
    return typer.Option(*names, metavar=metavar, help=help, show_default=default, **more)


def _without_types(params: list[Any]) -> list[Any]:
    """The parameters of a command; help shows no type for an option without a value, and no brackets around a default in words."""
    for param in params:
        if isinstance(getattr(param, "show_default", None), str):
            param._get_default_string = lambda default=param.show_default, **_: default
        if getattr(param, "is_flag", False) and param.metavar is None:
            param.metavar = ""
    return params


class Command(TyperCommand):
    """A command."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Its parameters, with ``--help``."""
        return _without_types(super().get_params(ctx))


class Group(TyperGroup):
    """All commands of a program."""

    def get_params(self, ctx: Any) -> list[Any]:
        """The options of the program itself, with ``--help``."""
        return _without_types(super().get_params(ctx))


class Program(typer.Typer):
    """A program of several commands."""

    def __init__(self) -> None:
        super().__init__(cls=Group, no_args_is_help=True, pretty_exceptions_enable=False)

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Run the program; typer's own call would replace the hook that keeps a lost Ctrl-C from being printed."""
        return get_command(self)(*arguments, **options)

    def command(self, name: str | None = None, *, cls: type[TyperCommand] | None = Command, **options: Any) -> Any:
        """Take up a function as a command."""
        return super().command(name, cls=cls, **options)


def folder_option(help: str, default: str | bool = "none") -> Any:
    """``--out`` of a command that writes a folder."""
    return valued("DIR", help, default, "--out")


def verbose_flag(help: str) -> Any:
    """``--verbose`` of a command."""
    return flag("--verbose", "-v", help=help)


def _print_version(requested: bool) -> None:
    if requested:
        from importlib.metadata import version

        print(f"rbdyn {version('rbdyn')}")
        raise typer.Exit()


Version = Annotated[bool, flag("--version", help="Print the version.", callback=_print_version, is_eager=True)]
SceneFile = Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene file: bearing and operating point.")]
Set = Annotated[
    list[str] | None, valued("KEY.PATH=VALUE", "Replace a key of the scene file; repeatable.", "none", "--set")
]
Turns = Annotated[float | None, valued("N", "Counted shaft turns.", "numerics.turns of the scene")]
Replicates = Annotated[int | None, valued("N", "Seeded replicates.", "numerics.replicates of the scene")]
Seed = Annotated[int | None, valued("N", "Seed of all random starts and deviations.", "numerics.seed of the scene")]
Workers = Annotated[int | None, valued("N", "Number of threads.", "all processors", min=1)]
Force = Annotated[bool, flag("--force", help="Overwrite files in the folder that this command did not write.")]
OutFile = Annotated[Path | None, valued("FILE", "Write to this file.", "standard output", "--out")]
ForceFile = Annotated[bool, flag("--force", help="Overwrite the file of --out.")]
Json = Annotated[bool, flag("--json", help="Print only one JSON object.")]
Quiet = Annotated[bool, flag("--quiet", "-q", help="Print no progress, and only notes of danger.")]


# Column in which the comment on a key starts.
COLUMN = 35


def fill_template(template: str, values: Mapping[str, Any]) -> str:
    """The template with its ``{names}`` filled in, comments in a column.

    A line whose value is None, a table without keys and an empty comment are left out.
    """
    lines = [_fill_line(line, values) for line in template.splitlines() if _has_values(line, values)]
    full = (line for line, after in pairwise([*lines, ""]) if not (line.startswith("[") and not after))
    return "\n".join(full).replace("\n\n\n", "\n\n")


def _has_values(line: str, values: Mapping[str, Any]) -> bool:
    """Whether every name in the line has a value; a part of what is None has none."""
    names = (name.split(".") for _, name, _, _ in string.Formatter().parse(line) if name)
    return all(
        reduce(lambda table, part: getattr(table, part, None), parts, values[name]) is not None
        for name, *parts in names
    )


def _fill_line(line: str, values: Mapping[str, Any]) -> str:
    assignment, _, reason = (part.format_map(values) for part in line.partition(" # "))
    return f"{assignment:<{COLUMN}} # {reason}" if reason else assignment


DECIMAL_COMMA = re.compile(r"(\d),(\d)")


TYPED = re.compile(r"\s*([+-]?\d+(?:[.,]\d+)?)\s*([^\d\s.,](?:[^\d]*[^\d\s])?)\s*")
# Units that are typed in place of another, and their factor to it.
FACTORS = {
    ("kN", "N"): 1e3,
    ("m", "mm"): 1e3,
    ("cm", "mm"): 10.0,
    ("um", "mm"): 1e-3,
    ("\u00b5m", "mm"): 1e-3,
    ("krpm", "rpm"): 1e3,
}


def plain_number(text: str, unit: str = "", fault: Callable[[float], str | None] = lambda value: None) -> float:
    """A number that is typed, in a ``unit``. Raises MethodError for a decimal comma, a unit, for what is no number, and with the
    ``fault`` of the value; a value that has one is not advised.
    """
    comma, typed = comma_fault(text, float), TYPED.fullmatch(text)
    factor = 1.0 if typed and typed[2] in (unit, f"\u00b0{unit}") else typed and FACTORS.get((typed[2], unit))
    try:
        value, advice = float(text.replace(",", ".") if comma else text), comma
    except ValueError:
        if not typed or not factor:
            raise MethodError(f"is not a number; write a plain number{f' in {unit}' if unit else ''}") from None
        value = factor * float(typed[1].replace(",", "."))
        advice = f"has a unit; write {value:.10g}"
    if sentence := fault(value) or advice:
        raise MethodError(sentence)
    return value


def comma_fault(text: str, reader: Callable[[str], Any]) -> str:
    """What to write in place of a decimal comma; empty where there is none, or where ``reader`` does not take the rest."""
    with_point = DECIMAL_COMMA.sub(r"\1.\2", text.strip())
    if with_point == text.strip():
        return ""
    try:
        reader(with_point)
    except (MethodError, ValueError):
        return ""
    return f"has a decimal comma; write {one_line(with_point, LONGEST_NAME)}"
