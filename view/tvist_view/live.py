"""The page of robots on the network; as a client it takes the latest state and never delays a robot."""

import asyncio

import msgspec

from tvist_view import tab_messages
from tvist_view.look import Meshes
from tvist_view.request_handler import Judge
from tvist_view.shown_robot import RobotPlace, ShownRobot, Watcher
from tvist_view.stage import Tab, page

MOST_SHOWN = 8  # most robots that tabs show at once, since each takes one of a server's limited sessions


class LivePage:
    """Serves tabs: each shows one robot, and all tabs that show the same robot share its connection."""

    def __init__(self, place: RobotPlace, first: str, judge: Judge, *, factor: float = 100.0) -> None:
        self._place, self._first, self._judge = place, first, judge
        self._shown: dict[str, ShownRobot] = {}
        self.meshes = Meshes()
        self.page = page({"kind": "live", "factor": factor})

    async def run(self) -> None:
        """Look for the first robot until cancelled, even if no tab is open."""
        try:
            await self._robot(self._first).task
        finally:
            for shown in self._shown.values():
                shown.task.cancel()

    def _robot(self, name: str) -> "ShownRobot":
        if name not in self._shown:
            self._shown[name] = ShownRobot(self._place, name, self._judge, self.meshes)
        return self._shown[name]

    async def meet(self, tab: Tab) -> None:
        """Serve a tab until it is closed."""
        watcher = Watcher(tab)
        shown = self._robot(self._first)
        shown.come(watcher)
        telling = asyncio.create_task(watcher.tell())
        try:
            async for text in tab:
                try:
                    message = tab_messages.read(text)
                except msgspec.MsgspecError as error:
                    watcher.say(f"the page sent an invalid message: {error}")
                    continue
                if isinstance(message, tab_messages.Seen):
                    watcher.free = True
                elif not isinstance(message, tab_messages.Show):
                    await shown.do(watcher, message)
                elif message.name not in {self._first, *shown.robots}:
                    watcher.say(f"there is no robot {message.name}: choose one of {', '.join(shown.robots)}")
                elif message.name not in self._shown and len(self._shown) >= MOST_SHOWN:
                    watcher.say(f"tabs already show {MOST_SHOWN} robots, the maximum: close one first")
                else:
                    await self._leave(shown, watcher)
                    shown = self._robot(message.name)
                    shown.come(watcher)
        finally:
            telling.cancel()
            await self._leave(shown, watcher)

    async def _leave(self, shown: ShownRobot, watcher: Watcher) -> None:
        """Detach a tab; close the connection of a robot that no tab shows, unless it is the first one."""
        await shown.go(watcher)
        if not shown.watchers and shown.name != self._first and self._shown.get(shown.name) is shown:
            del self._shown[shown.name]
            shown.task.cancel()
            await asyncio.wait([shown.task])
