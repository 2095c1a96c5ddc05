"""The fits: response surfaces, their statistics and pictures, and the record of ``doe fit``."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from statistics import NormalDist
from string import ascii_uppercase
from typing import TYPE_CHECKING, Any

from doe.report.sections.record import Record, factors, fits, part, probability, record_table
from doe.report.still import GUIDE, Point, Still, name_marks
from doe.response_surface import Surface, describe
from rbdyn.base.blocks import Block, Bullets, Detail, Figures, Heading, Paragraph, Section, Table, Widget
from rbdyn.base.words import counted, label, quantity, shown, with_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes


Draw = Callable[[str, Sequence[Point], Sequence[str], "Axes"], None]
# Studentized residuals beyond this are suspect; runs with a larger Cook's distance are influential.
SUSPECT, INFLUENTIAL = 3.0, 1.0
STATISTICS = (
    ("r2", "R²"), ("adjusted_r2", "adjusted R²"), ("predicted_r2", "predicted R²"), ("press", "PRESS"),
    ("cv_percent", "CV [%]"), ("adequate_precision", "adequate precision"),
)  # fmt: skip


STARS = ((0.001, "***"), (0.01, "**"), (0.05, "*"))
LEGEND = "*** p <= 0.001, ** p <= 0.01, * p <= 0.05; sums of squares of terms are partial (type III)"
RUN_COLUMNS = ("observed", "predicted", "residual", "standardized", "studentized", "leverage", "cook")
# Parts of a fit without a table of their own.
FURTHER = ("box_cox", "blocks", "canonical", "known_variance", "rival")


def surfaces(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """The interactive surfaces, and their coefficients."""
    fitted = fits(summary)
    if not fitted:
        return None
    terms = list(dict.fromkeys(term for surface in fitted.values() for term in surface["coefficients"]))
    errors = {name: surface.get("standard_errors") or {} for name, surface in fitted.items()}
    rows = [
        [_term(term, summary), *(_coefficient(surface["coefficients"].get(term), errors[name].get(term)) for name, surface in fitted.items())]
        for term in terms
    ]  # fmt: skip
    note = "± are standard errors." if any(errors.values()) else ""
    header = ["term", *(f"{label(name)}, {surface.get('model', '')}" for name, surface in fitted.items())]
    blocks: list[Block] = [Widget("surface")] if part(summary, "asked", "factors") else []
    blocks += [Table("Coefficients in coded units", header, rows, note), _stationary(summary, fitted)]
    return Section("surfaces", "Response surfaces", blocks)


def _term(term: str, summary: Record) -> str:
    names = {factor.letter: factor.words for factor in factors(summary)}
    return f"{term}, {names[term]}" if term in names else term.replace("^2", "²")


def _coefficient(value: float | None, error: float | None) -> str:
    return "–" if value is None else with_error(value, error)


def _stationary(summary: Record, fitted: Record) -> Table:
    columns = factors(summary)
    rows = []
    for name, surface in fitted.items():
        actual = part(surface, "stationary_point", "actual") or []
        if len(actual) == len(columns):
            places = [factor.text(x) for factor, x in zip(columns, actual, strict=True)]
            rows.append([label(name), *places, str(part(surface, "stationary_point", "nature") or "")])
    header = ["response", *(label(factor.name) for factor in columns), "nature"]
    return Table("Stationary points", header, rows, "A point outside the region is an extrapolation.", text_columns=(len(columns) + 1,))  # fmt: skip


def diagnostics(summary: Record, motion: Mapping[str, Any]) -> Section:
    """Analysis of variance with its sentences, and pictures of the residuals, response by response."""
    fitted = fits(summary)
    rows = [
        [
            label(name),
            *(shown(surface.get(key)) for key, _ in STATISTICS),
            probability(part(surface, "lack_of_fit", "p")),
        ]
        for name, surface in fitted.items()
    ]
    header = ["response", *(words for _, words in STATISTICS), "p of lack of fit"]
    blocks: list[Block] = [Table("Quality of the fits", header, rows)]
    names = [factor.name for factor in factors(summary)]
    for name, surface in fitted.items():
        blocks += fit_blocks(name, surface, names)
    return Section("diagnostics", "Diagnostics", blocks)


def fit_blocks(name: str, fitted: Record, names: Sequence[str] = ()) -> list[Block]:
    """One fit: analysis of variance, coefficients, equations and sentences on them; at full detail also every run.

    names : the factors behind the letters of the terms.
    """
    # The heading already names the response.
    sentences = [sentence.removeprefix(f"{name}: ") for sentence in fitted.get("sentences") or []]
    runs = part(fitted, "diagnostics", "runs") or []
    caption = "Predicted on observed, residuals on predicted, normal plot, Cook's distance on leverage."
    further = {
        key: {name: value for name, value in fitted[key].items() if name != "sentence"}
        for key in FURTHER
        if isinstance(fitted.get(key), Mapping)
    }
    return [
        Heading(label(name)),
        _anova(name, fitted),
        _coefficients(name, fitted),
        *(Paragraph(text, detail=Detail.USUAL) for text in (*_equations(name, fitted, names), _quality(fitted))),
        Bullets([text[:1].upper() + text[1:] for text in sentences]),
        Figures([still.svg for still in diagnostic_plots(name, runs)], caption),
        _runs(name, runs),
        replace(record_table(f"Further figures of {label(name)}", further, folded=True), detail=Detail.ALL),
    ]


def _anova(name: str, fitted: Record) -> Table:
    rows = [
        (row["source"].replace("_", " "), shown(row.get("ss"), 5), shown(row.get("df")), shown(row.get("ms"), 5),
         shown(row.get("f")), *_significance(row.get("p")))
        for row in fitted.get("anova") or []
        if "source" in row
    ]  # fmt: skip
    power = "" if fitted.get("transform") is None else f", Box-Cox exponent {fitted['transform']:.3g}"
    model = f"{fitted['model'].replace('_', ' ')} model, coded units{power}" if fitted.get("model") else ""
    caption = f"Analysis of variance of {label(name)}: {model}".rstrip(": ")
    header = ("source", "sum of squares", "df", "mean square", "F", "p", "")
    return Table(caption, header, rows, LEGEND, text_columns=(6,), detail=Detail.USUAL)


def _coefficients(name: str, fitted: Record) -> Table:
    rows = []
    for term, value in fitted["coefficients"].items():
        tested = part(fitted, "tests", term) or {}
        error = part(fitted, "standard_errors", term)
        numbers = (shown(tested.get(key), 5) for key in ("low", "high", "t"))
        inflation = shown(part(fitted, "vif", term), 5)
        rows.append((term, _coefficient(value, error), *numbers, *_significance(tested.get("p")), inflation))
    header = ("term", "coefficient ± standard error", "95 % from", "to", "t", "p", "", "VIF")
    return Table(f"Coefficients of {label(name)}", header, rows, text_columns=(6,), detail=Detail.USUAL)


def _significance(p: float | None) -> tuple[str, str]:
    """A p value and its stars."""
    return probability(p), "" if p is None else next((stars for limit, stars in STARS if p <= limit), "")


def _equations(name: str, fitted: Record, names: Sequence[str]) -> list[str]:
    """The surface in coded and in actual units, and which factor each letter is."""
    power, symbol = fitted.get("transform"), quantity(name)[0]
    if power is not None:
        symbol = f"ln {symbol}" if power == 0 else f"({symbol}^{power:.3g} - 1)/{power:.3g}"
    sides = ("coefficients", "coded"), ("actual_coefficients", "actual units")
    equations = [f"{symbol} = {_sum(fitted[key])} ({words})" for key, words in sides if fitted.get(key)]
    letters = zip(ascii_uppercase, names, strict=False)
    return [*equations, ", ".join(f"{letter} = {label(factor)}" for letter, factor in letters)]


def _sum(terms: Record) -> str:
    return " ".join(f"{c:+.5g}{'' if term == '1' else ' ' + term}" for term, c in terms.items())


def _quality(fitted: Record) -> str:
    """Every figure of how well the surface fits, in one sentence."""
    figures = [f"{words} {shown(fitted[key], 5)}" for key, words in STATISTICS if fitted.get(key) is not None]
    residual: Record = next((row for row in fitted.get("anova") or [] if row.get("source") == "residual"), {})
    if residual.get("ms") is not None:
        freedom = counted(residual["df"], "degree") + " of freedom"
        figures.append(f"residual standard deviation {shown(float(residual['ms']) ** 0.5, 5)} on {freedom}")
    return ", ".join(figures)


def _runs(name: str, runs: Sequence[Record]) -> Table:
    """Residual of each run, and its leverage on the surface."""
    rows = [(shown(run.get("run")), *(shown(run.get(key), 5) for key in RUN_COLUMNS)) for run in runs]
    header = ("run", *RUN_COLUMNS)
    return Table(f"Runs and residuals of {label(name)}", header, rows, folded=True, detail=Detail.ALL)


def fit_record(surfaces: Sequence[Surface]) -> dict[str, Any]:
    """JSON of ``doe fit``."""
    return {"responses": {surface.name: surface.as_dict() | {"sentences": describe(surface)} for surface in surfaces}}


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


def diagnostic_plots(name: str, runs: Sequence[Record]) -> list[Still]:
    """Four pictures; a picture whose numbers are undefined is left out."""
    pictures = [
        _plotted(_predicted_on_observed, f"Predicted on observed {label(name)}", name, runs, "observed", "predicted"),
        _plotted(_residuals, f"Studentized residuals of {label(name)} on predicted values", name, runs, "predicted", "studentized"),
        _normal_plot(name, runs),
        _plotted(_influence, f"Cook's distance of {label(name)} on leverage", name, runs, "leverage", "cook"),
    ]  # fmt: skip
    return [still for still in pictures if still]


def _plotted(draw: Draw, words: str, name: str, runs: Sequence[Record], across: str, up: str) -> Still | None:
    defined = [run for run in runs if run.get(across) is not None and run.get(up) is not None]
    points = [(float(run[across]), float(run[up])) for run in defined]
    titles = [f"run {run.get('run')}: {shown(x)}, {shown(y)}" for run, (x, y) in zip(defined, points, strict=True)]
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


def _normal_plot(name: str, runs: Sequence[Record]) -> Still | None:
    defined = sorted((float(run["studentized"]), run.get("run")) for run in runs if run.get("studentized") is not None)
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
