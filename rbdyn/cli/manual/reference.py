"""Keys of input files and options of commands as Markdown."""

from collections.abc import Iterator

import typer

from rbdyn.cli.keys import Key, keys, lines
from rbdyn.cli.manual.part import Part


def keys_of(part: Part) -> Iterator[str]:
    """A heading a kind of file, a table and a key, and what the key means."""
    tables: dict[tuple[str, str], list[Key]] = {}
    for key in keys(part.kinds):
        tables.setdefault((key.file, key.key.rpartition(".")[0]), []).append(key)
    kind = ""
    for (file, table), found in tables.items():
        if file != kind:
            kind = file
            yield f"## {file.capitalize()}"
        yield f"### {file}, " + (f"table `{table}`" if table else "outside all tables")
        for key in found:
            head = lines(key)[0].removeprefix(f"{key.key}: ")
            # Its description, and what else a key says behind it.
            told = (plain(str(each)) for each in (head, *key[Key._fields.index("description") :]))
            yield "\n\n".join((f"#### `{key.key}`", *told))


def commands_of(part: Part) -> Iterator[str]:
    """A heading a command: its usage, what it does, its options."""
    for name, command in part.commands.commands.items():
        whole = f"{part.package} {name}"
        context = typer.Context(command, info_name=whole)
        usage = " ".join(command.get_usage(context).removeprefix("Usage: ").split())
        records = filter(None, (each.get_help_record(context) for each in command.params))
        options = "\n".join(f"- `{option}`: {plain(says)}" for option, says in records)
        yield f"## `{whole}`\n\n```sh\n{usage}\n```\n\n{plain(command.help)}\n\n{options}"


def plain(text: str) -> str:
    """Text in which Markdown sees no emphasis."""
    return text.replace("*", r"\*")
