"""The page of measured figures: the studies of the shipped examples, part by part, as one file of Markdown.

``measured.toml`` lists the parts and the commands that each is measured by. A part that is not run keeps its former tables
with their date and says so; one that fails keeps them and says why.

``python examples/benchmarks/measured_page.py examples/measured.md [--part NAME]...``, from the folder of the repository; exit
codes: 0, 1 where a part failed, 2 for a part that is none.
"""

import argparse
import re
import shlex
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Collection, Mapping
from contextlib import AbstractContextManager
from datetime import date
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rbdyn.accuracy import study
from rbdyn.accuracy.report import Report, Reporter, processor
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.files import versions, whole_file
from rbdyn.scene import Scene

NEVER = "*Not measured yet.*\n"
BAR = r"\|"  # within a cell


def measure(
    path: Path, wanted: Collection[str], bar: Callable[[str], AbstractContextManager[Reporter]]
) -> dict[str, dict[str, Any]]:
    """Run the ``wanted`` parts, all where none is named, and write the page after each; returns by part what came of it.

    ``bar(title)`` gives the progress of a part. Commands are run where the process stands: paths of scenes are those of the
    repository. Raises InputError for a part that is none, KeyboardInterrupt.
    """
    whole = tomllib.loads(Path(__file__).with_name("measured.toml").read_text(encoding="utf-8"))
    commands = {part["name"]: part["commands"] for part in whole["part"]}
    if unknown := [name for name in wanted if name not in commands]:
        raise InputError([f"--part {name}: is none; the parts are {', '.join(commands)}" for name in unknown])
    old = path.read_text(encoding="utf-8") if path.exists() else ""
    today = date.today().isoformat()
    blocks = kept_blocks(old, commands)
    found: dict[str, dict[str, Any]] = {name: {"status": "kept"} for name in commands}
    _write(path, whole, blocks)  # before hours of running, lest there be no such folder
    for name in [name for name in commands if name in wanted or not wanted]:
        started = time.perf_counter()
        try:
            with bar(name) as progress, TemporaryDirectory() as folder:
                output = "\n\n".join(_told(line, folder, progress) for line in commands[name])
        except (InputError, RunError, OSError) as error:
            found[name] = {"status": f"failed: {error}"}
            blocks[name] = _kept(old, name, f"failed on {today}: {error}")
        else:
            found[name] = {"status": "ok", "seconds": time.perf_counter() - started}
            on = ", ".join((processor(), *(f"{key} {value}" for key, value in versions().items())))
            blocks[name] = f"*Measured {today}; times include compiling; {on}.*\n\n{output}\n"
        _write(path, whole, blocks)
    return found


def _write(path: Path, whole: Mapping[str, Any], blocks: Mapping[str, str]) -> None:
    with whole_file(path) as new:
        new.write_text(_page(whole, blocks), encoding="utf-8")


def _page(whole: Mapping[str, Any], blocks: Mapping[str, str]) -> str:
    sections = [f"# {whole['title']}\n\n{whole['words']}"]
    for part in whole["part"]:
        commands = "\n".join(part["commands"])
        block = f"<!-- {part['name']} -->\n{blocks[part['name']]}<!-- /{part['name']} -->\n"
        sections.append(f"## {part['title']}\n\n{part['words']}\n```sh\n{commands}\n```\n\n{block}")
    return "\n".join(sections)


def kept_blocks(page: str, names: Collection[str]) -> dict[str, str]:
    """What the page tells of these parts; those that were not measured today say so."""
    today = date.today().isoformat()
    new = {name for name in names if f"<!-- {name} -->\n*Measured {today};" in page}
    return {name: _kept(page, name, "" if name in new else f"not run for the page of {today}") for name in names}


def _kept(page: str, name: str, why: str) -> str:
    """What the page tells of a part, with its date in the first line, and ``why`` it is not from today, empty where it is."""
    found = re.search(f"<!-- {name} -->\n(.*?)<!-- /{name} -->\n", page, re.DOTALL)
    if found is None or found[1] == NEVER:
        return NEVER
    first, _, rest = re.sub(r"\*Kept: .*\*\n", "", found[1]).partition("\n")
    kept = f"*Kept: {' '.join(why.split())}.*\n" if why else ""
    return f"{first}\n{kept}{rest}"


def _told(line: str, folder: str, progress: Reporter) -> str:
    """A command, how long it took and what it tells; ``TMP`` in it is the ``folder``."""
    started = time.perf_counter()
    output = _run(line.replace(" TMP", f" {folder}"), progress)
    return f"`{line}`, {time.perf_counter() - started:.3g} s:\n\n{output}"


def _run(line: str, progress: Reporter) -> str:
    """What a command tells, as Markdown: tables of a study, of any other command what it prints. Raises RunError where it
    fails, InputError.
    """
    program, *words = shlex.split(line)
    if (program, words[0]) == ("rbdyn", "accuracy"):
        options = argparse.ArgumentParser()
        options.add_argument("scene")
        options.add_argument("study", nargs="?")
        options.add_argument("--set", action="append", default=[])
        asked = options.parse_args(words[1:])
        return _markdown(study(asked.study, Scene.load(asked.scene, asked.set), progress))
    called = words if program == "python" else ["-m", program, *words]
    ended = subprocess.run([sys.executable, *called], capture_output=True, text=True, check=False)
    if ended.returncode:
        raise RunError(f"{line}: ended with {ended.returncode}, {(ended.stderr.splitlines() or [''])[-1]}")
    printed = [row for row in ended.stdout.rstrip().splitlines() if not row.startswith("written to ")]
    return "\n".join(["```text", *printed, "```"])


def _markdown(report: Report) -> str:
    tables = []
    for table in report.tables:
        rows = (table.header, ["---"] * len(table.header), *table.rows)
        lines = (f"| {' | '.join(each.replace('|', BAR) for each in row)} |" for row in rows)
        tables.append("\n".join((f"**{table.caption}**\n", *lines)))
    return "\n\n".join((*tables, *report.sentences))


def main() -> int:
    """Write the page; returns the exit code."""
    from rbdyn.base.command import progress_bar

    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("page", type=Path, metavar="FILE", help="the page, Markdown")
    options.add_argument("--part", action="append", default=[], metavar="NAME", help="this part only; repeatable")
    asked = options.parse_args()
    try:
        found = measure(asked.page, asked.part, lambda name: progress_bar(name, False))
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    measured = [name for name, part in found.items() if part["status"] == "ok"]
    print(f"written to {asked.page}: measured {', '.join(measured) or 'nothing'}")
    failures = [f"{name} {part['status']}" for name, part in found.items() if part["status"] not in ("ok", "kept")]
    print(*failures, sep="\n", end="\n" if failures else "", file=sys.stderr)
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
