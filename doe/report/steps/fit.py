"""Response surfaces as JSON, as tables and on the terminal."""

from collections.abc import Sequence
from typing import Any

from doe.report.words import probability
from doe.response_surface import Surface, describe
from rbdyn.cli.terminal import print_table

STARS = ((0.001, "***"), (0.01, "**"), (0.05, "*"))
LEGEND = "*** p <= 0.001, ** p <= 0.01, * p <= 0.05; sums of squares of terms are partial (type III)"
RUN_COLUMNS = ("observed", "predicted", "residual", "standardized", "studentized", "leverage", "cook")


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


def print_fit(
    surfaces: Sequence[Surface], quiet: bool = False, verbose: bool = False, factors: Sequence[str] = ()
) -> None:
    """A response at a time: analysis of variance, coefficients and what they say.

    Quietly, only what they say; verbosely, also the diagnostics of every run. ``factors`` are the names behind
    the letters.
    """
    for surface in surfaces:
        if not quiet:
            _print_anova(surface)
            _print_coefficients(surface)
            _print_equations(surface, factors)
        if verbose:
            _print_runs(surface)
        for sentence in describe(surface):
            print(sentence)
        print()


def _print_anova(surface: Surface) -> None:
    rows = [
        (row["source"], *(_shown(row[key]) for key in ("ss", "df", "ms", "f")), *_verdict(row["p"]))
        for row in surface.anova
    ]
    weights = ", weights 1 / variance of the replicates" if surface.weighting == "replicates" else ""
    power = "" if surface.transform is None else f", Box-Cox exponent {surface.transform:.3g}"
    print_table(
        f"{surface.name}: {surface.model} model, coded units{weights}{power}",
        ("source", "sum of squares", "df", "mean square", "F", "p", ""),
        rows,
    )
    print(LEGEND)


def _print_coefficients(surface: Surface) -> None:
    keys = ("coefficient", "standard_error", "low", "high", "t")
    rows = [
        (row["term"], *(_shown(row[key]) for key in keys), *_verdict(row["p"]), _shown(row["vif"]))
        for row in surface.coefficient_table()
    ]
    header = ("term", "coefficient", "standard error", "95 % from", "to", "t", "p", "", "VIF")
    print_table("", header, rows)


def _print_equations(surface: Surface, factors: Sequence[str]) -> None:
    power = surface.transform
    left = surface.name
    if power is not None:
        left = f"ln {left}" if power == 0 else f"({left}^{power:.3g} - 1)/{power:.3g}"
    coded = zip(surface.terms, surface.coefficients.tolist(), strict=True)
    print(f"{left} = {_sum(coded)} (coded)")
    print(f"{left} = {_sum(surface.actual_coefficients.items())} (actual units)")
    if factors:
        named = zip("ABCDEFGHIJKLMNOPQRSTUVWXYZ", factors, strict=False)
        print(", ".join(f"{letter} = {name}" for letter, name in named))
    unit = "times the known error " if surface.weighting == "replicates" else ""
    shares = map(_shown, (surface.r2, surface.adjusted_r2, surface.predicted_r2))
    explained = "R² {}, adjusted {}, predicted {}".format(*shares)
    missed = f"PRESS {_shown(surface.press)}, CV {_shown(surface.cv_percent)} %"
    precision = f"adequate precision {_shown(surface.adequate_precision)}"
    rest = f"{_shown(surface.residual_mean_square**0.5)} {unit}on {surface.residual_dof} degrees of freedom"
    print(f"{explained}, {missed}, {precision}, residual standard deviation {rest}")


def _print_runs(surface: Surface) -> None:
    rows = [
        (str(run["run"]), *(_shown(run[key]) for key in RUN_COLUMNS))  # type: ignore[literal-required]
        for run in surface.diagnostics["runs"]
    ]
    print_table("", ("run", *RUN_COLUMNS), rows)


def _sum(terms: Any) -> str:
    return " ".join(f"{c:+.5g}{'' if term == '1' else ' ' + term}" for term, c in terms)


def _verdict(p: float | None) -> tuple[str, str]:
    """A p value and its stars."""
    if p is None:
        return "", ""
    return probability(p), next((stars for limit, stars in STARS if p <= limit), "")


def _shown(value: float | None) -> str:
    return "" if value is None else f"{value:.5g}"
