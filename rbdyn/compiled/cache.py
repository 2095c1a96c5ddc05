"""Machine code on disk: one file for each function and signature, whole or absent, and checked before it is used.

numba's own cache trusts what it reads: an empty file ends the process, and a flipped bit becomes machine code. Here a file
opens with the hash of the rest, and the rest names what it is of. What fails a check is removed and compiled anew. A file
gets its name once it is whole, so that processes may share a folder. Where nothing can be written the run goes on without.
"""

import contextlib
import functools
import hashlib
import inspect
import logging
import pickle
import re
import secrets
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite
from numba.core import types
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from rbdyn.records.digest import content_of, with_digest

# Code in a file depends on them; numba itself is in the name of the folder.
VERSIONS = (sys.implementation.cache_tag, llvmlite.__version__)


class EntryCache:
    """Compiled code of one function; the methods are those that numba's dispatcher calls."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        """Raises OSError where the source file of the function cannot be read."""
        self.folder = folder
        self.name = re.sub(r"[^\w.]", "", f"{function.__module__}.{function.__qualname__}")
        cells = [cell.cell_contents for cell in function.__closure__ or ()]
        source = Path(inspect.getfile(function)).read_bytes()
        self.stamp = hashlib.sha256(source + dumps(cells)).hexdigest()

    @property
    def cache_path(self) -> str:
        """The folder."""
        return str(self.folder)

    def path(self, signature: Any, magic: tuple[Any, ...]) -> Path:
        """File of a signature on a processor, which ``magic`` names."""
        text = repr((_text(signature), magic, VERSIONS))
        return self.folder / f"{self.name}-{hashlib.sha256(text.encode()).hexdigest()[:24]}.nbc"

    def load_overload(self, signature: Any, context: Any) -> CompileResult | None:
        """The compiled code of a signature, None where there is none. What cannot be loaded is removed."""
        context.refresh()
        magic = context.codegen().magic_tuple()
        path = self.path(signature, magic)
        try:
            return CompileResult._rebuild(context, *_payload(path.read_bytes(), self._key(signature, magic)))
        except FileNotFoundError:
            return None
        except Exception:  # a pickle may raise any
            _remove(path)
            return None

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Write compiled code, or say once a process that it cannot be."""
        if compiled.library.has_dynamic_globals:
            return  # addresses of this process stand in the code
        magic = compiled.codegen.magic_tuple()
        content = dumps((self._key(signature, magic), compiled._reduce()))
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            write_whole(self.path(signature, magic), with_digest(content))
        except OSError as error:
            warn_once(self.folder, error.strerror)

    def flush(self) -> None:
        """Remove all that is kept of the function."""
        for path in self.folder.glob(f"{self.name}-*.nbc"):
            _remove(path)

    def _key(self, signature: Any, magic: tuple[Any, ...]) -> tuple[Any, ...]:
        return self.name, self.stamp, signature, magic, VERSIONS


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under another name and rename it. Raises OSError, and leaves no part of it."""
    unfinished = path.with_name(f"{path.name}.{secrets.token_hex(8)}")
    try:
        unfinished.write_bytes(content)
        if path.is_dir():
            _remove(path)
        unfinished.replace(path)
    except BaseException:
        _remove(unfinished)
        raise


@functools.cache
def warn_once(folder: Path, why: str | None) -> None:
    """Say that compiled code is not kept; a handler of ``logging`` may take it elsewhere."""
    logging.getLogger("rbdyn").warning(
        "compiled code cannot be kept in %s (%s): every run compiles anew; let NUMBA_CACHE_DIR name another folder",
        folder,
        why,
    )


def _payload(data: bytes, key: tuple[Any, ...]) -> tuple[Any, ...]:
    """What was compiled. Raises ValueError where the file is not as it was written, or of something else."""
    written, compiled = pickle.loads(content_of(data))
    if written != key:
        raise ValueError("compiled code of something else")
    return compiled


def _remove(path: Path) -> None:
    """Remove a file, or what stands in its place, as far as that is allowed."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with contextlib.suppress(OSError):
            path.unlink()


def _text(of: Any) -> str:
    """Types of a signature by names that tell apart named tuples of one name from different modules."""
    if isinstance(of, types.NamedTuple | types.NamedUniTuple):
        kind = of.instance_class
        return f"{kind.__module__}.{kind.__qualname__}({', '.join(map(_text, of.types))})"
    if isinstance(of, tuple):
        return f"({', '.join(map(_text, of))})"
    return str(of)
