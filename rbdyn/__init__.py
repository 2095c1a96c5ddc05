"""Dynamics of rolling bearings: from a drawing and an operating point to forces, whirl and power loss, with errors.

``Scene`` reads and checks the input. ``simulate`` runs a roller bearing, ``history`` returns its motion, ``equilibrium`` solves
a ball bearing, ``simulate_duty`` runs a roller bearing at the points of a duty, ``compare`` sets two bearings side by side. Each takes a scene or the path of its file. Results save themselves, and ``load`` reads them back.
Names are fetched when first used: importing the package loads neither numba nor scipy, nor anything else but itself.
"""

TYPE_CHECKING = False  # as type checkers take it, without ``typing``
if TYPE_CHECKING:
    from pathlib import Path

    from rbdyn.base.faults import InputError, RunError
    from rbdyn.comparison import Comparison, compare
    from rbdyn.dynamics.duty_simulation import DutySimulation, simulate_duty
    from rbdyn.dynamics.motion import History, history
    from rbdyn.dynamics.simulate import simulate
    from rbdyn.quasistatic.bearing import equilibrium
    from rbdyn.quasistatic.result import BallResult
    from rbdyn.result import SimulationResult
    from rbdyn.scene import BallScene, Scene

__all__ = [
    "BallResult", "BallScene", "Comparison", "DutySimulation", "History", "InputError", "RunError", "Scene", "SimulationResult", "compare", "equilibrium", "history",
    "load", "simulate", "simulate_duty",
]  # fmt: skip

_HOMES = {
    "Scene": "rbdyn.scene",
    "BallScene": "rbdyn.scene",
    "equilibrium": "rbdyn.quasistatic.bearing",
    "BallResult": "rbdyn.quasistatic.result",
    "simulate": "rbdyn.dynamics.simulate",
    "simulate_duty": "rbdyn.dynamics.duty_simulation",
    "DutySimulation": "rbdyn.dynamics.duty_simulation",
    "compare": "rbdyn.comparison",
    "Comparison": "rbdyn.comparison",
    "history": "rbdyn.dynamics.motion",
    "History": "rbdyn.dynamics.motion",
    "SimulationResult": "rbdyn.result",
    "InputError": "rbdyn.base.faults",
    "RunError": "rbdyn.base.faults",
}


def load(path: "Path | str") -> "SimulationResult":
    """Read a saved result of ``simulate``. Raises InputError when the file is missing or another one."""
    from rbdyn.result import SimulationResult

    return SimulationResult.load(path)


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name == "__version__":
        return import_module("importlib.metadata").version("rbdyn")
    if name not in _HOMES:
        raise AttributeError(f"module 'rbdyn' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
