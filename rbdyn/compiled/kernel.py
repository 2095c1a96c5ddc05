"""Compiled code: plain kernels, laws by type, and cached entry points.

- ``@kernel``: a small pure function of floats and arrays, compiled as part of its callers.
- ``@law``: a function with a body for each type of its first argument (a NamedTuple of parameters), selected at compile time. A
  law that a scene does not use is not compiled.
- ``@entry``: the few functions called from Python, and large ones that several of these share. Their machine code is saved in a
  folder named by a hash of all modules with kernels (``base.digests``), so an edit never reuses stale code.

``parts`` compiles all of them from numba's internal parts, which a new release may change. Where this numba lacks a part, or the
self-test fails, its own ``njit`` compiles them: the same bits in more than twice the time. ``compiler_notes`` reports it.

Machine code on disk is one complete file for each function and signature, verified before use. numba's own cache trusts its
files: an empty file ends the process, and a flipped bit becomes machine code. Here a file begins with the hash of the rest, which
names its function and signature. A file that fails a check is removed and compiled anew. It gets its final name when complete, so
processes may share a folder. A run continues without saved code where nothing can be written.
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
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import llvmlite
import numba
import numba.extending
from llvmlite.binding import get_host_cpu_features, get_host_cpu_name
from numba import njit, types

from rbdyn.base.digests import compiled_digest, content_of, user_cache, with_digest
from rbdyn.base.notes import Note, Notes

# Environment variable that selects numba's own njit.
STOCK = "RBDYN_STOCK_NUMBA"
# Doubles in the widest vector register that LLVM fills: on other makers' processors than AMD's it halves registers of 512 bits.
# Loops over whole vectors have no scalar rest. Results do not depend on it, since each lane is rounded separately.
VECTOR = 8 if get_host_cpu_name().startswith("znver") and get_host_cpu_features().get("avx512f") else 4
# Versions on which saved code depends.
VERSIONS = (sys.implementation.cache_tag, llvmlite.__version__, numba.__version__)
# Whether kernels stay Python: NUMBA_DISABLE_JIT.
INTERPRETED: bool = getattr(numba.config, "DISABLE_JIT", False)


@functools.cache
def cache_folder() -> Path | None:
    """Folder of the compiled code of exactly these kernels, created at the first use; None for a user without a home."""
    override = os.environ.get("NUMBA_CACHE_DIR")
    base = Path(override).absolute() if override else user_cache()
    digest = hashlib.sha256(repr((VERSIONS, compiled_digest())).encode())
    return None if base is None else base / "rbdyn" / digest.hexdigest()[:16]


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under another name and rename it. Raises OSError without leaving a partial file."""
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
    """Remove a file, or a folder of that name, as far as permissions allow."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with contextlib.suppress(OSError):
            path.unlink()


def working_parts() -> tuple[ModuleType | None, str]:
    """The module ``parts`` where it works with this numba, else None with the reason."""
    if os.environ.get(STOCK):
        return None, f"{STOCK} is set"
    try:
        from rbdyn.compiled import parts

        _test_once(parts.self_test)
    except Exception as error:  # numba raises errors of its own for failures of a compiler
        return None, f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
    return parts, ""


def compiler_notes() -> Notes:
    """A sentence where stock numba compiles, for verbose output."""
    sentence = (
        f"compiler: stock numba {numba.__version__} compiles ({WHY_STOCK}): the results are the same, "
        "the first run takes more than twice as long"
    )
    return (Note("method", sentence),) if WHY_STOCK else ()


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


OWN_COMPILER, WHY_STOCK = working_parts()
# In the name of what is kept on disk, for each way takes its own.
WAY = "parts" if OWN_COMPILER else "stock"
# No relaxed arithmetic at all. The compiler keeps a scalar and a vector version of a loop and takes one by where the
# arrays happen to lie: only when every operation is rounded by itself do both give the same bits. And NaN stays a signal.
OPTIONS: dict[str, Any] = {"error_model": "numpy"}
# Calls of compiled code return tuples through memory and carry an error status: small functions must vanish.
INLINED: dict[str, Any] = {**OPTIONS, **(OWN_COMPILER.INLINED if OWN_COMPILER else {"forceinline": True})}
ROUTINE: dict[str, Any] = {**OPTIONS, **(OWN_COMPILER.ROUTINE if OWN_COMPILER else {"forceinline": False})}
ENTRY: dict[str, Any] = {**OPTIONS, **(OWN_COMPILER.ENTRY if OWN_COMPILER else {}), "nogil": True}


def _inner(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    make: Any = njit  # whose stubs leave these options out
    compiled = make(**options)(function)
    return OWN_COMPILER.Inner.of(compiled) if OWN_COMPILER and not INTERPRETED else compiled


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a small pure function into its callers; ``.py_func`` is the interpreted one."""
    return _inner(function, INLINED)


