"""The fits: response surfaces, their statistics and pictures, and their tables."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from statistics import NormalDist
from string import ascii_uppercase
from typing import TYPE_CHECKING, Any, TypeVar

from doe.report.still import GUIDE, Point, Still, name_marks
from doe.report.summary import Summary
from doe.response_surface.adequacy import AnovaRow, RunDiagnostics, probability
from doe.response_surface.statistics import Fit, Term
from doe.workflow.problem import Factor
from rbdyn.base.blocks import (
    Block,
    Bullets,
    Column,
    Detail,
    Figures,
    Heading,
    Paragraph,
    Section,
    Sheet,
    Table,
    Widget,
    columns_of,
)
from rbdyn.base.words import label, quantity, shown, with_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes


Row = TypeVar("Row")
Draw = Callable[[str, Sequence[Point], Sequence[str], "Axes"], None]
# Studentized residuals beyond this are suspect; runs with a larger Cook's distance are influential.
SUSPECT, INFLUENTIAL = 3.0, 1.0
STARS = ((0.001, "***"), (0.01, "**"), (0.05, "*"))
LEGEND = "*** p <= 0.001, ** p <= 0.01, * p <= 0.05; sums of squares of terms are partial (type III)"


def stars(row: AnovaRow | Term) -> str:
    """Stars of a p value."""
    return "" if row.p is None else next((stars for limit, stars in STARS if row.p <= limit), "")


SIGNIFICANCE = Column[Any]("", words="", cell=stars, text=True)
RESPONSE = Column[Any]("response", screen=False, meaning="response, and its term, source of scatter or run")
QUALITY: tuple[Column[Fit], ...] = (
    Column("response", label, at="name"),
    Column("model", screen=False),
    Column("r2", words="R²"),
    Column("adjusted_r2", words="adjusted R²"),
    Column("predicted_r2", words="predicted R²"),
    Column("press", words="PRESS"),
    Column("cv_percent", words="CV [%]"),
    Column("adequate_precision", words="adequate precision"),
    Column("", probability, "p of lack of fit", at=("lack_of_fit", "p")),
)
TERM_COLUMNS = columns_of(Term)
# On the screen the test of a coefficient follows its interval.
TESTED: tuple[Column[Term], ...] = (Column("", 5, "t", at="t"), Column("", probability, "p", at="p"), SIGNIFICANCE)


ANOVA = Sheet(
    "Analysis of variance", (RESPONSE, *columns_of(AnovaRow), SIGNIFICANCE), note=LEGEND, detail=Detail.USUAL, file="anova.csv",
    content="Analysis of variance, one row per source of each response.",
)  # fmt: skip
TERMS = Sheet(
    "Coefficients",
    (RESPONSE, *TERM_COLUMNS[:7], *TESTED, *TERM_COLUMNS[7:]),
    detail=Detail.USUAL,
    file="coefficients.csv",
    content="One row per term of each surface.",
)
RUNS = Sheet(
    "Runs and residuals", (RESPONSE, *columns_of(RunDiagnostics)), folded=True, detail=Detail.ALL, file="runs.csv",
    content="Diagnostics, one row per run of each response.",
)  # fmt: skip


def surfaces(summary: Summary) -> Section:
    """The interactive surfaces, and their coefficients."""
    fitted, factors = summary.fit.responses, summary.asked.factors
    terms = list(dict.fromkeys(term for surface in fitted.values() for term in surface.by_term))
    rows = [
        [_term(term, factors), *(_coefficient(surface.by_term.get(term), surface.standard_errors.get(term)) for surface in fitted.values())]
        for term in terms
    ]  # fmt: skip
    header = ["term", *(f"{label(name)}, {surface.model}" for name, surface in fitted.items())]
    places = [
        [label(name), *(factor.text(x) for factor, x in zip(factors, surface.stationary_point.actual, strict=True)), surface.stationary_point.nature]
        for name, surface in fitted.items()
        if surface.stationary_point is not None
    ]  # fmt: skip
    columns = ["response", *(label(factor.name) for factor in factors), "nature"]
    note = "A point outside the region is an extrapolation."
    blocks: list[Block] = [
        Widget("surface"),
        Table("Coefficients in coded units", header, rows, "± are standard errors."),
        Table("Stationary points", columns, places, note, text_columns=(len(factors) + 1,)),
    ]
    return Section("surfaces", "Response surfaces", blocks)


def _term(term: str, factors: Sequence[Factor]) -> str:
    names = {factor.letter: factor.words for factor in factors}
    return f"{term}, {names[term]}" if term in names else term.replace("^2", "²")


def _coefficient(value: float | None, error: float | None) -> str:
    return "–" if value is None else with_error(value, error)


def diagnostics(summary: Summary) -> Section:
    """Analysis of variance with its sentences, and pictures of the residuals, response by response."""
    return Section("diagnostics", "Diagnostics", fit_blocks([*summary.fit.responses.values()], summary.asked.columns))


def fit_blocks(fits: Sequence[Fit], factors: Sequence[str] = ()) -> list[Block]:
    """Quality of the fits; of each analysis of variance, coefficients, equations and sentences on them; at full detail also every run.

    factors : names of those behind the letters of the terms.
    """
    quality = Sheet("Quality of the fits", QUALITY, fits, detail=Detail.USUAL).block
    return [quality, *(block for fit in fits for block in _fit_blocks(fit, factors))]


def _fit_blocks(fit: Fit, factors: Sequence[str]) -> list[Block]:
    # The heading already names the response.
    sentences = [sentence.removeprefix(f"{fit.name}: ") for sentence in fit.sentences]
    runs = fit.diagnostics.runs
    caption = "Predicted on observed, residuals on predicted, normal plot, Cook's distance on leverage."
    anova, terms, residuals = _sheets(fit)
    return [
        Heading(label(fit.name)),
        anova.block,
        terms.block,
        *(Paragraph(text, detail=Detail.USUAL) for text in _equations(fit, factors)),
        Bullets([text[:1].upper() + text[1:] for text in sentences]),
        Figures([still.svg for still in diagnostic_plots(fit.name, runs)], caption),
        residuals.block,
    ]


def _sheets(fit: Fit) -> tuple[Sheet[AnovaRow], Sheet[Term], Sheet[RunDiagnostics]]:
    """Analysis of variance, coefficients, and runs with their residuals."""
    power = "" if fit.transform is None else f", Box-Cox exponent {fit.transform:.3g}"
    model = f"{fit.model.replace('_', ' ')} model, coded units{power}"
    return (
        _of(fit, ANOVA, fit.anova, f": {model}"),
        _of(fit, TERMS, fit.coefficient_table),
        _of(fit, RUNS, fit.diagnostics.runs),
    )


def _of(fit: Fit, sheet: Sheet[Row], rows: Sequence[Row], further: str = "") -> Sheet[Row]:
    """A sheet of one fit, whose name is in files alone."""
    columns = (replace(RESPONSE, at=lambda _: fit.name), *sheet.columns[1:])
    return replace(sheet, caption=f"{sheet.caption} of {label(fit.name)}{further}", columns=columns, rows=rows)


def fit_files(fits: Sequence[Fit]) -> dict[str, list[dict[str, Any]]]:
    """Rows of each CSV file: the analysis of variance, the coefficients, the runs with their diagnostics."""
    return {
        sheets[0].file: [row for sheet in sheets for row in sheet.records]
        for sheets in zip(*map(_sheets, fits), strict=True)
    }


def fit_rows(fits: Sequence[Fit]) -> dict[str, list[dict[str, Any]]]:
    """Rows of each table of fits by its name: their quality, then those of the files."""
    files = {name.removesuffix(".csv"): rows for name, rows in fit_files(fits).items()}
    return {"quality": Sheet("Quality of the fits", QUALITY, fits).records, **files}


def _equations(fit: Fit, factors: Sequence[str]) -> list[str]:
    """The surface in coded and in actual units, and which factor each letter is."""
    power, symbol = fit.transform, quantity(fit.name)[0]
    if power is not None:
        symbol = f"ln {symbol}" if power == 0 else f"({symbol}^{power:.3g} - 1)/{power:.3g}"
    sides = (fit.by_term, "coded"), (fit.actual_coefficients, "actual units")
    letters = zip(ascii_uppercase, factors, strict=False)
    return [
        *(f"{symbol} = {_sum(terms)} ({words})" for terms, words in sides),
        ", ".join(f"{letter} = {label(factor)}" for letter, factor in letters),
    ]


def _sum(terms: Mapping[str, float]) -> str:
    return " ".join(f"{c:+.5g}{'' if term == '1' else ' ' + term}" for term, c in terms.items())


def diagnostic_plots(name: str, runs: Sequence[RunDiagnostics]) -> list[Still]:
    """Four pictures; a picture whose numbers are undefined is left out."""
    pictures = [
        _plotted(_predicted_on_observed, f"Predicted on observed {label(name)}", name, runs, "observed", "predicted"),
        _plotted(_residuals, f"Studentized residuals of {label(name)} on predicted values", name, runs, "predicted", "studentized"),
        _normal_plot(name, runs),
        _plotted(_influence, f"Cook's distance of {label(name)} on leverage", name, runs, "leverage", "cook"),
    ]  # fmt: skip
    return [still for still in pictures if still]


def _plotted(draw: Draw, words: str, name: str, runs: Sequence[RunDiagnostics], across: str, up: str) -> Still | None:
    places = ((run.run, getattr(run, across), getattr(run, up)) for run in runs)
    defined = [(run, x, y) for run, x, y in places if x is not None and y is not None]
    points = [(x, y) for _, x, y in defined]
    titles = [f"run {run}: {shown(x)}, {shown(y)}" for run, x, y in defined]
    return Still(f"{words}, {len(points)} runs", partial(draw, name, points, titles)) if points else None


def _mark_runs(axis: "Axes", points: Sequence[Point], titles: Sequence[str]) -> None:
    name_marks(axis.plot(*zip(*points, strict=True), "o")[0], "run", titles)


def _predicted_on_observed(name: str, points: Sequence[Point], titles: Sequence[str], axis: "Axes") -> None:
    _mark_runs(axis, points, titles)
    both = min(axis.get_xlim()[0], axis.get_ylim()[0]), max(axis.get_xlim()[1], axis.get_ylim()[1])
    axis.plot(both, both, **GUIDE)
    axis.set(xlim=both, ylim=both, xlabel=f"observed {label(name)}", ylabel="predicted")


def _residuals(name: str, points: Sequence[Point], titles: Sequence[str], axis: "Axes") -> None:
    _mark_runs(axis, points, titles)
    reach = max(SUSPECT * 1.1, *(abs(y) * 1.06 for _, y in points))
    for level in (-SUSPECT, 0.0, SUSPECT):
        axis.axhline(level, **GUIDE)
    axis.set(ylim=(-reach, reach), xlabel=f"predicted {label(name)}", ylabel="studentized residual")


def _normal_plot(name: str, runs: Sequence[RunDiagnostics]) -> Still | None:
    defined = sorted((run.studentized, run.run) for run in runs if run.studentized is not None)
    if len(defined) < 3:
        return None
    # Blom's plotting positions.
    scores = [NormalDist().inv_cdf((rank + 0.625) / (len(defined) + 0.25)) for rank in range(len(defined))]
    points = [(value, score) for (value, _), score in zip(defined, scores, strict=True)]
    titles = [f"run {run}: {shown(value)}" for value, run in defined]
    words = f"Normal plot of the residuals of {label(name)}, {len(points)} runs"
    return Still(words, partial(_normal, points, titles))


def _normal(points: Sequence[Point], titles: Sequence[str], axis: "Axes") -> None:
    _mark_runs(axis, points, titles)
    (nearest, farthest), (low, high) = limits = axis.get_xlim(), axis.get_ylim()
    ends = max(nearest, low), min(farthest, high)
    axis.plot(ends, ends, **GUIDE)
    axis.set(xlim=limits[0], ylim=limits[1], xlabel="studentized residual", ylabel="normal score")


def _influence(name: str, points: Sequence[Point], titles: Sequence[str], axis: "Axes") -> None:
    _mark_runs(axis, points, titles)
    top = max(INFLUENTIAL * 1.05, *(1.08 * y for _, y in points))
    axis.axhline(INFLUENTIAL, **GUIDE)
    axis.set(xlim=(0.0, 1.05), ylim=(0.0, top), xlabel="leverage", ylabel="Cook's distance")
