"""How a command meets its streams and Ctrl-C: both commands run through here. Loads nothing heavy.

What is written to a pipe whose reader has gone, or to a stream that is closed, is lost without a word: the command goes
on, so that its files stand whole and its exit code is the usual one. A device that takes no more is reported once.
"""

import codecs
import errno
import io
import os
import re
import signal
import sys
import threading
import warnings
from collections.abc import Callable
from typing import Any, NoReturn

from rbdyn.base.loading import INTERRUPTED

FAILED = 1
# What tables and sentences hold beyond ASCII, for streams that have no more.
PLAIN = {
    "±": "+-", "×": "x", "─": "-", "−": "-", "–": "-", "µ": "u", "°": " deg", "²": "^2", "³": "^3", "≤": "<=", "≥": ">=", "█": "#",
}  # fmt: skip
# Time [s] after which a swallowed Ctrl-C is raised again.
AGAIN_S = 0.05
# A path in the text of a warning, and characters of it that are written.
PATH, LONGEST_WARNING = re.compile(r"(?<!\w)(?:[A-Za-z]:)?[/\\][^\s/\\]+[/\\]\S+"), 300


class _Losing(io.FileIO):
    """A stream that takes all; ``fault`` is why it began to lose what it takes."""

    fault: OSError | None = None

    def write(self, data: Any, /) -> int:
        if self.fault is None:
            try:
                return super().write(data)
            except OSError as error:
                self.fault = error
        return memoryview(data).nbytes


def run(app: Callable[[], object]) -> NoReturn:
    """Run a command to its exit code, whatever its streams are."""
    code: Any = 0
    out, swallowed = _standing(), _swallowed_interrupts()
    _word_warnings()
    try:
        try:
            app()
        except SystemExit as end:
            code = end.code
        sys.stdout.flush()
    except BaseException as error:
        if not swallowed and not _is_interrupt(error):
            raise
        code = INTERRUPTED
    if out is not None:
        # All is done: no later Ctrl-C may spoil the code while the interpreter is taken down.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if out.fault is not None and out.fault.errno != errno.EPIPE:
            print(f"standard output: {out.fault.strerror}; make room, or write elsewhere", file=sys.stderr)
            code = code or FAILED
        sys.stderr.flush()
        if code == INTERRUPTED:
            # An interrupt that passed through ``exec`` would have the interpreter end by the signal, not by this code.
            os._exit(code)
    sys.exit(code)


def _is_interrupt(error: BaseException | None) -> bool:
    """Whether it is Ctrl-C, or what Python made of one that fell into the making of a class."""
    return error is not None and (isinstance(error, KeyboardInterrupt) or _is_interrupt(error.__cause__))


def _word_warnings() -> None:
    """Let a library's warning be one sentence, written once: the line of the library that gave it helps no user."""
    if sys.warnoptions:
        return  # whoever asks Python for warnings wants them whole
    texts = set[str]()

    def show(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
        text = PATH.sub("...", " ".join(str(message).split()))[:LONGEST_WARNING]
        if text not in texts:
            texts.add(text)
            print(f"warning: {text} ({category.__name__}); check the input for extreme numbers", file=sys.stderr)

    warnings.showwarning = show


def _swallowed_interrupts() -> list[object]:
    """Where Ctrl-C falls into a callback, from which nothing can be raised: it is kept here and raised again soon."""
    swallowed: list[object] = []
    usual = sys.unraisablehook

    def hook(lost: Any) -> None:
        if lost.exc_type is not KeyboardInterrupt:
            return usual(lost)
        swallowed.append(lost.object)
        threading.Timer(AGAIN_S, os.kill, (os.getpid(), signal.SIGINT)).start()

    sys.unraisablehook = hook
    return swallowed


def _standing() -> _Losing | None:
    """Put streams that never fail in place of the standard ones; returns that of the output, None if it is redirected."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # Closed: the next file that is opened would be given its number. The lowest one free is the first closed.
            os.open(os.devnull, os.O_RDWR)
    codecs.register_error("rbdyn.plain", _plain)
    losing = None
    for number, name in ((2, "stderr"), (1, "stdout")):
        given, losing = getattr(sys, name), None
        if given is getattr(sys, f"__{name}__"):
            losing = _Losing(number, "w", closefd=False)
            lines, encoding = (given.line_buffering, given.encoding) if given else (True, "utf-8")
            stream = io.TextIOWrapper(io.BufferedWriter(losing), encoding, "rbdyn.plain", line_buffering=lines)
            setattr(sys, name, stream)
    return losing


def _plain(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeEncodeError)
    return "".join(PLAIN.get(each, "?") for each in error.object[error.start : error.end]), error.end
