"""Which study ``rbdyn accuracy`` is asked for: one at a time, and one of this kind of bearing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rbdyn.accuracy import BALL_STUDIES
from rbdyn.faults import InputError
from rbdyn.scene import BallScene, Scene

# Studies that take the length of trajectories.
TRAJECTORIES = ("tolerances", "methods")
# Studies that judge means with errors.
JUDGED = ("tolerances", "methods", "slices", "replicates")


def asked_study(flags: Mapping[str, bool], limits: Mapping[str, Any], scene: Scene | BallScene) -> str:
    """Name of the study: that of the only flag set, or the default of the scene's kind of bearing.

    ``limits``: options of single studies, "turns", "scenes", "repeats" and "sought". Raises InputError for two flags, for a study of the other
    kind of bearing, and for limits that the study does not know.
    """
    chosen = [name for name, wished in flags.items() if wished]
    shown = " and ".join(f"--{name}" for name in chosen)
    if len(chosen) > 1:
        raise InputError([f"{shown}: are studies of their own; choose one"])
    balls, kind = isinstance(scene, BallScene), scene.bearing.kind
    name = chosen[0] if chosen else ("solvers" if balls else "tolerances")
    if balls and name not in BALL_STUDIES:
        raise InputError([f"{shown}: studies roller bearings in time; leave it out for {kind!r}"])
    if not balls and name in BALL_STUDIES:
        raise InputError([f"{shown}: studies ball bearings; leave it out for {kind!r}"])
    if "turns" in limits and name not in TRAJECTORIES:
        why = f"{shown or 'the study of ' + repr(kind)} integrates no trajectories; leave it out"
        raise InputError([f"--trajectory {limits['turns']:g}: {why}"])
    if "sought" in limits and name not in JUDGED:
        why = f"{shown or 'the study of ' + repr(kind)} judges no means; leave it out"
        raise InputError([f"--sought-percent {100.0 * limits['sought']:g}: {why}"])
    if "scenes" in limits and name != "battery":
        raise InputError([f"--scenes {limits['scenes']}: goes with --battery only; leave it out"])
    if "repeats" in limits and name != "coverage":
        raise InputError([f"--repeats {limits['repeats']}: goes with --coverage only; leave it out"])
    return name
