"""Standard streams and Ctrl-C of both commands. Loads nothing heavy.

Output to a closed pipe or stream is dropped silently: the command continues, completes its files and ends with its usual exit
code. A full device is reported once. Control characters, which names and paths may hold, are escaped in all output, so none
of them acts on a terminal; what styles its text itself escapes first and writes to ``styled``.
"""

import codecs
import errno
import gc
import io
import logging
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
# Replacements of characters beyond ASCII, for streams that cannot encode them.
PLAIN = {
    "±": "+-", "×": "x", "─": "-", "−": "-", "–": "-", "µ": "u", "°": " deg", "²": "^2", "³": "^3", "≤": "<=", "≥": ">=", "█": "#",
}  # fmt: skip
# Characters that act on a terminal or turn the direction of a text, but for line breaks and tabs.
ACTING = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]|\r(?!\n)")
# Time [s] after which a swallowed Ctrl-C is raised again.
AGAIN_S = 0.05
# New objects between two searches for garbage in cycles. At Python's 700 these take a twentieth of a study and find little.
OBJECTS_A_COLLECTION = 50_000
# A path in the text of a warning, and the longest text that is printed.
PATH, LONGEST_WARNING = re.compile(r"(?<!\w)(?:[A-Za-z]:)?[/\\][^\s/\\]+[/\\]\S+"), 300


def escaped(text: str) -> str:
    """The text with its control characters as Python writes them."""
    return ACTING.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


class _Escaping(io.TextIOWrapper):
    """A stream that escapes control characters."""

    def write(self, text: str, /) -> int:
        super().write(escaped(text))
        return len(text)

    def write_styled(self, text: str) -> int:
        """Write a text whose control characters are meant."""
        return super().write(text)


class _Styled:
    """The same stream as another, without its escapes."""

    def __init__(self, stream: _Escaping) -> None:
        self._stream, self.write = stream, stream.write_styled

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def styled(stream: Any) -> Any:
    """A standard stream for text whose control characters are meant."""
    return _Styled(stream) if isinstance(stream, _Escaping) else stream


class Uninterrupted:
    """Context in which Ctrl-C waits until its end, for a few statements of which all or none must be executed."""

    def __enter__(self) -> None:
        self._waiting, self._usual = 0, None
        # Only the main thread hears of signals, and only a handler of Python can wait.
        if threading.current_thread() is threading.main_thread() and callable(signal.getsignal(signal.SIGINT)):
            self._usual = signal.signal(signal.SIGINT, self._wait)

    def _wait(self, number: int, frame: Any) -> None:
        self._waiting += 1

    def __exit__(self, *ended: object) -> None:
        if callable(self._usual):
            signal.signal(signal.SIGINT, self._usual)
            if self._waiting:
                self._usual(signal.SIGINT, None)


class _Losing(io.FileIO):
    """A stream whose writes never fail; ``fault`` is the first error, after which it drops output."""

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
    # Pictures go to files only, whatever the user's own programs show; typer styles no text, for it may quote an argument.
    os.environ |= {"MPLBACKEND": "agg", "_TYPER_FORCE_DISABLE_TERMINAL": "1"}
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # without a home it tells where its cache is
    gc.set_threshold(OBJECTS_A_COLLECTION)
    out, interrupts = _replace_streams(), _pending_interrupts()
    _shorten_warnings()
    try:
        try:
            app()
        except SystemExit as end:
            code = end.code
        sys.stdout.flush()
    except BaseException as error:
        if not interrupts and not _is_interrupt(error):
            raise
        code = INTERRUPTED
    if out is not None:
        # A Ctrl-C during the shutdown of the interpreter may not change the exit code.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if out.fault is not None and out.fault.errno != errno.EPIPE:
            print(f"standard output: {out.fault.strerror}; free space or write elsewhere", file=sys.stderr)
            code = code or FAILED
        sys.stderr.flush()
        if code == INTERRUPTED:
            # After an interrupt within ``exec`` the interpreter would end by the signal instead of this code.
            os._exit(code)
    sys.exit(code)


def _is_interrupt(error: BaseException | None) -> bool:
    """Whether an error is Ctrl-C, or comes from one that interrupted the creation of a class; pydantic gives its name alone."""
    if error is None or isinstance(error, KeyboardInterrupt):
        return error is not None
    return "KeyboardInterrupt:" in str(error) or _is_interrupt(error.__cause__)


def _shorten_warnings() -> None:
    """Print each warning of a library once and as one sentence, without the line of code, which helps no user."""
    if sys.warnoptions:
        return  # options of Python ask for whole warnings
    texts = set[str]()

    def show(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
        text = PATH.sub("...", " ".join(str(message).split()))[:LONGEST_WARNING]
        if text not in texts:
            texts.add(text)
            print(f"warning: {text} ({category.__name__}); check the input for extreme numbers", file=sys.stderr)

    warnings.showwarning = show


def _pending_interrupts() -> list[object]:
    """List of the Ctrl-C that Python could not raise inside a callback; each is raised again soon after."""
    interrupts: list[object] = []
    usual = sys.unraisablehook

    def hook(lost: Any) -> None:
        if lost.exc_type is not KeyboardInterrupt:
            return usual(lost)
        interrupts.append(lost.object)
        threading.Timer(AGAIN_S, os.kill, (os.getpid(), signal.SIGINT)).start()

    def printed(kind: type[BaseException], error: BaseException, trace: Any) -> None:
        # Compiled code of libraries prints such a Ctrl-C before it hands it to the hook above.
        if kind is not KeyboardInterrupt:
            print_usual(kind, error, trace)

    print_usual = sys.excepthook
    sys.unraisablehook, sys.excepthook = hook, printed
    return interrupts


def _replace_streams() -> _Losing | None:
    """Replace the standard streams by ones that never fail; returns that of the output, None if it is redirected."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # Closed: the next opened file would get its number. The lowest free number is the first closed stream.
            os.open(os.devnull, os.O_RDWR)
    codecs.register_error("rbdyn.plain", _plain)
    losing = None
    for number, name in ((2, "stderr"), (1, "stdout")):
        standard, losing = getattr(sys, name), None
        if standard is getattr(sys, f"__{name}__"):
            losing = _Losing(number, "w", closefd=False)
            lines, encoding = (standard.line_buffering, standard.encoding) if standard else (True, "utf-8")
            stream = _Escaping(io.BufferedWriter(losing), encoding, "rbdyn.plain", line_buffering=lines)
            setattr(sys, name, stream)
    return losing


def _plain(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeEncodeError)
    return "".join(PLAIN.get(character, "?") for character in error.object[error.start : error.end]), error.end
