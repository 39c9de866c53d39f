"""Requests of the live page's tabs occupy few robots, and end when the tab closes."""

import asyncio
import json
from contextlib import asynccontextmanager

from tests.view.test_pilot import Realtime

from tvist_lab.in_process import free_setup, robot_in_process
from tvist_view import live, shown_robot


class Tab:
    """A tab that sends what a test puts into its queue; None closes it."""

    number = 1

    def __init__(self):
        self.asks, self.hears = asyncio.Queue(), asyncio.Queue()

    async def send(self, kind, content):
        self.hears.put_nowait((kind, content))

    async def __aiter__(self):
        while (message := await self.asks.get()) is not None:
            yield json.dumps(message)


async def test_page_connects_only_to_robots_that_tabs_show(monkeypatch):
    connected, tab = {}, Tab()

    @asynccontextmanager
    async def connection(name):
        async with robot_in_process(free_setup(name=name)) as robot:
            connected[name] = Realtime(robot)
            try:
                yield connected[name]
            finally:
                del connected[name]

    async def connect(_, name, **__):
        return connection(name)

    async def robots_at(*_):
        return ["a", "b", "c"]

    async def heard(kind, text):
        while (told := await tab.hears.get())[0] != kind or text not in json.dumps(told[1]):
            pass

    monkeypatch.setattr(shown_robot.Robot, "connect", connect)
    monkeypatch.setattr(shown_robot, "robots_at", robots_at)
    monkeypatch.setattr(live, "MOST_SHOWN", 2)
    page = live.LivePage(shown_robot.RobotPlace("tcp/nowhere"), "a", None)
    running, meeting = (asyncio.create_task(one) for one in (page.run(), page.meet(tab)))
    await heard("robot", '"name": "a"')
    for name in [*(f"r{number}" for number in range(2000)), "b"]:
        tab.asks.put_nowait({"do": "robot", "name": name})
    await heard("robot", '"name": "b"')
    assert set(connected) == {"a", "b"}
    tab.asks.put_nowait({"do": "robot", "name": "c"})
    await heard("notice", "the maximum")
    tab.asks.put_nowait({"do": "robot", "name": "a"})
    for message in [*({"do": "take"} for _ in range(100)), None]:
        tab.asks.put_nowait(message)
    await meeting
    assert set(connected) == {"a"}
    assert (await connected["a"].info()).control is None
    running.cancel()
    await asyncio.wait([running])
