"""How a response is fitted, in STUDY.toml."""

from __future__ import annotations

from typing import Literal

from rbdyn.faults import Strict


class Fitted(Strict):
    """How a surface is fitted to a response."""

    model: Literal["linear", "quadratic", "reduced"] = "quadratic"
