"""How far the numbers are from true ones, and what that costs in time.

Studies, each a module with ``study(scene, progress) -> Report``; ``rbdyn accuracy SCENE.toml STUDY`` runs them by name:

- ``tolerances``: bias of the statistics at each tolerance, and error of the motion; what an error allows to be said
- ``methods``: ours and other ``integrators`` at equal error, all on the compiled right-hand side (``fixed_step``); of a ball
  bearing its solvers (``ball_solvers``)
- ``coverage``: how often stated intervals hold the truth; ``options``: what each option costs; ``stability``: how extreme
  variants (``variants.toml``) of a scene end
- ``report``: tables, sentences, files

A reference is a much tighter run that two methods agree on; an error and a time come from separate runs, the first
call never counts; what fails stays in the table. Studies that only developers need are scripts of ``examples/benchmarks``.
From Python::

    from rbdyn import Scene, accuracy

    scene = Scene.load("examples/cylindrical_roller.toml")
    report = accuracy.study("methods", scene)  # .record, .tables, .sentences
    accuracy.write(report, folder)  # JSON, CSV, pictures
    rows = accuracy.statistics_bias(scene, (1e-1, 1e-2, 1e-3)).rows

Names are fetched when first used: importing the package loads neither numba nor scipy.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rbdyn.base.faults import InputError
from rbdyn.scene import BallScene, Scene

if TYPE_CHECKING:
    from rbdyn.accuracy.methods import times_faster
    from rbdyn.accuracy.report import Report, show, write
    from rbdyn.accuracy.tolerances import statistics_bias
    from rbdyn.dynamics.ensemble import Reporter

__all__ = ["STUDIES", "Report", "chosen", "show", "statistics_bias", "study", "times_faster", "write"]

STUDIES = {name: f"rbdyn.accuracy.{name}" for name in ("tolerances", "methods", "coverage", "options", "stability")}
# Of ball bearings, which are solved to rounding: no tolerance, no interval, no option of a right-hand side.
BALL_STUDIES = {"methods": "rbdyn.accuracy.ball_solvers"}
_HOMES = {
    "Report": "rbdyn.accuracy.report",
    "show": "rbdyn.accuracy.report",
    "write": "rbdyn.accuracy.report",
    "statistics_bias": "rbdyn.accuracy.tolerances",
    "times_faster": "rbdyn.accuracy.methods",
}


def chosen(name: str | None, scene: Scene | BallScene) -> str:
    """Name of a study, or of the first that the kind of bearing has. Raises InputError for one that it has not."""
    homes = BALL_STUDIES if isinstance(scene, BallScene) else STUDIES
    if name is not None and name not in homes:
        raise InputError(
            [f"{name}: is no study of a bearing of kind {scene.bearing.kind!r}; choose {' or '.join(homes)}"]
        )
    return name or next(iter(homes))


def study(name: str | None, scene: Scene | BallScene, progress: "Reporter" = None) -> "Report":
    """Run a study by name, the first of its kind of bearing unless named; ``progress(done, total)`` is called as it goes on.

    Raises InputError for a study that the kind of bearing has not, or where the scene has nothing to study, RunError,
    KeyboardInterrupt.
    """
    homes = BALL_STUDIES if isinstance(scene, BallScene) else STUDIES
    report: Report = import_module(homes[chosen(name, scene)]).study(scene, progress)
    return report


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'rbdyn.accuracy' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
