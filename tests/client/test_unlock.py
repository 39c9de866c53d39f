"""`unlock` over a network, also if the robot stops again."""

import pytest

from tvist_client import ProtectiveStopError, Robot
from tvist_client.unlock import unlock
from tvist_protocol import commands as c
from tvist_protocol.errors import RefusedError
from tvist_protocol.replies import Done, Refused
from tvist_protocol.stream import Event


async def unlocked(endpoint):
    async with await Robot.connect(endpoint) as robot:
        return await unlock(robot, endpoint, "tvist unlock")


async def test_unlock_does_nothing_if_the_robot_is_ready(realtime, endpoint):
    report = await unlocked(endpoint)
    assert (report.ok, report.done, report.robot) == (True, [], "ur5e")
    assert realtime.robot.commands == []


async def test_unlock_is_refused_while_another_client_has_control(realtime, endpoint):
    realtime.robot.told = {"robot_mode": 7, "safety_mode": 3}
    realtime.post(lambda: realtime.robot.controller.receive(c.TakeControl(client="somebody")))
    with pytest.raises(RefusedError, match="somebody"):
        await unlocked(endpoint)


async def test_another_protective_stop_after_unlocking_raises_an_error(realtime, endpoint):
    host, told = realtime.robot, []

    def unlocks():
        for event in told:
            host.publish(event)
        return Done()

    host.answers["unlock_protective_stop"] = unlocks
    async with await Robot.connect(endpoint) as robot, robot.control("me") as arm:
        await arm.unlock_protective_stop()
        # The event of the stop that is unlocked comes late; that of the next one counts.
        now = (await robot.state()).tick
        for why, tick in (("before", now), ("now", now + 10_000)):
            told.append(Event(tick=tick, kind="protective_stop", code="limit_torque", why=why))
        with pytest.raises(ProtectiveStopError, match=r"another protective stop.*: now") as caught:
            await arm.unlock_protective_stop()
        assert caught.value.event == told[-1]
        host.answers["unlock_protective_stop"] = Refused(code="wrong_mode", where="", why="none")
        with pytest.raises(RefusedError):
            await arm.unlock_protective_stop()
