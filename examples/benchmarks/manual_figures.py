"""Figures quoted in the prose of the manual, compared with runs of the commands that they come from.

``manual_figures.toml`` lists pages, their commands and their figures. ``python examples/benchmarks/manual_figures.py [PAGE]...``,
from the folder of the repository, runs them and lists each figure as quoted and as it is now; ``--records DIR`` keeps the JSON of
each run there and reads what is there. Exit codes: 0, 1 where a figure is stale or a command failed, 2 for an unknown page.
"""

import argparse
import json
import math
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from rbdyn.base.faults import InputError, RunError
from rbdyn.base.words import with_error

ROOT = Path(__file__).parents[2]
TERM = re.compile(r" ([+-]) ")


class Compared(NamedTuple):
    """A quoted figure: its page and words, what stands there, what a run gives, and how far they may differ."""

    page: str
    words: str
    quoted: float
    value: float
    allowed: float

    @property
    def stale(self) -> bool:
        """Whether the page and the run contradict each other."""
        return not abs(self.quoted - self.value) <= self.allowed


def pages() -> list[dict[str, Any]]:
    """The pages with their runs and figures."""
    return tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))["page"]


def quoted(page: Mapping[str, Any]) -> Iterator[tuple[Mapping[str, Any], re.Match[str]]]:
    """Figures of a page with the place in its prose. Raises InputError for words that are not there exactly once."""
    text = (ROOT / page["file"]).read_text(encoding="utf-8")
    for figure in page["figure"]:
        places = list(re.finditer(figure["words"], text))
        if len(places) != 1:
            raise InputError([f"{page['file']}: {len(places)} places of {figure['words']}; expected one"])
        yield figure, places[0]


def records(page: Mapping[str, Any], folder: Path, kept: Path | None) -> dict[str, Any]:
    """JSON of each run of a page. Raises RunError for a command that fails."""
    found = {}
    for name, lines in page["runs"].items():
        path = None if kept is None else kept / f"{Path(page['file']).stem}_{name}.json"
        text = path.read_text(encoding="utf-8") if path and path.exists() else _output(lines, folder)
        if path:
            path.write_text(text, encoding="utf-8")
        found[name] = json.loads(text)
    return found


def compared(page: Mapping[str, Any], runs: Mapping[str, Any]) -> Iterator[Compared]:
    """Every quoted number of a page with its value now: within half of its last digit and both errors it is not stale."""
    for figure, place in quoted(page):
        words = " ".join(place[0].split())
        for k, (text, term) in enumerate(zip(place.groups(), figure["values"], strict=True)):
            value, error = valued(term, runs)
            text = text.rstrip(".")  # of the end of a sentence
            digits = len(text.partition(".")[2])
            allowed = 0.501 * 10.0**-digits + math.sqrt(2.0) * error + figure.get("within", [0.0] * (k + 1))[k]
            yield Compared(page["file"], words, float(text), value, allowed)


def valued(term: str, runs: Mapping[str, Any]) -> tuple[float, float]:
    """Value and error of a term, or of the sum or difference of two."""
    if "~" not in term and (parts := TERM.split(term))[1:]:
        (a, s), (b, t) = valued(parts[0], runs), valued(parts[2], runs)
        return a + (b if parts[1] == "+" else -b), math.hypot(s, t)
    run, _, path = term.partition(":")
    path, _, pattern = path.partition("~")
    value = runs[run]
    for key in path.split("/"):
        value = value[key]
    if pattern:
        found = re.search(pattern, value if isinstance(value, str) else "\n".join(note["text"] for note in value))
        return float(found[1]) if found else math.nan, 0.0
    if isinstance(value, Mapping):
        return value["value"], math.hypot(value["statistical_error"], value["numerical_error"])
    return float(value), 0.0


def _output(lines: Sequence[str], folder: Path) -> str:
    """What the last of the lines prints."""
    text = ""
    for line in lines:
        call = re.sub(r"^(rbdyn|doe) ", rf"{sys.executable} -m \1 ", line).replace("TMP", str(folder))
        ran = subprocess.run(call, shell=True, capture_output=True, text=True, cwd=ROOT)
        if ran.returncode:
            raise RunError(f"{line}: exit code {ran.returncode}: {ran.stderr.strip()[-300:]}")
        text = ran.stdout
    return text


def main() -> int:
    """Run the pages that the command line names, all by default; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("page", nargs="*", help="part of the name of a page; all by default")
    parser.add_argument("--records", type=Path, help="keep the JSON of each run here, and read what is here")
    options = parser.parse_args()
    chosen = [page for page in pages() if not options.page or any(word in page["file"] for word in options.page)]
    if not chosen:
        print(f"{', '.join(options.page)}: no such page; choose {', '.join(page['file'] for page in pages())}")
        return 2
    if options.records:
        options.records.mkdir(parents=True, exist_ok=True)
    stale = False
    for page in chosen:
        with TemporaryDirectory() as folder:
            try:
                rows = list(compared(page, records(page, Path(folder), options.records)))
            except (InputError, RunError) as error:
                print(error)
                stale = True
                continue
        for row in rows:
            verdict = "STALE" if row.stale else "holds"
            print(f"{verdict}  {row.quoted:>9g}  now {with_error(row.value, row.allowed)}  {row.page}: {row.words}")
            stale = stale or row.stale
    return int(stale)


if __name__ == "__main__":
    sys.exit(main())
