"""Compiler of functions that only compiled code calls, from numba's own parts; ``kernel`` works without it where these changed.

numba optimises every function with all its callees and generates machine code for it, then repeats this in each caller. Here a
function that is linked into callers is only inlined; optimisation and code generation happen once, for the function that Python
calls. Passes for features that kernels lack are left out, references are not counted, and named tuples are passed whole. This
halves the time to the first result of a simulation, and leaves a fifth of it for a row of balls. Nothing of numba is replaced:
other packages in the same process compile as usual.
"""

import functools
import gc
import operator
from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numpy as np
from numba import _dynfunc  # type: ignore[attr-defined]
from numba.core import event, types
from numba.core import typed_passes as typed
from numba.core import untyped_passes as untyped
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, Flags
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager, _pass_registry, register_pass
from numba.core.cpu import CPUContext
from numba.core.datamodel import default_manager, models
from numba.core.datamodel.manager import DataModelManager
from numba.core.registry import CPUDispatcher
from numba.core.sigutils import normalize_signature
from numba.core.typed_passes import NativeLowering

# numba's passes that kernels need: they have no closures, exceptions, unrolled tuples or array expressions.
BEFORE_LOWERING = (
    untyped.TranslateByteCode,
    untyped.FixupArgs,
    untyped.IRProcessing,
    untyped.RewriteSemanticConstants,
    untyped.DeadBranchPrune,
    untyped.GenericRewrites,
    untyped.ReconstructSSA,
    untyped.DeadBranchPrune,
    typed.NopythonTypeInference,
    typed.PreLowerStripPhis,
    typed.IRLegalization,
    typed.AnnotateTypes,
)


class Part(JITCodeLibrary):
    """Code of a function and its callees for linking into its callers, without machine code of its own."""

    def _optimize_functions(self, ll_module: Any) -> None:
        """Simplify functions; longer optimisation happens once, for the whole."""
        ll_module.data_layout = self._codegen._data_layout
        passes, builder = self._codegen._function_pass_manager(opt=1)
        for function in ll_module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    def finalize(self) -> None:
        """Link callees and inline them here: inlined by the callers, small functions would grow before they shrink."""
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        passes, builder = self._codegen._module_pass_manager(
            loop_vectorize=False, slp_vectorize=False, opt=0, cost="cheap"
        )
        passes.run(self._final_module, builder)
        self._finalized = True


def _holds_array(form: Any) -> bool:
    return isinstance(form, types.Array) or any(map(_holds_array, getattr(form, "types", ())))


@register_pass(mutates_CFG=True, analysis_only=False)
class PartLowering(NativeLowering):
    """Lowering to a ``Part``."""

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        """Provide a function for linking into callers, with a handle of its own."""
        calls = (call.return_type for call in state.calltypes.values() if call is not None)
        if not any(map(_holds_array, (state.return_type, *calls))):
            # The function creates and returns no array: its caller owns all of them, so references need no count.
            state.targetctx = state.targetctx.subtarget(enable_nrt=False)
        state.library = Part(state.targetctx.codegen(), state.func_id.func_qualname)
        super().run_pass(state)
        code = state["cr"]
        handle = _dynfunc.make_function(code.fndesc.lookup_module(), code.fndesc.qualname, "", 0, code.env, ())
        state.targetctx.insert_user_function(handle, code.fndesc, [state.library])
        state.reload_init.extend(state.library._reload_init)
        state["cr"] = code._replace(cfunc=handle)
        return True


class Whole:
    """An argument passed whole, where numba would disassemble a tuple and rebuild it at every call."""

    def get_argument_type(self: Any) -> Any:
        """Its own type."""
        return self.get_value_type()

    def as_argument(self, builder: Any, value: Any) -> Any:
        """Itself."""
        return value

    from_argument = as_argument


WHOLE = DataModelManager().chain(default_manager)
for _kind, _model in ((types.NamedTuple, models.TupleModel), (types.NamedUniTuple, models.UniTupleModel)):
    WHOLE.register(_kind, type("WholeTuple", (Whole, _model), {}))


def _from_start(index: Any) -> Any:
    """Type of an index whose integers count from the start: numba tests only signed integers for a negative index."""
    if isinstance(index, types.Integer):
        bits: Any = index  # the stubs lack its width
        return types.Integer.from_bitwidth(bits.bitwidth, signed=False)
    if isinstance(index, types.UniTuple):
        return types.UniTuple(_from_start(index.dtype), index.count)
    if isinstance(index, types.Tuple):
        kinds = [_from_start(kind) for kind in index.types]
        return index if len(set(kinds)) == 1 else types.Tuple(kinds)  # a tuple of one type would have another layout
    return index


class KernelContext(CPUContext):
    """Code generation of kernels: named tuples are passed whole, and every index of an array counts from the start.

    With an index that may count from the end, vector code would have to test it, and read and write elements one by one.
    """

    @classmethod
    def of(cls, context: CPUContext) -> "KernelContext":
        """A copy of a context with this difference only."""
        target = context.subtarget(data_model_manager=WHOLE)
        target.__class__ = cls
        return target

    def get_function(self, fn: Any, sig: Any, _firstcall: bool = True) -> Any:
        """Reads and writes of array items have unsigned indices; all other functions are numba's."""
        key = getattr(fn, "typing_key", None)
        if key in (operator.getitem, operator.setitem) and isinstance(sig.args[0], types.Array):
            array, index, *value = sig.args
            fn, sig = key, sig.replace(args=(array, _from_start(index), *value))
        return super().get_function(fn, sig, _firstcall)


