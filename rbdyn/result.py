"""What a simulation returns: a frozen record that saves and loads itself as JSON."""

from __future__ import annotations

import copy
import functools
import json
import math
import os
import platform
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rbdyn.faults import InputError, bounded, read_text

if TYPE_CHECKING:
    import pandas as pd

FORMAT = "rbdyn.simulation/3"
# Figures with errors: their keys in JSON and tables, and their names here.
FIGURES = {
    "impact_force_N": "impact_force",
    "impact_contact_force_N": "impact_contact_force",
    "whirl_deviation_ratio": "whirl_deviation_ratio",
    "power_loss_W": "power_loss",
    "cage_speed_rpm": "cage_speed_rpm",
    "cage_slip": "cage_slip",
}
# The same of what JSON holds as it is.
PLAIN = {"power_terms_W": "power_terms", "clearance_um": "clearance"} | {
    name: name
    for name in (
        *("status", "races", "impact_window_turns", "transient_turns", "counted_turns", "target"),
        *("cost", "replicates", "seed", "versions", "scene"),
    )
}


@dataclass(frozen=True)
class Quantity:
    """A figure with the half-widths of its 95 % intervals; None where an error was not estimated.

    ``effective_samples``: how many independent batches would tell as much of it as the correlated ones of the run.
    """

    value: float
    statistical_error: float | None
    numerical_error: float | None
    effective_samples: float

    @property
    def error(self) -> float | None:
        """Half-width of the 95 % interval that is stated: statistical and numerical error as root sum of squares.

        They err independently, and a sum would be too wide. None where neither was estimated.
        """
        known = [error for error in (self.statistical_error, self.numerical_error) if error is not None]
        return math.hypot(*known) if known else None

    def as_dict(self) -> dict[str, float | None]:
        """JSON form."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Quantity:
        """Inverse of ``as_dict``. Raises TypeError for anything else."""
        errors = ("statistical_error", "numerical_error")
        if not all(isinstance(x, (int, float)) or (x is None and name in errors) for name, x in dict(data).items()):
            raise TypeError(data)
        return cls(**data)

    def __str__(self) -> str:
        errors = [f"± {self.statistical_error:.2g} (statistical)" if self.statistical_error is not None else ""]
        errors.append(f"± {self.numerical_error:.2g} (numerical)" if self.numerical_error is not None else "")
        return " ".join((f"{self.value:.5g}", *filter(None, errors)))


@dataclass(frozen=True)
class SimulationResult:
    """Outcome of one scene. Forces in N, powers in W, cage speed in rpm; ``scene`` is the resolved input.

    ``impact_force``: largest force of a roller on a pocket wall, contact and film together; ``impact_contact_force``: of
    the contact alone; ``races``: pressure, half-width and film at the largest load of "inner" and "outer"; ``clearance``: drawn and
    operating diametral clearance [um], with what fits, temperature and rotation take of it where a mounting is given;
    ``transient_turns``: shaft turns from the start until the figures settled, None where the run does not tell;
    ``counted_turns``: those that each replicate counts, more than asked for where it was lengthened;
    ``target``: what a run to a target accuracy chose, reached and cost, None for any other.
    """

    status: str
    impact_force: Quantity
    impact_contact_force: Quantity
    whirl_deviation_ratio: Quantity
    power_loss: Quantity
    cage_speed_rpm: Quantity
    cage_slip: Quantity
    power_gap: float
    power_terms: dict[str, float]
    max_inner_load: float
    max_outer_load: float
    max_land_load: float
    races: dict[str, dict[str, float]]
    clearance: dict[str, float]
    impact_window_turns: float
    transient_turns: float | None
    counted_turns: float
    cost: dict[str, float]
    replicates: int
    seed: int
    notes: tuple[str, ...]
    versions: dict[str, str]
    scene: dict[str, Any]
    target: dict[str, Any] | None = None

    def as_dict(self) -> dict[str, Any]:
        """JSON form, which shares nothing with the result."""
        return {
            "format": FORMAT,
            **{key: getattr(self, name).as_dict() for key, name in FIGURES.items()},
            "power_balance": {"relative_gap": self.power_gap},
            "loads": {
                "max_inner_N": self.max_inner_load,
                "max_outer_N": self.max_outer_load,
                "max_land_N": self.max_land_load,
            },
            "notes": list(self.notes),
            **{key: copy.deepcopy(getattr(self, name)) for key, name in PLAIN.items()},
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> SimulationResult:
        """Inverse of ``as_dict``. Raises KeyError or TypeError for anything else."""
        figures: dict[str, Any] = {name: Quantity.from_dict(data[key]) for key, name in FIGURES.items()}
        return cls(
            **figures,
            **{name: data[key] for key, name in PLAIN.items()},
            power_gap=data["power_balance"]["relative_gap"],
            **{f"max_{part}_load": data["loads"][f"max_{part}_N"] for part in ("inner", "outer", "land")},
            notes=tuple(data["notes"]),
        )

    def table(self) -> pd.DataFrame:
        """A row a figure: value, the half-widths of its 95 % errors, effective samples; units in the names."""
        import pandas as pd

        rows = {key: getattr(self, name).as_dict() for key, name in FIGURES.items()}
        return pd.DataFrame.from_dict(rows, orient="index", dtype=float).rename_axis("figure")

    def save(self, path: Path | str) -> None:
        """Write JSON, whole or not at all."""
        write_json(path, self.as_dict())

    @classmethod
    def load(cls, path: Path | str) -> SimulationResult:
        """Read a saved result. Raises InputError when the file is missing or not such a result."""
        from pydantic import TypeAdapter

        what = "simulation result"
        data = read_record(path, FORMAT, what)
        try:
            return TypeAdapter(cls).validate_json(json.dumps(asdict(cls.from_dict(data))), strict=True)
        except (ValueError, KeyError, TypeError):
            raise InputError([f"{path}: not a whole {what}; run the scene again"]) from None


def read_record(path: Path | str, form: str, what: str) -> dict[str, Any]:
    """A ``what`` saved as JSON in the format ``form``. Raises InputError when the file is missing or holds no such."""
    if not Path(path).is_file():
        raise InputError([f"{path}: cannot be read (no such file); check the path"])
    text = read_text(Path(path))
    try:
        data = json.loads(text)
    except (ValueError, RecursionError):
        data = None
    found = data.get("format") if isinstance(data, dict) else None
    if found != form:
        old = f"format is {found}, not {form}; run the scene again"
        raise InputError([f"{path}: {old if isinstance(found, str) else f'not a saved {what}; check the path'}"])
    return bounded(data, str(path))


def write_json(path: Path | str, data: dict[str, Any]) -> None:
    """Write JSON so that an interruption, or another process, leaves the old file or the new one, never half of it."""
    path = Path(path)
    partial = path.with_name(f"{path.name}.{os.getpid()}.partial")
    partial.write_text(json.dumps(data, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    os.replace(partial, path)


def versions() -> dict[str, str]:
    """Versions that the bits of a result depend on."""
    packages = {name: _version(name) for name in ("rbdyn", "numpy", "numba")}
    return {**packages, "python": platform.python_version(), "machine": platform.machine()}


@functools.cache
def _version(package: str) -> str:
    # Read from the installed files, which takes half a millisecond.
    return version(package)
