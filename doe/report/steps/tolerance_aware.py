"""The tolerance-aware front beside the plain one, as JSON and on the terminal."""

from typing import Any

import numpy as np

from doe.pareto.tolerance_aware import ToleranceAware
from doe.response_surface import Surface
from doe.study.predicted import predicted_gains
from doe.study_file import Study
from rbdyn.cli.terminal import print_table


def tolerance_aware_record(study: Study, surfaces: list[Surface], found: ToleranceAware) -> dict[str, Any]:
    """JSON of a tolerance-aware front. ``robust``: what manufacture leaves of a response (of its distance from the
    target, where it has one).
    """
    wanted = [response for response in study.file.response if response.goal != "none"]
    named = [response.name for response in wanted]
    sign = np.array([-1.0 if response.goal == "max" else 1.0 for response in wanted])

    def robust(costs: np.ndarray) -> dict[str, float]:
        return dict(zip(named, (sign * costs).tolist(), strict=True))

    points = study.actual(found.points)
    front = [
        {
            "factors": study.by_factor(point),
            "responses": dict(zip(study.responses, values.tolist(), strict=True)),
            "robust": robust(costs),
        }
        for point, values, costs in zip(points, found.values, found.costs, strict=True)
    ]
    gains = predicted_gains(study, surfaces, points[found.pick])
    return {
        "kind": found.box.kind,
        "quantile": found.box.quantile if found.box.kind == "quantile" else None,
        "distribution": found.box.distribution,
        "half_widths": study.by_factor(found.box.half * study.step),
        "front": front,
        "hypervolume": found.hypervolume,
        "pick": {**front[found.pick], "reason": found.pick_reason},
        "picks": {rule: front[row] for rule, row in found.picks.items()},
        "baseline_robust": robust(found.baseline_costs),
        "plain_pick_robust": robust(found.plain_pick_costs),
        "plain_pick_inside": found.plain_inside,
        "nominal_loss_percent": found.nominal_loss_percent,
        "robust_gain_percent": found.robust_gain_percent if np.isfinite(found.robust_gain_percent) else None,
        "pick_gains_percent": {gain.response: gain.percent for gain in gains},
        "survival": {
            "plain_pick": found.plain_survives,
            "pick": found.pick_survives,
            "standard_error": found.survival_error,
        },
    }


def print_tolerance_aware(record: dict[str, Any]) -> None:
    """What the tolerances cost, and whether the picks survive them."""
    pick, names = record["pick"], list(record["baseline_robust"])
    widths = ", ".join(f"{name} ± {width:g}" for name, width in record["half_widths"].items())
    kind = "worst case" if record["kind"] == "worst_case" else f"{100 * record['quantile']:g} % of the parts keep"
    rows = [
        ("baseline", *(f"{record['baseline_robust'][name]:.5g}" for name in names)),
        ("plain pick", *(f"{record['plain_pick_robust'][name]:.5g}" for name in names)),
        ("tolerance-aware pick", *(f"{pick['robust'][name]:.5g}" for name in names)),
        ("the same, nominal", *(f"{pick['responses'][name]:.5g}" for name in names)),
    ]
    print_table(f"after manufacture within {widths}: {kind}", ("", *names), rows)
    at = ", ".join(f"{name} = {x:.5g}" for name, x in pick["factors"].items())
    print(f"tolerance-aware pick: {at}; {pick['reason']}")
    print(
        f"the tolerance-aware front has {record['nominal_loss_percent']:.2f} % less hypervolume than the plain one in "
        "nominal values" + _robust_gain(record["robust_gain_percent"])
    )
    survival = record["survival"]
    print(
        f"parts that still dominate the baseline: {100 * survival['plain_pick']:.1f} % at the plain pick, "
        f"{100 * survival['pick']:.1f} % at the tolerance-aware one (± {196 * survival['standard_error']:.2f} %)"
    )
    if not record["plain_pick_inside"]:
        print("the tolerance box of the plain pick reaches out of the region: its figures are extrapolated")


def _robust_gain(percent: float | None) -> str:
    return "" if percent is None else f", and {percent:.2f} % more in what manufacture leaves"
