"""Several processes that serve robots behind one endpoint.

Clients connect to a process without robots, a router to which the others connect over a private socket. The
first process has no network, because a process with threads should not fork.
"""

import contextlib
import gc
import multiprocessing
import multiprocessing.process
import signal
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from multiprocessing.connection import Connection, wait
from typing import Any

from tvist_controller.controller import Controller
from tvist_controller.dispatch.planner import Planner
from tvist_controller.host import Host
from tvist_controller.setup import Setup
from tvist_protocol.errors import TvistError
from tvist_server.assembly import LOCAL, Share, check_together, security_of, shares
from tvist_server.config import ServeConfig
from tvist_server.gateways.access import with_robots_behind
from tvist_server.gateways.base import Prepare
from tvist_server.gateways.security import protocol
from tvist_server.kernels import warm_up
from tvist_server.option_values import StartError
from tvist_server.own_folder import OwnFolder
from tvist_server.server import RecordingResult
from tvist_server.shutdown import Shutdown
from tvist_server.ur_ports import InterfaceName
from tvist_server.worker import (
    END,
    News,
    ParentPipe,
    WorkerEnded,
    WorkerMade,
    WorkerReady,
    WorkerRefused,
    serve_robots,
    serve_router,
)


class WorkersError(TvistError):
    """Robots cannot be served, or some have stopped; the message says which and why."""


@dataclass
class _Worker:
    who: str  # description of the process and its robots
    process: multiprocessing.process.BaseProcess
    pipe: Connection
    ended: WorkerEnded | None = None  # last news of the process; None until then

    def send(self, word: object) -> None:
        """Send a message to the process. If the process has died, do nothing: `run` reports that."""
        with contextlib.suppress(OSError):
            self.pipe.send(word)


