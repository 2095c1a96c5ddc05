"""What the statistics of a surface say, in sentences."""

from doe.response_surface.anova import find
from doe.response_surface.canonical import describe_canonical
from doe.response_surface.diagnostics import describe_diagnostics, p_text
from doe.response_surface.known_variance import describe_known_variance
from doe.response_surface.surface import Surface

FAR_APART = 0.2  # difference of adjusted and predicted R2 above which they disagree
DISCERNIBLE = 4.0  # adequate precision above which the surface can steer a search


def describe(surface: Surface, alpha: float = 0.05) -> list[str]:
    """Say in sentences what is significant at ``alpha``, whether the surface fits, and what to look at."""
    name = surface.name
    known = surface.known_variance
    canonical = surface.canonical
    sentences = [
        _terms(surface, alpha),
        _lack_of_fit(surface, alpha),
        _removed(surface),
        _blocks(surface, alpha),
        *([] if known is None else describe_known_variance(name, known, alpha)),
        _model_error(surface),
        _summary(surface),
        *describe_diagnostics(name, surface.diagnostics, alpha),
        _transform(surface),
        "" if canonical is None else describe_canonical(name, canonical, surface.stationary_point),
        "" if surface.rival is None else surface.rival["sentence"],
    ]
    return [sentence for sentence in sentences if sentence]


def _terms(surface: Surface, alpha: float) -> str:
    tested = [row for row in surface.anova if row["source"] in surface.terms]
    known = {row["source"]: row["p"] for row in tested if row["p"] is not None}
    if len(known) < len(tested):
        return f"{surface.name}: the surface leaves no residual, so its terms cannot be tested."
    strong = sorted((p, source) for source, p in known.items() if p <= alpha)
    weak = [source for source, p in known.items() if p > alpha]
    listed = ", ".join(f"{source} ({p_text(p)})" for p, source in strong)
    head = f"significant at {alpha:g}: {listed}" if strong else f"no term is significant at {alpha:g}"
    return f"{surface.name}: {head}" + (f"; not significant: {', '.join(weak)}." if weak else ".")


def _lack_of_fit(surface: Surface, alpha: float) -> str:
    p, name = surface.lack_of_fit["p"], surface.name
    if p is not None and p <= alpha:
        return (
            f"{name}: lack of fit is significant ({p_text(p)}): the surface misses more than the scatter of "
            "replicates explains; enlarge the model, transform the response or narrow the region, and "
            "confirm predictions by runs."
        )
    if p is not None:
        found = f"lack of fit is not significant ({p_text(p)})"
        return f"{name}: {found}: what the surface misses is within the scatter of replicates."
    if surface.pure_error["df"] == 0:
        return f"{name}: lack of fit cannot be tested, for no run is replicated; add centre replicates."
    if surface.lack_of_fit["df"] == 0:
        return f"{name}: lack of fit cannot be tested, for the model has as many terms as distinct points."
    return f"{name}: lack of fit cannot be tested, for the replicates agree exactly."


def _model_error(surface: Surface) -> str:
    error = surface.model_error
    if error is None:
        return ""
    return (
        f"{surface.name}: the 95 % intervals of its mean join the error of the coefficients with what the model misses, a "
        f"standard deviation of {error.variance**0.5:.3g} told by {error.source} ({error.dof} degrees of freedom)."
    )


def _removed(surface: Surface) -> str:
    if not surface.elimination:
        return ""
    listed = ", ".join(f"{each['term']} ({p_text(each['p'])})" for each in surface.elimination)
    return (
        f"{surface.name}: removed in this order: {listed}; the p values of what is left are too small, for the "
        "same runs chose the terms."
    )


def _blocks(surface: Surface, alpha: float) -> str:
    if not surface.blocks:
        return ""
    p = find(surface.anova, "block")["p"]
    if p is None:
        return ""
    verdict = "differ" if p <= alpha else "do not differ significantly"
    return f"{surface.name}: the blocks {verdict} ({p_text(p)}); predictions are for the mean over all runs."


def _summary(surface: Surface) -> str:
    name, adjusted, predicted = surface.name, surface.adjusted_r2, surface.predicted_r2
    if adjusted is None or predicted is None:
        return f"{name}: predicted R2 cannot be computed, for a run is met exactly by its own coefficient."
    figures = f"adjusted R2 {adjusted:.3f} and predicted R2 {predicted:.3f}"
    precision = surface.adequate_precision
    weak = precision is not None and precision < DISCERNIBLE
    tail = (
        f" Adequate precision {precision:.3g} is below {DISCERNIBLE:g}: the scatter hides the surface." if weak else ""
    )
    if adjusted - predicted > FAR_APART:
        return (
            f"{name}: {figures} differ by more than {FAR_APART:g}: the surface foretells new runs worse than it "
            f"fits its own; look for influential runs or drop terms.{tail}"
        )
    return f"{name}: {figures} agree.{tail}"


def _transform(surface: Surface) -> str:
    if surface.transform is not None:
        return (
            f"{surface.name}: fitted as Box-Cox transform with exponent {surface.transform:.3g}; the analysis is on "
            "that scale, predictions are medians in the unit of the response."
        )
    return "" if surface.box_cox is None else str(surface.box_cox["sentence"])
