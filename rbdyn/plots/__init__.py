"""Pictures. matplotlib is loaded in this package and nowhere else in ``rbdyn``.

- ``motion``: cage orbit, pocket and land forces, whirl, sections, spectra, load, slip and heat, of a history; power by loss
- ``ball``: one equilibrium of a ball bearing; ``ball_sweep``: many, over one or two keys of the scene
- ``drawing``: the bearing at one moment, clearances magnified; shared by ``animation`` (GIF or MP4) and ``player`` (HTML)
"""

from rbdyn.plots.motion import (
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
