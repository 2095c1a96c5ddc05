"""Figures 3 to 7 of Hu et al., "Study on contact angle of double-decker bearing with consider of centrifugal expansion".

    python examples/paper_001_double_decker.py [--out DIR]

Contact angles of both layers of 71901C inside 71905C against speed, with and without growth of the inner and the middle
ring, of steel and of silicon nitride. The figures themselves are lost; what the text states of them stands beside ours and
each difference is explained. The paper does not tell its load: condition 1 of the companion paper's Table 4 is taken (200 N
radial, 200 N axial), and a table shows what other loads do. Nothing is tuned.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer
from published.common import Check, Table, canvas, save, tell

from rbdyn import BallScene, equilibrium

SCENE = Path(__file__).parent / "double_decker.toml"
SPEEDS = (10000, 15000, 20000, 25000, 30000, 35000, 40000)
RINGS = {"steel": "bearing_steel", "ceramic": "silicon_nitride"}
# No growth, the thick ring with the bore of the middle ring, and the printed form with the missing 1/(32 E).
FORMS = ("none", "thick_ring", "paper")
# Layer and race, in the order of Figs. 3 to 6.
ANGLES = (("inner", "inner"), ("inner", "outer"), ("outer", "inner"), ("outer", "outer"))
RACES = ("inner", "outer")
LOADS = ((200, 200), (200, 400), (200, 600), (50, 100), (0, 100), (0, 20))
LARGEST = -3.17  # per cent, of the inner layer's outer angle with ceramic rings


def point(speed: float, rings: str, form: str, load: tuple[float, float] = LOADS[0]) -> dict[str, float]:
    """Mean contact angle over the balls of each layer and race [deg], and the growth of both rows [um].

    ``load``: radial and axial [N]. Raises RuntimeError where there is no equilibrium.
    """
    changes = [
        f"operation.inner_speed_rpm={float(speed)}",
        f"operation.radial_load_N={float(load[0])}",
        f"operation.axial_load_N={float(load[1])}",
        f"materials.inner_ring='{RINGS[rings]}'",
        f"materials.middle_ring='{RINGS[rings]}'",
        f"model.ring_expansion={str(form != 'none').lower()}",
    ]
    if form != "none":
        changes.append(f"model.ring_expansion_form='{form}'")
    result = equilibrium(BallScene.load(SCENE, changes))
    if not result.is_equilibrium:
        raise RuntimeError(f"{rings}, {form}, {speed:g} rpm: {result.status}")
    record = result.as_dict()
    found = {
        f"{layer}_layer_{race}_deg": float(np.mean([ball[f"{race}_angle_deg"] for ball in record[layer]["balls"]]))
        for layer, race in ANGLES
    }
    grown = record.get("ring_growth_um", {})
    return found | {
        "inner_growth_um": grown.get("inner_less_middle_bore", 0.0),
        "middle_growth_um": grown.get("middle_less_outer_race", 0.0),
    }


def angles(
    speeds: Sequence[float] = SPEEDS, rings: Sequence[str] = tuple(RINGS), forms: Sequence[str] = FORMS
) -> pd.DataFrame:
    """A row a point: speed, rings, form of growth, the four mean angles, and their changes by growth in per cent."""
    records = []
    for name, speed in itertools.product(rings, speeds):
        without = point(speed, name, "none")
        for form in forms:
            found = without if form == "none" else point(speed, name, form)
            change = {
                f"{layer}_layer_{race}_percent": 100.0
                * (found[f"{layer}_layer_{race}_deg"] / without[f"{layer}_layer_{race}_deg"] - 1.0)
                for layer, race in ANGLES
            }
            records.append({"rings": name, "speed_rpm": speed, "growth": form} | found | change)
    return pd.DataFrame(records)


def loads(speed: float = SPEEDS[-1], cases: Sequence[tuple[float, float]] = LOADS) -> pd.DataFrame:
    """Change of the inner layer's outer and inner angle by growth [%] under other loads."""
    records = []
    for load, name in itertools.product(cases, RINGS):
        without = point(speed, name, "none", load)
        record: dict[str, object] = {"radial_N": load[0], "axial_N": load[1], "rings": name}
        for form, race in itertools.product(FORMS[1:], RACES):
            key = f"inner_layer_{race}_deg"
            record[f"{form}_{race}_percent"] = 100.0 * (point(speed, name, form, load)[key] / without[key] - 1.0)
        records.append(record)
    return pd.DataFrame(records)


