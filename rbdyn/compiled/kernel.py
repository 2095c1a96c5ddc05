"""How compiled code is made here: plain kernels, laws chosen by type, and cached entry points.

- ``@kernel``: a small pure function of floats and arrays, compiled as part of whatever calls it.
- ``@law``: a function whose body is chosen, at compile time, by the type of its first argument (a
  NamedTuple of parameters). A law that a scene leaves out is thus not compiled at all.
- ``@entry``: the few functions called from Python, and large ones that several of these share. Their machine code is
  kept on disk (``cache``), in a folder named by a hash of every module that kernels are made of (``sources``), so that
  an edit can never bring back stale code.
"""

import contextlib
import functools
import gc
import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numba.extending
from llvmlite.binding import get_host_cpu_features
from numba import njit
from numba.core import event, types
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher
from numba.core.sigutils import normalize_signature

from rbdyn.compiled.cache import EntryCache
from rbdyn.compiled.parts import KernelCompiler, PartCompiler, SettledCompiler
from rbdyn.compiled.sources import compiled_digest
from rbdyn.records.user_cache import user_cache

# No relaxed arithmetic at all. The compiler keeps a scalar and a vector version of a loop and takes one by where the
# arrays happen to lie: only when every operation is rounded by itself do both give the same bits. And NaN stays a signal.
OPTIONS: dict[str, Any] = {"error_model": "numpy"}
# Doubles in the widest vector register. Loops that run over whole vectors leave no scalar rest; results do not depend on
# it, for every lane is rounded by itself.
VECTOR = 8 if get_host_cpu_features().get("avx512f") else 4
# Calls of compiled code return tuples through memory and carry an error status: small functions must vanish.
WRAPPERS = ("no_cpython_wrapper", "no_cfunc_wrapper")
# What is not said here would be as in the caller that came first.
PART: dict[str, Any] = {
    **OPTIONS,
    **dict.fromkeys(WRAPPERS, True),
    "pipeline_class": PartCompiler,
    "forceinline": False,
}
INLINED: dict[str, Any] = {**PART, "forceinline": True}


class Inner(CPUDispatcher):
    """Machine code that compiled code calls: without the wrappers that Python would need, a fifth of the time of compiling.

    A call from Python goes to a twin that has them, compiled when first called.
    """

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Compile once for all values of an argument: numba would do so for each constant anew."""
        plain = types.unliteral
        return super().get_call_template([plain(one) for one in args], {name: plain(one) for name, one in kws.items()})

    def compile(self: Any, sig: Any) -> Any:
        """Compile without timing it for every caller that waits."""
        args, result = normalize_signature(sig)
        if args not in self.overloads:
            told = event.trigger_event("numba:compile", data={"dispatcher": self})
            with global_compiler_lock, self._compiling_counter, told:
                self.add_overload(self._compiler.compile(args, result))
        return self.overloads[args].entry_point

    def __call__(self, *arguments: Any) -> Any:
        """Call the twin."""
        return self.twin(*arguments)

    @functools.cached_property
    def twin(self) -> Any:
        """The same function, callable from Python."""
        return numba.jit(**{**self.targetoptions, **dict.fromkeys(WRAPPERS, False), "pipeline_class": KernelCompiler})(
            self.py_func
        )


class Entry(CPUDispatcher):
    """Machine code that Python calls."""

    def compile(self, sig: Any) -> Any:
        """Compile without looking for garbage: nearly nothing is, and the search takes a tenth of the time."""
        enabled = gc.isenabled()
        gc.disable()
        try:
            return super().compile(sig)
        finally:
            if enabled:
                gc.enable()


def _inner(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    make: Any = njit  # whose stubs leave these options out
    compiled = make(**options)(function)
    if isinstance(compiled, CPUDispatcher):  # a plain function where compiling is switched off
        compiled.__class__ = Inner
    return compiled


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a small pure function into its callers; ``.py_func`` keeps the interpreted one."""
    return _inner(function, INLINED)


def settled_kernel(function: Callable[..., Any]) -> Any:
    """``kernel`` with a ``reordered_sum``: its order is chosen here, the same for all callers."""
    return _inner(function, {**INLINED, "pipeline_class": SettledCompiler})


def routine(function: Callable[..., Any]) -> Any:
    """Compile a longer function that is called from several places and not copied into them."""
    return _inner(function, PART)


def law(declaration: Callable[..., Any]) -> Any:
    """Declare a law. Register a body for one or more parameter types with ``@declared.body(ParameterType)``; ``.bodies``
    holds them by type.

    Works compiled (the choice costs nothing) and interpreted. Raises TypeError where no body is registered.
    """
    bodies: dict[type, Callable[..., Any]] = {}

    @functools.wraps(declaration)
    def chosen(parameters: Any, *arguments: Any) -> Any:
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

    chosen.body, chosen.bodies = body, bodies  # type: ignore[attr-defined]
    overload: Any = numba.extending.overload
    overload(chosen, jit_options=INLINED, strict=False)(choose_at_compile_time)
    return chosen


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
    made: dict[str, Any] = {"either": either, "made": of.instance_class, "__name__": __name__}
    exec(f"def body(first, one, other): return made({fields})", made)
    chosen: Callable[..., Any] = made["body"]
    return chosen


def entry(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls: releases the GIL and keeps its machine code on disk."""
    make: Any = njit
    compiled = make(**OPTIONS, nogil=True, no_cfunc_wrapper=True, pipeline_class=KernelCompiler)(function)
    if isinstance(compiled, CPUDispatcher):
        compiled.__class__ = Entry
        if (folder := cache_folder()) is not None:
            keep_code(compiled, folder)
    return compiled


def keep_code(compiled: Any, folder: Path) -> None:
    """Let a dispatcher keep its machine code in a folder, and look for it there."""
    with contextlib.suppress(OSError):  # without a source file nothing tells old code from new
        compiled._cache = EntryCache(compiled.py_func, folder)


@functools.cache
def cache_folder() -> Path | None:
    """Folder of the compiled code of exactly these kernels, made when it is first needed; None where there is no home."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    base = Path(named).absolute() if named else user_cache()
    digest = hashlib.sha256((numba.__version__ + compiled_digest()).encode())
    return None if base is None else base / "rbdyn" / digest.hexdigest()[:16]
