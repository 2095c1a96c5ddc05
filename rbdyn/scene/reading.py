"""How a scene file is read."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from rbdyn.base.faults import LONGEST_NAME, Consistent, InputError, one_line, put_key, read_toml, set_key, validated
from rbdyn.base.records import plain
from rbdyn.base.words import html_table

T = TypeVar("T")


if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(Consistent)


class Checked(ModelMetaclass):
    """Tables given by keyword are checked as those of a file are, with the same messages."""

    def __call__(self, *given: Any, **tables: Any) -> Any:
        """The scene of these tables. Raises InputError with all faults at once."""
        if given:
            raise InputError(
                [
                    f"{self.__name__}({one_line(repr(given[0]), LONGEST_NAME)}): takes tables by keyword; "
                    f"{self.__name__}.load reads a file, {self.__name__}.from_dict a dict"
                ]
            )
        return cast(type[SceneFile], self).from_dict(tables, self.__name__)


class SceneFile(Consistent, metaclass=Checked):
    """A scene that is read from TOML. Equal scenes of equal seed and version give equal bits."""

    @classmethod
    def load(cls, path: Path | str, overrides: Iterable[str] = ()) -> Self:
        """Read a TOML scene, with ``key.path=value`` overrides. Raises InputError with all faults at once."""
        return cls.from_dict(read_toml(path), str(path), overrides)

    @classmethod
    def from_dict(cls, data: dict[str, Any], source: str = "scene", overrides: Iterable[str] = ()) -> Self:
        """Validate nested tables as TOML gives them; ``source`` stands in the messages. Raises InputError."""
        if not isinstance(data, Mapping):
            what = f"{source} = {one_line(repr(data), LONGEST_NAME)}: must be a dict of tables"
            raise InputError([f"{what}; {cls.__name__}.load reads a file"])
        listed = [overrides] if isinstance(overrides, str) or not isinstance(overrides, Iterable) else list(overrides)
        if listed == [overrides] or not all(isinstance(each, str) for each in listed):
            what = f"overrides = {one_line(repr(overrides), LONGEST_NAME)}"
            raise InputError([f'{what}: must be a list such as ["cage.mass_g=50"]'])
        data = deepcopy(data)
        for override in listed:
            set_key(data, override)
        scene = validated(cls._of_kind(data), data, source)
        scene.once("_given", lambda: data)
        return scene

    def changed(self, changes: Mapping[str, Any]) -> Self:
        """The scene with other values under dotted keys, as in ``scene.changed({"cage.mass_g": 50.0})``.

        What was left out is worked out anew, as of a file with these values. Raises InputError with all faults at once, as a
        file does.
        """
        if not isinstance(changes, Mapping) or not all(isinstance(key, str) for key in changes):
            raise InputError(
                [f'changes = {one_line(repr(changes), LONGEST_NAME)}: must be a dict such as {{"cage.mass_g": 50.0}}']
            )
        data = deepcopy(self._tables)
        for key, value in changes.items():
            put_key(data, key, plain(value), f"changed {key!r}")
        return self.from_dict(data, "changed scene")

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

    @property
    def _tables(self) -> dict[str, Any]:
        """Tables as they were given, without what was left out."""
        return self.once("_given", lambda: self.model_dump(exclude_unset=True))

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.summary}>"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """What a notebook shows: the keys that were given."""
        rows = ((name, ", ".join(_leaves(table))) for name, table in self._tables.items())
        return html_table(repr(self).strip("<>"), ("table", "keys given"), rows)

    @property
    def summary(self) -> str:
        """The scene in a line."""
        raise NotImplementedError

    @classmethod
    def _of_kind(cls, data: dict[str, Any]) -> type[Self]:
        """The class that reads a scene of this kind."""
        return cls


def _leaves(table: Any, prefix: str = "") -> Iterator[str]:
    """'key = value' of everything in nested tables; of long lists only how many they hold."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            long = isinstance(value, list) and len(value) > 6
            yield f"{prefix}{key} = {f'{len(value)} values' if long else value}"
