"""What a scene makes the program hold: types of laws, state, parameters, compiled code, modules."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rbdyn.faults import RunError

if TYPE_CHECKING:
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
    from rbdyn.dynamics.integrators.method import explicit_method, method_of
    from rbdyn.dynamics.parameters.scales import layout_of

    pair = method_of(explicit_method(scene.numerics.method, scene.numerics.rtol), scene, bearing)
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
        if signature[0] == kind and signature[2].types[-1] == of_pair:
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


def printed(function: Callable[[], None], data: Any, fault: str, **environment: str) -> str:
    """What a function of this package prints in a fresh interpreter that is given ``data`` as JSON on standard input.

    Raises RunError, which begins with ``fault``, where that interpreter fails.
    """
    name = function.__name__
    run = subprocess.run(
        [sys.executable, "-c", f"from {function.__module__} import {name}; {name}()"],
        input=json.dumps(data),
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    if run.returncode != 0:
        raise RunError(f"{fault}: {next(reversed(run.stderr.strip().splitlines()), 'no reason given')}")
    return run.stdout


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

    simulate.roller_bearing(scene)
    simulate.race_report(scene, 100.0, 100.0)
