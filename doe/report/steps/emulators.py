"""The emulators of a search as plain numbers: all that another program needs to evaluate them."""

from typing import Any

from doe.adaptive.emulators import LEAST_DEVIATION
from doe.emulator.likelihood import JITTER
from doe.study.adaptive import Adaptive, levels_at
from doe.study.goals import region_of
from doe.study_file import Study


def emulators_record(study: Study, adaptive: Adaptive) -> dict[str, Any]:
    """Mean and standard deviation of every response without its scatter, anywhere.

    The coordinates of a point are x = (factor - ``centre``) / ``half_range``, and of each of the ``categories`` 1 for the level
    that it has and 0 for each other one; ``pick``: that of the pick. Factors in the places that ``inactive`` lists by level are
    at 0 there. A response that has ``shares`` s of factors knows these by ln(1 + s x)/s. ``points`` (n, k) are the runs'
    factors, ``kinds`` (n, c) the places of their levels. A response is a trend of ``terms`` with ``coefficients``, A the first factor, and a process: the
    covariances of the point with the runs, Matern of smoothness 5/2 with ``lengths`` a coordinate and ``variance``, times
    ``weights`` (n,). The runs' ``values`` (n,) have the variances ``noise`` (n,). The deviation is that of universal kriging
    times ``stretch``, ``least`` at least.
    """
    emulators, numbers = adaptive.found.emulators, len(study.factors)
    runs = emulators.runs.points
    categories = zip(study.file.category, adaptive.study.levels, strict=True)
    responses = {}
    each_one = zip(study.responses, emulators.each, emulators.stretch.tolist(), emulators.shares, strict=True)
    for name, one, stretch, shares in each_one:
        given = one.hyperparameters
        responses[name] = {
            "terms": list(one.terms),
            "coefficients": one.solution.coefficients.tolist(),
            "lengths": given.lengths.tolist(),
            "variance": given.variance,
            "weights": one.solution.weights.tolist(),
            "values": one.values.tolist(),
            "noise": (one.variances + given.nugget + JITTER * given.variance).tolist(),
            "stretch": stretch,
            "shares": list(shares),
            "least": LEAST_DEVIATION * float(abs(one.values).max()),
        }
    return {
        "centre": study.centre.tolist(),
        "half_range": (region_of(study) * study.step).tolist(),
        "categories": [
            {
                "name": each.name,
                "levels": list(each.categories),
                "pick": place,
                "inactive": [[*map(study.factors.index, each.inactive_at(at))] for at in range(len(each.categories))],
            }
            for each, place in categories
        ],
        "points": runs[:, :numbers].tolist(),
        "kinds": [levels_at(study, point) for point in runs],
        "responses": responses,
    }
