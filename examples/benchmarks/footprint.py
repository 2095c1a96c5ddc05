"""What a scene and each of its options make the program hold: state, parameters, compiled code, modules.

``python examples/benchmarks/footprint.py [SCENE.toml]``
"""

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from studies import main, printed

if TYPE_CHECKING:
    from rbdyn.accuracy.report import Report, Reporter
    from rbdyn.dynamics.forces.equations import RollerBearing
    from rbdyn.scene import Scene


@dataclass(frozen=True)
class Footprint:
    """Numbers in the state vector, bytes of parameters, instructions of the time integration."""

    state: int
    parameter_bytes: int
    instructions: int


def footprint(scene: "Scene", bearing: "RollerBearing") -> Footprint:
    """Sizes for a scene whose bearing has been run. Raises KeyError where nothing was compiled for its laws."""
    from rbdyn.dynamics.parameters.state import layout_of
    from rbdyn.dynamics.run import explicit_method, method_of

    pair = method_of(explicit_method(scene), scene, bearing)
    return Footprint(layout_of(scene).size, parameter_bytes(bearing), instructions(bearing, pair))


def parameter_bytes(parameters: Any) -> int:
    """Size of all numbers and arrays within the parameters of a bearing."""
    single = (part for part in _parts(parameters) if not isinstance(part, tuple))
    return sum(part.nbytes if isinstance(part, np.ndarray) else 8 for part in single)


def _parts(parameters: Any) -> Iterator[Any]:
    yield parameters
    if isinstance(parameters, tuple):
        for part in parameters:
            yield from _parts(part)


def instructions(bearing: "RollerBearing", pair: Any) -> int:
    """Instructions (of LLVM, optimised) that the time integration of a bearing by an explicit pair was compiled to.

    Raises KeyError where the integration was not yet compiled, or loaded, for these types of laws.
    """
    import numba

    from rbdyn.dynamics.integrators.advance import advance

    kind, of_pair = numba.typeof(bearing), numba.typeof(pair)
    for signature, compiled in advance.overloads.items():
        carry = signature[2]
        if signature[0] == kind and carry.types[carry.fields.index("method")] == of_pair:
            module = compiled.library._get_module_for_linking()
            return sum(1 for body in module.functions for block in body.blocks for _ in block.instructions)
    raise KeyError(kind)


def added_modules(plain: "Scene", scenes: "Sequence[Scene]") -> list[tuple[str, ...]]:
    """Modules of this package that each scene loads and the plain one does not, found in a fresh interpreter.

    Raises RunError where that interpreter fails.
    """
    data = [scene.model_dump(mode="json", exclude_none=True) for scene in (plain, *scenes)]
    fault = "the modules of the options could not be listed"
    return [tuple(modules) for modules in json.loads(printed(print_added_modules, data, fault, NUMBA_DISABLE_JIT="1"))]


def print_added_modules() -> None:
    """Read scenes from standard input; print, for each after the first, the modules it adds to those of the first."""
    from rbdyn.scene import Scene

    scenes = [Scene.from_dict(data) for data in json.load(sys.stdin)]
    _build(scenes[0])
    plain = set(sys.modules)
    added = []
    for scene in scenes[1:]:
        _build(scene)
        new = [name for name in sys.modules if name not in plain and name.split(".")[0] == "rbdyn"]
        added.append(sorted(new))
        for name in new:  # so that the next scene has to load it again
            del sys.modules[name]
    print(json.dumps(added))


def _build(scene: "Scene") -> None:
    """Load what the simulation of a scene does, from its bearing to the report of its races."""
    from rbdyn.dynamics import simulate
    from rbdyn.dynamics.parameters.validity import race_report

    simulate.roller_bearing(scene)
    race_report(scene, 100.0, 100.0)


def study(
    scene: "Scene", progress: "Reporter" = None, options: "Mapping[str, Sequence[str]] | None" = None
) -> "Report":
    """A row an option that the scene allows, the plain scene first. Raises RunError, KeyboardInterrupt."""
    from rbdyn.accuracy.report import Progress, reported
    from rbdyn.accuracy.variants import OPTIONS, lawful
    from rbdyn.base.blocks import Table
    from rbdyn.dynamics.parameters.model import roller_bearing
    from rbdyn.dynamics.run import prepare

    variants = {"as given": scene, **lawful(scene, OPTIONS if options is None else options)}
    modules = added_modules(scene, list(variants.values()))
    rows = []
    for (name, variant), added in Progress(progress, len(variants)).over(zip(variants.items(), modules, strict=True)):
        bearing = roller_bearing(variant)
        prepare(variant, bearing)
        rows.append({"option": name, **asdict(footprint(variant, bearing)), "modules": " ".join(added)})
    header = "option", "state", "parameters [B]", "instructions", "modules that only it loads"
    table = Table(
        "what each option makes the program hold", header, [[str(cell) for cell in row.values()] for row in rows]
    )
    return reported("footprint", (table,), (), rows, options=rows)


if __name__ == "__main__":
    sys.exit(main(study, __doc__))
