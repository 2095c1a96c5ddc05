"""The example study on a simulation that is short, and what its store holds."""

import re
import shutil
import sqlite3
from pathlib import Path

from doe.study_file.sections import OtherLimits
from doe.workflow.problem import Problem

EXAMPLES = Path(__file__).parents[2] / "examples"
# Searches that find something, and draws that tell something, in no time.
BRIEF = (("generations = 200", "generations = 5\ndraws = 100"), ("keep = 0.5", "keep = 0.5\nsamples = 512"))
SHORT = "turns=3,discard_turns=1,replicates=2,companion=false,impact_window_turns=1"


def with_paper_goals(text: str) -> str:
    """The text of the example study with the goals of its paper alone, for which short runs and the published table serve."""
    added = re.compile(r'^\[\[response\]\]\nname = "pocket_impact_power_W".*?^(?=\[front\])', re.MULTILINE | re.DOTALL)
    assert added.search(text) and "\n[limits]\n" in text
    return added.sub("", text)


def paper_study() -> Problem:
    """The example study itself with the goals of its paper alone."""
    study = Problem.load(EXAMPLES / "clearance_study.toml")
    goals = [name for name in study.responses if name != "pocket_impact_power_W"]
    return study.with_responses(goals).with_file(limits=OtherLimits())


def short_study(folder: Path, settings: str = SHORT, replace: tuple[str, str] = ("", "")) -> Path:
    """The example study with a short simulation, in a folder of its own."""
    for name in ("cylindrical_roller.toml", "ccd_table4.csv", "bearing_chains.toml"):
        shutil.copy(EXAMPLES / name, folder)
    text = with_paper_goals((EXAMPLES / "clearance_study.toml").read_text(encoding="utf-8"))
    lines = [f'"numerics.{each}"' for each in settings.split(",")]
    first = next(line for line in text.splitlines() if line.startswith("set = "))
    text = text.replace(first, f"set = [{', '.join(lines)}]").replace("replicates = 16", "replicates = 2")
    pocket = 'factor = "pocket_clearance_mm"\n'
    text = text.replace(pocket, pocket + "half_width_mm = 0.005\n")
    for long, short in BRIEF:
        text = text.replace(long, short)
    text = text.replace(*replace) if replace[0] else text
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return path


def silent(done: int, total: int) -> None:
    """Progress that nobody watches."""


def stored(path: Path) -> int:
    """Finished runs in a store that another process may be making."""
    try:
        return len(rows(path))
    except sqlite3.Error:
        return 0


def rows(path: Path) -> dict[str, str]:
    """Results in a store by key."""
    if not path.exists():
        return {}
    connection = sqlite3.connect(path)
    try:
        return dict(connection.execute("SELECT key, result FROM runs WHERE status = 'done'"))
    finally:
        connection.close()


def run_design(study, folder, workers, progress=silent, scheduler=None, retry=False, agenda=None):
    """The design runs of a study, stored in a folder."""
    from doe.workflow import runs
    from doe.workflow.effort import Effort

    with Effort(workers, scheduler, retry).simulations(folder, study.path, agenda) as simulations:
        return runs.run_design(study, simulations, progress)


def run_study(study, folder, workers=None, progress=lambda title: silent, **options):
    """A whole study, stored in a folder; ``progress(title)`` gives the progress of a stage."""
    from doe.workflow import whole
    from doe.workflow.effort import Effort

    follow = Effort(workers, follow=lambda title, done, total: progress(title)(done, total))
    return whole.run_study(study, folder, follow, **options)


def region_that_runs(study, folder, workers, notice=None):
    """The region of a study that runs, with its heat balance stored in a folder."""
    from doe.workflow import region
    from doe.workflow.effort import Effort

    return region.region_that_runs(study, folder, Effort(workers, notice=notice))