def statements(frame: pd.DataFrame) -> list[tuple[str, str, str]]:
    """What the text states, what we find, and why where they differ; at the highest speed unless told."""
    top = frame[frame["speed_rpm"] == frame["speed_rpm"].max()].set_index(["rings", "growth"])
    thick, paper = top.loc[("steel", "thick_ring")], top.loc[("steel", "paper")]
    ceramic, ceramic_paper = top.loc[("ceramic", "thick_ring")], top.loc[("ceramic", "paper")]
    grown = frame[frame["growth"] != "none"]
    columns = [f"{layer}_layer_{race}_percent" for layer, race in ANGLES]
    ours, inner = columns[1], columns[0]
    steel = frame[(frame["rings"] == "steel") & (frame["growth"] == "thick_ring")][ours].to_numpy()
    ratio = ceramic[ours] / thick[ours]
    # Ceramic with growth against steel without: two changes at once.
    bare = top.loc[("steel", "none")]
    mixed = [100.0 * (ceramic[f"inner_layer_{race}_deg"] / bare[f"inner_layer_{race}_deg"] - 1.0) for race in RACES]
    return [
        (
            "every contact angle decreases with growth (Figs. 3 to 6)",
            f"{'agrees' if (grown[columns] < 0.0).all().all() else 'differs'}: {thick[columns].min():.2f} to "
            f"{thick[columns].max():.3f} % for steel",
            "",
        ),
        (
            "the change increases with speed",
            f"{'agrees' if (np.diff(steel) < 0.0).all() else 'differs'}: {steel[0]:.2f} to {steel[-1]:.2f} %",
            "growth goes with the square of speed",
        ),
        (
            "the outer layer changes less than the inner",
            f"agrees: {thick[columns[3]]:.3f} against {thick[ours]:.2f} %",
            "the middle ring has 5.8 % of the speed (eq 13), so 0.33 % of its square",
        ),
        (
            "in the inner layer the outer angle changes more than the inner one",
            f"differs: {thick[ours]:.2f} against {thick[inner]:.2f} % ({paper[ours]:.2f} against {paper[inner]:.2f} % by the "
            "printed form)",
            "for a thrust T a ball, tan a_i = T/N and tan a_o = T/(N + F_c) with N the radial part of its inner load: what growth "
            "adds to N counts less beside F_c. The reason given, the outer layer's share in it, does not exist: under a given "
            "load the inner row does not feel the outer one. Their eq 18 has the outer row's displacement in the inner row",
        ),
        (
            "ceramic rings change the angles more than steel ones (Fig. 7)",
            f"differs: {ratio:.2f} of steel",
            "growth goes with rho/E: (3240/317)/(7827/206) = 0.27. Ceramic is stiffer, though, and lowers the angles by itself: "
            f"ceramic with growth against steel without has {mixed[1]:.2f} % ({mixed[0]:.2f} % of the inner angle), which may be "
            "what was compared",
        ),
        (
            f"the largest change is {LARGEST} %, of the inner layer's outer angle, ceramic",
            f"differs: ceramic {ceramic[ours]:.2f} % ({ceramic_paper[ours]:.2f} % by the printed form), steel {thick[ours]:.2f} "
            f"({paper[ours]:.2f}) %",
            f"in proportion it takes {LARGEST / ceramic_paper[ours]:.1f} times the printed growth of ceramic, "
            f"{LARGEST / paper[ours]:.1f} times that of steel; eq 4 as printed lacks 1/(32 E), so its scale in their programme "
            "is unknown, and so is the load",
        ),
    ]  # fmt: skip


