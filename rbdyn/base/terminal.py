"""What the commands share: exit codes, messages, JSON, progress. Knows no physics.



How long the rest of a row of runs takes, from when those before it ended. Loads nothing.
"""

import errno
import json
import os
import sys
import time
from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import typer

from rbdyn.base.blocks import Table
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.loading import INTERRUPTED
from rbdyn.base.render.terminal import show
from rbdyn.base.storage import digest_of
from rbdyn.base.streams import FAILED
from rbdyn.result import read_json, write_json

# Ends that are looked back on: what a run takes may change on the way.
LOOK_BACK = 256
# A first report that comes within this time [s] counts runs that were there before.
AT_ONCE_S = 0.2


class Remaining:
    """Time left of runs, so many ``workers`` at once, that take about equally long.

    As many run as there are workers, so a run began when the one as many places before it ended. The first ones, which also
    wait for what is compiled, count only until others have ended.
    """

    def __init__(self, workers: int = 1, clock: Callable[[], float] = time.monotonic) -> None:
        self._workers, self._clock = max(workers, 1), clock
        self._ends = deque([(0, clock())], maxlen=LOOK_BACK)
        self._total = 0

    def update(self, done: int, total: int) -> None:
        """So many of all runs have ended by now."""
        self._total, now = total, self._clock()
        last, since = self._ends[-1]
        if len(self._ends) == 1 and (done == last or now - since < AT_ONCE_S):
            self._ends[0] = done, now
        elif done > last:
            self._ends.append((done, now))

    @property
    def seconds(self) -> float | None:
        """Time left [s]; None until a second run has ended."""
        done = self._ends[-1][0]
        if self._total <= done:
            return 0.0 if self._total else None
        first, workers = self._ends[0][0], min(self._workers, self._total - self._ends[0][0])
        if done < first + 2:
            return None
        each = self._each(first, workers, done)
        left, now = self._total - done, self._clock()
        running = range(done + 1, done + min(workers, left) + 1)
        begun = [self._end(max(place - workers, first)) for place in running]
        # One that takes longer than the others may end at any time.
        free = sorted(max(start + each - now, 0.0) for start in begun)
        rounds, more = divmod(left - len(free), len(free))
        return max(time_free + each * (rounds + (place < more)) for place, time_free in enumerate(free))

    def _each(self, first: int, workers: int, done: int) -> float:
        """What a run takes, by those that began as another ended; before there are any, by all."""
        since = next(count for count, _ in self._ends if count >= min(first + workers, done))
        if since < done:
            starts, ends = (sum(self._end(place - back) for back in range(workers)) for place in (since, done))
            return (ends - starts) / (done - since)
        begin = self._ends[0][1]
        whole = sum(self._end(place) - begin for place in range(done - min(workers, done - first) + 1, done + 1))
        return whole / (done - first)

    def _end(self, place: int) -> float:
        """When the run at a place, from 1, ended; those before the first known one, when that was."""
        return self._ends[min(bisect_left(self._ends, place, key=lambda each: each[0]), len(self._ends) - 1)][1]


def clock_words(seconds: float | None) -> str:
    """Time left as h:mm:ss; dashes while it is not known."""
    if seconds is None:
        return "-:--:--"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{rest:02d}"


BAD_INPUT = 2
# Names what a folder of results was made of.
MARK = "made_by.json"


@contextmanager
def guarded(as_json: bool) -> Iterator[None]:
    """Turn faults into sentences on standard error and an exit code; with ``--json`` also into one object."""
    try:
        yield
    except InputError as error:
        _leave(as_json, BAD_INPUT, error.faults)
    except RunError as error:
        _leave(as_json, FAILED, [str(error)])
    except KeyboardInterrupt as error:
        _leave(as_json, INTERRUPTED, [f"interrupted; {str(error) or 'nothing was kept'}"])
    except MemoryError as error:
        _leave(
            as_json, FAILED, [f"out of memory: {error or 'no more is left'}; ask for fewer points, samples or turns"]
        )
    except OSError as error:
        sentence = f"{error.filename or 'output'}: {error.strerror}; check the path, its permissions and the disk"
        _leave(as_json, FAILED if error.errno == errno.ENOSPC else BAD_INPUT, [sentence])


