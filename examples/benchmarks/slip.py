"""Cage slip of lightly loaded bearings: what the oil layer at open contacts and the form of the traction law do to it.

``python examples/benchmarks/slip.py`` prints three tables; ``--only share,cold,law`` takes some of them.

- share: rolling and shear forces of films at open contacts over the circle beyond 25 degrees from the load, at a diametral
  clearance of 52 um, over those of films that begin five of their own half-widths ahead, by thickness of the oil layer
- cold: slip of an NU 2326 in ISO VG 320 PAO at 1200 rpm and 3 kN over the temperature. NREL measured up to 60 % in the cold on a
  wind turbine's bearing, less as its oil warms
- law: slip of an NU 215 at 800 N over temperature and clearance, by three traction laws
"""

import argparse
import math
import subprocess
import sys
import tomllib
from collections.abc import Iterator

import numpy as np

from rbdyn import Scene, simulate
from rbdyn.base.words import with_error
from rbdyn.contact.rolling_resistance import inlet
from rbdyn.dynamics.parameters.model import oil_layer

LAYERS_UM, CLEARANCE_UM, LOADED_DEG, OWN_HALF_WIDTHS = (4.0, 10.0, 26.0, 60.0), 52.0, 25.0, 5.0
LAWS = "limiting_shear", "eyring", "four_constant"


def share() -> Iterator[list[str]]:
    """Mean forces over those of the inlet that moves away with the gap."""
    angle = np.radians(np.linspace(LOADED_DEG, 180.0, 1001))
    gap = 0.5 * CLEARANCE_UM * (1.0 - np.cos(angle))
    own = inlet(OWN_HALF_WIDTHS)
    yield ["oil layer um", "rolling", "shear"]
    for layer in LAYERS_UM:
        films = [inlet(math.sqrt(layer / h - 1.0)) if h < layer else None for h in gap]
        rolling, shear = (
            [0.0 if film is None else getattr(film, part) for film in films] for part in ("rolling", "shear")
        )
        root = gap**-0.5 / np.sum(gap**-0.5)
        yield [f"{layer:g}", f"{root @ rolling / own.rolling:.2f}", f"{root @ shear / own.shear:.2f}"]


def slip(name: str, words: tuple[str, ...], *keys: str) -> tuple[Scene, str]:
    """What ``rbdyn new`` writes, with changes, and its slip in percent with the statistical error."""
    command = [sys.executable, "-m", "rbdyn", "new", name, *words]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    scene = Scene.from_dict(
        tomllib.loads(text), name, ("numerics.companion=false", "numerics.replicates=2", "numerics.turns=40", *keys)
    )
    found = simulate(scene, notice=None).cage_slip
    return scene, with_error(100.0 * found.value, 100.0 * (found.statistical_error or 0.0))


def cold() -> Iterator[list[str]]:
    """Slip with the films of the layer and without films, over the temperature."""
    point = "--speed", "1200", "--load", "3000", "--oil", "ISO VG 320 PAO"
    yield ["C", "oil layer um", "slip %", "slip without films %"]
    for temperature in ("20", "30", "45", "60"):
        words = (*point, "--temperature", temperature)
        (scene, fed), (_, dry) = slip("NU2326", words), slip("NU2326", words, "model.open_contact_film=false")
        yield [temperature, f"{1e6 * oil_layer(scene):.1f}", fed, dry]


def law() -> Iterator[list[str]]:
    """Slip by three laws, over the temperature at the usual clearance, and over the clearance."""
    yield ["C", "clearance um", *(f"{name} %" for name in LAWS)]
    for temperature, clearance in (("30", None), ("60", None), ("90", None), ("70", "10"), ("70", "30"), ("70", "100")):
        keys = () if clearance is None else (f"bearing.radial_clearance_mm={float(clearance) * 1e-3:g}",)
        words = "--load", "800", "--temperature", temperature
        yield [temperature, clearance or "usual",
               *(slip("NU215", words, f"traction.model={name}", *keys)[1] for name in LAWS)]  # fmt: skip


TABLES = {"share": share, "cold": cold, "law": law}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(TABLES), help="tables, separated by commas")
    for name in parser.parse_args().only.split(","):
        print(f"\n{TABLES[name].__doc__}")
        for row in TABLES[name]():
            print("  ".join(f"{cell:>20}" for cell in row), flush=True)
