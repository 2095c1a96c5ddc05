"""``doe design``."""

from __future__ import annotations

from typing import Annotated

import typer

from doe.commands.options import Json, Save, StudyPath
from doe.commands.steps import save
from rbdyn.terminal import guarded, print_json, print_table


def design(
    path: StudyPath,
    out: Save = None,
    as_json: Json = False,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print a CSV table and nothing else.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Actual values only.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Also the seed of every run.")] = False,
) -> None:
    """Print the design: coded and actual factors of every run."""
    with guarded(as_json):
        from doe.designs import to_actual
        from doe.study.runs import design_points
        from doe.study_file import Study

        loaded = Study.load(path)
        coded = design_points(loaded)
        actual = to_actual(coded, loaded.centre, loaded.step)
        seed = loaded.file.design.seed
        runs = [
            {
                "run": run + 1,
                "coded": dict(zip(loaded.factors, c.tolist(), strict=True)),
                "factors": dict(zip(loaded.factors, a.tolist(), strict=True)),
                "seed": seed + run,
            }
            for run, (c, a) in enumerate(zip(coded, actual, strict=True))
        ]
        record = {"factors": loaded.factors, "runs": runs}
        save(out, "design.json", record)
        if as_json:
            print_json(record)
        elif as_csv:
            print(",".join(["run", *loaded.factors]))
            for run, row in enumerate(actual):
                print(",".join([str(run + 1), *(f"{x:.9g}" for x in row)]))
        else:
            header = ["run", *loaded.factors]
            rows = [[str(run + 1), *(f"{x:.6g}" for x in row)] for run, row in enumerate(actual)]
            if not quiet:
                header += [f"{name} (coded)" for name in loaded.factors]
                rows = [[*row, *(f"{x:+.4f}" for x in c)] for row, c in zip(rows, coded, strict=True)]
            if verbose:
                header.append("seed")
                rows = [[*row, str(seed + run)] for run, row in enumerate(rows)]
            print_table(f"{loaded.file.design.kind}, {len(coded)} runs", header, rows)
