"""Numbers that must not change by accident: short motions, equilibria, surfaces and chains, kept with their platform.

``python tests/golden/regenerate.py numbers`` writes ``golden.json`` anew, ``... regenerate.py simulate fit`` the outputs of
these cases, ``... regenerate.py`` everything. That is right only where a law, a default, a key or a sentence was changed on
purpose; the difference of the files says how far the numbers moved and what else changed.
"""

import json
import platform
import sys
import tempfile
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
FILE, EXAMPLES = HERE / "golden.json", HERE.parents[1] / "examples"
PLATFORMS = HERE / "outputs" / "platforms.json"
TURNS = 0.02  # so short that round-off has not grown
# The laws of these scenes are compiled for other tests too.
SCENES = ("outer", "inner", "conservative", "everything")
BALLS = ("angular_contact_ball", "angular_contact_7014", "double_decker")


def this_platform() -> dict[str, str]:
    """What the last bits depend on: processor, its vectors, and who makes machine code and sums."""
    from llvmlite.binding import get_host_cpu_features, get_host_cpu_name

    features = get_host_cpu_features()
    vectors = next((name for name in ("avx512f", "avx2", "avx", "neon") if features.get(name)), "none")
    packages = {name: version(name) for name in ("numba", "llvmlite", "numpy", "scipy")}
    return {"machine": platform.machine(), "cpu": get_host_cpu_name(), "vectors": vectors, **packages}


def platforms() -> dict[str, dict[str, str]]:
    """The platform on which the outputs of each case were kept."""
    kept: dict[str, dict[str, str]] = json.loads(PLATFORMS.read_text("utf-8"))
    return kept


def motion(name: str) -> list[float]:
    """State of the first replicate of a scene of ``conftest`` after ``TURNS``."""
    import conftest

    from rbdyn.dynamics.ensemble import Stop
    from rbdyn.dynamics.parameters.model import roller_bearing
    from rbdyn.dynamics.run import Run

    assignments = {
        "outer": (), "inner": ("cage.guidance=inner",), "conservative": conftest.CONSERVATIVE,
        "everything": conftest.EVERYTHING,
    }[name]  # fmt: skip
    scene = conftest.make(*assignments)
    run = Run(scene, roller_bearing(scene), 0, scene.numerics.rtol, Stop())
    run.to(TURNS)
    return run.carry.y.tolist()


def numbers(record: Any) -> Iterator[float]:
    """All numbers within a record, in its order."""
    if isinstance(record, dict):
        record = list(record.values())
    if isinstance(record, list):
        for part in record:
            yield from numbers(part)
    elif isinstance(record, float):
        yield record


def equilibrium(name: str) -> list[float]:
    """Displacement, loads, angles and stiffness of an example of balls."""
    import rbdyn

    record = rbdyn.equilibrium(rbdyn.BallScene.load(EXAMPLES / f"{name}.toml")).as_dict()
    parts = [record, *(record[row] for row in ("inner", "outer") if "balls" in record.get(row, ()))]
    return list(numbers([[part.get(key) for key in ("displacement_mm", "stiffness", "balls")] for part in parts]))


def surfaces() -> list[float]:
    """Coefficients of the surfaces of the published table."""
    from pareto_cases import edited_study, table_surfaces

    with tempfile.TemporaryDirectory() as folder:
        return [float(each) for surface in table_surfaces(edited_study(Path(folder))) for each in surface.coefficients]


def chains() -> list[float]:
    """Worst cases and allocated parts of the chains of the example."""
    from doe.dimension_chain import read_chains, solve

    found = [solve(chain, samples=1000) for chain in read_chains(EXAMPLES / "bearing_chains.toml").values()]
    parts = [
        [result.worst_case_mm, *((part.mean_mm, part.tolerance_mm) for part in result.allocation)] for result in found
    ]
    return [float(each) for result in parts for pair in result for each in pair]


CASES = {
    **{f"motion {name}": (motion, name) for name in SCENES},
    **{f"equilibrium {name}": (equilibrium, name) for name in BALLS},
    "surfaces of the published table": (surfaces,),
    "chains of the bearing": (chains,),
}


def computed(case: str) -> list[float]:
    """The numbers of a case, here and now."""
    make, *arguments = CASES[case]
    return make(*arguments)


if __name__ == "__main__":
    sys.path[:0] = [str(HERE.parents[1]), str(HERE.parent), str(HERE.parent / "helpers")]
    import outputs

    asked = sys.argv[1:] or ["numbers", *outputs.OUTPUTS]
    if unknown := set(asked) - {"numbers", *outputs.OUTPUTS}:
        sys.exit(f"{', '.join(sorted(unknown))}: no case; choose numbers or {' or '.join(outputs.OUTPUTS)}")
    if "numbers" in asked:
        cases = {case: computed(case) for case in CASES}
        FILE.write_text(json.dumps({"platform": this_platform(), "cases": cases}, indent=0) + "\n", encoding="utf-8")
        print(f"{FILE.name}: {sum(map(len, cases.values()))} numbers of {len(cases)} cases")
    for case in asked:
        if case != "numbers":
            outputs.keep(case)
            PLATFORMS.write_text(json.dumps(platforms() | {case: this_platform()}, indent=1) + "\n", encoding="utf-8")
            print(f"outputs/{case}")
