"""Gauss elimination of a dense system."""

from typing import Any

from rbdyn.compiled.kernel import routine


@routine
def eliminate(matrix: Any, vector: Any, size: int, least: float) -> bool:
    """Solve ``matrix`` x = ``vector`` in place with row pivots; x is left in ``vector``, the matrix is spent.

    Only the first ``size`` rows and columns count. Returns whether every pivot was found: False for a matrix that is not
    finite or has a pivot no larger than ``least``, 0 where only a singular one is to fail.
    """
    for i in range(size):
        pivot = i
        for k in range(i + 1, size):
            if abs(matrix[k, i]) > abs(matrix[pivot, i]):
                pivot = k
        if not least < abs(matrix[pivot, i]) < 1e300:
            return False
        if pivot != i:
            for k in range(i, size):
                matrix[i, k], matrix[pivot, k] = matrix[pivot, k], matrix[i, k]
            vector[i], vector[pivot] = vector[pivot], vector[i]
        one = 1.0 / matrix[i, i]
        for k in range(i + 1, size):
            factor = matrix[k, i] * one
            # Most of a matrix of all balls is zero, and stays so where no ball meets another.
            if factor != 0.0:
                for m in range(i + 1, size):
                    matrix[k, m] -= factor * matrix[i, m]
                vector[k] -= factor * vector[i]
    for i in range(size - 1, -1, -1):
        rest = vector[i]
        for k in range(i + 1, size):
            rest -= matrix[i, k] * vector[k]
        vector[i] = rest / matrix[i, i]
    return True
