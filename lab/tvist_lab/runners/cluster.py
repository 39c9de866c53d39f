"""Dask for work of minutes and more: processes of this machine, or a cluster. A worker that dies costs its task alone.

A worker takes a batch of tasks at a time. Dask repeats the batch of a worker that died on another one. If that happens
again and again, the tasks of the batch are done one by one, each alone, so that only the one that kills its worker
fails.
"""

import logging
import math
import signal
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from typing import Any

import dask
from distributed import Client, Future, KilledWorker, LocalCluster, as_completed

from tvist_lab.runners.interface import Failed, Outcome, Result, Task, TaskError
from tvist_lab.runners.parcels import do, pack, unpack
from tvist_lab.runners.processes import OF_TERMINAL, start_tracker
from tvist_server.own_folder import OwnFolder
from tvist_server.punctual import processors

SHARE = 16
"""Least number of batches for each worker thread, so that all end at about the same time."""
LARGEST = 8
"""Largest number of tasks in a batch: as many are repeated when a worker dies."""
AHEAD = 3
"""Number of batches handed out for each worker thread, so that none waits for the next one."""
PATIENCE = 10.0
"""Time within which a scheduler has to answer, and to have a worker [s]."""
LOOK = 0.01
"""Time between two looks for results [s]; a batch takes a hundred times as long."""
QUIET = {
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": False,
    "distributed.admin.tick.limit": "1h",
    "distributed.nanny.pre-spawn-environ.DASK_LOGGING__DISTRIBUTED": "critical",
}
"""Configuration of Dask: a task needs little memory, and a busy machine is no reason for a warning."""


@dataclass(frozen=True)
class Cluster:
    """Runs tasks by Dask."""

    scheduler: str | None = None
    """Address of a scheduler, such as tcp://HOST:8786; None for processes of this machine, which end with the run."""
    processes: int | None = None
    """Number of processes of this machine; None for one for each core."""

    def run(self, work: Callable[[Task], Result], tasks: Sequence[Task]) -> Iterator[Outcome[Result]]:
        """Yield an outcome for each task; see `Runner.run`.

        Raises:
            ConnectionError: There is no scheduler at the address, it has no workers or other ones, or it has gone; or
                processes cannot be started.
        """
        with _quiet(), self._client() as client:
            yield from _Run(client, work, tasks, self.scheduler).outcomes()

    @contextmanager
    def _client(self) -> Iterator[Client]:
        if self.scheduler is not None:
            with _connected(self.scheduler) as client:
                yield client
            return
        processes = self.processes or processors()
        with (
            closing(OwnFolder()) as folder,
            dask.config.set({"temporary-directory": str(folder.path)}),
            _local(processes) as cluster,
            Client(cluster, set_as_default=False) as client,
        ):
            yield client
            with suppress(
                TimeoutError
            ):  # a worker that is just replacing another one complains when it is ended
                client.wait_for_workers(processes, timeout=PATIENCE)


@contextmanager
def _connected(address: str) -> Iterator[Client]:
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ConnectionError(f"no Dask scheduler answers at {address}") from error
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError as error:
            raise ConnectionError(
                f"the Dask scheduler at {address} has no workers: start some with dask worker {address}"
            ) from error
        _check_alike(client)
        yield client


def _check_alike(client: Client) -> None:
    """Refuse workers whose results could differ, or that cannot do the work at all."""
    own = version("tvist")
    for worker, found in client.run(version, "tvist", on_error="return").items():
        if found != own:
            has = f"tvist {found}" if isinstance(found, str) else "no tvist"
            raise ConnectionError(f"the worker {worker} has {has}: install tvist {own}")


@contextmanager
def _local(processes: int) -> Iterator[LocalCluster]:
    """Start processes that neither Control+C nor a closed terminal reaches, so that this one can end them in order.

    They inherit a mask from the thread that starts them, which inherits it from this one, as do those that replace a
    killed one. Starting the resource tracker removes the mask, so that it has to run before.

    A Dask scheduler runs whatever it is sent: certificates of this run alone keep other users of this machine out.
    """
    start_tracker()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, OF_TERMINAL)
    try:
        cluster = LocalCluster(
            n_workers=processes,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            memory_limit=0,
            silence_logs=logging.CRITICAL,
            security=True,
        )
    except (OSError, RuntimeError) as error:
        why = " ".join(str(error.__cause__ or error).split())
        raise ConnectionError(f"the processes for the work cannot be started: {why}") from error
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    with cluster:
        yield cluster


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep Dask's log and warnings from the terminal: what matters becomes a failure or an error."""
    known = [name for name in logging.root.manager.loggerDict if name.split(".")[0] == "distributed"]
    levels = {name: logging.getLogger(name).level for name in known}
    for name in levels:  # Dask gives several of them a level and an output of their own
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings(), dask.config.set(QUIET):
            warnings.simplefilter("ignore")
            yield
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)


