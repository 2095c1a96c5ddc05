"""The command ``doe``: what it prints, and what it loads in a process of its own."""

import subprocess
import sys

from in_process import in_process

HEAVY = {"numba", "scipy", "pandas", "sklearn", "pymoo", "matplotlib"}


def doe(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command within this process."""
    return in_process("doe", *arguments)


def doe_process(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own."""
    return subprocess.run([sys.executable, "-m", "doe", *arguments], capture_output=True, text=True, timeout=300)


def loaded_by(code: str) -> set[str]:
    """Heavy packages in memory after running ``code`` in a fresh interpreter."""
    tail = "; import sys; print(sorted({name.split('.')[0] for name in sys.modules}))"
    shown = subprocess.run([sys.executable, "-c", code + tail], capture_output=True, text=True, check=True)
    return HEAVY & set(eval(shown.stdout.splitlines()[-1]))


def invoke(*arguments: str) -> str:
    """Code that runs the command inside an interpreter and survives its exit."""
    return (
        "import contextlib, io; from doe.cli import app\n"
        "with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):\n"
        f"    app({list(arguments)!r})\n"
        "0"
    )
