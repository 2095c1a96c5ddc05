"""How far the numbers are from true ones, and what that costs in time.

Studies, each a module with ``study(scene, progress) -> Report``; the command ``rbdyn accuracy`` runs them by name:
``rollers`` in time, ``balls`` in equilibrium. ``choice``: which study a command line means; ``judgement``: what errors
allow to conclude; ``report``: tables, files; ``page``: the parts of ``measured.toml`` on the shipped examples, as one page.

A reference is a much tighter run that two methods agree on; an error and a time come from separate runs, the first
call never counts; what fails stays in the table. From Python::

    from rbdyn import Scene, accuracy

    scene = Scene.load("examples/cylindrical_roller.toml")
    report = accuracy.study("methods", scene)  # .record, .tables, .sentences
    accuracy.write(report, folder)  # JSON, CSV, pictures
    rows = accuracy.statistics_bias(scene, (1e-1, 1e-2, 1e-3)).rows

Names are fetched when first used: importing the package loads neither numba nor scipy.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rbdyn.accuracy.report import Report, show, write
    from rbdyn.accuracy.rollers.comparison import times_faster
    from rbdyn.accuracy.rollers.tolerances import statistics_bias
    from rbdyn.dynamics.ensemble import Reporter
    from rbdyn.scene import BallScene, Scene

__all__ = ["BALL_STUDIES", "STUDIES", "Report", "show", "statistics_bias", "study", "times_faster", "write"]

BALL_STUDIES = {"solvers": "rbdyn.accuracy.balls.solvers", "battery": "rbdyn.accuracy.balls.battery"}
STUDIES = {
    "tolerances": "rbdyn.accuracy.rollers.work_precision",
    "methods": "rbdyn.accuracy.rollers.comparison",
    "slices": "rbdyn.accuracy.rollers.slicing",
    "replicates": "rbdyn.accuracy.rollers.replication",
    "coverage": "rbdyn.accuracy.rollers.coverage",
    "options": "rbdyn.accuracy.rollers.option_cost",
    "stability": "rbdyn.accuracy.rollers.stability",
    "scaling": "rbdyn.accuracy.rollers.scaling",
    **BALL_STUDIES,
}
_HOMES = {
    "Report": "rbdyn.accuracy.report",
    "show": "rbdyn.accuracy.report",
    "write": "rbdyn.accuracy.report",
    "statistics_bias": "rbdyn.accuracy.rollers.tolerances",
    "times_faster": "rbdyn.accuracy.rollers.comparison",
}


def study(name: str, scene: "Scene | BallScene", progress: "Reporter" = None, **options: Any) -> "Report":
    """Run the study ``name`` of ``STUDIES``; ``progress(done, total)`` is called as it goes on.

    Raises KeyError for an unknown name, InputError where the scene has nothing to study, RunError, KeyboardInterrupt.
    """
    report: Report = import_module(STUDIES[name]).study(scene, progress, **options)
    return report


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'rbdyn.accuracy' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