def paper_001(speeds: Sequence[float] = SPEEDS) -> Check:
    """The whole comparison: numbers, tables and pictures."""
    frame, by_load = angles(speeds), loads(speeds[-1])
    told = statements(frame)
    labels = [f"{layer} layer, {race} angle" for layer, race in ANGLES]
    values = [f"{layer}_layer_{race}" for layer, race in ANGLES]
    rows = tuple(
        (
            row["rings"], row["growth"], f"{row['speed_rpm']:g}",
            *(f"{row[f'{key}_deg']:.3f} ({row[f'{key}_percent']:+.3f} %)" for key in values),
        )
        for row in frame.to_dict("records")
    )  # fmt: skip
    load_rows = tuple(
        (
            f"{row['radial_N']:g} N, {row['axial_N']:g} N, {row['rings']}",
            *(f"{row[f'{form}_{race}_percent']:+.2f}" for form in FORMS[1:] for race in RACES),
        )
        for row in by_load.to_dict("records")
    )
    agreed = sum(ours.startswith("agrees") for _, ours, _ in told)
    return Check(
        "Contact angles of a double-decker bearing with centrifugal growth",
        (
            Table("mean contact angle [deg] and its change by growth", ("rings", "growth", "speed [rpm]", *labels), rows),
            Table(
                f"change of the inner layer's angles [%] at {speeds[-1]:g} rpm under other loads (radial, axial)",
                ("load", "inner, thick", "outer, thick", "inner, printed", "outer, printed"),
                load_rows,
            ),
            Table("what the paper states", ("statement", "ours", "why"), tuple(told)),
        ),
        f"{agreed} of {len(told)} statements agree. Growth is real but small: a thick ring takes "
        f"{-frame[frame['growth'] == 'thick_ring'][values[1] + '_percent'].min():.1f} % of the inner layer's outer angle at "
        f"{speeds[-1]:g} rpm, and ceramic rings a quarter of it.",
        frame,
        lambda path: draw(frame, path),
    )  # fmt: skip


def draw(frame: pd.DataFrame, path: Path) -> None:
    """Figs. 3 to 6 in one picture at ``path`` and Fig. 7 beside it, named ``..._materials``."""
    figure, axes = canvas(2, 2, 5.2, 3.8)
    for number, (axis, (layer, race)) in enumerate(zip(axes.flat, ANGLES, strict=True), start=3):
        for kind, part in frame.groupby(["rings", "growth"], sort=False):
            rings, form = map(str, kind)
            style = {"none": "o-", "thick_ring": "s--", "paper": "^:"}[form]
            label = f"{rings}, {'no growth' if form == 'none' else form.replace('_', ' ')}"
            colour = "C0" if rings == "steel" else "C1"
            axis.plot(part["speed_rpm"], part[f"{layer}_layer_{race}_deg"], style, color=colour, ms=3.5, label=label)
        axis.set_title(f"Fig. {number}: {layer} layer, {race} contact angle", fontsize=10)
        axis.set_xlabel("speed [rpm]")
        axis.set_ylabel("mean over the balls [deg]")
        axis.grid(alpha=0.3)
    axes[0][0].legend(fontsize=7)
    save(figure, path)

    top = frame[frame["speed_rpm"] == frame["speed_rpm"].max()].set_index(["rings", "growth"])
    figure, ((axis,),) = canvas(1, 1, 7.0, 3.8)
    places = np.arange(len(ANGLES))
    for k, (rings, form) in enumerate(itertools.product(RINGS, FORMS[1:])):
        heights = [top.loc[(rings, form), f"{layer}_layer_{race}_percent"] for layer, race in ANGLES]
        axis.bar(places + 0.2 * (k - 1.5), heights, 0.2, label=f"{rings}, {form.replace('_', ' ')}")
    axis.plot([0.7, 1.3], [LARGEST, LARGEST], "k--", label="stated, ceramic")
    axis.set_xticks(places, [f"{layer} layer,\n{race} angle" for layer, race in ANGLES])
    axis.set_ylabel("change by growth [%]")
    axis.set_title(f"Fig. 7: rings at {top['speed_rpm'].iloc[0]:g} rpm", fontsize=10)
    axis.grid(alpha=0.3, axis="y")
    axis.legend(fontsize=8, loc="lower right")
    save(figure, path.with_name(f"{path.stem}_materials{path.suffix}"))


def main(out: Annotated[Path | None, typer.Option(help="Folder for the numbers and pictures.")] = None) -> None:
    """Regenerate the figures and print what the paper states beside ours."""
    tell(paper_001(), out, "paper_001")


if __name__ == "__main__":
    typer.run(main)
