"""A piece of motion that a method has to integrate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbdyn.dynamics.forces.equations import RollerBearing
from rbdyn.scene import Scene


@dataclass(frozen=True)
class Stretch:
    """From the state ``start`` (n,) over so many shaft turns; ``scale`` (n,): the size of each component's errors."""

    scene: Scene
    bearing: RollerBearing
    start: NDArray[np.float64]
    turns: float
    scale: NDArray[np.float64]

    @property
    def duration(self) -> float:
        """Its length [s]."""
        return self.turns * self.scene.turn_s
