"""How a scene file is read."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from copy import deepcopy
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, Self, TypeVar, cast

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

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy, of whose changes nothing is left that the original worked out of itself."""
        copied = super().model_copy(update=update, deep=deep)
        for name in copied.__dict__.keys() - type(self).model_fields:
            del copied.__dict__[name]
        return copied

    @classmethod
    def _of_kind(cls, data: dict[str, Any]) -> type[Self]:
        """The class that reads a scene of this kind."""
        return cls


P = ParamSpec("P")
T = TypeVar("T")


def once(make: Callable[P, T]) -> Callable[P, T]:
    """``make`` worked out once a scene and kept with it, which never changes; its other arguments must follow from the scene."""
    name = f"{make.__module__}.{make.__qualname__}"

    @wraps(make)
    def kept(*args: P.args, **more: P.kwargs) -> T:
        found = args[0].__dict__
        if name not in found:
            found[name] = make(*args, **more)
        return cast(T, found[name])

    return kept
