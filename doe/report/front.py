"""The Pareto front as JSON and on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rbdyn.terminal import print_table

if TYPE_CHECKING:
    from doe.pareto import ParetoFront
    from doe.response_surface import Surface
    from doe.study_file import Study


def front_record(study: Study, surfaces: list[Surface], front: ParetoFront) -> dict[str, Any]:
    """JSON of ``doe front``: factor and response values in their own units and senses."""

    def named(point: np.ndarray, values: np.ndarray) -> dict[str, dict[str, float]]:
        return {
            "factors": dict(zip(study.factors, point.tolist(), strict=True)),
            "responses": dict(zip(study.responses, (values * study.signs).tolist(), strict=True)),
        }

    baseline = front.baseline_values
    assert baseline is not None
    return {
        "front": [named(point, values) for point, values in zip(front.points, front.values, strict=True)],
        "hypervolume": front.hypervolume,
        "ideal": dict(zip(study.responses, (front.ideal * study.signs).tolist(), strict=True)),
        "nadir": dict(zip(study.responses, (front.nadir * study.signs).tolist(), strict=True)),
        "knee": named(front.points[front.knee], front.values[front.knee]),
        "pick": {**named(front.points[front.pick], front.values[front.pick]), "reason": front.pick_reason},
        "baseline": named(study.baseline, baseline),
        "generations": front.generations,
        "seed": front.seed,
    }


def print_front(record: dict[str, Any], verbose: bool = False) -> None:
    """Baseline, knee and pick of a front; verbosely, every point of it."""
    names = [*record["baseline"]["factors"], *record["baseline"]["responses"]]
    points = {name: record[name] for name in ("baseline", "knee", "pick")}
    if verbose:
        points |= {str(number): point for number, point in enumerate(record["front"], 1)}
    rows = [
        (name, *(f"{x:.5g}" for kind in ("factors", "responses") for x in point[kind].values()))
        for name, point in points.items()
    ]
    print_table(f"Pareto front on the surfaces, {len(record['front'])} points", ("", *names), rows)
    print(f"pick: {record['pick']['reason']}; hypervolume {record['hypervolume']:.4f} of 1.331")
