"""Keeps the last second in memory and writes it to a file when the arm fails."""

import logging
import os
from collections import deque
from collections.abc import Callable, Mapping
from copy import copy
from pathlib import Path
from threading import Thread
from typing import Any

from tvist_controller.instruments.report import Report, Sink
from tvist_plant.user_file import named
from tvist_protocol.info import Info
from tvist_protocol.stream import Event
from tvist_server.recording import Kept, RecorderError

log = logging.getLogger(__name__)

KEPT = 500  # number of ticks kept before the failure: one second
MAX_FILES = 10
"""Largest number of files of one robot, and of logged exceptions, so that repeated failures do not fill the disk."""


class BlackBox(Sink):
    """Keeps the latest messages in memory."""

    def __init__(
        self,
        folder: Path,  # folder of the files
        info: Callable[[], Info],  # called when a file is written
        start: Mapping[str, Any],  # how the server was started, as in every recording
    ) -> None:
        self._folder, self._info, self._start = folder, info, start
        self._kept: deque[Kept] = deque()
        self._failed = False
        self._written = 0
        self._said = set[str]()

    def report(self, report: Report) -> None:
        """Keep a tick; after a failure, write the file, in which this tick is the last one."""
        kept = self._kept
        kept.append(copy(report))  # the state that others build in the original would double the size
        while kept[0].tick < report.tick - KEPT:
            kept.popleft()
        if self._failed:
            self._failed = False
            self._write(report.tick)

    def event(self, event: Event) -> None:
        self._kept.append(event)
        self._failed |= event.code == "plant_failure"

    def raised(self, error: Exception) -> None:
        """Log an exception with its traceback; log equal exceptions only once."""
        said = named(error)
        if said not in self._said and len(self._said) < MAX_FILES:
            self._said.add(said)
            log.error(
                "robot %s: the arm, a program, a study of motions or the controller has failed",
                self._info().name,
                exc_info=error,
            )

    def _keep(self, message: Kept) -> None:
        self._kept.append(message)

    truth = io = journal = _keep

    def _write(self, tick: int) -> None:
        if self._written < MAX_FILES:
            self._written += 1
            info = self._info()
            path = self._folder / f"tvist-{info.name}-{os.getpid()}-{tick}.mcap"
            messages = list(self._kept)
            Thread(
                target=self._write_file, args=(path, info, messages), name="black-box", daemon=True
            ).start()

    def _write_file(self, path: Path, info: Info, messages: list[Kept]) -> None:
        from tvist_server.recording.recorder import Recorder  # imports the MCAP library

        try:
            with Recorder(path, info, self._start, wait=True) as recorder:
                for message in messages:
                    recorder.take(message)
        except RecorderError as error:
            log.error("the last second before the failure is lost: %s", error)  # noqa: TRY400  the sentence says it
        else:
            why = (
                recorder.error
                or f"the last second before it is in {path}: look with tvist log analyze {path}"
            )
            log.error("robot %s: the arm failed; %s", info.name, why)
