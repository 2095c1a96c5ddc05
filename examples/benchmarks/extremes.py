"""How the extreme variants of ``rbdyn accuracy SCENE.toml stability`` end, over several scenes at once.

``python examples/benchmarks/extremes.py [SCENE.toml]``: the variants of this scene and of the shipped ones with every option and
of an NU 215; a line a scene with how many end how, and every case that neither closes nor tells why.
"""

import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from studies import EXAMPLES, main

from rbdyn.accuracy.report import Report, Reporter, records, reported
from rbdyn.accuracy.variants import CLOSED, OPEN, REFUSED, STOPPED, TIGHTENED, Ending, battery
from rbdyn.base.blocks import Table
from rbdyn.scene import Scene

OTHERS = ("all_options.toml", "published/nu215.toml")
STATUSES = (CLOSED, TIGHTENED, OPEN, STOPPED, REFUSED)


def study(scene: Scene, progress: Reporter = None, others: Sequence[str] = OTHERS) -> Report:
    """Endings of the variants of a scene and of ``others``, files of examples. Raises InputError, KeyboardInterrupt."""
    scenes = {"scene": scene, **{name: Scene.load(EXAMPLES / name) for name in others}}
    endings = {name: battery(each, progress=progress) for name, each in scenes.items()}
    table = Table("extreme variants by how they end", ("of", *STATUSES, "largest power gap", "slowest [ms a turn]"),
                  [_row(name, rows) for name, rows in endings.items()])  # fmt: skip
    unexplained = [
        f"{name}: {row.case}: {row.reason}" for name, rows in endings.items() for row in rows if row.unexplained
    ]
    written = [{"of": name, **row} for name, rows in endings.items() for row in records(rows)]
    sheet = [row | {"assignments": " ".join(row["assignments"])} for row in written]
    report = reported("extremes", (table,), unexplained, sheet, cases=written)
    return replace(report, failed=bool(unexplained))


def _row(name: str, rows: Sequence[Ending]) -> list[str]:
    counts = Counter(row.status for row in rows)
    gap = max((row.power_gap for row in rows if row.power_gap is not None), default=0.0)
    slowest = max((row.turn_ms for row in rows if row.turn_ms is not None), default=0.0)
    return [name, *(str(counts[status]) for status in STATUSES), f"{100.0 * gap:.2g} %", f"{slowest:.3g}"]


if __name__ == "__main__":
    sys.exit(main(study, __doc__))
