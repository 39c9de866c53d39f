"""A tab of the live page, and what it has been told."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from typing import Any, Protocol

from tvist_view.signals import Running, after_stop
from tvist_view.stage import Tab

FRAME_S = 1.0 / 30.0
"""Time between two pictures [s]."""
NOTES_EVERY = 6
"""Pictures between two looks at what the last stop was like."""


async def pictures() -> AsyncIterator[int]:
    """Count pictures from 0, each when it is due; a picture that comes too late delays those after it."""
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
    def running(self) -> Running | None:
        """What it does; None while it is away."""

    def status(self, tab: int) -> dict[str, Any] | None:
        """What the bar of a tab says; None before the first state."""


@dataclass(eq=False)
class Watcher:
    """A tab, and what it has been told."""

    tab: Tab
    robot: Watched | None = None
    waiting: list[tuple[str, dict[str, Any]]] = field(default_factory=list)
    tasks: set[asyncio.Task[Any]] = field(default_factory=set)
    """What is being done for it."""
    status: dict[str, Any] = field(default_factory=dict)
    count: int = 0
    free: bool = True
    """Whether the tab has drawn its last picture. What waits in a slow browser would delay all that comes later."""

    def put(self, kind: str, content: dict[str, Any]) -> None:
        """Have a message sent with the next picture."""
        self.waiting.append((kind, content))

    def say(self, sentence: str) -> None:
        """Say a sentence."""
        self.put("notice", {"text": sentence})

    async def tell(self) -> None:
        """Tell the tab what is new, picture by picture; a slow tab gets fewer."""
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
