"""The state vector: one table of its components, from which layout, names, tolerances and the Jacobian's pattern follow.

Each coordinate of the rollers is contiguous, roller after roller. Cage and inner ring follow, then what a scene adds.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Component(NamedTuple):
    """A coordinate or a speed: body, name, unit, and the name of the speed at which it changes, if the state has that.

    Body and unit together choose the scale of its error.
    """

    body: str
    name: str
    unit: str
    speed: str = ""

    @property
    def pushed(self) -> bool:
        """Whether forces change it, those of the rollers among them."""
        return self.unit.endswith("/s")


def _body(body: str, *rows: tuple[str, ...]) -> tuple[Component, ...]:
    return tuple(Component(body, *row) for row in rows)


PLACE, VELOCITY = (("x", "m", "vx"), ("y", "m", "vy")), (("vx", "m/s"), ("vy", "m/s"))
# Each component of a roller occurs Z times, for one roller after the other.
ROLLER = _body("roller", *PLACE, *VELOCITY, ("spin", "rad/s"))
CAGE = _body("cage", *PLACE, ("angle", "rad", "speed"), *VELOCITY, ("speed", "rad/s"))
BODIES = (*CAGE, *_body("inner ring", *PLACE, *VELOCITY))
# Of an outer ring on a support; of a scene that depends on time or on a ring's angle.
SUPPORT = _body("outer ring", *PLACE, *VELOCITY)
CLOCK = _body("clock", ("time", "s"), ("inner ring angle", "rad"), ("outer ring angle", "rad"))
# Of every roller with tangential elasticity: first all at the outer, then all at the inner race.
CONTACTS = _body("contact", ("outer traction coefficient", "1"), ("inner traction coefficient", "1"))
ROLLER_STATES = len(ROLLER)
# Places within BODIES, SUPPORT and CLOCK.
CAGE_X, CAGE_Y, CAGE_ANGLE, CAGE_VX, CAGE_VY, CAGE_SPEED, RING_X, RING_Y, RING_VX, RING_VY = range(len(BODIES))
SUPPORT_X, SUPPORT_Y, SUPPORT_VX, SUPPORT_VY = range(len(SUPPORT))
TIME, INNER_ANGLE, OUTER_ANGLE = range(len(CLOCK))
# Places of the largest loads in their vector. On a pocket wall: contact and film together, and contact alone.
POCKET_LOAD, OUTER_LOAD, INNER_LOAD, LAND_LOAD, POCKET_CONTACT_LOAD, LOADS = range(6)
# Rows of impacts under way, by roller: speed of the first approach [m/s], 0 without contact, and largest load since then [N].
# Then entries into the load zone: state, samples since the last one, slip [m/s] and energy [J] of one that has not ended.
APPROACH, PEAK, ENTRY_OUTSIDE, ENTRY_SAMPLES, ENTRY_SLIP, ENTRY_ENERGY, FOLLOWED = range(7)
# Sums over the impacts of a pocket: number, squared speeds [m2/s2], peaks to the power of the exponent, and the exponent.
NUMBER, SQUARES, PEAK_POWERS, EXPONENTS, IMPACT_SUMS = range(5)
# Sums of samples of the races and of entries: power density [W/m2] and flash temperature [K] of each race, slip [m/s] and energy [J]
# of entries. Each has number, total, and a histogram of steps of a sixteenth of a decade from the lowest value on.
INNER_DENSITIES, OUTER_DENSITIES, INNER_FLASHES, OUTER_FLASHES, ENTRY_SLIPS, ENTRY_ENERGIES, SAMPLED = range(7)
SAMPLES_NUMBER, SAMPLES_TOTAL = range(2)
SAMPLE_LOWEST, SAMPLE_STEPS, SAMPLE_BINS = 1e-9, 16, 16 * 22


class Layout(NamedTuple):
    """Where the parts that a scene adds begin; None where it adds none."""

    rollers: int
    size: int
    support: int | None
    clock: int | None
    coefficients: int | None

    @property
    def first_body(self) -> int:
        """Where the bodies begin, behind the rollers."""
        return ROLLER_STATES * self.rollers

    @property
    def bodies(self) -> tuple[Component, ...]:
        """Components behind those of the rollers."""
        supported, clocked = self.support is not None, self.clock is not None
        contacts = [part for part in CONTACTS for _ in range(self.rollers) if self.coefficients is not None]
        return (*BODIES, *(SUPPORT if supported else ()), *(CLOCK if clocked else ()), *contacts)

    @property
    def components(self) -> tuple[Component, ...]:
        """The component that each number of the state is."""
        return (*(part for part in ROLLER for _ in range(self.rollers)), *self.bodies)

    def values(self, value: Callable[[Component], float]) -> NDArray[np.float64]:
        """``value`` of every component, in the order of the state."""
        return np.array([value(part) for part in self.components])


def layout(rollers: int, supported: bool, clocked: bool, elastic: bool = False) -> Layout:
    """Layout for a number of rollers, with an outer ring on a support, a clock, tangential elasticity or not."""
    size = ROLLER_STATES * rollers + len(BODIES)
    support = size if supported else None
    size += len(SUPPORT) * supported
    clock = size if clocked else None
    size += len(CLOCK) * clocked
    coefficients = size if elastic else None
    return Layout(rollers, size + len(CONTACTS) * rollers * elastic, support, clock, coefficients)


def name(index: int, layout: Layout) -> str:
    """Name of a state component: 'roller 3 spin', 'cage vx'. Rollers count from 1."""
    part = layout.components[index]
    if part in (*ROLLER, *CONTACTS):
        index -= 0 if part in ROLLER else layout.coefficients or 0
        return f"roller {index % layout.rollers + 1} {part.name}"
    return part.name if part in CLOCK else f"{part.body} {part.name}"
