"""What a tab of the live page may ask costs the robots little, and ends with the tab."""

import asyncio
import json
from contextlib import asynccontextmanager

import pytest
from tests.view.test_pilot import Realtime

from tvist_lab.in_process import free_setup, robot_in_process
from tvist_view import live, shown_robot

ROBOTS = ["a", "b", "c"]


class Tab:
    """A tab that says what a test puts into its queue; None: it closes."""

    number = 1

    def __init__(self):
        self.says, self.hears = asyncio.Queue(), asyncio.Queue()

    async def send(self, kind, content):
        self.hears.put_nowait((kind, content))

    async def heard(self, kind):
        while (told := await self.hears.get())[0] != kind:
            pass
        return told[1]

    def ask(self, **message):
        self.says.put_nowait(json.dumps(message))

    async def __aiter__(self):
        while (text := await self.says.get()) is not None:
            yield text


@pytest.fixture
async def page(monkeypatch):
    """A page of three robots, and those of them to which it is connected."""
    connected = {}

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
        return ROBOTS

    monkeypatch.setattr(shown_robot.Robot, "connect", connect)
    monkeypatch.setattr(shown_robot, "robots_at", robots_at)
    shown = live.LivePage(shown_robot.Place("tcp/nowhere"), "a", None)
    running = asyncio.create_task(shown.run())
    yield shown, connected
    running.cancel()
    await asyncio.wait([running])


async def test_a_page_is_connected_to_the_robots_that_tabs_show_and_to_no_other_name(page, monkeypatch):
    shown, connected = page
    tab = Tab()
    meeting = asyncio.create_task(shown.meet(tab))
    assert (await tab.heard("robot"))["robots"] == ROBOTS
    for number in range(2000):
        tab.ask(do="robot", name=f"r{number}")
    for name in "bc":
        tab.ask(do="robot", name=name)
        while (await tab.heard("robot"))["name"] != name:
            pass
        assert set(connected) == {"a", name}
    monkeypatch.setattr(live, "MOST_SHOWN", 2)
    tab.ask(do="robot", name="b")
    while "most at once" not in (await tab.heard("notice"))["text"]:
        pass
    tab.says.put_nowait(None)
    await meeting
    assert set(connected) == {"a"}


async def test_what_a_tab_has_asked_for_ends_with_it(page):
    shown, connected = page
    tab = Tab()
    meeting = asyncio.create_task(shown.meet(tab))
    await tab.heard("robot")
    for _ in range(100):
        tab.ask(do="take")
    tab.says.put_nowait(None)
    await meeting
    assert (await connected["a"].info()).control is None
