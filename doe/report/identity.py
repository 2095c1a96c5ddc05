"""Whose result it is: the identity of a study, of one of its steps, and of a scene with unknown inputs."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from doe.workflow.problem import Problem
from doe.workflow.status import named_files
from rbdyn.base.faults import InputError
from rbdyn.base.identity import Identity, identity_of
from rbdyn.scene import Scene


def study_identity(command: str, study: Problem, data: Path | None = None) -> Identity:
    """Identity of a study or of a step of it; ``data``: table of runs made elsewhere. A study without a scene has no bearing."""
    scene: Mapping[str, Any] = {}
    if study.file.scene is not None:
        with suppress(InputError):
            loaded = Scene.from_dict(
                study.read(study.scene.file), str(study.path_of(study.scene.file)), study.scene.set
            )
            scene = loaded.model_dump(mode="json")
    named = [study.path, *named_files(study)] if study.file.scene is not None else [study.path]
    identity = identity_of(command, scene, [*named, *([] if data is None else [data])])
    return replace(identity, point=duty_words(study)) if study.shares and scene else identity


def duty_words(study: Problem) -> str:
    """'duty of idle 15 %, cruise 80 %, take-off 5 %': the points of operation of a study with their shares of the time."""
    points = (f"{point.name} {100.0 * study.shares[point.name]:.3g} %" for point in study.file.duty)
    return f"duty of {', '.join(points)}"


def scene_identity(command: str, path: Path, overrides: Iterable[str], data: Path | None = None) -> Identity:
    """Identity of a result on the scene of a file, with a table of measurements. Raises InputError."""
    scene = Scene.load(path, overrides).model_dump(mode="json")
    return identity_of(command, scene, [path, *([] if data is None else [data])])
