"""Whose result it is: the identity of a study, of one of its steps, and of a scene with unknown inputs."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from doe.study_file import Study
from doe.workflow.status import named_files
from rbdyn.base.faults import InputError
from rbdyn.base.identity import Identity, identity_of
from rbdyn.scene import Scene


def study_identity(command: str, study: Study, data: Path | None = None) -> Identity:
    """Identity of a study or of a step of it; ``data``: table of runs made elsewhere. A study without a scene has no bearing."""
    scene: Mapping[str, Any] = {}
    if study.file.scene is not None:
        with suppress(InputError):
            loaded = Scene.load(study.path_of(study.scene.file), study.scene.set)
            scene = loaded.model_dump(mode="json")
    named = [study.path, *named_files(study)] if study.file.scene is not None else [study.path]
    return identity_of(command, scene, [*named, *([] if data is None else [data])])


def scene_identity(command: str, path: Path, overrides: Iterable[str], data: Path | None = None) -> Identity:
    """Identity of a result on the scene of a file, with a table of measurements. Raises InputError."""
    scene = Scene.load(path, overrides).model_dump(mode="json")
    return identity_of(command, scene, [path, *([] if data is None else [data])])
