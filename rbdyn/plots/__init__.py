"""Pictures. matplotlib is loaded in this package and nowhere else in ``rbdyn``.

- ``roller``: cage orbit, pocket and land forces, whirl, sections, spectra, load, slip and heat, of a history; power by loss; slip
  over speed and load; the moving bearing as GIF or MP4
- ``ball``: one equilibrium of a ball bearing, and many over one or two keys of the scene
- ``drawing``: the bearing at one moment, clearances magnified, and the page of HTML that plays it
- ``style``: how every picture looks
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
    whirl,
)

__all__ = [
    "cage_orbit", "forces", "pocket_forces", "power_by_loss", "roller_loads", "section", "sliding", "spectra", "whirl",
]  # fmt: skip
