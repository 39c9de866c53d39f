"""Control for the tabs of a page, against a robot in process that stands in for one in real time."""

import asyncio
from contextlib import asynccontextmanager

import pytest

from tvist_lab.in_process import free_setup, robot_in_process
from tvist_protocol.errors import RefusedError
from tvist_view.pilot import DEADMAN_S, Pilot


class Realtime:
    """A robot that claims to run in real time, so that tabs can take control; its time stands still."""

    def __init__(self, robot):
        self._robot = robot
        self.stops, self.gate = 0, asyncio.Event()
        self.gate.set()

    def __getattr__(self, name):
        return getattr(self._robot, name)

    async def clock(self):
        return "realtime"

    async def stop(self):
        self.stops += 1
        await self._robot.stop()

    @asynccontextmanager
    async def control(self, client):
        await self.gate.wait()
        async with self._robot.control(client) as arm:
            yield arm


@pytest.fixture
async def robot():
    async with robot_in_process(free_setup()) as free:
        yield Realtime(free)


@pytest.fixture
def said():
    return []


@pytest.fixture
def pilot(robot, said):
    return Pilot(robot, "view", said.append)


async def control(robot):
    return (await robot.info()).control


async def test_one_tab_has_control_until_it_gives_it_back(robot, pilot, said):
    assert all(await asyncio.gather(pilot.take(1), pilot.take(1)))  # a double click takes it once
    assert await control(robot) == "view"
    assert not await pilot.take(2)
    assert "another tab" in said[-1]
    await pilot.give_back(2)
    assert pilot.holder == 1
    await pilot.give_back(1)
    assert (pilot.holder, await control(robot)) == (None, None)


async def test_tab_that_closes_while_taking_control_does_not_keep_it(robot, pilot):
    robot.gate.clear()
    taking = asyncio.create_task(pilot.take(1))
    await asyncio.sleep(0)
    leaving = asyncio.create_task(pilot.give_back(1))
    await asyncio.sleep(0)
    robot.gate.set()
    await asyncio.gather(taking, leaving)
    assert (pilot.holder, await control(robot)) == (None, None)


async def test_loss_of_control_is_noticed(robot, pilot, said):
    await pilot.take(1)
    await pilot.heard("view")
    assert pilot.holder == 1
    await pilot.heard(None)
    assert pilot.holder is None
    assert "lost control" in said[-1]


async def test_control_of_another_client_is_reported(robot, pilot, said):
    async with robot._robot.control("somebody"):
        assert not await pilot.take(1)
    assert "somebody" in said[-1]


async def test_robot_in_lockstep_is_only_watched(robot, said):
    pilot = Pilot(robot._robot, "view", said.append)
    assert not await pilot.take(1)
    assert "steps the time" in said[-1]


async def test_stop_ends_a_jog_until_the_button_is_released(robot, pilot, monkeypatch):
    monkeypatch.setattr(asyncio.get_running_loop(), "time", lambda: 1000.0)
    began = []

    async def play(_arm):
        began.append(1)
        while asyncio.get_running_loop().time() < pilot._jog_until:  # noqa: ASYNC110
            await asyncio.sleep(0)

    monkeypatch.setattr(pilot, "_play_jog", play)
    await pilot.take(1)
    pilot.jog(1, 0, 1.0)
    assert not began  # a hidden tab sends one a second: each is the first
    pilot.jog(1, 0, 1.0)
    await asyncio.sleep(0)
    assert len(began) == 1
    await pilot.stop()
    assert robot.stops == 1
    for _ in range(3):
        await asyncio.sleep(0)
        pilot.jog(1, 0, 1.0)
    assert len(began) == 1
    pilot._jog_heard -= 2 * DEADMAN_S  # the button was let go
    pilot.jog(1, 0, 1.0)
    pilot.jog(1, 0, 1.0)
    await asyncio.sleep(0)
    assert len(began) == 2
    await pilot.give_back(1)


async def test_tab_without_control_cannot_jog_or_move(robot, pilot, said):
    await pilot.take(1)
    pilot.jog(2, 0, 1.0)
    pilot.jog(2, 0, 1.0)
    assert not pilot.busy
    pilot.do(2, lambda arm: arm.set_shaper("none"))
    assert not pilot.busy
    assert "does not have control" in said[-1]
    await pilot.give_back(1)


async def test_refusal_is_shown_and_has_no_other_effect(robot, pilot, said):
    await pilot.take(1)

    async def refused(arm):
        with pytest.raises(RefusedError):
            await arm.set_shaper("nonsense")
        await arm.set_shaper("nonsense")

    assert not await pilot.set(1, refused)
    assert "nonsense" in said[-1]
    assert await pilot.set(1, lambda arm: arm.set_shaper("none"))
    await pilot.give_back(1)
