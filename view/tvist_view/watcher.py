"""A tab of the live page, and what has been sent to it."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from typing import Any, Protocol

from tvist_view.signals import LatestSignals, after_stop
from tvist_view.stage import Tab

FRAME_S = 1.0 / 30.0  # time between two frames [s]
NOTES_EVERY = 6  # frames between two updates of the note on the last stop


async def pictures() -> AsyncIterator[int]:
    """Count frames from 0, each when it is due; a late frame delays the following ones."""
    loop = asyncio.get_running_loop()
    count, due = 0, loop.time()
    while True:
        yield count
        count += 1
        due = max(due + FRAME_S, loop.time())
        await asyncio.sleep(due - loop.time())


class Watched(Protocol):
    """The robot that a tab shows."""

    @property
    def running(self) -> LatestSignals | None:
        """Its live data; None while the robot is away."""

    def status(self, tab: int) -> dict[str, Any] | None:
        """Return the content of a tab's status bar; None before the first state."""


@dataclass(eq=False)
class Watcher:
    """A tab, and what has been sent to it."""

    tab: Tab
    robot: Watched | None = None
    waiting: list[tuple[str, dict[str, Any]]] = field(default_factory=list)
    tasks: set[asyncio.Task[Any]] = field(default_factory=set)  # its requests that are being carried out
    status: dict[str, Any] = field(default_factory=dict)
    count: int = 0
    free: bool = True
    """Whether the tab has drawn its last frame; frames queued in a slow browser would delay everything after them."""

    def put(self, kind: str, content: dict[str, Any]) -> None:
        """Queue a message for the next frame."""
        self.waiting.append((kind, content))

    def say(self, sentence: str) -> None:
        """Show a notice."""
        self.put("notice", {"text": sentence})

    async def tell(self) -> None:
        """Send the tab what is new, frame by frame; a slow tab gets fewer frames."""
        note = ""
        async for number in pictures():
            waiting, self.waiting = self.waiting, []
            for kind, content in waiting:
                await self.tab.send(kind, content)
            robot = self.robot
            if robot is None or robot.running is None:
                continue
            if (status := robot.status(self.tab.number)) is not None and status != self.status:
                self.status = status
                await self.tab.send("status", status)
            running = robot.running
            running.update()
            if (row := running.row()) is None or running.state is None or not self.free:
                continue
            self.free = False
            if number % NOTES_EVERY == 0:
                note = after_stop(running.signals())
            state, columns = running.state, running.since(self.count)
            self.count = running.count
            await self.tab.send(
                "frame",
                {
                    "t": state.timestamp,
                    "row": [round(value, 6) for value in row],
                    "samples": columns,
                    "f_d": state.estimated_f_d[0] if state.estimated_f_d else None,
                    "zeta": state.estimated_zeta[0] if state.estimated_zeta else None,
                    "delay": state.shaper_delay,
                    "note": note,
                },
            )
