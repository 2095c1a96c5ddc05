"""What the checks share: how much to simulate, figures with errors, findings, tables, and what a check returns."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np
import pandas as pd

from rbdyn import Scene, SimulationResult, simulate
from rbdyn.base import blocks
from rbdyn.base.terminal import show
from rbdyn.result import Quantity

EXAMPLES = Path(__file__).parent.parent
CHEN = EXAMPLES / "cylindrical_roller.toml"
RESPONSES = ("impact_force_N", "whirl_deviation_ratio", "power_loss_W")
PLAIN = {"impact_force_N": "impact force", "whirl_deviation_ratio": "whirl ratio", "power_loss_W": "power loss"}
LAWS = ("four_constant", "thermal_newtonian")

Kind = Literal["measured", "trend", "model against model", "cross-check"]
Verdict = Literal["agrees", "differs", "unclear", "untested"]


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
        show([blocks.Table(self.title, self.header, self.rows)])

    def markdown(self) -> str:
        """The same for a report."""
        lines = [self.header, ("---",) + ("--:",) * (len(self.header) - 1), *self.rows]
        return f"**{self.title}**\n\n" + "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


@dataclass(frozen=True)
class Finding:
    """One published finding with ours beside it.

    ``kind``: "measured": what came out of a test, a value or which of two bearings did better; "trend": only the
    direction in which something runs with speed, load or oil, whoever found it; "model against model": a figure of
    another simulation, which may err as ours does; "cross-check": a formula of a maker or a handbook. ``source`` tells
    how much of it was read. ``verdict``: "unclear" where an error hides the answer, "untested" where the source has no
    number to set ours beside.
    """

    words: str
    source: str
    kind: Kind
    ours: str
    verdict: Verdict


def verdict_of(beyond: float, error: float) -> Verdict:
    """Of a difference that should be above 0: agrees or differs beyond its 95 % error, else unclear."""
    if not abs(beyond) > error:
        return "unclear"
    return "agrees" if beyond > 0.0 else "differs"


def findings_table(findings: Sequence[Finding]) -> Table:
    """A line a finding."""
    header = ("finding", "source", "kind", "ours", "verdict")
    return Table("what is published", header, tuple((f.words, f.source, f.kind, f.ours, f.verdict) for f in findings))


def tally_table(findings: Sequence[Finding]) -> Table:
    """How the findings of each kind came out."""
    rows = [(kind, [f.verdict for f in findings if f.kind == kind]) for kind in get_args(Kind)]
    return Table(
        "published findings by kind",
        ("kind", "findings", *get_args(Verdict)),
        tuple(
            (kind, f"{len(own)}", *(f"{own.count(word)}" for word in get_args(Verdict))) for kind, own in rows if own
        ),
    )


def tally(findings: Sequence[Finding]) -> str:
    """The same in words: 'measured 2 of 3 agree (1 untested), trend 3 of 3 agree'."""
    parts = []
    for kind, count, agree, _, *rest in tally_table(findings).rows:
        doubts = ", ".join(f"{n} {word}" for n, word in zip(rest, ("unclear", "untested"), strict=True) if n != "0")
        parts.append(f"{kind} {agree} of {count} agree" + (f" ({doubts})" if doubts else ""))
    return ", ".join(parts)


@dataclass(frozen=True)
class Check:
    """One check: its tables, its conclusion in a sentence or two, its numbers, how to draw it, and what it compares."""

    title: str
    tables: tuple[Table, ...]
    conclusion: str
    frame: pd.DataFrame
    draw: Callable[[Path], None]
    findings: tuple[Finding, ...] = ()


@functools.cache
def simulated(file: Path, effort: Effort, overrides: tuple[str, ...] = ()) -> SimulationResult:
    """Simulate a scene file with overrides; equal calls run once."""
    return simulate(Scene.load(file, (*effort.overrides, *overrides)))


def quantity(result: SimulationResult, response: str) -> Quantity:
    """A figure of a result by the name under which it is saved."""
    return getattr(result, response)


def error(figure: Quantity) -> float:
    """Half-width of the 95 % statistical interval; NaN where one replicate gives none."""
    return math.nan if figure.statistical_error is None else figure.statistical_error


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
