"""How far the numbers are from true ones, and what that costs in time.

Studies, each a module with ``study(scene, progress) -> Report``; the command ``rbdyn accuracy`` runs them by name:

- ``work_precision`` (default): ``tolerances``, the bias of the statistics at each tolerance, and ``trajectory``, the
  error of the motion over part of a turn
- ``comparison`` (``--methods``): our method beside fixed steps, SciPy and CVODE on one compiled right-hand side;
  ``method_bias``, the statistics of those that are compiled
- ``slicing`` (``--slices``): slices of a roller with a profile
- ``replication`` (``--replicates``): statistical error against replicates and turns
- ``coverage`` (``--coverage``): how often the stated intervals hold the truth
- ``rbdyn.option_cost`` (``--options``): what each option of a scene costs
- ``rbdyn.stability`` (``--stability``): how extreme variants of a scene end
- ``rbdyn.scaling`` (``--scaling``): time by rollers and slices, memory by turns
- ``ball_solvers`` (default for a ball bearing): solvers of its equilibrium, residual against time
- ``ball_battery`` (``--battery``): all of them over thousands of random ball bearings

Beneath them: ``right_hand_side`` (compiled, callable from Python), ``fixed_step`` (Runge-Kutta 4, velocity Verlet),
``methods`` (every integrator behind one door), ``stretch`` (what they integrate), ``equal_error`` (how many times
faster), ``report`` (tables, files).

A reference is a much tighter run that two methods agree on; an error and a time come from separate runs, the first
call never counts; what fails stays in the table. From Python::

    from rbdyn import Scene, accuracy

    scene = Scene.load("examples/cylindrical_roller.toml")
    found = accuracy.study("methods", scene)  # .record, .tables, .sentences
    accuracy.write(found, folder)  # JSON, CSV, pictures
    rows = accuracy.statistics_bias(scene, (1e-1, 1e-2, 1e-3)).rows

Names are fetched when first used: importing the package loads neither numba nor scipy.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rbdyn.accuracy.equal_error import times_faster
    from rbdyn.accuracy.report import Report, show, write
    from rbdyn.accuracy.tolerances import statistics_bias
    from rbdyn.scene import BallScene, Scene

__all__ = ["BALL_STUDIES", "STUDIES", "Report", "show", "statistics_bias", "study", "times_faster", "write"]

BALL_STUDIES = {"solvers": "rbdyn.accuracy.ball_solvers", "battery": "rbdyn.accuracy.ball_battery"}
STUDIES = {
    "tolerances": "rbdyn.accuracy.work_precision",
    "methods": "rbdyn.accuracy.comparison",
    "slices": "rbdyn.accuracy.slicing",
    "replicates": "rbdyn.accuracy.replication",
    "coverage": "rbdyn.accuracy.coverage",
    "options": "rbdyn.option_cost",
    "stability": "rbdyn.stability",
    "scaling": "rbdyn.scaling",
    **BALL_STUDIES,
}
_HOMES = {
    "Report": "rbdyn.accuracy.report",
    "show": "rbdyn.accuracy.report",
    "write": "rbdyn.accuracy.report",
    "statistics_bias": "rbdyn.accuracy.tolerances",
    "times_faster": "rbdyn.accuracy.equal_error",
}


def study(
    name: str, scene: Scene | BallScene, progress: Callable[[int, int], None] | None = None, **options: Any
) -> Report:
    """Run the study ``name`` of ``STUDIES``; ``progress(done, total)`` is called as it goes on.

    Raises KeyError for an unknown name, InputError where the scene has nothing to study, RunError, KeyboardInterrupt.
    """
    found: Report = import_module(STUDIES[name]).study(scene, progress, **options)
    return found


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'rbdyn.accuracy' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
