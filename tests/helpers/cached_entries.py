"""Two small compiled functions, their machine code in a folder of one's choice, and ways to spoil a file."""

import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rbdyn.base.digests import with_digest
from rbdyn.compiled.kernel import entry, save_code


def line(x: Any) -> Any:
    """3 x + 1."""
    return 3 * x + 1


def parabola(x: Any) -> Any:
    """x^2 - 2."""
    return x * x - 2


FUNCTIONS: tuple[Callable[[Any], Any], ...] = (line, parabola)
ARGUMENTS = (0.5, 7)  # two signatures


def fresh(function: Callable[[Any], Any], folder: Path) -> Any:
    """The function as a new process has it: compiled code only on disk."""
    compiled = entry(function)
    save_code(compiled, folder)
    return compiled


def fill(folder: Path) -> list[Path]:
    """Compile every function for every argument; returns the files."""
    for function in FUNCTIONS:
        compiled = fresh(function, folder)
        for argument in ARGUMENTS:
            compiled(argument)
    return sorted(folder.iterdir())


def remove(path: Path) -> None:
    """Remove a file or a folder."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def is_whole(path: Path, data: bytes) -> bool:
    """Whether a file can be read and holds what was written."""
    try:
        return path.read_bytes() == data
    except OSError:
        return False


def spoil(draw: random.Random, path: Path, other: Path) -> str:
    """Spoil a file in a random way, or leave it; returns how."""
    data = path.read_bytes() or b" "  # another process may have emptied it
    at = draw.randrange(len(data))
    ways: dict[str, Callable[[], object]] = {
        "left": lambda: None,
        "emptied": lambda: path.write_bytes(b""),
        "cut": lambda: path.write_bytes(data[:at]),
        "longer": lambda: path.write_bytes(data + draw.randbytes(draw.choice((1, 1000)))),
        "a bit": lambda: path.write_bytes(data[:at] + bytes([data[at] ^ 1 << draw.randrange(8)]) + data[at + 1 :]),
        "a gap": lambda: path.write_bytes(data[:at] + bytes(min(512, len(data) - at)) + data[at + 512 :]),
        "garbage": lambda: path.write_bytes(draw.randbytes(at)),
        "end first": lambda: path.write_bytes(data[at:]),
        "of another": lambda: path.write_bytes(other.read_bytes()),
        "head of another": lambda: path.write_bytes(other.read_bytes()[:at] + data[at:]),
        "swapped": lambda: (path.write_bytes(other.read_bytes()), other.write_bytes(data)),
        "missing": lambda: path.unlink(),
        "a folder": lambda: (path.unlink(), path.mkdir()),
        "a full folder": lambda: (path.unlink(), path.mkdir(), (path / "file").write_bytes(data)),
        "a dead link": lambda: (path.unlink(), path.symlink_to(path.with_name("nowhere"))),
        "a link to itself": lambda: (path.unlink(), path.symlink_to(path)),
        "a link to a folder": lambda: (path.unlink(), path.symlink_to(path.parent, target_is_directory=True)),
        "unreadable": lambda: path.chmod(0),
        "no pickle": lambda: path.write_bytes(with_digest(draw.randbytes(at))),
        "of a module that is gone": lambda: path.write_bytes(with_digest(b"cno_such_module\nname\n.")),
    }  # fmt: skip
    way = draw.choice(list(ways))
    ways[way]()
    return way
