"""Parts of a table or a study that the jobs of a queue run, each into a store of its own, and their gathering."""

from pathlib import Path

from doe.running.runner import agendas_of
from doe.running.store import STORE, Store
from rbdyn.base.faults import InputError

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
                f"--out {folder}: {path.parent.name} is a part of another input; remove it or name another folder"
            )


def gather(folder: Path) -> None:
    """Take over the runs of all parts into the store of their folder. Raises as ``Store``."""
    if stores := part_stores(folder):
        with Store(folder / STORE) as store:
            for path in stores:
                store.adopt(path)
