"""`unlock` over a network, and what becomes of an unlock that does not hold."""

import pytest

from tvist_client import ProtectiveStopError, Robot
from tvist_client.unlock import unlock
from tvist_protocol import commands as c
from tvist_protocol.errors import RefusedError
from tvist_protocol.replies import Done, Refused
from tvist_protocol.stream import Event


def test_a_robot_that_is_ready_is_left_alone(realtime, endpoint):
    report = unlock(endpoint)
    assert (report.ok, report.done, report.robot) == (True, [], "ur5e")
    assert realtime.robot.commands == []


def test_a_robot_that_another_controls_is_left_alone_and_the_other_is_named(realtime, endpoint):
    realtime.robot.told = {"robot_mode": 7, "safety_mode": 3}
    realtime.post(lambda: realtime.robot.receive(c.TakeControl(client="somebody")))
    with pytest.raises(RefusedError, match="somebody"):
        unlock(endpoint)


async def test_in_real_time_an_unlock_that_does_not_hold_is_an_error_with_the_event(realtime, endpoint):
    host, told = realtime.robot, []

    def unlocks():
        for event in told:
            host.put("event", event)
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
