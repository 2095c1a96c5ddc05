"""Compiler of functions that only compiled code calls, made of numba's own parts: ``kernel`` does without where they changed.

numba optimises every function with all that it calls, makes machine code of it, and does so again in each of its callers. What
is linked into callers anyway is only inlined here; the rest is done once, for the whole that Python calls. Nothing is looked
for that kernels do not hold, no references are counted, and named tuples are handed on whole. Together that takes half of the
time off the first result of a simulation and four fifths off that of a row of balls. Nothing of numba's is replaced: what is
compiled by other packages in the same process is compiled as ever.
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

# Of numba's passes those that kernels need: they hold no closures, exceptions, unrolled tuples or array expressions.
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
    """Code of a function and of what it calls, to be linked into its callers; never machine code by itself."""

    def _optimize_functions(self, ll_module: Any) -> None:
        """Tidy functions up; what takes longer is done once, for the whole."""
        ll_module.data_layout = self._codegen._data_layout
        passes, builder = self._codegen._function_pass_manager(opt=1)
        for function in ll_module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    def finalize(self) -> None:
        """Link what it calls and inline it. Left for the callers to inline, small functions would swell before they shrink."""
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        passes, builder = self._codegen._module_pass_manager(
            loop_vectorize=False, slp_vectorize=False, opt=0, cost="cheap"
        )
        passes.run(self._final_module, builder)
        self._finalized = True


class SettledPart(Part):
    """A part that is optimised before it is linked into its callers."""

    def finalize(self) -> None:
        """Settle the order of sums that the compiler may choose, whatever calls them."""
        super().finalize()
        self._optimize_final_module()


def _holds_array(of: Any) -> bool:
    return isinstance(of, types.Array) or any(map(_holds_array, getattr(of, "types", ())))


@register_pass(mutates_CFG=True, analysis_only=False)
class PartLowering(NativeLowering):
    """Lowering to a ``Part``."""

    library: type[Part] = Part

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        """Leave a function for callers to link in, known by a handle of its own."""
        calls = (call.return_type for call in state.calltypes.values() if call is not None)
        if not any(map(_holds_array, (state.return_type, *calls))):
            # It makes no array and returns none: its caller holds them all, and no references need be counted.
            state.targetctx = state.targetctx.subtarget(enable_nrt=False)
        state.library = self.library(state.targetctx.codegen(), state.func_id.func_qualname)
        super().run_pass(state)
        code = state["cr"]
        handle = _dynfunc.make_function(code.fndesc.lookup_module(), code.fndesc.qualname, "", 0, code.env, ())
        state.targetctx.insert_user_function(handle, code.fndesc, [state.library])
        state.reload_init.extend(state.library._reload_init)
        state["cr"] = code._replace(cfunc=handle)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class SettledLowering(PartLowering):
    """Lowering to a ``SettledPart``."""

    library = SettledPart


class Whole:
    """An argument handed on as it is. numba would take a tuple apart and build it anew at every call."""

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
    """Type of an index whose integers count from the start: numba looks for a negative one only where there can be one."""
    if isinstance(index, types.Integer):
        bits: Any = index  # whose stubs leave this out
        return types.Integer.from_bitwidth(bits.bitwidth, signed=False)
    if isinstance(index, types.UniTuple):
        return types.UniTuple(_from_start(index.dtype), index.count)
    if isinstance(index, types.Tuple):
        kinds = [_from_start(kind) for kind in index.types]
        return (
            index if len(set(kinds)) == 1 else types.Tuple(kinds)
        )  # of one type it would be laid out as another tuple
    return index


class KernelContext(CPUContext):
    """How kernels become machine code: named tuples as ``WHOLE`` says, and every index of an array counts from the start.

    Where an index might count from the end, vector code must look first, and reads and writes one by one.
    """

    @classmethod
    def of(cls, context: CPUContext) -> "KernelContext":
        """A copy of a context that differs in this only."""
        own = context.subtarget(data_model_manager=WHOLE)
        own.__class__ = cls
        return own

    def get_function(self, fn: Any, sig: Any, _firstcall: bool = True) -> Any:
        """What reads or writes an item of an array, its indices without a sign; all else is numba's."""
        key = getattr(fn, "typing_key", None)
        if key in (operator.getitem, operator.setitem) and isinstance(sig.args[0], types.Array):
            array, index, *value = sig.args
            fn, sig = key, sig.replace(args=(array, _from_start(index), *value))
        return super().get_function(fn, sig, _firstcall)


