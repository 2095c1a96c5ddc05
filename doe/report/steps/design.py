"""A design as JSON and on the terminal."""

from typing import Any

from doe.designs import Design
from doe.study.design import actual_of
from doe.study_file import Study
from rbdyn.cli.terminal import print_table
from rbdyn.records.cells import quoted_cell
from rbdyn.records.words import counted


def runs_record(study: Study, design: Design) -> list[dict[str, Any]]:
    """Runs in their order, from 1."""
    actual = actual_of(study, design)
    rows = zip(design.order.tolist(), design.kind, design.block_numbers, design.coded, actual, strict=True)
    return [
        {
            "run": number,
            "kind": kind,
            "block": block,
            "coded": study.by_factor(coded),
            "factors": study.by_factor(values),
            "seed": study.file.design.seed + place,
        }
        for number, (place, kind, block, coded, values) in enumerate(rows, 1)
    ]


def design_record(study: Study, design: Design, evaluation: dict[str, Any]) -> dict[str, Any]:
    """JSON of ``doe design``: runs in their order, ``standard`` being the place in the standard order from 1."""
    runs = zip(runs_record(study, design), design.order.tolist(), strict=True)
    return {
        "kind": study.file.design.kind,
        "factors": study.factors,
        "reach": design.reach,
        "runs": [{**run, "standard": place + 1} for run, place in runs],
        "evaluation": evaluation,
    }


def print_csv(record: dict[str, Any]) -> None:
    """Run and actual factors, with the block where there are several."""
    blocked = record["evaluation"]["blocks"] is not None
    print(",".join(["run", *(["block"] if blocked else []), *map(quoted_cell, record["factors"])]))
    for run in record["runs"]:
        values = [f"{x:.9g}" for x in run["factors"].values()]
        print(",".join([str(run["run"]), *([str(run["block"])] if blocked else []), *values]))


def print_design(record: dict[str, Any], quiet: bool = False, verbose: bool = False) -> None:
    """The runs and what they can tell; quietly, actual values only; verbosely, also seeds and leverages."""
    blocked = record["evaluation"]["blocks"] is not None
    columns: dict[str, list[str]] = {"run": [str(run["run"]) for run in record["runs"]]}
    if blocked:
        columns["block"] = [str(run["block"]) for run in record["runs"]]
    for name in record["factors"]:
        columns[name] = [f"{run['factors'][name]:.6g}" for run in record["runs"]]
    if not quiet:
        columns["point"] = [run["kind"] for run in record["runs"]]
        for name in record["factors"]:
            columns[f"{name} (coded)"] = [f"{run['coded'][name]:+.4f}" for run in record["runs"]]
    if verbose:
        columns["standard"] = [str(run["standard"]) for run in record["runs"]]
        columns["seed"] = [str(run["seed"]) for run in record["runs"]]
        columns["leverage"] = [f"{x:.3f}" for x in record["evaluation"]["leverage"]]
    title = f"{record['kind']}, {counted(len(record['runs']), 'run')}"
    print_table(title, list(columns), list(zip(*columns.values(), strict=True)))
    if not quiet:
        _print_evaluation(record["evaluation"], verbose)


def _print_evaluation(found: dict[str, Any], verbose: bool) -> None:
    freedom, variance = found["degrees_of_freedom"], found["scaled_prediction_variance"]
    letters = found["efficiency_percent"].items()
    region = found["region"]
    size = f"{'radius' if region['shape'] == 'ball' else 'half-width'} {region['reach']:.4g}"
    rows = [
        ["efficiency [%]", ", ".join(f"{letter.upper()} {value:.1f}" for letter, value in letters)],
        ["scaled prediction variance", ", ".join(f"{name} {variance[name]:.2f}" for name in ("centre", "mean", "max"))],
        ["its largest in the box of the front", f"{variance['box_max']:.2f}"],
        ["degrees of freedom", ", ".join(f"{name.replace('_', ' ')} {n}" for name, n in freedom.items())],
        ["condition number of the model matrix", f"{found['condition_number']:.2f}"],
        ["largest leverage", f"{max(found['leverage']):.3f}"],
    ]
    if found["blocks"] is not None:
        relation = "orthogonal" if found["blocks"]["orthogonal"] else "not orthogonal"
        cosine = found["blocks"]["largest_cosine"]
        rows.append(["blocks", f"{relation} to the terms (largest cosine {cosine:.3f})"])
    title = (
        f"{found['model']} model, {counted(len(found['terms']), 'term')}, over the {region['shape']} of {size} (coded)"
    )
    print_table(title, ["", "value"], rows)
    terms = [
        [term, f"{inflation:.3f}", *(_percent(found["power_percent"][term][key]) for key in SIGMAS)]
        for term, inflation in found["vif"].items()
    ]
    print_table("", ["term", "VIF", "power for 1 sigma [%]", "power for 2 sigma [%]"], terms)
    if verbose:
        shells = [[f"{shell[key]:.3f}" for key in ("radius", "min", "mean", "max")] for shell in found["by_radius"]]
        print_table("scaled prediction variance by radius", ["radius", "min", "mean", "max"], shells)


SIGMAS = ("one_sigma", "two_sigma")


def _percent(value: float | None) -> str:
    return "" if value is None else f"{value:.1f}"
