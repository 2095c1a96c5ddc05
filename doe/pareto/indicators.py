"""Normalised costs and the hypervolume of a front.

Normalised costs are 0 at the ideal point and 1 at the nadir point. The hypervolume is that of normalised costs up
to `REFERENCE` in each of them.
"""

import numpy as np

from doe.arrays import Array

REFERENCE = 1.1  # reference point of the hypervolume: the nadir and a tenth of each range beyond it


def normalised(values: Array, ideal: Array, nadir: Array) -> Array:
    """Costs (..., q) on the scale from ideal 0 to nadir 1; a cost without range stays at 0."""
    span = nadir - ideal
    return (values - ideal) / np.where(span > 0, span, 1.0)


def hypervolume(values: Array, ideal: Array, nadir: Array) -> float:
    """Volume that ``values`` (n, m) dominate, in objectives normalised to ``ideal`` 0 and ``nadir`` 1.

    The reference point is `REFERENCE` in each objective, so the largest volume possible is REFERENCE^m.
    Fronts compare only under the same ``ideal`` and ``nadir``.
    """
    from pymoo.indicators.hv import HV

    inside = normalised(values, ideal, nadir)
    inside = inside[(inside < REFERENCE).all(axis=1)]
    return float(HV(ref_point=np.full(values.shape[1], REFERENCE))(inside)) if len(inside) else 0.0
