"""Pictures. matplotlib is loaded in this package and nowhere else in ``rbdyn``.

- ``roller``: pictures of a history and of a slip map, power by loss, the moving bearing as GIF or MP4
- ``start``: temperatures and clearances of a machine that warms
- ``ball``: one equilibrium of a ball bearing, and many over one or two keys of the scene
- ``drawing``: the bearing at one moment with magnified clearances, and the page of HTML that plays it
- ``sketches``: what names of sizes and signs mean, as SVG of a scene's own geometry
- ``style``: how every picture looks, and axes of error against run time
"""

from rbdyn.plots.roller import (
    cage_orbit,
    forces,
    pocket_forces,
    power_by_loss,
    roller_loads,
    section,
    sliding,
    spectra,
    stiffness_over_clearance,
    whirl,
)
from rbdyn.plots.start import start

__all__ = [
    "cage_orbit", "forces", "pocket_forces", "power_by_loss", "roller_loads", "section", "sliding", "spectra", "start",
    "stiffness_over_clearance", "whirl",
]  # fmt: skip
