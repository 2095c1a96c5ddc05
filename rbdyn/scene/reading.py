"""How a scene file is read."""

from __future__ import annotations

from collections.abc import Iterable
from copy import deepcopy
from pathlib import Path
from typing import Any, Self

from rbdyn.faults import Strict, read_toml, set_key, validated


class SceneFile(Strict):
    """A scene that is read from TOML. Equal scenes of equal seed and version give equal bits."""

    @classmethod
    def load(cls, path: Path | str, overrides: Iterable[str] = ()) -> Self:
        """Read a TOML scene, with ``key.path=value`` overrides. Raises InputError with all faults at once."""
        return cls.from_dict(read_toml(path), str(path), overrides)

    @classmethod
    def from_dict(cls, data: dict[str, Any], source: str = "scene", overrides: Iterable[str] = ()) -> Self:
        """Validate nested tables as TOML gives them; ``source`` stands in the messages. Raises InputError."""
        data = deepcopy(data)
        for override in overrides:
            set_key(data, override)
        return validated(cls._of_kind(data), data, source)

    @classmethod
    def _of_kind(cls, data: dict[str, Any]) -> type[Self]:
        """The class that reads a scene of this kind."""
        return cls
