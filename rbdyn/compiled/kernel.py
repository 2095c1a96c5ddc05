"""How compiled code is made here: plain kernels, laws chosen by type, and cached entry points.

- ``@kernel``: a small pure function of floats and arrays, compiled as part of whatever calls it.
- ``@law``: a function whose body is chosen, at compile time, by the type of its first argument (a
  NamedTuple of parameters). A law that a scene leaves out is thus not compiled at all.
- ``@entry``: the few functions called from Python, and large ones that several of these share. Their machine code is
  kept on disk, in a folder named by a hash of every module that kernels are made of (``records.sources``), so that
  an edit can never bring back stale code.

``parts`` compiles all of them from numba's inner parts, which a new release may change. Where this numba lacks one, or the
self-test fails, its own ``njit`` compiles them: the same bits, more than twice the time. ``compiler_notes`` says so.

Machine code on disk is one file for each function and signature, whole or absent, and checked before it is used. numba's own
cache trusts what it reads: an empty file ends the process, and a flipped bit becomes machine code. Here a file opens with
the hash of the rest, and the rest names what it is of. What fails a check is removed and compiled anew. A file gets its name
once it is whole, so that processes may share a folder. Where nothing can be written the run goes on without.
"""

import contextlib
import functools
import hashlib
import inspect
import logging
import os
import pickle
import re
import secrets
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import llvmlite
import numba
import numba.extending
from llvmlite.binding import get_host_cpu_features
from numba import njit, types

from rbdyn.base.cache import content_of, user_cache, with_digest
from rbdyn.base.sources import compiled_digest

# Set to anything in the environment, numba's own njit compiles.
STOCK = "RBDYN_STOCK_NUMBA"
# Doubles in the widest vector register. Loops that run over whole vectors leave no scalar rest; results do not depend on
# it, for every lane is rounded by itself.
VECTOR = 8 if get_host_cpu_features().get("avx512f") else 4
# Code in a file depends on them.
VERSIONS = (sys.implementation.cache_tag, llvmlite.__version__, numba.__version__)
# Whether kernels stay Python: NUMBA_DISABLE_JIT.
INTERPRETED: bool = getattr(numba.config, "DISABLE_JIT", False)


@functools.cache
def cache_folder() -> Path | None:
    """Folder of the compiled code of exactly these kernels, made when it is first needed; None where there is no home."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    base = Path(named).absolute() if named else user_cache()
    digest = hashlib.sha256(repr((VERSIONS, compiled_digest())).encode())
    return None if base is None else base / "rbdyn" / digest.hexdigest()[:16]


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


def _remove(path: Path) -> None:
    """Remove a file, or what stands in its place, as far as that is allowed."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with contextlib.suppress(OSError):
            path.unlink()


def working_parts() -> tuple[ModuleType | None, str]:
    """The module ``parts`` where it works with this numba, else None and why."""
    if os.environ.get(STOCK):
        return None, f"{STOCK} is set"
    try:
        from rbdyn.compiled import parts

        _test_once(parts.self_test)
    except Exception as error:  # numba puts what goes wrong in a compiler into errors of its own
        return None, f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
    return parts, ""


def compiler_notes() -> tuple[str, ...]:
    """A sentence where stock numba compiles, for a person who asks for details."""
    sentence = (
        f"stock numba {numba.__version__} compiles ({WHY_STOCK}): the results are the same, "
        "the first run takes more than twice as long"
    )
    return (sentence,) if WHY_STOCK else ()


def _test_once(self_test: Callable[[], None]) -> None:
    """Run the self-test unless it passed before with the same versions and the same code."""
    folder = cache_folder()
    passed = None if folder is None else folder / "self-test-passed"
    if INTERPRETED or (passed is not None and passed.exists()):
        return
    self_test()
    if passed is not None:
        with contextlib.suppress(OSError):
            passed.parent.mkdir(parents=True, exist_ok=True)
            write_whole(passed, b"")


