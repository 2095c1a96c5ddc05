"""Which study ``rbdyn accuracy`` runs: one at a time, and one of this kind of bearing."""

from collections.abc import Mapping

from rbdyn.accuracy import BALL_STUDIES
from rbdyn.faults import InputError
from rbdyn.scene import BallScene, Scene

# Options of some studies only: as typed, by name the studies that take them, and why others do not.
LIMITS = {
    "turns": ("--trajectory {:g}", ("tolerances", "methods"), "{study} integrates no trajectories"),
    "sought": ("--sought-percent {:g}", ("tolerances", "methods", "slices", "replicates"), "{study} judges no means"),
    "scenes": ("--scenes {}", ("battery",), "goes with --battery only"),
    "repeats": ("--repeats {}", ("coverage",), "goes with --coverage only"),
}


def chosen_study(flags: Mapping[str, bool], limits: Mapping[str, float], scene: Scene | BallScene) -> str:
    """Name of the study: that of the only flag set, or the default of the scene's kind of bearing.

    ``limits``: options of single studies as they are typed, by their names in ``LIMITS``. Raises InputError for two flags,
    for a study of the other kind of bearing, and for limits that the study does not know.
    """
    chosen = [name for name, wished in flags.items() if wished]
    shown = " and ".join(f"--{name}" for name in chosen)
    if len(chosen) > 1:
        raise InputError([f"{shown}: are studies of their own; choose one"])
    balls, kind = isinstance(scene, BallScene), scene.bearing.kind
    name = chosen[0] if chosen else ("solvers" if balls else "tolerances")
    if balls != (name in BALL_STUDIES):
        studied = "roller bearings in time" if balls else "ball bearings"
        raise InputError([f"{shown}: studies {studied}; leave it out for {kind!r}"])
    for limit, (option, studies, why) in LIMITS.items():
        if limit in limits and name not in studies:
            reason = why.format(study=shown or f"the study of {kind!r}")
            raise InputError([f"{option.format(limits[limit])}: {reason}; leave it out"])
    return name
