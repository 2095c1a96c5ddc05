"""Compiler of functions that only compiled code calls.

numba optimises every function with all that it calls, makes machine code of it, and does so again in each of its callers. What
is linked into callers anyway is only inlined here; the rest is done once, for the whole that Python calls. Nothing is looked
for that kernels do not hold, no references are counted, and named tuples are handed on whole. Together that takes half of the
time off the first result of a simulation and four fifths off that of a row of balls.
"""

import functools
from typing import Any

from numba import _dynfunc  # type: ignore[attr-defined]
from numba.core import typed_passes as typed
from numba.core import types
from numba.core import untyped_passes as untyped
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, Flags
from numba.core.compiler_machinery import PassManager, _pass_registry, register_pass
from numba.core.datamodel import default_manager, models
from numba.core.datamodel.manager import DataModelManager
from numba.core.typed_passes import NativeLowering
from numba.np import arrayobj

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


wrapped_index = arrayobj.fix_integer_index


def index_from_start(context: Any, builder: Any, kind: types.Integer, index: Any, size: Any) -> Any:
    """An index of a kernel as it is: it counts from the start. Where it might count from the end, vector code must look first,
    and reads and writes one by one."""
    if context.data_model_manager is not WHOLE:
        return wrapped_index(context, builder, kind, index, size)
    return context.cast(builder, index, kind, types.intp)


arrayobj.fix_integer_index = index_from_start


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
        self.state.targetctx = self.state.targetctx.subtarget(data_model_manager=WHOLE)

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

    def __init__(self, *given: Any) -> None:
        super().__init__(*given[:5], PartFlags.of(given[5]), *given[6:])


class SettledCompiler(PartCompiler):
    """Compiler of a ``SettledPart``."""

    lowering = SettledLowering
