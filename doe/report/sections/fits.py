"""Response surfaces and whether they can be trusted."""

from collections.abc import Mapping
from typing import Any

from doe.report.sections.answer import record_table
from doe.report.sections.blocks import Block, Bullets, Figures, Heading, Section, Table, Widget
from doe.report.sections.plots_of_fits import diagnostic_plots
from doe.report.sections.record import Record, factors, fits, part
from doe.report.words import probability
from rbdyn.records.words import label, shown, with_error

STATISTICS = (
    ("r2", "R²"), ("adjusted_r2", "adjusted R²"), ("predicted_r2", "predicted R²"), ("press", "PRESS"),
    ("cv_percent", "CV [%]"), ("adequate_precision", "adequate precision"),
)  # fmt: skip


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


def diagnostics(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Analysis of variance, what it says, and pictures of the residuals, a response at a time."""
    fitted = fits(summary)
    rows = [
        [label(name), *(shown(each.get(key)) for key, _ in STATISTICS), probability(part(each, "lack_of_fit", "p"))]
        for name, each in fitted.items()
    ]
    header = ["response", *(words for _, words in STATISTICS), "p of lack of fit"]
    blocks: list[Block] = [Table("Quality of the fits", header, rows)]
    for name, each in fitted.items():
        blocks += _one(name, each)
    return Section("diagnostics", "Diagnostics", blocks)


def _one(name: str, fitted: Record) -> list[Block]:
    blocks: list[Block] = [Heading(label(name))]
    # The heading says already of which response they speak.
    said = [sentence.removeprefix(f"{name}: ") for sentence in fitted.get("sentences") or []]
    blocks.append(Bullets([text[:1].upper() + text[1:] for text in said]))
    if runs := part(fitted, "diagnostics", "runs"):
        caption = "Predicted on observed, residuals on predicted, normal plot, Cook's distance on leverage."
        blocks.append(Figures(diagnostic_plots(name, runs), caption))
    rows = [
        (row["source"].replace("_", " "), shown(row.get("ss"), 5), shown(row.get("df")), shown(row.get("ms"), 5),
         shown(row.get("f")), probability(row.get("p")))
        for row in fitted.get("anova") or []
        if "source" in row
    ]  # fmt: skip
    header = ("source", "sum of squares", "df", "mean square", "F", "p")
    blocks.append(Table(f"Analysis of variance of {label(name)}", header, rows))
    rest = {
        key: {name: value for name, value in fitted[key].items() if name != "sentence"}
        for key in FURTHER
        if isinstance(fitted.get(key), Mapping)
    }
    blocks.append(record_table(f"Further figures of {label(name)}", rest, folded=True))
    return blocks
