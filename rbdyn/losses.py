"""Losses of a bearing, each once: the power of a simulation that it is of, the nodes that it heats, and the film that it depends on.

Two surfaces that slide on each other share the heat by beta = e1 sqrt(u1)/(e1 sqrt(u1) + e2 sqrt(u2)) with the effusivity
e = sqrt(k rho c) and the speed u at which each passes the contact (Blok, from memory). Those of races that roll, and of a
land whose contact whirls, are taken as equal. The oil of a film takes the share ``film`` of its heat along. Walls of equal area
share the rest, and the shares of race damping are assumptions. A damper of a support has an oil of its own and heats no node.
"""

from collections.abc import Callable
from typing import Literal, NamedTuple

# The oil in the cavity, both rings, and the rollers with their cage; "guide" is the node of what guides the cage.
Node = Literal["oil", "outer", "inner", "rollers"]
Heat = tuple[tuple[Node, float], ...]


class Partition(NamedTuple):
    """Shares of the heat: of a ``ring`` in that of sliding on rollers, of the ``land`` on the cage, of the oil in a ``film``.

    ``guide``: node of the guiding ring, or of the rollers that guide the cage.
    """

    ring: float
    land: float
    film: float
    guide: Node

    def sliding(self, race: Node) -> Heat:
        """Heat of a race and the rollers that slide on it."""
        return (race, self.ring), ("rollers", 1.0 - self.ring)

    def lubricated(self, wall: Node) -> Heat:
        """Heat of a film between a wall and rollers or cage."""
        share = 0.5 * (1.0 - self.film)
        return ("oil", self.film), (wall, share), ("rollers", share)

    @property
    def landing(self) -> Heat:
        """Heat of the land and the cage that touches it."""
        return (self.guide, self.land), ("rollers", 1.0 - self.land)


class Loss(NamedTuple):
    """A loss: its name, and the shares of the nodes in its heat.

    ``power``: the power of a simulation that it is part of, its own name unless stated; none of an estimate. ``exponent``: of the
    viscosity, with which a search for temperatures begins. ``film``: surface of its film besides the rollers.
    """

    name: str
    heats: Callable[[Partition], Heat]
    power: str | None = ""
    exponent: float = 0.0
    film: Node | Literal["guide"] | None = None


LOSSES = (
    Loss("outer_race_traction", lambda shares: shares.sliding("outer")),
    Loss("inner_race_traction", lambda shares: shares.sliding("inner")),
    Loss("outer_rolling_resistance", lambda shares: shares.lubricated("outer"), "rolling_resistance", 0.7, "outer"),
    Loss("inner_rolling_resistance", lambda shares: shares.lubricated("inner"), "rolling_resistance", 0.7, "inner"),
    Loss("race_damping", lambda shares: (("outer", 0.25), ("inner", 0.25), ("rollers", 0.5))),
    Loss("pocket_friction", lambda shares: (("rollers", 1.0),)),
    Loss("pocket_damping", lambda shares: (("rollers", 1.0),)),
    Loss("pocket_film", lambda shares: (("oil", shares.film), ("rollers", 1.0 - shares.film)), "", 0.5, "rollers"),
    Loss("land_film", lambda shares: shares.lubricated(shares.guide), "", 1.0, "guide"),
    Loss("land_friction", lambda shares: shares.landing),
    Loss("land_damping", lambda shares: shares.landing),
    Loss("roller_drag", lambda shares: (("oil", 1.0),)),
    Loss("support_damping", lambda shares: ()),
    Loss("spin_windage", lambda shares: (("oil", 1.0),), None),
)
# Powers lost of a simulation; its rolling resistance is that of both races.
POWER_TERMS = tuple(dict.fromkeys(loss.power or loss.name for loss in LOSSES if loss.power is not None))
# Their places in the power vector of a simulation. The input by the shafts and by loads without a potential follow, then the
# inner race's part of the rolling resistance. At last come what damage sums: the force of all pockets [N], and the squeeze power of
# their films. A force is no power: balances of power and energy leave it out.
(
    OUTER_TRACTION, INNER_TRACTION, ROLLING, RACE_DAMPING, POCKET_FRICTION, POCKET_DAMPING, POCKET_FILM,
    LAND_FILM, LAND_FRICTION, LAND_DAMPING, DRAG, SUPPORT_DAMPING, SHAFT, LOAD, INNER_ROLLING, POCKET_FORCE, POCKET_SQUEEZE, POWERS,
) = range(len(POWER_TERMS) + 6)  # fmt: skip
