"""What ``doe design``, ``doe fit`` and ``doe chain`` report."""

from collections.abc import Mapping, Sequence
from typing import Any

from doe.designs import Design
from doe.dimension_chain import ChainResult
from doe.response_surface import Surface, describe
from doe.study_file import Study
from doe.workflow.runs import actual_of
from rbdyn.base.blocks import Block, Detail, Table
from rbdyn.base.records import quoted_cell
from rbdyn.base.words import counted, label


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


def blocks(record: dict[str, Any]) -> list[Block]:
    """The runs in actual values, the same in coded ones, how good they are; for who asks for all seeds and leverages."""
    evaluation, runs = record["evaluation"], record["runs"]
    blocked = evaluation["blocks"] is not None
    actual = [
        (str(run["run"]), *([str(run["block"])] if blocked else []), *(f"{x:.6g}" for x in run["factors"].values()))
        for run in runs
    ]
    coded = [(str(run["run"]), run["kind"], *(f"{x:+.4f}" for x in run["coded"].values())) for run in runs]
    seeds = [
        (str(run["run"]), str(run["standard"]), str(run["seed"]), f"{leverage:.3f}")
        for run, leverage in zip(runs, evaluation["leverage"], strict=True)
    ]
    title = f"{record['kind'].replace('_', ' ')}, {counted(len(runs), 'run')}"
    names = [label(name) for name in record["factors"]]
    return [
        Table(title, ("run", *(["block"] if blocked else []), *names), actual),
        Table("Coded values", ("run", "point", *names), coded, text_columns=(1,), detail=Detail.USUAL),
        Table("Order, seeds and leverages", ("run", "standard", "seed", "leverage"), seeds, detail=Detail.ALL),
        *_evaluation(evaluation),
    ]


def _evaluation(found: dict[str, Any]) -> list[Block]:
    """How good the design is for the largest model asked: as a whole, by term, by radius."""
    region = found["region"]
    size = f"{'radius' if region['shape'] == 'ball' else 'half-width'} {region['reach']:.4g}"
    model = f"{found['model'].replace('_', ' ')} model, {counted(len(found['terms']), 'term')}"
    title = f"{model}, over the {region['shape']} of {size} (coded)"
    terms = [
        (term, f"{inflation:.3f}", *(_percent(found["power_percent"][term][key]) for key in SIGMAS))
        for term, inflation in found["vif"].items()
    ]
    header = ("term", "VIF", "power for 1 sigma [%]", "power for 2 sigma [%]")
    shells = [tuple(f"{shell[key]:.3f}" for key in ("radius", "min", "mean", "max")) for shell in found["by_radius"]]
    by_radius = "Scaled prediction variance by radius"
    return [
        Table(title, ("", "value"), _figures(found), text_columns=(1,), detail=Detail.USUAL),
        Table("By term", header, terms, detail=Detail.USUAL),
        Table(by_radius, ("radius", "least", "mean", "largest"), shells, detail=Detail.ALL),
    ]


def _figures(found: dict[str, Any]) -> list[tuple[str, str]]:
    freedom, variance = found["degrees_of_freedom"], found["scaled_prediction_variance"]
    letters = found["efficiency_percent"].items()
    rows = [
        ("efficiency [%]", ", ".join(f"{letter.upper()} {value:.1f}" for letter, value in letters)),
        ("scaled prediction variance", ", ".join(f"{name} {variance[name]:.2f}" for name in ("centre", "mean", "max"))),
        ("its largest in the box of the front", f"{variance['box_max']:.2f}"),
        ("degrees of freedom", ", ".join(f"{name.replace('_', ' ')} {n}" for name, n in freedom.items())),
        ("condition number of the model matrix", f"{found['condition_number']:.2f}"),
        ("largest leverage", f"{max(found['leverage']):.3f}"),
    ]
    if found["blocks"] is not None:
        relation = "orthogonal" if found["blocks"]["orthogonal"] else "not orthogonal"
        cosine = found["blocks"]["largest_cosine"]
        rows.append(("blocks", f"{relation} to the terms (largest cosine {cosine:.3f})"))
    return rows


SIGMAS = ("one_sigma", "two_sigma")


def _percent(value: float | None) -> str:
    return "" if value is None else f"{value:.1f}"


def fit_record(surfaces: Sequence[Surface]) -> dict[str, Any]:
    """JSON of ``doe fit``."""
    return {"responses": {each.name: each.as_dict() | {"sentences": describe(each)} for each in surfaces}}


def fit_tables(surfaces: Sequence[Surface]) -> dict[str, list[dict[str, Any]]]:
    """Rows of each CSV file: the analysis of variance, the coefficients, the runs with their diagnostics."""
    return {
        "anova.csv": [{"response": s.name, **row} for s in surfaces for row in s.anova],
        "coefficients.csv": [
            {"response": s.name, **row, "actual_units": s.actual_coefficients[row["term"]]}
            for s in surfaces
            for row in s.coefficient_table()
        ],
        "runs.csv": [{"response": s.name, **run} for s in surfaces for run in s.diagnostics["runs"]],
    }


def chains_record(results: Mapping[str, ChainResult]) -> dict[str, Any]:
    """JSON of ``doe chain`` for a file of several chains."""
    refused = [name for name, result in results.items() if result.refused]
    status = f"refused: {', '.join(refused)}" if refused else "ok"
    return {"chains": {name: result.as_dict() for name, result in results.items()}, "status": status}
