"""How a scene file is read."""

from collections.abc import Callable, Iterable, Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any, Self, TypeVar, cast

from rbdyn.faults import Consistent, read_toml, set_key, validated

T = TypeVar("T")


class SceneFile(Consistent):
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

    def once(self, name: str, make: Callable[[], T]) -> T:
        """What ``make`` gives, worked out once a scene and kept with it under a name: a scene never changes."""
        if name not in self.__dict__:
            self.__dict__[name] = make()
        return cast(T, self.__dict__[name])

    @classmethod
    def _of_kind(cls, data: dict[str, Any]) -> type[Self]:
        """The class that reads a scene of this kind."""
        return cls