class Workers:
    """The first process: it starts the others, and ends with them.

    May raise StartError, UserFileError or GatewayError, or WorkersError if a process cannot serve its robots.
    """

    def __init__(self, config: ServeConfig, prepare: Prepare | None = None) -> None:
        self.setups = config.setups()
        check_together(config, len(self.setups))
        self._names = [setup.name for setup in self.setups]
        self._listen, self._guard = security_of(config, self._names)
        self._config = config
        self.ur: list[tuple[str, dict[InterfaceName, int]]] = []
        """Address and ports of each robot's UR interfaces; empty if they are closed."""
        self.recordings: list[RecordingResult] = []
        self._folder = OwnFolder()
        self._inside = (
            f"{LOCAL}{self._folder.path / 'robots'}"  # endpoint for the processes of this server alone
        )
        self._front: list[_Worker] = []  # the process that clients connect to
        self._workers: list[_Worker] = []
        try:
            self._front.append(self._open())
            self.page = self._made(self._front[0]).page
            """Address of the page with figures for Prometheus; None if they are not published."""
            if prepare is not None:
                prepare(lambda done, total: self._front[0].send((done, total)))
            for setup in {id(setup.description): setup for setup in self.setups}.values():
                _rehearse(setup)
            self._fork()
            for worker in self._workers:
                self.ur += self._made(worker).ur
        except BaseException:  # including a signal
            self.close()
            raise

    def run(self, ready: Callable[[], None], ending: Shutdown) -> None:
        """Serve until a signal comes; WorkersError if a process or robot stops, after the others have ended."""
        heard, wake = multiprocessing.Pipe(duplex=False)
        ending.on_request(lambda: wake.send(None))
        why: str | None = None
        try:
            for worker in self._workers:
                worker.send(True)
            waiting: dict[Any, _Worker] = {worker.pipe: worker for worker in self._front + self._workers}
            starting = len(self._workers)
            while why is None:
                for source in wait([heard, *waiting]):
                    if source is heard:
                        return
                    worker = waiting[source]
                    news = self._news(worker)
                    if not isinstance(news, WorkerReady):
                        why = why or self._why(worker, news)
                        continue
                    starting -= 1
                    if starting == 0:
                        self._front[0].send(True)
                    elif starting < 0:
                        ready()
        finally:
            failures = self.close()
        said = [*([why] if why is not None else []), *failures]
        if said:
            raise WorkersError("; ".join(said) + ": the other robots were also stopped")

    def close(self) -> list[str]:
        """End the other processes, then the network; return the failures. A second call does nothing."""
        failures: list[str] = []
        for group in (self._workers, self._front):  # clients read until the robots have ended
            for worker in group:
                worker.send(False)
            failures += [failure for worker in group for failure in self._end(worker)]
            group.clear()
        self._folder.close()
        return failures

    def _fork(self) -> None:
        for needed, name in (
            (self._config.ur, "gateways.ur.interfaces"),
            (self._config.record, "recording.recorder"),
        ):
            if needed:
                import_module(f"tvist_server.{name}")
        gc.collect()
        gc.freeze()  # keeps memory shared: the collector writes to every object that it visits
        parts = shares(len(self.setups), self._config.workers)
        router = None if self._config.connect else self._inside
        for number, part in enumerate(parts):
            who = f"worker {number + 1} of {len(parts)} ({_listed(self._names, part)})"
            self._workers.append(self._start(who, partial(serve_robots, self._config, Share(part, router))))
        gc.unfreeze()

    def _open(self) -> _Worker:
        config, listen, guard = self._config, self._listen, self._guard
        if not config.connect:
            listen, place = [*listen, self._inside], config.namespace or ""
            access = with_robots_behind(guard["access_control"], self._names, place, protocol(self._inside))
            guard = {**guard, "access_control": access}
        do = partial(serve_router, config, self._names, listen, guard)
        return self._start("the process that clients connect to", do)

    def _start(self, who: str, do: Callable[[ParentPipe], None]) -> _Worker:
        ours, theirs = multiprocessing.Pipe()
        # A process that keeps another process's pipe open would hide the first process's end from that one.
        rest = [ours, *(worker.pipe for worker in self._front + self._workers)]
        context = multiprocessing.get_context("fork")
        process = context.Process(target=_begin, args=(do, theirs, rest, self._folder))
        process.start()
        theirs.close()
        return _Worker(who, process, ours)

    def _made(self, worker: _Worker) -> WorkerMade:
        news = self._news(worker)
        if isinstance(news, WorkerMade):
            return news
        if isinstance(news, WorkerRefused) and news.misuse:
            raise StartError(news.why)
        raise WorkersError(self._why(worker, news))

    def _news(self, worker: _Worker) -> News | None:
        try:
            news: News = worker.pipe.recv()
        except (EOFError, OSError):
            return None
        if isinstance(news, WorkerEnded):
            worker.ended = news
            self.recordings += news.recordings
        return news

    def _why(self, worker: _Worker, news: News | None) -> str:
        if isinstance(news, WorkerRefused):
            return news.why
        if isinstance(news, WorkerEnded) and news.failure is not None:
            return news.failure
        worker.process.join(END)
        code = worker.process.exitcode
        how = (
            f"was ended by {signal.Signals(-code).name}"
            if code and code < 0
            else f"ended with exit code {code}"
        )
        return f"{worker.who} {how}"

    def _end(self, worker: _Worker) -> list[str]:
        """Wait for the end of a process that was told to end; return failures."""
        already = worker.ended is not None or not worker.process.is_alive()
        while worker.ended is None and worker.pipe.poll(END) and self._news(worker) is not None:
            pass
        worker.process.join(END)
        if worker.process.is_alive():
            worker.process.kill()
            worker.process.join()
            return [f"{worker.who} did not end within {END:g} s and was killed"]
        failure = None if worker.ended is None else worker.ended.failure
        return [] if failure is None or already else [failure]


def _begin(
    do: Callable[[ParentPipe], None], first: Connection, others: Sequence[Connection], folder: OwnFolder
) -> None:
    """Run in a new process: close the pipes of other processes, ignore signals, then do the work."""
    for end in others:
        end.close()
    Shutdown().close()  # from now on a signal ends only the first process
    do(ParentPipe(first, folder.remove))


def _rehearse(setup: Setup) -> None:
    """Compile and load what a robot needs, so that forked processes share it; creates no plug-in arm."""
    setup = replace(setup, plant=None)
    warm_up()
    Planner(setup).rehearse_scripts()
    Host(Controller(setup)).tick()


def _listed(names: Sequence[str], part: range) -> str:
    first, last = names[part[0]], names[part[-1]]
    return first if len(part) == 1 else f"{first}, {last}" if len(part) == 2 else f"{first} to {last}"
