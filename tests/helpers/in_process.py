"""The commands within this process: what they print and their exit code, for a fraction of the time of a process.

Streams of a real process, signals and what is loaded are the subjects of ``test_streams`` and of the tests that start one.
"""

import importlib
import io
import os
import subprocess
import sys
import warnings
from contextlib import ExitStack, redirect_stderr, redirect_stdout
from typing import Any
from unittest.mock import patch

# What a process of its own would not have been told of, as Python has it by default.
UNSEEN = (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning)


def in_process(program: str, *arguments: Any) -> subprocess.CompletedProcess[str]:
    """Run ``rbdyn`` or ``doe`` to its exit code, without colours; whatever is raised comes out."""
    words, out, said, code = [program, *map(str, arguments)], io.StringIO(), io.StringIO(), 0
    with ExitStack() as stack:
        stack.enter_context(patch.object(sys, "argv", words))
        stack.enter_context(patch.dict(os.environ, {"NO_COLOR": "1"}))
        stack.enter_context(patch.object(sys, "unraisablehook", sys.unraisablehook))
        stack.enter_context(patch.object(sys, "excepthook", sys.excepthook))
        stack.enter_context(warnings.catch_warnings())
        warnings.resetwarnings()
        for category in UNSEEN:
            warnings.simplefilter("ignore", category)
        stack.enter_context(redirect_stdout(out))
        stack.enter_context(redirect_stderr(said))
        try:
            importlib.import_module(f"{program}.cli").run()
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
    return subprocess.CompletedProcess(words, code, out.getvalue(), said.getvalue())