class PartFlags(Flags):
    """Immutable options, compared by identity: numba looks functions up by them thousands of times."""

    __eq__, __hash__ = object.__eq__, object.__hash__

    @staticmethod
    @functools.cache
    def of(flags: Flags) -> "PartFlags":
        """The one instance of these options."""
        copied: Any = PartFlags(flags)
        copied.no_compile = True
        return copied

    def copy(self) -> "PartFlags":
        """Itself."""
        return self


class Passes(PassManager):
    """Passes in sequence, without the timings, events and type descriptions of each pass."""

    def run(self, state: Any) -> None:
        """Take a function through all passes."""
        for kind, _ in self.passes:
            step = _pass_registry.get(kind).pass_inst
            step.analysis = self._analysis
            step.run_pass(state)


class KernelCompiler(CompilerBase):
    """numba's compiler without the passes that kernels do not need, and with whole named tuples."""

    lowering: type[NativeLowering] = NativeLowering

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.targetctx = KernelContext.of(self.state.targetctx)

    @classmethod
    @functools.cache
    def passes(cls) -> PassManager:
        """The one pipeline."""
        pipeline = Passes("kernel")
        for kind in (*BEFORE_LOWERING, cls.lowering, typed.NoPythonBackend):
            pipeline.add_pass(kind)
        pipeline.finalize()
        return pipeline

    def define_pipelines(self) -> list[PassManager]:
        """The one pipeline."""
        return [self.passes()]


class PartCompiler(KernelCompiler):
    """Compiler of a ``Part``."""

    lowering = PartLowering

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments[:5], PartFlags.of(arguments[5]), *arguments[6:])


# Options of each kind of function; a missing option would be that of its first caller.
WRAPPERS = ("no_cpython_wrapper", "no_cfunc_wrapper")
ROUTINE: dict[str, Any] = {**dict.fromkeys(WRAPPERS, True), "pipeline_class": PartCompiler, "forceinline": False}
INLINED: dict[str, Any] = {**ROUTINE, "forceinline": True}
ENTRY: dict[str, Any] = {"no_cfunc_wrapper": True, "pipeline_class": KernelCompiler}


class Inner(CPUDispatcher):
    """Code that compiled code calls, without the wrappers for Python, which take a fifth of the compile time.

    A call from Python uses a twin with wrappers, compiled at the first call.
    """

    @classmethod
    def of(cls, dispatcher: Any) -> "Inner":
        """The dispatcher itself, changed to this class."""
        dispatcher.__class__ = cls
        return dispatcher

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Compile once for all values of an argument, where numba would compile for each constant."""
        plain = types.unliteral
        return super().get_call_template(
            [plain(kind) for kind in args], {name: plain(kind) for name, kind in kws.items()}
        )

    def compile(self: Any, sig: Any) -> Any:
        """Compile without a timing for each waiting caller."""
        args, result = normalize_signature(sig)
        if args not in self.overloads:
            event_of_it = event.trigger_event("numba:compile", data={"dispatcher": self})
            with global_compiler_lock, self._compiling_counter, event_of_it:
                self.add_overload(self._compiler.compile(args, result))
        return self.overloads[args].entry_point

    def __call__(self, *arguments: Any) -> Any:
        """Call the twin."""
        return self.twin(*arguments)

    @functools.cached_property
    def twin(self) -> Any:
        """The same function, callable from Python."""
        options = {**self.targetoptions, **dict.fromkeys(WRAPPERS, False), "pipeline_class": KernelCompiler}
        return numba.jit(**options)(self.py_func)


class Entry(CPUDispatcher):
    """Machine code that Python calls."""

    @classmethod
    def of(cls, dispatcher: Any) -> "Entry":
        """The dispatcher itself, changed to this class."""
        dispatcher.__class__ = cls
        return dispatcher

    def compile(self, sig: Any) -> Any:
        """Compile without garbage collection, which finds nearly nothing and takes a tenth of the time."""
        enabled = gc.isenabled()
        gc.disable()
        try:
            return super().compile(sig)
        finally:
            if enabled:
                gc.enable()


class Probe(NamedTuple):
    """Argument of the self-test, passed whole."""

    factor: float
    rows: Any


def self_test() -> None:
    """Compile a small function of each kind. Raises RuntimeError for a wrong result, and any error of numba."""
    make: Any = numba.njit

    def compiled(options: dict[str, Any], kind: Any = Inner) -> Callable[[Any], Any]:
        return lambda function: kind.of(make(error_model="numpy", **options)(function))

    @compiled(INLINED)
    def row_sum(row):
        total = 0.0
        for i in range(len(row)):
            total += row[i]
        return total

    @compiled(INLINED)
    def row_of(probe, n):
        return probe.rows[n, :]

    @compiled(ROUTINE)
    def scaled(probe, n):
        return Probe(probe.factor * row_sum(row_of(probe, n)), probe.rows)

    @compiled(ENTRY, Entry)
    def scale_all(probe, sums):
        for n in range(len(sums)):
            sums[n] = scaled(probe, n).factor
        return scaled(probe, 0)

    sums, rows = np.zeros(2), np.array([[1.0, 2.0, 4.0], [0.5, -1.0, 8.0]])
    first, same = scale_all(Probe(-2.0, rows), sums)
    if sums.tolist() != [-14.0, -15.0] or first != -14.0 or not np.array_equal(same, rows):
        raise RuntimeError(f"the self-test of compiled code gave {sums.tolist()}")
