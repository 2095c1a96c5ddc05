"""Pictures of the residuals of a fit, and of how well a design predicts."""

from collections.abc import Callable, Sequence
from statistics import NormalDist

from doe.report.sections.plot import Plot, Point, span
from doe.report.sections.record import Record
from rbdyn.base.words import label, shown

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
