"""What the checks share: how much to simulate, figures with errors, tables, and what a check returns."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from rbdyn import Scene, SimulationResult, simulate
from rbdyn.result import Quantity
from rbdyn.terminal import print_table

EXAMPLES = Path(__file__).parent.parent
CHEN = EXAMPLES / "cylindrical_roller.toml"
RESPONSES = ("impact_force_N", "whirl_deviation_ratio", "power_loss_W")
PLAIN = {
    "impact_force_N": "impact force",
    "whirl_deviation_ratio": "whirl ratio",
    "power_loss_W": "power loss",
}
LAWS = ("four_constant", "thermal_newtonian")


@dataclass(frozen=True)
class Effort:
    """How much to simulate: replicates of ``turns`` counted shaft turns after ``discard_turns``."""

    replicates: int
    turns: int
    discard_turns: int

    @property
    def overrides(self) -> tuple[str, ...]:
        """The same as scene keys. Companions at a tighter tolerance are left out: rtol 1e-2 biases nothing by 0.5 %."""
        return (
            f"numerics.replicates={self.replicates}",
            f"numerics.turns={self.turns}",
            f"numerics.discard_turns={self.discard_turns}",
            "numerics.companion=false",
        )


@dataclass(frozen=True)
class Table:
    """A printed table; the first column is text."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def show(self) -> None:
        """Print it."""
        print_table(self.title, self.header, self.rows)

    def markdown(self) -> str:
        """The same for a report."""
        lines = [self.header, ("---",) + ("--:",) * (len(self.header) - 1), *self.rows]
        return f"**{self.title}**\n\n" + "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


@dataclass(frozen=True)
class Check:
    """One check: its tables, its conclusion in a sentence or two, its numbers, and how to draw it."""

    title: str
    tables: tuple[Table, ...]
    conclusion: str
    frame: pd.DataFrame
    draw: Callable[[Path], None]


@functools.cache
def simulated(file: Path, effort: Effort, overrides: tuple[str, ...] = ()) -> SimulationResult:
    """Simulate a scene file with overrides; equal calls run once."""
    return simulate(Scene.load(file, (*effort.overrides, *overrides)))


def quantity(result: SimulationResult, response: str) -> Quantity:
    """A figure of a result by the name under which it is saved."""
    return getattr(result, response.removesuffix("_N").removesuffix("_W"))


def error(figure: Quantity) -> float:
    """Half-width of the 95 % statistical interval; NaN where one replicate gives none."""
    return math.nan if figure.statistical_error is None else figure.statistical_error


def plus_minus(value: float, half_width: float) -> str:
    """Value and error, the error to two digits and the value to as many places."""
    if not half_width > 0.0:
        return f"{value:.4g}"
    places = max(1 - math.floor(math.log10(half_width)), 0)
    return f"{value:.{places}f} ± {half_width:.{places}f}"


def trend(values: Sequence[float], errors: Sequence[float]) -> str:
    """How a row of values runs: 'falls, then rises' only where the lowest lies below both ends by more than error."""
    y, e = np.asarray(values, float), np.asarray(errors, float)
    low, high = int(y.argmin()), int(y.argmax())

    def below(i: int, j: int) -> bool:
        return bool(y[j] - y[i] > math.hypot(e[i], e[j]))

    if 0 < low < len(y) - 1 and below(low, 0) and below(low, -1):
        return "falls, then rises"
    if 0 < high < len(y) - 1 and below(0, high) and below(-1, high):
        return "rises, then falls"
    if below(0, -1):
        return "rises"
    return "falls" if below(-1, 0) else "level"


def percent(change: float) -> str:
    """A relative change."""
    return f"{100.0 * change:+.1f} %"


def save(figure: object, path: Path) -> None:
    """Write a matplotlib figure and forget it."""
    from matplotlib import pyplot as plt

    figure.tight_layout()  # type: ignore[attr-defined]
    figure.savefig(path, dpi=130)  # type: ignore[attr-defined]
    plt.close(figure)  # type: ignore[arg-type]


def canvas(rows: int, columns: int, width: float = 4.2, height: float = 3.6) -> tuple[object, np.ndarray]:
    """An empty figure and its axes in a 2-D array, without a screen."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    return plt.subplots(rows, columns, figsize=(width * columns, height * rows), squeeze=False)


def tell(check: Check, out: Path | None, name: str) -> None:
    """Print a check; where a folder is given, write its numbers and pictures there as ``name``."""
    print(f"# {check.title}\n")
    for table in check.tables:
        print(table.markdown())
    print(check.conclusion)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        check.frame.to_csv(out / f"{name}.csv", index=False, float_format="%.8g")
        check.draw(out / f"{name}.png")
        print(f"written to {out}: {', '.join(sorted(path.name for path in out.glob(f'{name}*')))}")
