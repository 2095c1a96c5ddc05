"""Power loss of ten catalogue bearings at their reference speed, by term, next to SKF's friction model and ISO 15312.

``python examples/benchmarks/maker_friction.py`` writes each scene by ``rbdyn new`` at the thermal reference speed of the
catalogue, 0.05 C0, ISO VG 32 at 70 C and an oil bath, the conditions of ISO 15312, and simulates it as it is. One table is of
the bearings as ``rbdyn new`` has them without a suffix, with a brass cage on lands of the outer ring; one of the cage that the
catalogue lists, of polyamide and guided by the rollers. SKF's figure is M_rr + M_sl: it has no drag of a bath.
``--only 204,210`` takes some sizes, ``--turns`` and ``--replicates`` the length of runs.
"""

import argparse
import statistics
import subprocess
import sys
import tomllib

from rbdyn import Scene, SimulationResult, simulate
from rbdyn.base.words import with_error
from rbdyn.properties.catalogue import envelope, read_designation

SIZES = ("204", "208", "210", "215", "220", "308", "314", "320", "1020", "2210")
# Suffixes of the cage, and what they stand for.
CAGES = {
    "": "brass cage on the outer ring, as without a suffix",
    "ECP": "polyamide cage guided by the rollers, as the catalogue lists most sizes",
}
LOAD_SHARE = 0.05  # of C0
# A term below this share of the loss in all bearings stands among the rest.
SHOWN_SHARE = 0.02


def scene_of(size: str, cage: str, turns: float, replicates: int) -> Scene:
    """What ``rbdyn new`` writes for a size at its reference speed, with runs of that length."""
    name = f"NU {size} {cage}".strip()
    sizes = envelope(read_designation(name))
    assert sizes.reference_speed is not None and sizes.static_capacity is not None
    point = ("--speed", f"{sizes.reference_speed:g}", "--load", f"{LOAD_SHARE * sizes.static_capacity:g}")
    words = [sys.executable, "-m", "rbdyn", "new", name, *point, "--oil", "ISO VG 32", "--temperature", "70"]
    text = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    length = (f"turns={turns:g}", f"discard_turns={turns:g}", f"replicates={replicates}", "impact_window_turns=5")
    keys = (f"numerics.{key}" for key in (*length, "extend=false", "companion=false"))
    return Scene.from_dict(tomllib.loads(text), name, keys)


def rows_of(results: dict[str, SimulationResult]) -> list[list[str]]:
    """A header, and a row a bearing: power by term and in all, the makers' figures, their ratio with its statistical error."""
    terms = {name: result.power_terms_W for name, result in results.items()}
    every = list(next(iter(terms.values())))
    shown = [
        term for term in every
        if any(abs(terms[name][term]) > SHOWN_SHARE * result.power_loss_W.value for name, result in results.items())
    ]  # fmt: skip
    header = ["bearing", "rpm", "N", *(f"{term.replace('_', ' ')} W" for term in shown), "rest W", "power loss W",
              "SKF W", "ISO 15312 W", "over SKF", "cage slip %"]  # fmt: skip
    rows = [header]
    for name, result in results.items():
        check, loss, point = result.friction_check, result.power_loss_W, result.scene["operation"]
        assert check is not None
        skf, heat, ratio = check.skf_power_W, check.iso_15312_heat_W, check.ratio
        assert skf and heat and ratio
        rest = sum(power for term, power in terms[name].items() if term not in shown)
        rows.append([
            name, f"{point['inner_speed_rpm']:.0f}", f"{point['radial_load_N']:.0f}",
            *(f"{terms[name][term]:.1f}" for term in shown), f"{rest:.1f}",
            with_error(loss.value, loss.statistical_error), f"{skf:.0f}", f"{heat:.0f}",
            with_error(ratio, (loss.statistical_error or 0.0) / skf), f"{100.0 * result.cage_slip.value:.2f}",
        ])  # fmt: skip
    return rows


def conclusion(results: dict[str, SimulationResult]) -> str:
    """Range and median over the bearings of the loss over SKF's, and of each term that makes it."""
    every = [(result, result.friction_check.skf_power_W) for result in results.values() if result.friction_check]
    ratios = [result.power_loss_W.value / skf for result, skf in every if skf]
    terms = {
        term: [result.power_terms_W[term] / skf for result, skf in every if skf] for term in every[0][0].power_terms_W
    }
    shown = {term: shares for term, shares in terms.items() if max(shares) > SHOWN_SHARE}
    parts = (f"{term.replace('_', ' ')} {_spread(shares)}" for term, shares in shown.items())
    return f"Over SKF's M_rr + M_sl, median (range): power loss {_spread(ratios)}; {', '.join(parts)}."


def _spread(values: list[float]) -> str:
    return f"{statistics.median(values):.2f} ({min(values):.2f} to {max(values):.2f})"


def main() -> None:
    """Read the arguments, simulate, and print a table a cage."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default=",".join(SIZES), help="sizes, such as 204,210 (all)")
    parser.add_argument("--turns", type=float, default=15.0, help="shaft turns counted, after as many (15)")
    parser.add_argument("--replicates", type=int, default=3, help="replicates (3)")
    asked = parser.parse_args()
    for cage, words in CAGES.items():
        names = asked.only.split(",")
        results = {f"NU {size}": simulate(scene_of(size, cage, asked.turns, asked.replicates)) for size in names}
        header, *rows = rows_of(results)
        lines = [f"| {' | '.join(row)} |" for row in (header, ["---"] * len(header), *rows)]
        print(f"**{words}**", "", *lines, "", conclusion(results), "", sep="\n", flush=True)


if __name__ == "__main__":
    main()
