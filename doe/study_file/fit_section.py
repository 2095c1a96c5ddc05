"""How a response is fitted, in STUDY.toml."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from rbdyn.faults import Strict


class Fitted(Strict):
    """How a surface is fitted to a response.

    ``weighting``: "replicates" weighs each run by the inverse of its variance, known from the replicates of
    the simulation. ``transform``: of Box and Cox, the recommended one or with the exponent given.
    """

    model: Literal["linear", "interaction", "quadratic", "reduced"] = "quadratic"
    weighting: Literal["equal", "replicates"] = "equal"
    transform: Literal["none", "box_cox"] | Annotated[float, Field(ge=-5.0, le=5.0)] = "none"