def routine(function: Callable[..., Any]) -> Any:
    """Compile a longer function that several kernels call, without a copy in each of them."""
    return _inner(function, ROUTINE)


def law(declaration: Callable[..., Any]) -> Any:
    """Declare a law.

    ``@declared.body(ParameterType)`` registers a body for one or more parameter types; ``.bodies`` holds them by type. Works
    compiled (the choice costs nothing) and interpreted. Raises TypeError for a type without a body.
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


def law_of(*parameter_types: type) -> Callable[[Callable[..., Any]], Any]:
    """Declare a law whose declaration is its body for these parameter types; one without code does nothing and returns None."""

    def declare(declaration: Callable[..., Any]) -> Any:
        choice = law(declaration)
        choice.body(*parameter_types)(declaration)
        return choice

    return declare


def _leaves(form: Any) -> list[types.Type]:
    if isinstance(form, types.NamedTuple | types.NamedUniTuple):
        return [leaf for field in form.types for leaf in _leaves(field)]
    return [form]


def alike(left: Any, right: Any) -> bool:
    """Whether two sets of parameters have one type and numbers only; decided at compile time."""
    if isinstance(left, tuple) and type(left) is type(right):
        return all(alike(x, y) for x, y in zip(left, right, strict=True))
    return isinstance(left, float | int) and isinstance(right, float | int)


@numba.extending.overload(alike, jit_options=INLINED)  # type: ignore[arg-type]
def _alike(left, right):
    answer = _mixable(left, right)

    def body(left, right):
        return answer

    return body


def either(first: bool, left: Any, right: Any) -> Any:
    """``left`` or ``right``, number by number, so that neighbouring lanes may choose differently without a branch.

    Sets that are not ``alike`` cannot be mixed and always give ``right``.
    """
    return left if first and alike(left, right) else right


@numba.extending.overload(either, jit_options=INLINED)  # type: ignore[arg-type]
def _either(first, left, right):
    if not _mixable(left, right):

        def body(first, left, right):
            return right

        return body
    return _choice(left)


def _mixable(left: Any, right: Any) -> bool:
    return left == right and all(isinstance(leaf, types.Number) for leaf in _leaves(left))


def _choice(form: Any) -> Callable[..., Any]:
    if isinstance(form, types.Number):

        def body(first, left, right):
            return left if first else right

        return body
    fields = "".join(f"either(first, left.{name}, right.{name})," for name in form.fields)
    names: dict[str, Any] = {"either": either, "record": form.instance_class, "__name__": __name__}
    exec(f"def body(first, left, right): return record({fields})", names)
    body_of_record: Callable[..., Any] = names["body"]
    return body_of_record


def entry(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls, without the GIL and with its machine code saved on disk."""
    make: Any = njit
    compiled = make(**ENTRY)(function)
    if not INTERPRETED:
        compiled = OWN_COMPILER.Entry.of(compiled) if OWN_COMPILER else compiled
        if (folder := cache_folder()) is not None:
            save_code(compiled, folder)
    return compiled


