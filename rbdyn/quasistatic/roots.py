"""Other equilibria of the same bearing under the same load: a raceway control other than outer may have several."""

from collections.abc import Sequence

import numpy as np

from rbdyn.arrays import Array
from rbdyn.quasistatic.row.control import Control, FixedShare, FrictionShare
from rbdyn.quasistatic.row.equilibrium import Solution, solve
from rbdyn.quasistatic.row.row import Row

# Shares of the inner race and of the speeds whose equilibria are the starts of the search.
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
SPEEDS = (0.7, 1.4)
# Contact angles that differ by less belong to one equilibrium [rad].
SAME = 1e-4


def other_roots(row: Row, control: Control, load: Array, given: Array, known: Solution) -> tuple[Solution, ...]:
    """Equilibria besides ``known``, found from those of other raceway controls and of slower and faster rings.

    A search, not a proof: an empty answer says that none of these starts leads elsewhere. None under one common cage speed,
    where the equilibrium is unique.
    """
    if not isinstance(control, FixedShare | FrictionShare):
        return ()
    roots = [known]
    for start in _starts(row, control, load, given):
        root = solve(row, control, load, given, start)
        if root.found and all(_differ(root, other) for other in roots):
            roots.append(root)
    return tuple(roots[1:])


def _starts(row: Row, control: FixedShare | FrictionShare, load: Array, given: Array) -> Sequence[Solution]:
    usual = control.spinning
    neighbours: list[Control] = [FixedShare(share, usual) for share in SHARES]
    turning = [usual._replace(inner_speed=k * usual.inner_speed, outer_speed=k * usual.outer_speed) for k in SPEEDS]
    # The sign of the moment that many texts have leads to the other side.
    turning.append(usual._replace(turning=-usual.turning))
    neighbours += [control._replace(spinning=each) for each in turning]
    return [start for start in (solve(row, each, load, given) for each in neighbours) if start.found]


def _differ(one: Solution, other: Solution) -> bool:
    touching = (one.inner_load > 0.0) & (other.inner_load > 0.0)
    apart = np.abs(one.inner_angle - other.inner_angle)[touching]
    return bool(np.any((one.inner_load > 0.0) != (other.inner_load > 0.0)) or np.any(apart > SAME))
