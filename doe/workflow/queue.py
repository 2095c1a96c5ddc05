"""Parts of a table or of a study for the jobs of a queue: each part has a store of its own in the folder of the whole."""

from pathlib import Path

from doe.clearance import every_scene, points_of, work_of
from doe.duty import DutyResult
from doe.running.runner import AgendaKeeper, Stage, agendas_of
from doe.running.store import STORE, Failure, Store
from doe.workflow.effort import Effort
from doe.workflow.problem import Problem
from doe.workflow.region import region_that_runs
from doe.workflow.status import DESIGN
from rbdyn.base.faults import InputError
from rbdyn.result import SimulationResult

# Part k of n: every n-th run from the k-th.
Part = tuple[int, int]


def rows_of(part: Part | None) -> slice:
    """Places of the runs of a part; those of all runs without one."""
    return slice(None) if part is None else slice(part[0] - 1, None, part[1])


def part_folder(folder: Path, part: Part | None) -> Path:
    """Folder of the store of a part within that of its table."""
    return folder if part is None else folder / f"part-{part[0]}-of-{part[1]}"


def part_stores(folder: Path) -> list[Path]:
    """Stores of all parts in the folder of a table or a study."""
    return sorted(folder.glob(f"part-*-of-*/{STORE}"))


def refuse_other_parts(folder: Path, question: str) -> None:
    """Raises InputError where the folder has a part of another table or study than that of this digest."""
    for path in part_stores(folder):
        with Store(path, read_only=True) as store:
            questions = {agenda.question for agenda, _ in agendas_of(store)}
        if questions - {question}:
            raise InputError(
                [f"--out {folder}: {path.parent.name} is a part of another input; remove it or name another folder"]
            )


def gather(folder: Path) -> None:
    """Take over the runs of all parts into the store of their folder. Raises as ``Store``."""
    if stores := part_stores(folder):
        with Store(folder / STORE) as store:
            for path in stores:
                store.adopt(path)


def run_part(
    study: Problem, folder: Path, effort: Effort, part: Part, agenda: AgendaKeeper
) -> list[SimulationResult | DutyResult | Failure]:
    """Simulate the design runs of a part of a study, with their store in ``folder``. Raises as ``run_study``."""
    from doe.workflow.whole import check_study

    study, _ = region_that_runs(study, folder, effort)
    check_study(study)
    ordered, rows = study.plan, rows_of(part)
    scenes, labels = ordered.scenes[rows], ordered.labels[rows]
    points = points_of(scenes, labels)
    works = {point.key: work_of(scene) for point, scene in zip(points, every_scene(scenes), strict=True)}
    if not works:
        raise InputError([f"--part {part[0]}/{part[1]}: has no run of {len(ordered.scenes)}; name fewer parts"])
    agenda.plan([Stage(DESIGN, (DESIGN,), len(works), sum(works.values()))])
    with effort.simulations(folder, study.path, agenda) as simulations:
        return simulations.run(scenes, labels, simulations.progress(DESIGN), ordered.factors[rows])