def save_code(compiled: Any, folder: Path) -> None:
    """Let a dispatcher save its machine code in a folder, and load it from there."""
    try:
        compiled._cache = EntryCache(compiled.py_func, folder)
    except OSError:
        return  # without a source file stale code cannot be recognized
    except (ImportError, AttributeError) as error:
        warn_once(f"numba {numba.__version__} cannot save compiled code ({error}): every run compiles again")


class EntryCache:
    """Saved code of one function; numba's dispatcher calls its methods."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        """Raises OSError for an unreadable source file, ImportError or AttributeError for a numba without the necessary parts."""
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
        """File of a signature on the processor that ``magic`` names."""
        text = repr((_text(signature), magic, WAY, VERSIONS))
        return self.folder / f"{self.name}-{hashlib.sha256(text.encode()).hexdigest()[:24]}.nbc"

    def load_overload(self, signature: Any, context: Any) -> Any:
        """The saved code of a signature; None without any. A file that cannot be loaded is removed."""
        context.refresh()
        magic = context.codegen().magic_tuple()
        path = self.path(signature, magic)
        try:
            return self.rebuild(context, *_payload(path.read_bytes(), self._key(signature, magic)))
        except FileNotFoundError:
            COMPILING.begin()
            return None
        except Exception:  # a pickle may raise any
            _remove(path)
            return None

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Save compiled code, or warn once in a process that this fails."""
        COMPILING.end()
        if compiled.library.has_dynamic_globals:
            return  # the code contains addresses of this process
        magic = compiled.codegen.magic_tuple()
        content = self.dumps((self._key(signature, magic), self.reduce(compiled)))
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            write_whole(self.path(signature, magic), with_digest(content))
        except OSError as error:
            warn_once(
                f"compiled code cannot be saved in {self.folder} ({error.strerror}): every run compiles again; set NUMBA_CACHE_DIR "
                "to another folder"
            )

    def flush(self) -> None:
        """Remove all saved code of the function."""
        for path in self.folder.glob(f"{self.name}-*.nbc"):
            _remove(path)

    def _key(self, signature: Any, magic: tuple[Any, ...]) -> tuple[Any, ...]:
        return self.name, self.stamp, signature, magic, WAY, VERSIONS


class Compiling:
    """Time that compiling took so far in this process, ``seconds``, of functions within each other once; said at the first."""

    def __init__(self) -> None:
        self.seconds, self._depth, self._since = 0.0, 0, 0.0

    def begin(self) -> None:
        """A function that is not saved on disk begins to be compiled."""
        if self._depth == 0:
            self._since = time.perf_counter()
            if not self.seconds:
                logging.getLogger("rbdyn.compiled").info("Compiling ... (once; kept for later runs)")
        self._depth += 1

    def end(self) -> None:
        """It is compiled."""
        self._depth = max(self._depth - 1, 0)
        if self._depth == 0:
            self.seconds += time.perf_counter() - self._since


COMPILING = Compiling()


@functools.cache
def warn_once(sentence: str) -> None:
    """Warn that compiled code is not saved; a handler of ``logging`` may redirect the warning."""
    logging.getLogger("rbdyn").warning(sentence)


def _payload(data: bytes, key: tuple[Any, ...]) -> tuple[Any, ...]:
    """The compiled code in a file. Raises ValueError for a damaged file, or one of another function or signature."""
    own_key, compiled = pickle.loads(content_of(data))
    if own_key != key:
        raise ValueError("compiled code of another function or signature")
    return compiled


def _text(form: Any) -> str:
    """Types of a signature by names that distinguish named tuples of one name from different modules."""
    if isinstance(form, types.NamedTuple | types.NamedUniTuple):
        kind = form.instance_class
        return f"{kind.__module__}.{kind.__qualname__}({', '.join(map(_text, form.types))})"
    if isinstance(form, tuple):
        return f"({', '.join(map(_text, form))})"
    return str(form)
