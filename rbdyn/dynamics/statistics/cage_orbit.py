"""How far the cage's centre moves about its mean place, and whether that is a whirl at all.

The whirl deviation ratio is one of speeds and says nothing of how far the cage moves. Rollers and film press most cages to
one place of their land, where the centre trembles. The radius of the orbit is the root mean square distance of the centre
from its mean place in each replicate: a circle about the guide has its own radius, a cage that rests off the middle none.
"""

from rbdyn.dynamics.statistics.metrics import ORBIT_RADIUS, Runs, quantity
from rbdyn.result import JITTER, Quantity
from rbdyn.scene import Scene


def orbit_radius_share(scene: Scene, runs: Runs, companions: Runs, share: float) -> Quantity | None:
    """Radius of the cage's orbit over its radial play, with errors as of any figure; None for a cage without a play.

    ``share`` of the difference from the companions is the bias of the runs.
    """
    play = scene.cage_play_m
    if play is None:
        return None
    return quantity(ORBIT_RADIUS, runs, companions, share, 0.0, 1.0 / play)


def whirl_notes(scene: Scene, share: Quantity | None) -> tuple[str, ...]:
    """A note where the whirl deviation ratio is that of a jitter."""
    play = scene.cage_play_m
    if share is None or play is None or share.value >= JITTER:
        return ()
    where = "radial play in its pockets" if scene.guide_clearance_m is None else "radial guide clearance"
    what = "whirl deviation ratio: that of a jitter, for the cage does not whirl"
    return (f"{what}; its orbit has a radius of {1e6 * play * share.value:.2g} um, {share.value:.2g} of the {where}",)
