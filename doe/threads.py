"""Linear algebra on one thread: its last bits depend on the number of threads, and the matrices here are too small to gain."""

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
R = TypeVar("R")


@functools.cache
def _controller() -> ThreadpoolController:
    # numpy and scipy have a library each, and only a loaded one can be limited.
    import scipy.linalg  # noqa: F401

    return ThreadpoolController()


def one_thread(function: Callable[P, R]) -> Callable[P, R]:
    """The same function with linear algebra on one thread; simulations keep their threads."""

    @functools.wraps(function)
    def limited(*arguments: P.args, **named: P.kwargs) -> R:
        with _controller().limit(limits=1, user_api="blas"):
            return function(*arguments, **named)

    return limited