PARTS, WHY_STOCK = working_parts()
# In the name of what is kept on disk, for each way takes its own.
WAY = "parts" if PARTS else "stock"
# No relaxed arithmetic at all. The compiler keeps a scalar and a vector version of a loop and takes one by where the
# arrays happen to lie: only when every operation is rounded by itself do both give the same bits. And NaN stays a signal.
OPTIONS: dict[str, Any] = {"error_model": "numpy"}
# Calls of compiled code return tuples through memory and carry an error status: small functions must vanish.
INLINED: dict[str, Any] = {**OPTIONS, **(PARTS.INLINED if PARTS else {"forceinline": True})}
SETTLED: dict[str, Any] = {**OPTIONS, **(PARTS.SETTLED if PARTS else {"forceinline": True})}
ROUTINE: dict[str, Any] = {**OPTIONS, **(PARTS.ROUTINE if PARTS else {"forceinline": False})}
ENTRY: dict[str, Any] = {**OPTIONS, **(PARTS.ENTRY if PARTS else {}), "nogil": True}


def _inner(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    make: Any = njit  # whose stubs leave these options out
    compiled = make(**options)(function)
    return PARTS.Inner.of(compiled) if PARTS and not INTERPRETED else compiled


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a small pure function into its callers; ``.py_func`` keeps the interpreted one."""
    return _inner(function, INLINED)


def settled_kernel(function: Callable[..., Any]) -> Any:
    """``kernel`` with a ``reordered_sum``: its order is chosen here, the same for all callers."""
    return _inner(function, SETTLED)


def routine(function: Callable[..., Any]) -> Any:
    """Compile a longer function that is called from several places and not copied into them."""
    return _inner(function, ROUTINE)


def law(declaration: Callable[..., Any]) -> Any:
    """Declare a law. Register a body for one or more parameter types with ``@declared.body(ParameterType)``; ``.bodies``
    holds them by type.

    Works compiled (the choice costs nothing) and interpreted. Raises TypeError where no body is registered.
    """
    bodies: dict[type, Callable[..., Any]] = {}

    @functools.wraps(declaration)
    def choice(parameters: Any, *arguments: Any) -> Any:
        if type(parameters) not in bodies:
            raise TypeError(f"{declaration.__name__} has no body for {type(parameters).__name__}")
        return bodies[type(parameters)](parameters, *arguments)

    def body(*parameter_types: type) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
        def register(function: Callable[..., Any]) -> Callable[..., Any]:
            bodies.update(dict.fromkeys(parameter_types, function))
            return function

        return register

    def choose_at_compile_time(parameters: types.Type, *arguments: types.Type) -> Callable[..., Any] | None:
        return bodies.get(getattr(parameters, "instance_class", type(None)))

    choice.body, choice.bodies = body, bodies  # type: ignore[attr-defined]
    overload: Any = numba.extending.overload
    overload(choice, jit_options=INLINED, strict=False)(choose_at_compile_time)
    return choice


def _leaves(of: Any) -> list[types.Type]:
    if isinstance(of, types.NamedTuple | types.NamedUniTuple):
        return [leaf for field in of.types for leaf in _leaves(field)]
    return [of]


def alike(one: Any, other: Any) -> bool:
    """Whether two sets of parameters are of one type, and made of numbers only; known at compile time."""
    if isinstance(one, tuple) and type(one) is type(other):
        return all(alike(x, y) for x, y in zip(one, other, strict=True))
    return isinstance(one, float | int) and isinstance(other, float | int)


@numba.extending.overload(alike, jit_options=INLINED)  # type: ignore[arg-type]
def _alike(one, other):
    answer = _mixable(one, other)

    def body(one, other):
        return answer

    return body


def either(first: bool, one: Any, other: Any) -> Any:
    """``one`` or ``other``, number by number, so that neighbouring lanes may choose differently without a branch.

    Where they are not alike they cannot be mixed: ``other``, whatever is asked for.
    """
    return one if first and alike(one, other) else other


@numba.extending.overload(either, jit_options=INLINED)  # type: ignore[arg-type]
def _either(first, one, other):
    if not _mixable(one, other):

        def body(first, one, other):
            return other

        return body
    return _choice(one)


def _mixable(one: Any, other: Any) -> bool:
    return one == other and all(isinstance(leaf, types.Number) for leaf in _leaves(one))


def _choice(of: Any) -> Callable[..., Any]:
    if isinstance(of, types.Number):

        def body(first, one, other):
            return one if first else other

        return body
    fields = "".join(f"either(first, one.{name}, other.{name})," for name in of.fields)
    names: dict[str, Any] = {"either": either, "record": of.instance_class, "__name__": __name__}
    exec(f"def body(first, one, other): return record({fields})", names)
    body_of_record: Callable[..., Any] = names["body"]
    return body_of_record


def entry(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls: releases the GIL and keeps its machine code on disk."""
    make: Any = njit
    compiled = make(**ENTRY)(function)
    if not INTERPRETED:
        compiled = PARTS.Entry.of(compiled) if PARTS else compiled
        if (folder := cache_folder()) is not None:
            keep_code(compiled, folder)
    return compiled


def keep_code(compiled: Any, folder: Path) -> None:
    """Let a dispatcher keep its machine code in a folder, and look for it there."""
    try:
        compiled._cache = EntryCache(compiled.py_func, folder)
    except OSError:
        return  # without a source file nothing distinguishes old code from new
    except (ImportError, AttributeError) as error:
        warn_once(
            f"numba {numba.__version__} lacks what keeping compiled code needs ({error}): every run compiles anew"
        )


class EntryCache:
    """Compiled code of one function; the methods are those that numba's dispatcher calls."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        """Raises OSError where the source file of the function cannot be read, ImportError or AttributeError where this numba
        lacks what it takes."""
        from numba.core.compiler import CompileResult
        from numba.core.serialize import dumps

        self.dumps, self.reduce, self.rebuild = dumps, CompileResult._reduce, CompileResult._rebuild
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
        text = repr((_text(signature), magic, WAY, VERSIONS))
        return self.folder / f"{self.name}-{hashlib.sha256(text.encode()).hexdigest()[:24]}.nbc"

    def load_overload(self, signature: Any, context: Any) -> Any:
        """The compiled code of a signature, None where there is none. What cannot be loaded is removed."""
        context.refresh()
        magic = context.codegen().magic_tuple()
        path = self.path(signature, magic)
        try:
            return self.rebuild(context, *_payload(path.read_bytes(), self._key(signature, magic)))
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
        content = self.dumps((self._key(signature, magic), self.reduce(compiled)))
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            write_whole(self.path(signature, magic), with_digest(content))
        except OSError as error:
            warn_once(
                f"compiled code cannot be kept in {self.folder} ({error.strerror}): every run compiles anew; "
                "let NUMBA_CACHE_DIR name another folder"
            )

    def flush(self) -> None:
        """Remove all that is kept of the function."""
        for path in self.folder.glob(f"{self.name}-*.nbc"):
            _remove(path)

    def _key(self, signature: Any, magic: tuple[Any, ...]) -> tuple[Any, ...]:
        return self.name, self.stamp, signature, magic, WAY, VERSIONS


@functools.cache
def warn_once(sentence: str) -> None:
    """Say that compiled code is not kept; a handler of ``logging`` may take it elsewhere."""
    logging.getLogger("rbdyn").warning(sentence)


def _payload(data: bytes, key: tuple[Any, ...]) -> tuple[Any, ...]:
    """What was compiled. Raises ValueError where the file is not as it was written, or of something else."""
    written, compiled = pickle.loads(content_of(data))
    if written != key:
        raise ValueError("compiled code of something else")
    return compiled


def _text(of: Any) -> str:
    """Types of a signature by names that distinguish named tuples of one name from different modules."""
    if isinstance(of, types.NamedTuple | types.NamedUniTuple):
        kind = of.instance_class
        return f"{kind.__module__}.{kind.__qualname__}({', '.join(map(_text, of.types))})"
    if isinstance(of, tuple):
        return f"({', '.join(map(_text, of))})"
    return str(of)