def _leave(as_json: bool, code: int, sentences: Sequence[str]) -> NoReturn:
    for sentence in sentences:
        print(sentence, file=sys.stderr)
    failed = {"status": "interrupted" if code == INTERRUPTED else f"failed: {sentences[0]}"}
    if as_json:
        print_json({"status": "refused", "faults": sentences} if code == BAD_INPUT else failed)
    raise typer.Exit(code)


def print_json(record: dict[str, Any]) -> None:
    """One JSON object on standard output."""
    print(json.dumps(record, indent=1, allow_nan=False))


def hand_over(
    record: Callable[[], dict[str, Any]],
    as_json: bool,
    answer: Callable[[], None],
    folder: Path | None = None,
    files: Sequence[str] = (),
) -> None:
    """The ``record`` as JSON; else what ``answer`` prints, and the names of the files written, where there is a folder."""
    if as_json:
        print_json(record())
        return
    answer()
    if folder:
        print(f"written to {folder}: {', '.join(files)}")


@contextmanager
def keeping(path: Path | None) -> Iterator[None]:
    """Let Ctrl-C say that what was finished lies in ``path``, once that is there; elsewhere nothing is kept."""
    try:
        yield
    except KeyboardInterrupt:
        if path is None or not path.exists():
            raise
        raise KeyboardInterrupt(f"what was finished is kept in {path}: start again to go on") from None


def output_folder(path: Path, command: str, source: Path) -> Path:
    """Make the folder that ``--out`` names, for what ``command`` makes of the file ``source``.

    The rule of all commands: a folder belongs to one command and one file, noted in its ``made_by.json``. Results of the
    same file, by its place or its content, are written over, those of another stay and the folder is refused. All commands
    of ``doe`` count as one, for those on one study share its store. Raises InputError.
    """
    mark, source = path / MARK, source.resolve()
    try:
        path.mkdir(parents=True, exist_ok=True)
        digest = digest_of(source.read_bytes())
        # From the folder on, so that both can be moved, or mounted elsewhere, together.
        own = {"command": command, "file": os.path.relpath(source, path.resolve()), "sha256": digest}
        marked = read_json(mark) if mark.exists() and len(os.listdir(path)) > 1 else own
        if marked["command"] != command or (own["file"] != marked["file"] and digest != marked["sha256"]):
            raise InputError(
                [
                    f"--out {path}: holds what {marked['command']} made of {os.path.normpath(path / marked['file'])}; "
                    "name another folder or remove this one"
                ]
            )
        write_json(mark, own)
    except OSError as error:
        raise InputError([f"--out {path}: is no folder to write to ({error.strerror}); name another"]) from None
    except (ValueError, KeyError, TypeError):
        raise InputError([f"--out {path}: its {MARK} cannot be read; name another folder or remove this one"]) from None
    return path


@contextmanager
def progress_bar(title: str, quiet: bool, workers: int | None = 1) -> Iterator[Callable[[int, int], None]]:
    """Progress on a terminal, silence elsewhere; yields ``progress(done, total)``. ``workers``: how many go on at once, all
    processors by None."""
    if quiet or not sys.stderr.isatty():
        yield lambda done, total: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn
    from rich.text import Text

    remaining = Remaining(workers or os.cpu_count() or 1)

    class TimeLeft(ProgressColumn):
        """The speed that rich estimates is lost where a run takes longer than half a minute."""

        def render(self, task: Task) -> Text:
            return Text(clock_words(remaining.seconds), style="progress.remaining")

    def progress(done: int, total: int) -> None:
        remaining.update(done, total)
        bar.update(task, completed=done, total=total)

    with Progress(
        TextColumn(title), BarColumn(), MofNCompleteColumn(), TimeLeft(), console=Console(stderr=True), transient=True
    ) as bar:
        task = bar.add_task(title, total=None)
        yield progress


def notice(quiet: bool) -> Callable[[str], None] | None:
    """What prints a sentence while a command runs, to standard error, at once; nothing where it is to be quiet."""
    return None if quiet else lambda sentence: print(f"note: {sentence}", file=sys.stderr, flush=True)


def print_table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print one table."""
    show([Table(title, header, rows)])
