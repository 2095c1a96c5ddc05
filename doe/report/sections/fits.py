"""Sections on fits: surfaces, their statistics and their plots."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from statistics import NormalDist
from string import ascii_uppercase
from typing import Any

from doe.report.sections.plot import Plot, Point, span
from doe.report.sections.record import Record, factors, fits, part, record_table
from doe.report.words import probability
from rbdyn.base.blocks import Block, Bullets, Detail, Figures, Heading, Paragraph, Section, Table, Widget
from rbdyn.base.words import counted, label, quantity, shown, with_error

# Studentized residuals beyond these are looked at; Cook's distances beyond 1 move the fit.
SUSPECT, INFLUENTIAL = 3.0, 1.0


def diagnostic_plots(name: str, runs: Sequence[Record]) -> list[str]:
    """Four pictures as SVG; a picture whose numbers are undefined is left out."""
    drawn = [_plotted(_predicted, name, runs, "observed", "predicted")]
    drawn += [_plotted(_residuals, name, runs, "predicted", "studentized"), _normal(name, runs)]
    drawn.append(_plotted(_influence, name, runs, "leverage", "cook"))
    return [svg for svg in drawn if svg]


def _plotted(plot: Callable[..., str], name: str, runs: Sequence[Record], across: str, up: str) -> str:
    kept = [run for run in runs if run.get(across) is not None and run.get(up) is not None]
    points = [(float(run[across]), float(run[up])) for run in kept]
    titles = [f"run {run.get('run')}: {shown(p[0])}, {shown(p[1])}" for run, p in zip(kept, points, strict=True)]
    return plot(name, points, titles) if points else ""


def _predicted(name: str, points: list[Point], titles: list[str]) -> str:
    both = span([x for point in points for x in point])
    plot = Plot(both, both, (f"observed {label(name)}", "predicted"))
    plot.line([(both[0], both[0]), (both[1], both[1])], "guide")
    plot.dots(points, "front", radius=3.4, titles=titles)
    return plot.svg(f"Predicted on observed {label(name)}, {len(points)} runs")


def _residuals(name: str, points: list[Point], titles: list[str]) -> str:
    reach = max(SUSPECT * 1.1, *(abs(y) * 1.06 for _, y in points))
    plot = Plot(span(x for x, _ in points), (-reach, reach), (f"predicted {label(name)}", "studentized residual"))
    for level in (-SUSPECT, 0.0, SUSPECT):
        plot.line([(plot.x[0], level), (plot.x[1], level)], "guide")
    plot.dots(points, "front", radius=3.4, titles=titles)
    return plot.svg(f"Studentized residuals of {label(name)} on predicted values, {len(points)} runs")


def _normal(name: str, runs: Sequence[Record]) -> str:
    kept = sorted((float(run["studentized"]), run.get("run")) for run in runs if run.get("studentized") is not None)
    if len(kept) < 3:
        return ""
    # Blom's plotting positions.
    scores = [NormalDist().inv_cdf((rank + 0.625) / (len(kept) + 0.25)) for rank in range(len(kept))]
    points = [(value, score) for (value, _), score in zip(kept, scores, strict=True)]
    plot = Plot(span(x for x, _ in points), span(scores), ("studentized residual", "normal score"))
    low, high = max(plot.x[0], plot.y[0]), min(plot.x[1], plot.y[1])
    plot.line([(low, low), (high, high)], "guide")
    plot.dots(points, "front", radius=3.4, titles=[f"run {run}: {shown(value)}" for value, run in kept])
    return plot.svg(f"Normal plot of the residuals of {label(name)}, {len(points)} runs")


def _influence(name: str, points: list[Point], titles: list[str]) -> str:
    top = max(INFLUENTIAL * 1.05, *(1.08 * y for _, y in points))
    plot = Plot((0.0, 1.05), (0.0, top), ("leverage", "Cook's distance"))
    plot.line([(0.0, INFLUENTIAL), (1.05, INFLUENTIAL)], "guide")
    plot.dots(points, "front", radius=3.4, titles=titles)
    return plot.svg(f"Cook's distance of {label(name)} on leverage, {len(points)} runs")


def evaluation_plots(evaluation: Record) -> list[str]:
    """Variance dispersion graph and fraction of design space, as far as they are there."""
    drawn = []
    if shells := evaluation.get("by_radius"):
        curves = {key: [(float(each["radius"]), float(each[key])) for each in shells] for key in ("min", "mean", "max")}
        top = span([0.0, *(y for curve in curves.values() for _, y in curve)])
        plot = Plot(span(x for x, _ in curves["mean"]), (0.0, top[1]), ("coded radius", "scaled prediction variance"))
        for key, curve in curves.items():
            plot.line(curve, "front" if key == "mean" else "guide")
        drawn.append(plot.svg("Scaled prediction variance by radius: least, mean, largest"))
    if shares := evaluation.get("fraction_of_design_space"):
        points = [(float(each["percent"]), float(each["variance"])) for each in shares]
        top = span([0.0, *(y for _, y in points)])
        plot = Plot((0.0, 100.0), (0.0, top[1]), ("share of the region [%]", "scaled prediction variance"))
        plot.line(points, "front")
        drawn.append(plot.svg("Scaled prediction variance that a share of the region stays below"))
    return drawn


STATISTICS = (
    ("r2", "R²"), ("adjusted_r2", "adjusted R²"), ("predicted_r2", "predicted R²"), ("press", "PRESS"),
    ("cv_percent", "CV [%]"), ("adequate_precision", "adequate precision"),
)  # fmt: skip


STARS = ((0.001, "***"), (0.01, "**"), (0.05, "*"))
LEGEND = "*** p <= 0.001, ** p <= 0.01, * p <= 0.05; sums of squares of terms are partial (type III)"
RUN_COLUMNS = ("observed", "predicted", "residual", "standardized", "studentized", "leverage", "cook")
# Parts of a fit that are shown as they are.
FURTHER = ("box_cox", "blocks", "canonical", "known_variance", "rival")


def surfaces(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """The interactive surfaces, and their coefficients."""
    fitted = fits(summary)
    if not fitted:
        return None
    terms = list(dict.fromkeys(term for each in fitted.values() for term in each["coefficients"]))
    errors = {name: each.get("standard_errors") or {} for name, each in fitted.items()}
    rows = [
        [_term(term, summary), *(_coefficient(each["coefficients"].get(term), errors[name].get(term)) for name, each in fitted.items())]
        for term in terms
    ]  # fmt: skip
    note = "± are standard errors." if any(errors.values()) else ""
    header = ["term", *(f"{label(name)}, {each.get('model', '')}" for name, each in fitted.items())]
    blocks: list[Block] = [Widget("surface")] if part(summary, "asked", "factors") else []
    blocks += [Table("Coefficients in coded units", header, rows, note), _stationary(summary, fitted)]
    return Section("surfaces", "Response surfaces", blocks)


def _term(term: str, summary: Record) -> str:
    names = {each.letter: each.words for each in factors(summary)}
    return f"{term}, {names[term]}" if term in names else term.replace("^2", "²")


def _coefficient(value: float | None, error: float | None) -> str:
    return "–" if value is None else with_error(value, error)


def _stationary(summary: Record, fitted: Record) -> Table:
    given = factors(summary)
    rows = []
    for name, each in fitted.items():
        actual = part(each, "stationary_point", "actual") or []
        if len(actual) == len(given):
            places = [factor.text(x) for factor, x in zip(given, actual, strict=True)]
            rows.append([label(name), *places, str(part(each, "stationary_point", "nature") or "")])
    header = ["response", *(label(each.name) for each in given), "nature"]
    return Table("Stationary points", header, rows, "A point outside the region is an extrapolation.", text_columns=(len(given) + 1,))  # fmt: skip


def diagnostics(summary: Record, motion: Mapping[str, Any]) -> Section:
    """Analysis of variance, what it says, and pictures of the residuals, a response at a time."""
    fitted = fits(summary)
    rows = [
        [label(name), *(shown(each.get(key)) for key, _ in STATISTICS), probability(part(each, "lack_of_fit", "p"))]
        for name, each in fitted.items()
    ]
    header = ["response", *(words for _, words in STATISTICS), "p of lack of fit"]
    blocks: list[Block] = [Table("Quality of the fits", header, rows)]
    names = [each.name for each in factors(summary)]
    for name, each in fitted.items():
        blocks += fit_blocks(name, each, names)
    return Section("diagnostics", "Diagnostics", blocks)


def fit_blocks(name: str, fitted: Record, names: Sequence[str] = ()) -> list[Block]:
    """One fit: analysis of variance, coefficients, equations, what they say; for who asks for all every run.

    names : the factors behind the letters of the terms.
    """
    # The heading says already of which response they speak.
    said = [sentence.removeprefix(f"{name}: ") for sentence in fitted.get("sentences") or []]
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
        Bullets([text[:1].upper() + text[1:] for text in said]),
        Figures(diagnostic_plots(name, runs) if runs else (), caption),
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
    weights = ", weights 1 / variance of the replicates" if fitted.get("weighting") == "replicates" else ""
    power = "" if fitted.get("transform") is None else f", Box-Cox exponent {fitted['transform']:.3g}"
    model = f"{fitted['model'].replace('_', ' ')} model, coded units{weights}{power}" if fitted.get("model") else ""
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
    power, left = fitted.get("transform"), quantity(name)[0]
    if power is not None:
        left = f"ln {left}" if power == 0 else f"({left}^{power:.3g} - 1)/{power:.3g}"
    sides = ("coefficients", "coded"), ("actual_coefficients", "actual units")
    equations = [f"{left} = {_sum(fitted[key])} ({words})" for key, words in sides if fitted.get(key)]
    letters = zip(ascii_uppercase, names, strict=False)
    return [*equations, ", ".join(f"{letter} = {label(factor)}" for letter, factor in letters)]


def _sum(terms: Record) -> str:
    return " ".join(f"{c:+.5g}{'' if term == '1' else ' ' + term}" for term, c in terms.items())


def _quality(fitted: Record) -> str:
    """Every figure of how well the surface fits, in one sentence."""
    known = [f"{words} {shown(fitted[key], 5)}" for key, words in STATISTICS if fitted.get(key) is not None]
    residual: Record = next((row for row in fitted.get("anova") or [] if row.get("source") == "residual"), {})
    if residual.get("ms") is not None:
        unit = "times the known error " if fitted.get("weighting") == "replicates" else ""
        freedom = counted(residual["df"], "degree") + " of freedom"
        known.append(f"residual standard deviation {shown(float(residual['ms']) ** 0.5, 5)} {unit}on {freedom}")
    return ", ".join(known)


def _runs(name: str, runs: Sequence[Record]) -> Table:
    """What each run deviates by, and how much it steers the surface."""
    rows = [(shown(run.get("run")), *(shown(run.get(key), 5) for key in RUN_COLUMNS)) for run in runs]
    header = ("run", *RUN_COLUMNS)
    return Table(f"Runs and residuals of {label(name)}", header, rows, folded=True, detail=Detail.ALL)
