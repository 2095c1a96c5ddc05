"""Types of arrays by their elements, and linear algebra on one thread.

More threads do not gain: its last bits would depend on their number, and the matrices here are small.
"""

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Whole = NDArray[np.int64]
Mask = NDArray[np.bool_]
Rows = NDArray[np.intp]


P = ParamSpec("P")
R = TypeVar("R")


@functools.cache
def _controller() -> "ThreadpoolController":
    # numpy and scipy have a library each, and only a loaded one can be limited.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def one_thread(function: Callable[P, R]) -> Callable[P, R]:
    """The same function with linear algebra on one thread; simulations keep their threads."""

    @functools.wraps(function)
    def limited(*arguments: P.args, **named: P.kwargs) -> R:
        with _controller().limit(limits=1, user_api="blas"):
            return function(*arguments, **named)

    return limited
