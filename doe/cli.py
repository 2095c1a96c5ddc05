"""The command ``doe``."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbdyn.terminal import (
    BAD_INPUT,
    guarded,
    output_folder,
    print_json,
    print_table,
    progress_bar,
)

if TYPE_CHECKING:
    from doe.response_surface import Surface
    from doe.study_file import Study

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)

StudyPath = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Study to run.")]
Data = Annotated[
    Path | None, typer.Option(metavar="TABLE.csv", help="Runs of a table instead of simulated ones.")
]
Workers = Annotated[int | None, typer.Option(min=1, help="Threads; all processors by default.")]
Out = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Folder of results and of the store of finished runs.")
]
Save = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Also write the JSON record here.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress, only the answer.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Also print the analysis of variance.")]


@app.callback()
def main() -> None:
    """Designed experiments on a bearing: from clearances to part dimensions with tolerances."""


@app.command()
def study(
    path: StudyPath,
    out: Out = None,
    workers: Workers = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Design, simulate, fit, optimise, confirm and dimension in one go; resumes by itself."""
    with guarded(as_json), ExitStack() as bars:
        from doe.study_file import Study

        loaded = Study.load(path)
        folder = output_folder(out or Path(f"{path.stem}_results"))
        from doe import report
        from doe.study import run_study

        outcome = run_study(
            loaded,
            folder,
            workers,
            lambda title: bars.enter_context(progress_bar(title, quiet or as_json)),
        )
        bars.close()
        files = report.write(outcome, folder)
        if as_json:
            print_json(report.summary(outcome))
            return
        if verbose:
            report.print_fit(outcome.surfaces)
        report.print_outcome(outcome, quiet)
        print(f"{outcome.cost['total_s']:.1f} s, of which design runs {outcome.cost['design_s']:.1f} s")
        print(f"written to {folder}: {', '.join(files)}")


@app.command()
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
        from doe.study import design_points
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
        _save(out, "design.json", record)
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


@app.command()
def fit(
    path: StudyPath,
    data: Data = None,
    out: Out = None,
    workers: Workers = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Fit the response surfaces and print their analysis of variance."""
    with guarded(as_json):
        from doe import report

        _, surfaces = _fitted(path, data, out, workers, quiet or as_json)
        record = report.fit_record(surfaces)
        _save(out, "fit.json", record)
        if as_json:
            print_json(record)
        else:
            report.print_fit(surfaces, quiet)


@app.command()
def front(
    path: StudyPath,
    data: Data = None,
    out: Out = None,
    workers: Workers = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Also every point of the front.")] = False,
) -> None:
    """Find the Pareto front on the response surfaces."""
    with guarded(as_json):
        from doe import report
        from doe.study import find_front

        loaded, surfaces = _fitted(path, data, out, workers, quiet or as_json)
        record = report.front_record(loaded, surfaces, find_front(loaded, surfaces))
        _save(out, "front.json", record)
        if as_json:
            print_json(record)
        else:
            report.print_front(record, verbose)


@app.command()
def chain(
    path: Annotated[Path, typer.Argument(metavar="CHAIN.toml", help="Dimension chain to solve.")],
    out: Save = None,
    as_json: Json = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Parts only.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Also yields and contributions.")] = False,
) -> None:
    """Solve a dimension chain: limits, yield, contributions, allocation. One that misses its limits is refused."""
    with guarded(as_json):
        from doe import report
        from doe.dimension_chain import read_chain, solve

        result = solve(read_chain(path))
        _save(out, "chain.json", result.as_dict())
        if as_json:
            print_json(result.as_dict())
        else:
            report.print_chain(path.stem, result, quiet, verbose)
        if result.status.startswith("refused"):
            print(f"{path}: {result.status}", file=sys.stderr)
            raise typer.Exit(BAD_INPUT)


def _save(out: Path | None, name: str, record: dict[str, Any]) -> None:
    if out is not None:
        from rbdyn.result import write_json

        write_json(output_folder(out) / name, record)


def _fitted(
    path: Path, data: Path | None, out: Path | None, workers: int | None, quiet: bool
) -> tuple[Study, list[Surface]]:
    from doe.study import fit_surfaces, read_runs, run_design
    from doe.study_file import Study

    loaded = Study.load(path)
    if data is not None:
        return loaded, fit_surfaces(loaded, read_runs(loaded, data))
    with _store_folder(out) as folder, progress_bar("design runs", quiet) as progress:
        return loaded, fit_surfaces(loaded, run_design(loaded, folder, workers, progress))


@contextmanager
def _store_folder(out: Path | None) -> Iterator[Path]:
    """The given folder, or one that lasts as long as the command."""
    if out is not None:
        yield output_folder(out)
        return
    with tempfile.TemporaryDirectory() as folder:
        yield Path(folder)


def run() -> None:
    """Entry point of the command."""
    app()
