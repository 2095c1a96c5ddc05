"""A shaft with a disc between two rolling bearings, in ROSS: natural frequencies with the stiffness that rbdyn states.

``pip install ross-rotordynamics "plotly<6"`` (ROSS 2.3; its plots need that plotly), then
``rbdyn map SCENE.toml --stiffness --speed 2000:12000:6 --load 1000 --load-angle=-90 --out map`` and
``python examples/rotor_in_ross.py map/stiffness.csv [--load N]``. In ROSS y points up, so a load by gravity is at -90 degrees.
The damping is that of the table; without a loss factor the whirl is undamped.
"""

import argparse
import inspect
from pathlib import Path
from typing import Any

import pandas as pd

COEFFICIENTS = [f"{letter}{axes}" for letter in "kc" for axes in ("xx", "xy", "yx", "yy")]
# Shaft of steel: elements, their length and the diameter [m]; the disc in the middle is wide by a share of its diameter.
ELEMENTS, LENGTH, DIAMETER = 6, 0.05, 0.04
DISC_WIDTH, DISC_DIAMETER = 0.03, 0.2


def bearing_arguments(path: Path, load: float | None = None) -> dict[str, list[float]]:
    """Stiffness [N/m] and damping [N s/m] over speed [rad/s] as arguments of ROSS's BearingElement.

    ``load``: radial load [N] of the rows to take, by default the first one. Raises ValueError where a point of the table failed.
    """
    table = pd.read_csv(path)
    rows = table[table["radial_load_N"] == (table["radial_load_N"].iloc[0] if load is None else load)]
    if not len(rows) or rows[COEFFICIENTS].isna().any(axis=None):
        raise ValueError(f"{path}: has no whole row of coefficients at each speed of a load of {load} N")
    return {"speed": rows["speed"].tolist(), **{name: rows[name].tolist() for name in COEFFICIENTS}}


def rotor_of(arguments: dict[str, list[float]]) -> Any:
    """A ROSS rotor on two such bearings."""
    import ross

    # Speeds of the table are called frequency in ROSS 2.
    names = inspect.signature(ross.BearingElement.__init__).parameters
    speed = "speed" if "speed" in names else "frequency"
    by_name = {speed if name == "speed" else name: values for name, values in arguments.items()}
    steel = ross.Material(name="steel", rho=7810.0, E=211e9, G_s=81.2e9)
    shaft = [ross.ShaftElement(L=LENGTH, idl=0.0, odl=DIAMETER, material=steel) for _ in range(ELEMENTS)]
    disc = ross.DiskElement.from_geometry(
        n=ELEMENTS // 2, material=steel, width=DISC_WIDTH, i_d=DIAMETER, o_d=DISC_DIAMETER
    )
    bearings = [ross.BearingElement(n=node, **by_name) for node in (0, ELEMENTS)]
    return ross.Rotor(shaft, [disc], bearings)


def main() -> None:
    """Print the first natural frequencies at each speed of the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", type=Path)
    parser.add_argument("--load", type=float)
    given = parser.parse_args()
    arguments = bearing_arguments(given.table, given.load)
    rotor = rotor_of(arguments)
    for speed in arguments["speed"]:
        first = rotor.run_modal(speed=speed).wd[:4]
        hertz = ", ".join(f"{frequency / 6.283185307179586:.1f}" for frequency in first)
        print(f"{speed * 9.549296585513721:.0f} rpm: {hertz} Hz")


if __name__ == "__main__":
    main()
