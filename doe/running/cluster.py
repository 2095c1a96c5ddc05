"""Engine of a cluster: runs on the workers of a dask scheduler, by dask.distributed."""

import asyncio
import logging
import queue
import uuid
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from functools import partial
from typing import Any

from doe.running.runner import RunOutcome
from doe.running.store import StoppedError
from rbdyn.base.faults import InputError

# Longest waits [s] for a scheduler to shake hands, to accept a client, and to have a worker.
KNOCK_S, CONNECT_S, WORKERS_S = 2.0, 4.0, 10.0
# Longest wait [s] of a study under way for new workers.
DESERTED_S = 60.0
# Interval [s] between looks at the cluster.
LOOK_S = 1.0


def run_on_cluster(
    address: str,
    work: Callable[[str], RunOutcome],
    tasks: Sequence[str],
    on_end: Callable[[int, RunOutcome], None],
    on_begin: Callable[[int], None] = lambda place: None,
) -> None:
    """Run ``work`` on each text of ``tasks``; hand over its place at its begin, and its place and outcome at its end.

    ``on_begin`` is called in another thread. A task whose worker is lost runs again on another; one that is lost repeatedly
    is handed over as lost. Raises InputError without a cluster, or if its workers run other code; StoppedError if it goes
    away.
    """
    with _client(address) as client:
        # All tasks are submitted at once, so that workers which join later find work.
        topic = f"rbdyn-{uuid.uuid4().hex}"
        client.subscribe_topic(topic, lambda event: on_begin(event[1]))
        announced = partial(_work_with_event, work, topic)
        futures = dict(enumerate(client.map(announced, range(len(tasks)), list(tasks), pure=False)))
        answers: queue.SimpleQueue[int] = queue.SimpleQueue()
        for number, future in futures.items():
            future.add_done_callback(lambda _, number=number: answers.put(number))
        deserted_s = 0.0
        while futures:
            place = -1
            try:
                place = answers.get(timeout=LOOK_S)
                outcome = futures[place].result(timeout=LOOK_S)
            except (queue.Empty, TimeoutError):
                # A result lost with its worker is computed again on another.
                if place in futures:
                    answers.put(place)
                is_broken = place in futures and futures[place].status == "error"
                running = client.status == "running"
                deserted_s = 0.0 if running and client.scheduler_info(n_workers=-1)["workers"] else deserted_s + LOOK_S
                if is_broken or client.status != "running" or deserted_s > DESERTED_S:
                    raise _loss(address, client) from None
                continue
            except InputError:
                raise
            except (CancelledError, OSError, MemoryError) as error:
                raise _loss(address, client) from error
            except Exception as error:
                outcome = RunOutcome(None, f"its workers were lost ({error})", 0.0, lost=True)
            # An unreleased result would run again if its worker were lost.
            futures.pop(place).release()
            on_end(place, outcome)


def _work_with_event(work: Callable[[str], RunOutcome], topic: str, place: int, text: str) -> RunOutcome:
    """Work on a worker, after an event that it begins."""
    from distributed import get_worker

    get_worker().log_event(topic, place)
    return work(text)


def _loss(address: str, client: Any) -> StoppedError:
    """Error of a cluster that has lost its workers or its scheduler."""
    fix = "start again when the cluster is back"
    if client.status == "running":
        return StoppedError(f"--scheduler {address}: its workers are gone", fix)
    return StoppedError(f"--scheduler {address}: the scheduler is gone", fix)


async def _knock(address: str) -> None:
    """Shake hands with the scheduler, because a client without a scheduler would leave threads behind."""
    from distributed.comm import connect

    # The limit of connect alone would not end the wait for a server that accepts and stays silent.
    comm = await asyncio.wait_for(connect(address, timeout=KNOCK_S), KNOCK_S)
    await comm.close()


@contextmanager
def _client(address: str) -> Iterator[Any]:
    where = f"--scheduler {address}"
    try:
        import distributed
    except ImportError:
        raise InputError([f"{where}: needs the package distributed; pip install 'rbdyn[cluster]'"]) from None
    # Errors are reported here in a sentence, not by its log.
    for name in logging.root.manager.loggerDict:
        if name.split(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        asyncio.run(_knock(address))
        client = distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
    # Any server may answer at the address, with any error.
    except Exception:
        raise InputError(
            [f"{where}: no dask scheduler answers there within {KNOCK_S:g} s; check the address"]
        ) from None
    try:
        try:
            client.wait_for_workers(1, timeout=WORKERS_S)
        except TimeoutError:
            raise InputError([f"{where}: has no workers; start some with dask worker {address}"]) from None
        yield client
    finally:
        client.close(timeout=CONNECT_S)
