"""What the commands share: runs and surfaces of a study, and where a record goes."""

import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rbdyn.base.faults import RunError
from rbdyn.base.terminal import keeping, notice, output_folder, progress_bar

if TYPE_CHECKING:
    from doe.clearance import Simulations
    from doe.response_surface import Surface
    from doe.running.keeper import AgendaKeeper
    from doe.running.runner import Progress
    from doe.study_file import Study


def save(out: Path | None, source: Path, name: str, record: dict[str, Any]) -> None:
    """Write the JSON record that a command made of the file ``source`` into the folder of ``--out``, if one is given."""
    if out is not None:
        from rbdyn.result import write_json

        write_json(output_folder(out, "doe", source) / name, record)


@contextmanager
def keeping_runs(out: Path | None, source: Path) -> Iterator[None]:
    """Let Ctrl-C say that finished runs are kept, once there is a store of them in ``out``, and ``doe status`` that the
    study of the file ``source`` runs there."""
    from doe.running.lock import at_work
    from doe.workflow.runs import STORE

    with keeping(None if out is None else out / STORE), nullcontext() if out is None else at_work(source, out / STORE):
        yield


@contextmanager
def stages(quiet: bool, workers: int | None) -> "Iterator[Callable[[str], Progress]]":
    """Progress of one stage after the other, each by its title: a terminal has room for one bar. ``workers`` run at once."""
    with ExitStack() as bars:

        def stage(title: str) -> "Progress":
            bars.close()
            return bars.enter_context(progress_bar(title, quiet, workers))

        yield stage


@contextmanager
def simulations_in(
    folder: Path,
    source: Path,
    workers: int | None,
    scheduler: str | None,
    retry: bool,
    quiet: bool,
    agenda: "AgendaKeeper | None" = None,
) -> "Iterator[Simulations]":
    """Simulations of what the file ``source`` asks for, kept in the store of a folder and counted in an agenda."""
    from doe.clearance import Simulations
    from doe.running.store import Store
    from doe.workflow.runs import STORE

    with Store(folder / STORE, source.stem) as store, stages(quiet, workers) as progress:
        progress = progress if agenda is None else agenda.announced(progress)
        yield Simulations(store, workers, scheduler, retry, progress, agenda)


@contextmanager
def noted_agenda(
    folder: Path,
    command: str,
    workers: int | None,
    quiet: bool,
    options: Mapping[str, bool] | None = None,
    inputs: str = "",
    asked: str = "",
) -> "Iterator[AgendaKeeper]":
    """The agenda of a command in the store of its folder, for ``doe status``, which states what is left unless ``quiet``;
    ``inputs``: the digest of what it answers, ``asked``: also of what decides its runs."""
    from doe.running.keeper import agenda_in
    from doe.workflow.runs import STORE

    threads = workers or os.cpu_count() or 1
    with agenda_in(folder / STORE, command, threads, options, inputs, notice(quiet), asked) as agenda:
        yield agenda


def print_predicted(agenda: "AgendaKeeper | None", as_json: bool) -> None:
    """How long a command took compared with what was predicted; nothing where nothing was."""
    from rbdyn.base.forecast import duration, span

    noted = None if agenda is None or as_json else agenda.agenda
    if noted is not None and noted.predicted is not None and noted.took_s is not None:
        print(f"the whole command took {duration(noted.took_s)}; predicted were {span(*noted.predicted)}")


class Effort(NamedTuple):
    """Where and how the runs of a command are made: its options ``--out``, ``--workers``, ``--scheduler``, ``--retry``."""

    out: Path | None
    workers: int | None
    scheduler: str | None
    retry: bool
    quiet: bool


def fitted(study: "Study", data: Path | None, effort: Effort) -> "list[Surface]":
    """Surfaces of a study, of a table or of simulated runs. Raises InputError, RunError, KeyboardInterrupt."""
    from doe.workflow.runs import read_runs, run_design
    from doe.workflow.surfaces import fit_surfaces

    if data is not None:
        return fit_surfaces(study, read_runs(study, data))
    out, workers, scheduler, retry, quiet = effort
    with _store_folder(out, study.path) as folder, progress_bar("design runs", quiet, workers) as progress:
        return fit_surfaces(study, run_design(study, folder, workers, progress, scheduler, retry))


@contextmanager
def _store_folder(out: Path | None, source: Path) -> Iterator[Path]:
    """The given folder, or one that lasts as long as the command."""
    if out is not None:
        yield output_folder(out, "doe", source)
        return
    from doe.running.store import StoppedError

    with tempfile.TemporaryDirectory() as folder:
        try:
            yield Path(folder)
        except StoppedError as error:
            raise RunError("{}; without --out no finished run is kept: {}".format(*error.args)) from None
