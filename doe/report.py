"""What a study leaves behind: tables, summary.json, pictures, and the few lines a person acts on."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rbdyn.result import versions, write_json
from rbdyn.terminal import print_table

if TYPE_CHECKING:
    from doe.dimension_chain import ChainResult, Part
    from doe.pareto import ParetoFront
    from doe.response_surface import Surface
    from doe.study import Outcome, Runs
    from doe.study_file import Study

FORMAT = "doe.study/1"
# Shaft turns of the motion that is drawn.
DRAWN_TURNS = 10.0


def fit_record(surfaces: list[Surface]) -> dict[str, Any]:
    """JSON of ``doe fit``."""
    return {"responses": {surface.name: surface.as_dict() for surface in surfaces}}


def front_record(study: Study, surfaces: list[Surface], front: ParetoFront) -> dict[str, Any]:
    """JSON of ``doe front``: factor and response values in their own units and senses."""

    def named(point: np.ndarray, values: np.ndarray) -> dict[str, dict[str, float]]:
        return {
            "factors": dict(zip(study.factors, point.tolist(), strict=True)),
            "responses": dict(zip(study.responses, (values * study.signs).tolist(), strict=True)),
        }

    baseline = front.baseline_values
    assert baseline is not None
    return {
        "front": [named(point, values) for point, values in zip(front.points, front.values, strict=True)],
        "hypervolume": front.hypervolume,
        "ideal": dict(zip(study.responses, (front.ideal * study.signs).tolist(), strict=True)),
        "nadir": dict(zip(study.responses, (front.nadir * study.signs).tolist(), strict=True)),
        "knee": named(front.points[front.knee], front.values[front.knee]),
        "pick": {**named(front.points[front.pick], front.values[front.pick]), "reason": front.pick_reason},
        "baseline": named(study.baseline, baseline),
        "generations": front.generations,
        "seed": front.seed,
    }


def write(outcome: Outcome, folder: Path) -> list[str]:
    """Write everything into ``folder``; returns the file names."""
    import pandas as pd

    from doe import clearance, plots

    study, front = outcome.study, outcome.front
    tables = {
        "design_runs.csv": _runs_table(study, outcome.runs),
        "anova.csv": [
            {"response": surface.name, **row} for surface in outcome.surfaces for row in surface.anova
        ],
        "coefficients.csv": [
            {"response": s.name, "term": term, "coefficient": c, "standard_error": e}
            for s in outcome.surfaces
            for term, c, e in zip(s.terms, s.coefficients, np.sqrt(np.diag(s.covariance)), strict=True)
        ],
        "front.csv": [
            {**point["factors"], **point["responses"]}
            for point in front_record(study, outcome.surfaces, front)["front"]
        ],
        "confirmation.csv": _confirmation_table(outcome),
        "part_dimensions.csv": [
            {"chain": name, "part": part.name, **_dimension(part)}
            for name, chain in outcome.chains.items()
            for part in chain.allocation
        ],
    }
    if outcome.reference_values is not None:
        tables["beside_reference.csv"] = _beside_table(outcome)
    for name, rows in tables.items():
        pd.DataFrame(rows).to_csv(folder / name, index=False)
    pictures = []
    for surface in outcome.surfaces:
        pictures.append(f"surface_{surface.name}.png")
        plots.response_surface(study, surface, folder / pictures[-1])
    confirmed = np.array([outcome.baseline.values, outcome.pick.values])
    plots.pareto_front(study, front, outcome.surfaces, confirmed, folder / "pareto_front.png")
    points = {"baseline": outcome.baseline.point, "pick": outcome.pick.point}
    pictures += ["pareto_front.png", *clearance.draw_motion(study, points, DRAWN_TURNS, folder)]
    write_json(folder / "summary.json", summary(outcome))
    return ["summary.json", *tables, *pictures]


def summary(outcome: Outcome) -> dict[str, Any]:
    """JSON of ``doe study``."""
    study = outcome.study
    return {
        "format": FORMAT,
        "status": "ok",
        "design": {"runs": len(outcome.runs.coded), "factors": study.factors, "responses": study.responses},
        "fit": fit_record(outcome.surfaces),
        "front": front_record(study, outcome.surfaces, outcome.front),
        "pick": dict(zip(study.factors, outcome.pick.point.tolist(), strict=True)),
        "confirmation": {
            name: {
                "factors": dict(zip(study.factors, each.point.tolist(), strict=True)),
                "responses": {
                    response: {
                        "value": value,
                        "statistical_error": _or_none(s),
                        "numerical_error": _or_none(n),
                    }
                    for response, value, s, n in zip(
                        study.responses, each.values.tolist(), each.statistical, each.numerical, strict=True
                    )
                },
            }
            for name, each in (("baseline", outcome.baseline), ("pick", outcome.pick))
        },
        "gains": {
            gain.response: {"percent": gain.percent, "error_percent": gain.error, "verdict": gain.verdict}
            for gain in outcome.gains
        },
        "chains": {name: chain.as_dict() for name, chain in outcome.chains.items()},
        "beside_reference": {
            row.response: {
                "ours_min_mean_max": [float(x) for x in row.our_range],
                "theirs_min_mean_max": [float(x) for x in row.their_range],
                "linear_effects": {
                    factor: {"ours": ours[0], "theirs": theirs[0], "same_sign": ours[0] * theirs[0] > 0.0}
                    for factor, (ours, theirs) in row.effects.items()
                },
                "rank_correlation": row.rank_correlation,
                "verdict": row.verdict,
                "why": row.why,
            }
            for row in outcome.beside
        },
        "notes": list(outcome.runs.notes),
        "cost": outcome.cost,
        "versions": versions(),
    }


def print_fit(surfaces: list[Surface], quiet: bool = False) -> None:
    """Analysis of variance and what it says, a response at a time; quietly, only what it says."""
    from doe.response_surface import describe

    for surface in surfaces:
        if not quiet:
            _print_anova(surface)
        terms = zip(surface.terms, surface.coefficients, strict=True)
        print(f"{surface.name} = " + " ".join(f"{c:+.5g}{'' if t == '1' else ' ' + t}" for t, c in terms))
        print(
            f"R² {_shown(surface.r2)}, adjusted {_shown(surface.adjusted_r2)}, predicted "
            f"{_shown(surface.predicted_r2)}, PRESS {_shown(surface.press)}, CV {_shown(surface.cv_percent)} %, "
            f"adequate precision {_shown(surface.adequate_precision)}"
        )
        for sentence in describe(surface):
            print(sentence)
        print()


def _print_anova(surface: Surface) -> None:
    rows = [
        (row["source"], *(_shown(row[key]) for key in ("ss", "df", "ms", "f", "p"))) for row in surface.anova
    ]
    print_table(
        f"{surface.name}: {surface.model} model, coded units",
        ("source", "sum of squares", "df", "mean square", "F", "p"),
        rows,
    )


def print_front(record: dict[str, Any], verbose: bool = False) -> None:
    """Baseline, knee and pick of a front; verbosely, every point of it."""
    names = [*record["baseline"]["factors"], *record["baseline"]["responses"]]
    points = {name: record[name] for name in ("baseline", "knee", "pick")}
    if verbose:
        points |= {str(number): point for number, point in enumerate(record["front"], 1)}
    rows = [
        (name, *(f"{x:.5g}" for kind in ("factors", "responses") for x in point[kind].values()))
        for name, point in points.items()
    ]
    print_table(f"Pareto front on the surfaces, {len(record['front'])} points", ("", *names), rows)
    print(f"pick: {record['pick']['reason']}; hypervolume {record['hypervolume']:.4f} of 1.331")


def print_chain(name: str, chain: ChainResult, quiet: bool = False, verbose: bool = False) -> None:
    """Parts, closing link and yield of a dimension chain; verbosely, all yields and contributions."""
    refused = chain.status.startswith("refused")
    title = f"dimension chain {name}" + (": the nearest parts that meet the limits" if refused else "")
    rows = [(part.name, part_text(part), part.grade or "") for part in chain.allocation]
    print_table(title, ("part", "dimension [mm]", "grade"), rows)
    if verbose:
        shares = [
            (part, f"{each['variance_percent']:.1f} %", f"{each['worst_case_percent']:.1f} %")
            for part, each in chain.contributions.items()
        ]
        print_table("contributions", ("part", "variance", "worst case"), shares)
        yields = [(kind.replace("_", " "), f"{share:.6f}") for kind, share in chain.yields.items()]
        print_table(f"yield, ± {chain.standard_error:.1g}", ("distribution of the parts", "yield"), yields)
    if quiet:
        return
    low, high = chain.worst_case_mm
    print(
        f"{'as given: ' if refused else ''}closing link {low:.4f} to {high:.4f} mm in worst case, yield "
        f"{chain.yields['as_given']:.6f} ± {chain.standard_error:.1g}"
    )


def print_outcome(outcome: Outcome, quiet: bool) -> None:
    """The end of a study on the terminal: the answer last, where the eye is."""
    study = outcome.study
    if not quiet and outcome.beside and study.file.reference:
        _print_beside(study.file.reference.label, outcome)
    rows = [
        (name, f"{base:.4g}", f"{pick:.4g}")
        for name, base, pick in zip(study.factors, outcome.baseline.point, outcome.pick.point, strict=True)
    ]
    print_table("chosen clearances", ("", "baseline", "pick"), rows)
    gains = []
    for index, gain in enumerate(outcome.gains):
        cells = [_value(each, index) for each in (outcome.baseline, outcome.pick)]
        gains.append((gain.response, *cells, f"{gain.percent:+.2f} ± {gain.error:.2f} %", gain.verdict))
    print_table(
        "confirmed by simulation (95 % intervals)", ("", "baseline", "pick", "improvement", "verdict"), gains
    )
    print(f"pick: {outcome.front.pick_reason}")
    for name, chain in outcome.chains.items():
        print_chain(name, chain)
        print(chain.status)
    if not quiet:
        for note in outcome.runs.notes:
            print(f"note: {note}")


def part_text(part: Part) -> str:
    """'9.2900 0/-0.0050'."""

    def deviation(value: float) -> str:
        return "0" if value == 0.0 else f"{value:+.4f}"

    return f"{part.nominal_mm:.4f} {deviation(part.upper_mm)}/{deviation(part.lower_mm)}"


def _print_beside(reference: str, outcome: Outcome) -> None:
    rows = []
    for row in outcome.beside:
        rows.append(
            (row.response, "level: min, mean, max", _three(row.our_range), _three(row.their_range), "")
        )
        for factor, (ours, theirs) in row.effects.items():
            same = "same sign" if ours[0] * theirs[0] > 0.0 else "opposite sign"
            rows.append(("", f"effect of {factor}", _effect(ours), _effect(theirs), same))
        rows.append(("", "rank correlation of the runs", f"{row.rank_correlation:+.2f}", "", ""))
    print_table(f"our runs beside {reference} (* significant at 5 %)", ("", "", "ours", "theirs", ""), rows)
    for row in outcome.beside:
        print(f"{row.verdict} {row.why}".rstrip())


def _runs_table(study: Study, runs: Runs) -> list[dict[str, Any]]:
    return [
        {
            "run": run + 1,
            **{f"coded_{name}": x for name, x in zip(study.factors, coded, strict=True)},
            **dict(zip(study.factors, actual, strict=True)),
            **dict(zip(study.responses, values, strict=True)),
            **{f"{name}_error": e for name, e in zip(study.responses, errors, strict=True)},
        }
        for run, (coded, actual, values, errors) in enumerate(
            zip(runs.coded, runs.actual, runs.values, runs.errors, strict=True)
        )
    ]


def _beside_table(outcome: Outcome) -> list[dict[str, Any]]:
    study, runs = outcome.study, outcome.runs
    assert outcome.reference_values is not None
    return [
        {
            "run": run + 1,
            **dict(zip(study.factors, runs.actual[run], strict=True)),
            **{f"{name}_ours": x for name, x in zip(study.responses, runs.values[run], strict=True)},
            **{f"{name}_theirs": x for name, x in zip(study.responses, theirs, strict=True)},
        }
        for run, theirs in enumerate(outcome.reference_values)
    ]


def _confirmation_table(outcome: Outcome) -> list[dict[str, Any]]:
    return [
        {
            "response": gain.response,
            "baseline": outcome.baseline.values[i],
            "baseline_statistical_error": outcome.baseline.statistical[i],
            "baseline_numerical_error": outcome.baseline.numerical[i],
            "pick": outcome.pick.values[i],
            "pick_statistical_error": outcome.pick.statistical[i],
            "pick_numerical_error": outcome.pick.numerical[i],
            "improvement_percent": gain.percent,
            "improvement_error_percent": gain.error,
            "verdict": gain.verdict,
        }
        for i, gain in enumerate(outcome.gains)
    ]


def _dimension(part: Part) -> dict[str, Any]:
    return {
        "nominal_mm": part.nominal_mm,
        "upper_mm": part.upper_mm,
        "lower_mm": part.lower_mm,
        "grade": part.grade,
    }


def _value(confirmed: Any, index: int) -> str:
    error = np.hypot(np.nan_to_num(confirmed.statistical[index]), np.nan_to_num(confirmed.numerical[index]))
    return f"{confirmed.values[index]:.5g} ± {error:.2g}"


def _effect(effect: tuple[float, bool]) -> str:
    return f"{effect[0]:+.3g}{'*' if effect[1] else ''}"


def _three(values: tuple[float, float, float]) -> str:
    return ", ".join(f"{x:.4g}" for x in values)


def _shown(value: float | None) -> str:
    return "" if value is None else f"{value:.5g}"


def _or_none(value: float) -> float | None:
    return None if np.isnan(value) else float(value)
