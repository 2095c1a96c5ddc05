"""How runs are made: in threads or on a cluster, who watches them, and the folder that keeps them."""

import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from doe.running.runner import AgendaKeeper, Progress, agenda_in
from doe.running.store import STORE, StoppedError, Store
from rbdyn.base.faults import RunError
from rbdyn.base.words import Notice

if TYPE_CHECKING:
    from doe.clearance import Simulations

# ``progress(stage, done, total)``: called as the runs of a stage end.
Follow = Callable[[str, int, int], None] | None


class Effort(NamedTuple):
    """How to run: ``workers`` threads (None: all processors) or the cluster of a ``scheduler``'s address.

    ``retry``: repeat runs that failed before. ``follow`` hears of runs that end, ``notice`` of their number and time.
    """

    workers: int | None = None
    scheduler: str | None = None
    retry: bool = False
    follow: Follow = None
    notice: Notice = None

    def progress(self, title: str) -> Progress:
        """Progress of the stage of this title."""

        def progress(done: int, total: int) -> None:
            if self.follow is not None:
                self.follow(title, done, total)

        return progress

    @property
    def threads(self) -> int:
        """Number of threads. Raises InputError unless it is a whole number from 1."""
        from rbdyn.dynamics.ensemble import threads_of

        return threads_of(self.workers)

    def agenda(
        self,
        folder: Path,
        command: str,
        options: Mapping[str, bool] | None = None,
        inputs: str = "",
        question: str = "",
    ) -> AbstractContextManager[AgendaKeeper]:
        """The agenda of a command in the store of its folder, for ``doe status``.

        ``inputs``: digest of the inputs of its answer; ``question``: digest of all that decides its runs.
        """
        return agenda_in(folder / STORE, command, self.threads, options, inputs, self.notice, question)

    @contextmanager
    def simulations(self, folder: Path, source: Path, agenda: AgendaKeeper | None = None) -> "Iterator[Simulations]":
        """Simulations for the file ``source``, stored in a folder and counted in an agenda, if there is one."""
        from doe.clearance import Simulations

        with Store(folder / STORE, source.stem) as store:
            progress = self.progress if agenda is None else agenda.announced(self.progress)
            yield Simulations(store, self.workers, self.scheduler, self.retry, progress, agenda)

    @contextmanager
    def folder(self, out: Path | None) -> Iterator[Path]:
        """The stated folder, or one that lasts as long as the runs."""
        if out is not None:
            yield out
            return
        with tempfile.TemporaryDirectory() as folder:
            try:
                yield Path(folder)
            except StoppedError as error:
                raise RunError("{}; without --out no finished run is kept: {}".format(*error.args)) from None
