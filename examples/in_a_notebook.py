"""A bearing in a notebook: from a scene to a picture of one's own, in cells that editors and jupytext know by ``# %%``.

    python examples/in_a_notebook.py

A scene, a result, a history at the end of a cell show themselves as a small table with units and errors.
"""

# %% The scene: read from a file, then changed; every value is checked as in the file.
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import rbdyn
from rbdyn.base.words import with_error

drawn = rbdyn.Scene.load(Path(__file__).with_name("cylindrical_roller.toml"))
scene = drawn.changed({"cage.mass_g": 50, "numerics.turns": 20, "numerics.discard_turns": 5, "numerics.replicates": 2})
scene  # noqa: B018

# %% The simulation: figures with the half-widths of their 95 % intervals, here of a short run.
result = rbdyn.simulate(scene)
result  # noqa: B018

# %% The motion of one replicate, in SI: what the inner race carries in the direction of the load, which is that of the shaft.
motion = rbdyn.history(scene, turns=10)
carried = float((motion.inner_load * np.cos(motion.azimuth)).sum(axis=1).mean())

# %% A picture of one's own: the load zone.
figure, axis = plt.subplots(figsize=(6.0, 3.5), layout="constrained")
angle = np.degrees((motion.azimuth + np.pi) % (2.0 * np.pi) - np.pi)
axis.plot(angle.ravel(), motion.inner_load.ravel(), ".", markersize=1)
axis.set_xlabel("roller from the load direction [deg]")
axis.set_ylabel("load on the inner race [N]")
axis.set_title(
    f"power loss {with_error(result.power_loss_W.value, result.power_loss_W.error)} W, carried {carried:.0f} N"
)
if __name__ == "__main__":
    figure.savefig("load_zone.png", dpi=130)
