"""Runs on a cluster: the workers of a dask scheduler, by dask.distributed."""

import asyncio
import logging
import queue
import uuid
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from functools import partial
from typing import Any

from doe.running.runner import Ran
from doe.running.store import StoppedError
from rbdyn.base.faults import InputError

# A scheduler that does not shake hands, take up a client or have a worker within so long [s] is not there.
KNOCK_S, CONNECT_S, WORKERS_S = 2.0, 4.0, 10.0
# A study under way waits for new workers for so long [s] when the last one is gone.
DESERTED_S = 60.0
# The cluster is looked at as often as this [s].
LOOK_S = 1.0


def run_on_cluster(
    address: str,
    work: Callable[[str], Ran],
    tasks: Sequence[str],
    ended: Callable[[int, Ran], None],
    begun: Callable[[int], None] = lambda place: None,
) -> None:
    """Run ``work`` on every text of ``tasks`` and hand over each result, with its place, as it ends; and, in another thread,
    its place as it begins.

    A task whose worker is lost runs again on another; one that was lost
    again and again is handed over as lost. Raises InputError when there is no cluster to start on, or its workers run
    other code; StoppedError when it goes away.
    """
    with _client(address) as client:
        # All at once, so that workers which join later find work.
        topic = f"rbdyn-{uuid.uuid4().hex}"
        client.subscribe_topic(topic, lambda event: begun(event[1]))
        announced = partial(_announced, work, topic)
        futures = dict(enumerate(client.map(announced, range(len(tasks)), list(tasks), pure=False)))
        answers: queue.SimpleQueue[int] = queue.SimpleQueue()
        for number, future in futures.items():
            future.add_done_callback(lambda _, number=number: answers.put(number))
        alone_s = 0.0
        while futures:
            place = -1
            try:
                place = answers.get(timeout=LOOK_S)
                ran = futures[place].result(timeout=LOOK_S)
            except (queue.Empty, TimeoutError):
                # A result that went with its worker is made again on another.
                if place in futures:
                    answers.put(place)
                broken = place in futures and futures[place].status == "error"
                running = client.status == "running"
                alone_s = 0.0 if running and client.scheduler_info(n_workers=-1)["workers"] else alone_s + LOOK_S
                if broken or client.status != "running" or alone_s > DESERTED_S:
                    raise _gone(address, client) from None
                continue
            except InputError:
                raise
            except (CancelledError, OSError, MemoryError) as error:
                raise _gone(address, client) from error
            except Exception as error:
                ran = Ran(None, f"its workers were lost ({error})", 0.0, lost=True)
            # What is still held would be run again if its worker were lost.
            futures.pop(place).release()
            ended(place, ran)


def _announced(work: Callable[[str], Ran], topic: str, place: int, text: str) -> Ran:
    """Work on a worker, which says that it begins."""
    from distributed import get_worker

    get_worker().log_event(topic, place)
    return work(text)


def _gone(address: str, client: Any) -> StoppedError:
    what = "its workers are gone" if client.status == "running" else "the scheduler is gone"
    return StoppedError(f"--scheduler {address}: {what}", "start again when the cluster is back")


async def _knock(address: str) -> None:
    """Shake hands with the scheduler; a client that cannot would leave threads behind."""
    from distributed.comm import connect

    # Its own limit ends with the connection: what accepts that and says nothing would be waited for without end.
    comm = await asyncio.wait_for(connect(address, timeout=KNOCK_S), KNOCK_S)
    await comm.close()


@contextmanager
def _client(address: str) -> Iterator[Any]:
    where = f"--scheduler {address}"
    try:
        import distributed
    except ImportError:
        raise InputError([f"{where}: needs the package distributed; pip install 'rbdyn[cluster]'"]) from None
    # What it would log is said here in a sentence.
    for name in logging.root.manager.loggerDict:
        if name.split(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        asyncio.run(_knock(address))
        client = distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
    # What answers there may be anything, and its words mean anything.
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
