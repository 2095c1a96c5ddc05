"""Errors of the numbers, and the time that accuracy costs.

``rbdyn accuracy SCENE.toml STUDY`` runs a study by name:

- ``tolerances``: bias of the statistics at each tolerance, and error of the motion
- ``methods``: ours and other integrators at equal error, all on one compiled right-hand side (``fixed_step``); for a ball
  bearing its solver (``ball_solvers``)
- ``coverage``: how often stated intervals contain the truth
- ``options`` and ``stability`` (``variants``): cost of each option, and how extreme variants of a scene end

Each is a function ``study(scene, progress) -> Report`` (``report``: tables, sentences, files). A reference is a much tighter
run, or one that two methods agree on. Error and time come from separate runs, and a first call never counts. Failures stay
in the table. Studies that only developers need are scripts of ``examples/benchmarks``. From Python::

    from rbdyn import Scene, accuracy

    scene = Scene.load("examples/cylindrical_roller.toml")
    report = accuracy.study("methods", scene)  # .record, .tables, .sentences
    accuracy.write(report, folder)  # JSON, CSV, pictures
    rows = accuracy.statistics_bias(scene, (1e-1, 1e-2, 1e-3)).rows

Names are loaded when first used: importing the package loads neither numba nor scipy.
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

__all__ = ["STUDIES", "Report", "show", "statistics_bias", "study", "study_name", "times_faster", "write"]

STUDIES = {
    "tolerances": "rbdyn.accuracy.tolerances:study",
    "methods": "rbdyn.accuracy.methods:study",
    "coverage": "rbdyn.accuracy.coverage:study",
    "options": "rbdyn.accuracy.variants:study_options",
    "stability": "rbdyn.accuracy.variants:study_stability",
}
# Of ball bearings, solved to rounding, without tolerance, interval or right-hand side.
BALL_STUDIES = {"methods": "rbdyn.accuracy.ball_solvers:study"}
_HOMES = {
    "Report": "rbdyn.accuracy.report",
    "show": "rbdyn.accuracy.report",
    "write": "rbdyn.accuracy.report",
    "statistics_bias": "rbdyn.accuracy.tolerances",
    "times_faster": "rbdyn.accuracy.methods",
}


def study_name(name: str | None, scene: Scene | BallScene) -> str:
    """Name of a study, by default the first of the kind of bearing. Raises InputError where the kind lacks it."""
    homes = BALL_STUDIES if isinstance(scene, BallScene) else STUDIES
    if name is not None and name not in homes:
        names = " or ".join(homes)
        raise InputError(f"{name}: is not a study of a bearing of kind {scene.bearing.kind!r}; choose {names}")
    return name or next(iter(homes))


def study(name: str | None, scene: Scene | BallScene, progress: "Reporter" = None) -> "Report":
    """Run a study by name, by default the first of the kind of bearing; ``progress(done, total)`` is called as it goes on.

    A scene with [thermal] is studied at its steady temperatures. Raises InputError where the kind of bearing lacks the study or the scene has nothing to study; RunError; KeyboardInterrupt.
    """
    homes = BALL_STUDIES if isinstance(scene, BallScene) else STUDIES
    module, _, function = homes[study_name(name, scene)].partition(":")
    if not isinstance(scene, BallScene) and scene.thermal is not None:
        from rbdyn.dynamics.simulate import steady_scene

        scene = steady_scene(scene)
    report: Report = getattr(import_module(module), function)(scene, progress)
    return report


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'rbdyn.accuracy' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
