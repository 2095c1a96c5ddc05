"""A command in a process of its own that loads nothing anew: this process forks, and the child has real streams.

What Python itself does with its streams before the first import is the subject of the few tests that start an interpreter.
"""

import gc
import importlib
import os
import shlex
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Iterable
from typing import Any, NamedTuple, NoReturn

from in_process import UNSEEN


class Ended(NamedTuple):
    """How a command ended: its exit code, and what its reader and the error stream got."""

    returncode: int
    stdout: str
    stderr: str


def forked(
    line: str, closed: Iterable[int] = (), output: str = "", lines: int | None = None, encoding: str = "utf-8"
) -> Ended:
    """Run ``rbdyn`` or ``doe`` with the streams ``closed``, its ``output`` into a file, else into a pipe.

    The reader of the pipe goes after so many ``lines``, at once where these are 0.
    """
    reading, writing = os.pipe()
    if output:
        with open(output, "wb", buffering=0) as file:
            os.dup2(file.fileno(), writing)
    if lines == 0:
        os.close(reading)
    with tempfile.TemporaryFile() as errors:
        child = os.fork()
        if not child:
            _child(shlex.split(os.path.expandvars(line)), frozenset(closed), writing, errors.fileno(), encoding)
        os.close(writing)
        shown = b""
        if lines != 0:
            with open(reading, "rb") as reader:
                shown = reader.read() if lines is None else b"".join(reader.readline() for _ in range(lines))
        _, status = os.waitpid(child, 0)
        errors.seek(0)
        return Ended(os.waitstatus_to_exitcode(status), shown.decode(), errors.read().decode())


def _child(words: list[str], closed: frozenset[int], output: int, errors: int, encoding: str) -> NoReturn:
    """The command with its streams in the places 0 to 2, to the exit code of the process."""
    code: Any = 1
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(output, 1)
        os.dup2(errors, 2)
        # A file of the parent, collected as garbage here, would close a number that a file of the command has by then.
        gc.freeze()
        os.closerange(3, os.sysconf("SC_OPEN_MAX"))
        for number, name in enumerate(("stdin", "stdout", "stderr")):
            stream: Any = None  # as Python has it where the stream is closed
            if number in closed:
                os.close(number)
            else:
                stream = open(number, "w" if number else "r", encoding=encoding, closefd=False)  # noqa: SIM115
            setattr(sys, name, stream)
            setattr(sys, f"__{name}__", stream)
        os.environ["NO_COLOR"] = "1"
        sys.argv = words
        warnings.resetwarnings()
        for category in UNSEEN:
            warnings.simplefilter("ignore", category)
        try:
            importlib.import_module(f"{words[0]}.cli").run()
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
    except BaseException:
        os.write(2, traceback.format_exc().encode())
    finally:
        os._exit(code)
