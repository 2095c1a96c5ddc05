"""What the statistics of a surface say, in sentences."""

from doe.response_surface.anova import find
from doe.response_surface.canonical import describe_canonical
from doe.response_surface.diagnostics import describe_diagnostics, p_text
from doe.response_surface.model_error import describe_known_variance
from doe.response_surface.surface import Surface

ALPHA = 0.05  # p-value up to which something is significant
FAR_APART = 0.2  # difference of adjusted and predicted R2 above which they disagree
DISCERNIBLE = 4.0  # adequate precision above which the surface can steer a search


def describe(surface: Surface) -> list[str]:
    """Say in sentences what is significant at `ALPHA`, whether the surface fits, and what to look at."""
    known, canonical = surface.known_variance, surface.canonical
    sentences = [
        *(_terms(surface), _lack_of_fit(surface), _removed(surface), _blocks(surface)),
        *([] if known is None else describe_known_variance(known, ALPHA)),
        *(_model_error(surface), _summary(surface)),
        *describe_diagnostics(surface.diagnostics, ALPHA),
        _transform(surface),
        "" if canonical is None else describe_canonical(canonical, surface.stationary_point),
        "" if surface.rival is None else surface.rival["sentence"],
    ]
    head = f"{surface.name}: "
    # Some name their response by themselves.
    return [head + sentence.removeprefix(head) for sentence in sentences if sentence]


def _terms(surface: Surface) -> str:
    tested = [row for row in surface.anova if row["source"] in surface.terms]
    known = {row["source"]: row["p"] for row in tested if row["p"] is not None}
    if len(known) < len(tested):
        return "the surface leaves no residual, so its terms cannot be tested."
    strong = sorted((p, source) for source, p in known.items() if p <= ALPHA)
    weak = [source for source, p in known.items() if p > ALPHA]
    listed = ", ".join(f"{source} ({p_text(p)})" for p, source in strong)
    head = f"significant at {ALPHA:g}: {listed}" if strong else f"no term is significant at {ALPHA:g}"
    return head + (f"; not significant: {', '.join(weak)}." if weak else ".")


def _lack_of_fit(surface: Surface) -> str:
    p = surface.lack_of_fit["p"]
    if p is not None and p <= ALPHA:
        why = f"lack of fit is significant ({p_text(p)})"
        what = f"{why}: the surface misses more than the scatter of replicates explains"
        mend = "enlarge the model, transform the response or narrow the region, and confirm predictions by runs"
        return f"{what}; {mend}."
    if p is not None:
        what = "what the surface misses is within the scatter of replicates"
        return f"lack of fit is not significant ({p_text(p)}): {what}."
    if surface.pure_error["df"] == 0:
        return "lack of fit cannot be tested, for no run is replicated; add centre replicates."
    if surface.lack_of_fit["df"] == 0:
        return "lack of fit cannot be tested, for the model has as many terms as distinct points."
    return "lack of fit cannot be tested, for the replicates agree exactly."


def _model_error(surface: Surface) -> str:
    if (error := surface.model_error) is None:
        return ""
    size = f"a standard deviation of {error.variance**0.5:.3g} told by {error.source} ({error.dof} degrees of freedom)"
    return f"the 95 % intervals of its mean join the error of the coefficients with what the model misses, {size}."


def _removed(surface: Surface) -> str:
    if not surface.elimination:
        return ""
    listed = ", ".join(f"{each['term']} ({p_text(each['p'])})" for each in surface.elimination)
    return f"removed in this order: {listed}; the p values of what is left are too small, for the same runs chose the terms."


def _blocks(surface: Surface) -> str:
    if not surface.blocks or (p := find(surface.anova, "block")["p"]) is None:
        return ""
    verdict = "differ" if p <= ALPHA else "do not differ significantly"
    return f"the blocks {verdict} ({p_text(p)}); predictions are for the mean over all runs."


def _summary(surface: Surface) -> str:
    adjusted, predicted = surface.adjusted_r2, surface.predicted_r2
    if adjusted is None or predicted is None:
        return "predicted R2 cannot be computed, for a run is met exactly by its own coefficient."
    figures = f"adjusted R2 {adjusted:.3f} and predicted R2 {predicted:.3f}"
    precision = surface.adequate_precision
    tail = ""
    if precision is not None and precision < DISCERNIBLE:
        tail = f" Adequate precision {precision:.3g} is below {DISCERNIBLE:g}: the scatter hides the surface."
    if adjusted - predicted > FAR_APART:
        worse = f"differ by more than {FAR_APART:g}: the surface foretells new runs worse than it fits its own"
        return f"{figures} {worse}; look for influential runs or drop terms.{tail}"
    return f"{figures} agree.{tail}"


def _transform(surface: Surface) -> str:
    if surface.transform is not None:
        scale = "the analysis is on that scale, predictions are medians in the unit of the response"
        return f"fitted as Box-Cox transform with exponent {surface.transform:.3g}; {scale}."
    return "" if surface.box_cox is None else str(surface.box_cox["sentence"])
