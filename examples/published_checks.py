"""Every published check in one run: ours beside theirs, the differences in words. Nothing is tuned to them.

    python examples/published_checks.py [--quick] [--out DIR] [--only NAME]

Prints plain tables and a conclusion a check, and at the end how the findings came out by kind: measured, trends, other
models, formulas. ``--out`` writes published_checks.md, a table of the numbers and a picture for each. ``--quick``
simulates less and says so.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer
from published.ball_papers import angular_contact, double_decker_search
from published.cage_speed import cage_speed
from published.chen_2022 import table4
from published.common import Check, Effort, Finding, tally_table
from published.friction_totals import friction_totals
from published.minimum_load import minimum_load
from published.operating import figure14, friction
from published.rolling_torque import check as rolling_torque
from published.sensitivity import QUICK, sensitivity
from published.skidding import QUICK as QUICK_ASSUMPTIONS
from published.skidding import nu215
from published.whirl import whirl

SHORT = Effort(replicates=3, turns=20, discard_turns=5)
LONG = Effort(replicates=6, turns=40, discard_turns=10)
MEDIUM = Effort(replicates=4, turns=40, discard_turns=10)
# The NU215 slows down from its epicyclic start over some 40 turns; its slip differs little between replicates.
SLOW = Effort(replicates=3, turns=10, discard_turns=40)
# Rolling resistance hardly fluctuates.
STEADY = Effort(replicates=2, turns=10, discard_turns=10)
# A cage that lags needs some tens of turns to settle.
LAGGING = Effort(replicates=2, turns=10, discard_turns=40)

FULL: dict[str, Callable[[], Check]] = {
    "table4": lambda: table4(LONG),
    "figure14": lambda: figure14(MEDIUM),
    "nu215": lambda: nu215(SLOW),
    "friction": lambda: friction(SHORT),
    "totals": lambda: friction_totals(STEADY),
    "minimum": lambda: minimum_load(LAGGING),
    "sensitivity": lambda: sensitivity(SHORT),
    "whirl": lambda: whirl(MEDIUM),
    "cage_speed": lambda: cage_speed(SHORT),
    "torque": rolling_torque,
    "search": double_decker_search,
    "angular": angular_contact,
}
BRIEF: dict[str, Callable[[], Check]] = {
    "table4": lambda: table4(SHORT),
    "figure14": lambda: figure14(SHORT, ("four_constant",), (24000, 27000, 30000), (1000, 1250, 1500)),
    "nu215": lambda: nu215(
        Effort(2, 10, 30), (2400, 3600, 5000), (1000, 5000), QUICK_ASSUMPTIONS
    ),
    "friction": lambda: friction(SHORT, (12000, 24000, 30000), (650, 1300, 2600)),
    "totals": lambda: friction_totals(),
    "minimum": lambda: minimum_load(Effort(2, 10, 20), ("NU 210", "NU 308")),
    "sensitivity": lambda: sensitivity(SHORT, QUICK, whole_design=False),
    "whirl": lambda: whirl(SHORT, (1.0, 0.1, 0.01, 0.001), ("four_constant",), 5.0),
    "cage_speed": lambda: cage_speed(SHORT, (20000, 26000, 32000)),
    "torque": rolling_torque,
    "search": double_decker_search,
    "angular": angular_contact,
}  # fmt: skip


def main(
    quick: Annotated[bool, typer.Option(help="Simulate less.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder for the report, numbers and pictures.")] = None,
    only: Annotated[str | None, typer.Option(help=f"One of {', '.join(FULL)}.")] = None,
) -> None:
    """Compare rbdyn with published tables, trends, measurements and friction formulas."""
    checks = BRIEF if quick else FULL
    if only is not None and only not in checks:
        raise typer.BadParameter(f"{only} is none of {', '.join(checks)}", param_hint="--only")
    names = [only] if only else list(checks)
    started = time.perf_counter()
    report = ["# rbdyn beside what is published\n"]
    findings: list[Finding] = []
    if quick:
        report.append("Quick run: fewer turns, replicates and points than the full one.\n")
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    for name in names:
        check = checks[name]()
        findings += check.findings
        typer.echo(f"\n{check.title}\n")
        for table in check.tables:
            table.show()
        typer.echo(check.conclusion)
        report += [f"## {check.title}\n", *(table.markdown() for table in check.tables), check.conclusion + "\n"]
        if out is not None:
            check.frame.to_csv(out / f"{name}.csv")
            check.draw(out / f"{name}.png")
            report.append(f"![{check.title}]({name}.png)\n")
            (out / "published_checks.md").write_text("\n".join(report), encoding="utf-8")
    if findings:
        counts = tally_table(findings)
        counts.show()
        if out is not None:
            text = "\n".join([*report, "## All findings\n", counts.markdown()])
            (out / "published_checks.md").write_text(text, encoding="utf-8")
    typer.echo(f"\n{len(names)} checks in {time.perf_counter() - started:.0f} s, compilation included")


if __name__ == "__main__":
    typer.run(main)
