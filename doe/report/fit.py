"""Response surfaces as JSON and on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rbdyn.terminal import print_table

if TYPE_CHECKING:
    from doe.response_surface import Surface


def fit_record(surfaces: list[Surface]) -> dict[str, Any]:
    """JSON of ``doe fit``."""
    return {"responses": {surface.name: surface.as_dict() for surface in surfaces}}


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


def _shown(value: float | None) -> str:
    return "" if value is None else f"{value:.5g}"