class PartFlags(Flags):
    """Options that stay as they are: numba looks functions up by them, thousands of times."""

    __eq__, __hash__ = object.__eq__, object.__hash__

    @staticmethod
    @functools.cache
    def of(flags: Flags) -> "PartFlags":
        """The one instance of these options."""
        own: Any = PartFlags(flags)
        own.no_compile = True
        return own

    def copy(self) -> "PartFlags":
        """Itself."""
        return self


class Passes(PassManager):
    """Passes one after the other, without timings, events and descriptions of types for each of them."""

    def run(self, state: Any) -> None:
        """Take a function through all passes."""
        for kind, _ in self.passes:
            one = _pass_registry.get(kind).pass_inst
            one.analysis = self._analysis
            one.run_pass(state)


class KernelCompiler(CompilerBase):
    """numba's own but for passes that look for what no kernel holds, and for how named tuples are handed on."""

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


class SettledCompiler(PartCompiler):
    """Compiler of a ``SettledPart``."""

    lowering = SettledLowering


# Options of each kind of function. What is not said here would be as in the caller that came first.
WRAPPERS = ("no_cpython_wrapper", "no_cfunc_wrapper")
ROUTINE: dict[str, Any] = {**dict.fromkeys(WRAPPERS, True), "pipeline_class": PartCompiler, "forceinline": False}
INLINED: dict[str, Any] = {**ROUTINE, "forceinline": True}
SETTLED: dict[str, Any] = {**INLINED, "pipeline_class": SettledCompiler}
ENTRY: dict[str, Any] = {"no_cfunc_wrapper": True, "pipeline_class": KernelCompiler}


class Inner(CPUDispatcher):
    """Machine code that compiled code calls: without the wrappers that Python would need, a fifth of the time of compiling.

    A call from Python goes to a twin that has them, compiled when first called.
    """

    @classmethod
    def of(cls, dispatcher: Any) -> "Inner":
        """The dispatcher itself, of this kind from now on."""
        dispatcher.__class__ = cls
        return dispatcher

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Compile once for all values of an argument: numba would do so for each constant anew."""
        plain = types.unliteral
        return super().get_call_template([plain(one) for one in args], {name: plain(one) for name, one in kws.items()})

    def compile(self: Any, sig: Any) -> Any:
        """Compile without timing it for every caller that waits."""
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
        """The dispatcher itself, of this kind from now on."""
        dispatcher.__class__ = cls
        return dispatcher

    def compile(self, sig: Any) -> Any:
        """Compile without looking for garbage: nearly nothing is, and the search takes a tenth of the time."""
        enabled = gc.isenabled()
        gc.disable()
        try:
            return super().compile(sig)
        finally:
            if enabled:
                gc.enable()


class Probe(NamedTuple):
    """What the self-test hands on whole."""

    factor: float
    rows: Any


def self_test() -> None:
    """Compile a small function of each kind. Raises RuntimeError where the answer is wrong, whatever numba raises where it cannot."""
    make: Any = numba.njit

    def compiled(options: dict[str, Any], kind: Any = Inner) -> Callable[[Any], Any]:
        return lambda function: kind.of(make(error_model="numpy", **options)(function))

    @compiled(SETTLED)
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
    def whole(probe, sums):
        for n in range(len(sums)):
            sums[n] = scaled(probe, n).factor
        return scaled(probe, 0)

    sums, rows = np.zeros(2), np.array([[1.0, 2.0, 4.0], [0.5, -1.0, 8.0]])
    first, same = whole(Probe(-2.0, rows), sums)
    if sums.tolist() != [-14.0, -15.0] or first != -14.0 or not np.array_equal(same, rows):
        raise RuntimeError(f"the self-test of compiled code gave {sums.tolist()}")