class _Run:
    """Tasks on their way.

    Args:
        client: The client of a scheduler.
        work: The work.
        tasks: The tasks.
        address: Address of the scheduler, for messages; None for a local one.
    """

    def __init__(
        self, client: Client, work: Callable[[Task], Result], tasks: Sequence[Task], address: str | None
    ) -> None:
        self._client, self._tasks, self._address = client, tasks, address
        self._work = partial(do, work)
        size = math.ceil(len(tasks) / (SHARE * max(self._threads(), 1)))
        self._batch = min(max(size, 1), LARGEST)
        self._out: dict[str, list[int]] = {}
        self._suspects: deque[int] = deque()

    def outcomes(self) -> Iterator[Outcome[Result]]:
        """Yield an outcome for each task."""
        arriving = as_completed(loop=self._client.loop, raise_errors=False)
        batches = deque(
            range(first, min(first + self._batch, len(self._tasks)))
            for first in range(0, len(self._tasks), self._batch)
        )
        yield from self._hand_out(arriving, batches)
        for future in self._each(arriving):
            yield from self._arrived(future, arriving)
            yield from self._hand_out(arriving, batches)
        while self._suspects:
            single = as_completed(loop=self._client.loop, raise_errors=False)
            yield from self._submit(single, [self._suspects.popleft()])
            for future in self._each(single):
                yield from self._arrived(future, single, alone=True)

    def _each(self, arriving: as_completed) -> "Iterator[Future[list[bytes]]]":
        """Yield futures as they complete, until there are none; look after the workers while nothing comes.

        Raises:
            ConnectionError: All workers have died, and no other one came.
        """
        quiet = 0.0
        while not arriving.is_empty():
            batch = arriving.next_batch(block=False)
            yield from batch
            if batch:
                quiet = 0.0
                continue
            time.sleep(LOOK)
            quiet += LOOK
            if quiet > PATIENCE:
                quiet = 0.0
                self._look_after()

    def _look_after(self) -> None:
        """Wait for a worker where there is none."""
        if self._threads():
            return
        with suppress(TimeoutError):
            self._client.wait_for_workers(1, timeout=3.0 * PATIENCE)
        if not self._threads():
            where = (
                "of this machine" if self._address is None else f"of the Dask scheduler at {self._address}"
            )
            raise ConnectionError(f"all workers {where} have died, and no other one came")

    def _threads(self) -> int:
        return sum(self._client.nthreads().values())

    def _hand_out(self, arriving: as_completed, batches: deque[range]) -> Iterator[Outcome[Result]]:
        """Submit batches for all workers that there are by now; yield a failure for each task that cannot go."""
        most = AHEAD * max(self._threads(), 1)
        while batches and len(self._out) < most:
            yield from self._submit(arriving, batches.popleft())

    def _submit(self, arriving: as_completed, indices: Sequence[int]) -> Iterator[Outcome[Result]]:
        going, packed = [], []
        for index in indices:
            one = pack(self._tasks[index])
            if isinstance(one, Failed):
                yield index, one
            else:
                going.append(index)
                packed.append(one)
        if going:
            future = self._client.submit(self._work, packed, pure=False)
            self._out[str(future.key)] = going
            arriving.add(future)

    def _arrived(
        self, future: "Future[list[bytes]]", arriving: as_completed, *, alone: bool = False
    ) -> Iterator[Outcome[Result]]:
        if future.status in {
            "lost",
            "pending",
        }:  # the worker that had the result died: the batch is done again
            arriving.add(future)
            return
        indices = self._out.pop(str(future.key))
        found: Sequence[Any]
        try:
            found = [unpack(one) for one in future.result()]
        except KilledWorker:
            if not alone:
                self._suspects.extend(indices)
                return
            found = [Failed(TaskError("every worker that did it died"))]
        except CancelledError:
            raise ConnectionError(f"the Dask scheduler at {self._address} has gone") from None
        except Exception as error:  # noqa: BLE001  a worker that cannot do the work at all
            found = [Failed(error)] * len(indices)
        yield from zip(indices, found, strict=True)
