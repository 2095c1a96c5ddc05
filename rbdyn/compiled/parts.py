"""Compiler of functions that only compiled code calls.

numba optimises every function with all that it calls, makes machine code of it, and does so again in each of its callers. What
is linked into callers anyway is only inlined here; the rest is done once, for the whole that Python calls. That, and not
counting references, takes two fifths of the time off the first result of a simulation and four fifths off that of a row of
balls.
"""

from typing import Any

from numba import _dynfunc  # type: ignore[attr-defined]
from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering


class Part(JITCodeLibrary):
    """Code of a function and of what it calls, to be linked into its callers; never machine code by itself."""

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
        state.flags.no_compile = True
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


class PartCompiler(CompilerBase):
    """numba's own but for the lowering."""

    lowering: type[PartLowering] = PartLowering

    def define_pipelines(self) -> list[PassManager]:
        """The one pipeline."""
        pipeline = PassManager("part")
        for kind, what in DefaultPassBuilder.define_nopython_pipeline(self.state).passes:
            pipeline.add_pass(self.lowering if kind is NativeLowering else kind, what)
        pipeline.finalize()
        return [pipeline]


class SettledCompiler(PartCompiler):
    """Compiler of a ``SettledPart``."""

    lowering = SettledLowering
