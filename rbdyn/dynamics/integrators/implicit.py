"""From a scene to what the linearly implicit method works on."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import VECTOR
from rbdyn.dynamics.forces.equations import LOADS, POWERS, RollerBearing
from rbdyn.dynamics.forces.race_lanes import scratch
from rbdyn.dynamics.forces.races import EqualRollers, UnequalRollers
from rbdyn.dynamics.forces.state import PARTS
from rbdyn.dynamics.integrators.rosenbrock import STAGES, Differences, OneRoller, Rodas, arrow_matrix
from rbdyn.dynamics.parameters.state import absolute_tolerance, layout_of
from rbdyn.scene import Scene


def rodas(scene: Scene, bearing: RollerBearing) -> Rodas:
    """The method with work space for a scene."""
    layout = layout_of(scene)
    n = layout.size
    return Rodas(
        np.zeros((STAGES, n)),
        np.zeros((STAGES, POWERS)),
        np.zeros((2, n)),
        differences(scene, bearing),
        arrow_matrix(layout),
    )


def differences(scene: Scene, bearing: RollerBearing) -> Differences:
    """Storage for the Jacobian of a scene."""
    layout = layout_of(scene)
    gradients = np.zeros((POWERS, layout.size))
    return Differences(arrow_matrix(layout), gradients, increments(scene, bearing), one_roller(bearing, layout.size))


def increments(scene: Scene, bearing: RollerBearing) -> NDArray[np.float64]:
    """Increment of each state component: the geometric mean of its round-off and of the scale on which laws change,
    so that round-off and truncation of a difference quotient are alike.
    """
    layout, length = layout_of(scene), 0.5 * scene.bearing.pitch_diameter
    turning = max(abs(speed) for speed in scene.operation.speeds)
    sizes = {"m": length, "rad": 1.0, "m/s": length * turning, "rad/s": turning, "s": scene.turn_s}
    spin = max(abs(scene.geometry.motion.roller_spin), turning)
    size = layout.each(lambda part: spin if (part.body, part.unit) == ("roller", "rad/s") else sizes[part.unit])
    scale = np.minimum(absolute_tolerance(scene, bearing, 1.0, "rosenbrock"), size)
    return np.sqrt(np.finfo(float).eps * size * scale)


def one_roller(bearing: RollerBearing, size: int) -> OneRoller:
    """The same bearing, of the same types of laws, with room for one roller."""
    moved = PARTS * (bearing.rollers - 1)
    single = bearing._replace(
        rollers=1,
        sizes=_room_for_one(bearing.sizes),
        pocket_cos=np.ones(1),
        pocket_sin=np.zeros(1),
        drive=_moved(bearing.drive, moved),
        outer_ring=_moved(bearing.outer_ring, moved),
    )
    rows = size - moved
    return OneRoller(
        single, np.zeros(rows), np.zeros((2, rows)), np.zeros((2, POWERS)), np.zeros((2, LOADS)), scratch(1)
    )


def _room_for_one(sizes: EqualRollers | UnequalRollers) -> EqualRollers | UnequalRollers:
    return sizes if isinstance(sizes, EqualRollers) else UnequalRollers(np.zeros(VECTOR))


def _moved(part: Any, by: int) -> Any:
    """A part whose coordinates stand further forward by ``by``, where it has any."""
    return part._replace(start=part.start - by) if hasattr(part, "start") else part
