"""A program in which lists have one entry more: ``python with_entries.py FOLDER`` runs commands and tells what has the entry.

The entries are a figure, a loss and a clearance; each is added to the text of its one list before anything reads it.
"""

import json
import sys
import types
from collections.abc import Mapping
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "examples" / "cylindrical_roller.toml"
SHORT = (
    "--turns", "2", "--replicates", "2", "--set", "numerics.discard_turns=1", "--set", "numerics.companion=false", "--set",
    "numerics.extend=false",
)  # fmt: skip
FIGURE = """BEARING += (
    Figure("race_force_N", "largest force of a roller on the outer race", windowed(OUTER_LOAD), tested=True, judged="notes",
           words="largest race force [N]", panel=(5, "race [N]"), accuracy=7.0),
)
"""
LOSS = '    Loss("grease_churning", lambda shares: (("oil", 1.0),)),\n'
CLEARANCE = (
    '    Clearance("axial", "bearing.axial_clearance_mm", "between ribs and rollers", 0.4, "axial clearance"),\n'
)


def add(module: str, entries: Mapping[str, str], more: str = "") -> None:
    """Read a module whose text begins with ``more`` and has ``entries``, each before the first of its place."""
    path = ROOT.joinpath(*module.split(".")).with_suffix(".py")
    text = path.read_text(encoding="utf-8")
    for place, entry in entries.items():
        before, mark, after = text.partition(place)
        assert mark, module
        text = before + entry + mark + after
    found = types.ModuleType(module)
    found.__file__ = str(path)
    sys.modules[module] = found
    exec(compile(more + text, str(path), "exec"), found.__dict__)


def run(*words: Any) -> str:
    """Standard output of ``rbdyn``."""
    from in_process import in_process

    done = in_process("rbdyn", *words)
    assert done.returncode == 0, done.stderr
    return done.stdout


def figure(folder: Path) -> dict[str, bool]:
    """Whether the figure is in everything that names figures."""
    key, words = "race_force_N", "largest race force [N]"
    terminal = run("simulate", SCENE, *SHORT, "--out", folder / "run")
    record = json.loads((folder / "run" / "result.json").read_text(encoding="utf-8"))
    run("map", SCENE, *SHORT, "--speed", "20000:24000:2", "--load", "1300", "--out", folder / "map")
    from doe.clearance import responses_of
    from doe.commands.new import limits_of
    from doe.workflow.rig import ACCURACIES, RigTable
    from doe.workflow.uncertainty import OUTPUTS
    from rbdyn.dynamics.duty_simulation import WORST
    from rbdyn.plots.roller import PANELS
    from rbdyn.result import SimulationResult

    result = SimulationResult.load(folder / "run" / "result.json")
    return {
        "json": record[key]["value"] == result.figures[key].value > 0.0 and key in result.responses,
        "terminal": words in terminal,
        "page": words in (folder / "run" / "report.html").read_text(encoding="utf-8"),
        "table": key in (folder / "run" / "figures.csv").read_text(encoding="utf-8"),
        "responses": key in responses_of(heats=False),
        "limits": limits_of([f"{key}<=9"]) == {key: {"upper": 9.0}},
        "map": f"{key}_statistical_error" in (folder / "map" / "map.csv").read_text(encoding="utf-8").splitlines()[0],
        "panel": PANELS[-1].key == key,
        "uncertainty": key in OUTPUTS,
        "rig": ACCURACIES[key] == 7.0 and f"{key}_accuracy_percent" in RigTable.model_fields,
        "worst": key in WORST,
        "manual": "largest force of a roller on the outer race" in manual(folder),
    }


def manual(folder: Path) -> str:
    """The page of the manual."""
    run("manual", "--out", folder / "manual")
    return (folder / "manual" / "manual.html").read_text(encoding="utf-8")


def loss() -> dict[str, bool]:
    """Whether the loss heats its node and is a figure of a part."""
    from doe.clearance import responses_of
    from rbdyn.dynamics.parameters.heat import TERMS_OF_POWERS
    from rbdyn.losses import POWER_TERMS
    from rbdyn.thermal.losses import TERMS, Effusivities, shares

    row = TERMS.index("grease_churning")
    return {
        "power": POWER_TERMS[-1] == "grease_churning",
        "heat": shares(Effusivities(1.0, 1.0, 1.0), "outer", 0.5)[row].tolist() == [1.0, 0.0, 0.0, 0.0],
        "balance": TERMS_OF_POWERS[row].tolist()
        == [float(term == "grease_churning") for term in [*POWER_TERMS, *"....."]],
        "responses": "grease_churning_power_W" in responses_of(heats=False),
    }


def clearance() -> dict[str, bool]:
    """Whether the clearance is a figure, a factor of a new study, and has words."""
    from doe.clearance import responses_of
    from doe.commands.new import _factors
    from doe.report.sections.answer import MEANINGS
    from doe.workflow.duty import NAMES
    from rbdyn.clearances import other_ranges
    from rbdyn.cli.simulation_output import CLEARANCE_COLUMNS

    tables = {"bearing": {"axial_clearance_mm": 0.2}, "cage": {"guidance": "outer"}}
    return {
        "responses": "axial_operating_clearance_um" in responses_of(heats=False),
        "duty": CLEARANCE_COLUMNS["axial"][0] == "axial_operating_clearance_um",
        "ranges": "axial clearance 1 to 3 µm" in other_ranges({"axial_um": (1.0, 2.0, 3.0)}),
        "factor": [(one.name, one.step) for one in _factors(tables)] == [("axial_clearance_mm", 0.08)],
        "study": NAMES["bearing.axial_clearance_mm"] == "axial",
        "meaning": MEANINGS["bearing.axial_clearance_mm"] == "between ribs and rollers",
    }


def main(kind: str, folder: Path) -> None:
    """The program."""
    if kind == "figure":
        imported = "from rbdyn.dynamics.forces.state import OUTER_LOAD\n"
        add("rbdyn.dynamics.figures", {"_PLACES = ": FIGURE}, imported)
        found = figure(folder)
    elif kind == "loss":
        add("rbdyn.losses", {'    Loss("spin_windage"': LOSS, "SHAFT, LOAD": "CHURNING, "})
        found = loss()
    else:
        add("rbdyn.clearances", {'    Clearance("lip"': CLEARANCE})
        found = clearance()
    print(json.dumps(found))


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
