"""Where the points of a study run: its store, its workers or cluster, and who watches."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from doe import clearance
from doe.running.failure import Failure
from doe.running.store import Store
from doe.study.runs import Progress
from rbdyn.result import SimulationResult
from rbdyn.scene import Scene


@dataclass(frozen=True)
class Simulations:
    """Runs scenes once each and keeps them in ``store``.

    ``workers``: threads, all processors by default; ``scheduler``: address of a cluster to run on instead.
    ``retry``: run those again that failed before. ``progress(title)`` gives the progress of a stage.
    """

    store: Store
    workers: int | None
    scheduler: str | None
    retry: bool
    progress: Callable[[str], Progress]

    def run(
        self,
        scenes: Sequence[Scene],
        labels: Sequence[str],
        progress: Progress,
        factors: Sequence[Mapping[str, float]] | None = None,
    ) -> list[SimulationResult | Failure]:
        """Results or failures of scenes, in their order. Raises InputError, RunError, KeyboardInterrupt.

        ``factors``: of design runs, which are numbered then.
        """
        return clearance.run_scenes(
            scenes, labels, self.store, self.workers, progress, self.scheduler, retry=self.retry, factors=factors
        )
