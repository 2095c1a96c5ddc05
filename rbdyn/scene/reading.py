"""Reading of scenes from files and tables, and changed copies of a scene."""

from collections.abc import Callable, Iterable, Mapping
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from rbdyn.base import faults
from rbdyn.base.records import leaves, plain
from rbdyn.base.words import html_table

T = TypeVar("T")


if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(faults.Consistent)


class Validation(ModelMetaclass):
    """Validates tables passed by keyword like those of a file, with the same messages."""

    def __call__(self, *arguments: Any, **tables: Any) -> Any:
        """The scene of these tables. Raises InputError with all faults at once."""
        if arguments:
            raise faults.InputError(
                f"{self.__name__}({faults.one_line(repr(arguments[0]), faults.LONGEST_NAME)}): takes tables by keyword; "
                f"{self.__name__}.load reads a file, {self.__name__}.from_dict a dict"
            )
        return cast(type[SceneFile], self).from_dict(tables, self.__name__)


def _copied(value: T, source: str) -> T:
    """A copy that shares nothing. Raises InputError for what cannot be copied, such as a generator."""
    try:
        return deepcopy(value)
    except (TypeError, RecursionError) as error:
        raise faults.InputError(
            f"{source}: holds a value that cannot be copied ({error}); give numbers, texts, lists and tables"
        ) from None


class SceneFile(faults.Consistent, faults.Sparse, metaclass=Validation):
    """A scene from TOML. Equal scenes of equal seed and version give equal bits."""

    @classmethod
    def load(cls, path: Path | str, overrides: Iterable[str] = ()) -> Self:
        """Read a TOML scene, with ``key.path=value`` overrides. Raises InputError with all faults at once."""
        return cls.from_dict(faults.read_toml(path), str(path), overrides)

    @classmethod
    def from_dict(cls, data: dict[str, Any], source: str = "scene", overrides: Iterable[str] = ()) -> Self:
        """Validate nested tables in the form of TOML; messages name the ``source``. Raises InputError."""
        if not isinstance(data, Mapping):
            name = faults.one_line(repr(data), faults.LONGEST_NAME)
            raise faults.InputError(f"{source} = {name}: must be a dict of tables; {cls.__name__}.load reads a file")
        assignments = _assignments(overrides)
        data = _copied(data, source)
        for assignment in assignments:
            faults.set_key(data, assignment)
        scene = faults.validated(cls._of_kind(data), data, source)
        scene.once("_stated", lambda: data)
        return scene

    def changed(self, changes: Mapping[str, Any]) -> Self:
        """The scene with other values under dotted keys, as in ``scene.changed({"cage.mass_g": 50.0})``.

        Defaults are computed anew, as for a file with these values. Raises InputError with all faults at once.
        """
        if not isinstance(changes, Mapping) or not all(isinstance(key, str) for key in changes):
            raise faults.InputError(
                f'changes = {faults.one_line(repr(changes), faults.LONGEST_NAME)}: must be a dict such as {{"cage.mass_g": 50.0}}'
            )
        data = deepcopy(self._tables)
        for key, value in changes.items():
            faults.put_key(data, key, _copied(plain(value), f"changed {key!r}"), f"changed {key!r}")
        return self.from_dict(data, "changed scene")

    def overridden(self, overrides: Iterable[str]) -> Self:
        """The scene with ``key.path=value`` overrides, as ``load`` takes them. Raises InputError with all faults at once."""
        return self.from_dict(self._tables, "scene", overrides)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy without the cached properties of the original."""
        copy = super().model_copy(update=update, deep=deep)
        for name in copy.__dict__.keys() - type(self).model_fields:
            del copy.__dict__[name]
        return copy

    def once(self, name: str, make: Callable[[], T]) -> T:
        """The value of ``make``, computed once for the scene and cached under a name."""
        if name not in self.__dict__:
            self.__dict__[name] = make()
        return cast(T, self.__dict__[name])

    @property
    def _tables(self) -> dict[str, Any]:
        """Tables as stated, without defaults."""
        return self.once("_stated", lambda: self.model_dump(exclude_unset=True))

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.summary}>"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """Table of the stated keys for a notebook."""
        rows = ((name, ", ".join(map(_stated, leaves(table)))) for name, table in self._tables.items())
        return html_table(repr(self).strip("<>"), ("table", "stated keys"), rows)

    @property
    def summary(self) -> str:
        """The scene in a line."""
        raise NotImplementedError

    @classmethod
    def _of_kind(cls, data: dict[str, Any]) -> type[Self]:
        """The class that reads a scene of this kind."""
        return cls


def _assignments(overrides: Any) -> list[str]:
    """The overrides as a list of texts. Raises InputError for anything else."""
    if isinstance(overrides, Iterable) and not isinstance(overrides, str):
        assignments = list(overrides)
        if all(isinstance(assignment, str) for assignment in assignments):
            return assignments
    name = faults.one_line(repr(overrides), faults.LONGEST_NAME)
    raise faults.InputError(f'overrides = {name}: must be a list such as ["cage.mass_g=50"]')


def _stated(leaf: tuple[str, Any]) -> str:
    """'key = value'; of long lists only the number of values."""
    key, value = leaf
    long = isinstance(value, list) and len(value) > 6
    return f"{key} = {f'{len(value)} values' if long else value}"
