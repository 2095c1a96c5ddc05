"""Places in the vectors that the equations fill: powers, and the largest loads."""

from rbdyn.losses import POWER_TERMS

# After the powers lost come the input by the shafts and by loads without a potential, and last the inner race's part of the
# rolling resistance.
(
    OUTER_TRACTION, INNER_TRACTION, ROLLING, RACE_DAMPING, POCKET_FRICTION, POCKET_DAMPING, POCKET_FILM,
    LAND_FILM, LAND_FRICTION, LAND_DAMPING, DRAG, SUPPORT_DAMPING, SHAFT, LOAD, INNER_ROLLING, POWERS,
) = range(len(POWER_TERMS) + 4)  # fmt: skip
# On a pocket wall: contact and film together, and contact alone.
POCKET_LOAD, OUTER_LOAD, INNER_LOAD, LAND_LOAD, POCKET_CONTACT_LOAD, LOADS = range(6)
