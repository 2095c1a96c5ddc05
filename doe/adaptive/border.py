"""The border of a region: whether a search is to go beyond it, and what holds the pick in the end."""

from itertools import product
from typing import NamedTuple

import numpy as np

from doe.adaptive.candidates import Region, front_rows
from doe.adaptive.emulators import Emulators
from doe.adaptive.runs import Border, Face
from doe.arrays import Array
from doe.pareto.goals import Rule, pick_all
from doe.pareto.search import dominates

NEAR = 0.05  # of the range of a factor: as near to a face a pick lies at it
AHEAD, BETTER = 0.1, 0.9  # of the range beyond a face; chance there of what no point of the front dominates
GROWTH, MOST_MOVES = 0.5, 3  # of the range a move; moves of a search
DRAWN = 64  # functions


class Place(NamedTuple):
    """Where a search is looked at: what it knows, its region, points (n, k) of it, and how many faces it has moved."""

    emulators: Emulators
    region: Region
    points: Array
    moves: int


def faces(place: Place, border: Border, rule: Rule, random: np.random.Generator) -> list[Face]:
    """The faces that the pick of the front foretold lies at."""
    emulators, region, points, moves = place
    rows, costs = front_rows(emulators, points)
    pick = points[rows[pick_all(costs[rows], emulators.goals, None)[0][rule]]]
    span, draws = region.high - region.low, emulators.draws(DRAWN, random)
    found = []
    for factor, side in product(range(pick.size - len(region.levels)), (-1, 1)):
        face = (region.high if side > 0 else region.low)[factor]
        if abs(pick[factor] - face) > NEAR * span[factor]:
            continue
        beyond = pick.copy()
        beyond[factor] = face + side * AHEAD * span[factor]
        drawn = emulators.goals.costs(draws(np.vstack([beyond, points[rows]])))
        better = 1.0 - float(dominates(drawn[:, 1:], drawn[:, :1]).any(axis=1).mean())
        found.append(
            Face(
                factor,
                side,
                float(face),
                better,
                "moves" if moves == MOST_MOVES else _held(border, region, factor, side),
            )
        )
    return found


def outermost(found: list[Face]) -> Face | None:
    """The face to be moved: of those that nothing holds and that the front goes on beyond, the surest."""
    free = [face for face in found if not face.held and face.better > BETTER]
    return max(free, key=lambda face: face.better, default=None)


def grown(border: Border, region: Region, factor: int, side: int) -> Region:
    """The region with a face moved outward, as far as the border permits."""
    low, high = region.low.copy(), region.high.copy()
    by = GROWTH * (high - low)[factor]
    if side > 0:
        high[factor] = max(min(high[factor] + by, border.high[factor]), high[factor])
    else:
        low[factor] = min(max(low[factor] - by, border.low[factor]), low[factor])
    return region._replace(low=low, high=high)


def _held(border: Border, region: Region, factor: int, side: int) -> str:
    wider = grown(border, region, factor, side)
    if (
        np.ptp([wider.low, wider.high], axis=0)[factor]
        < (1.0 + AHEAD) * np.ptp([region.low, region.high], axis=0)[factor]
    ):
        return "allowed"
    return "" if border.possible(np.array(list(product(*zip(wider.low, wider.high, strict=True))))) else "scene"
