"""`unlock` over a network, with a robot that does what a test tells it."""

import pytest

from tvist_client import ProtectiveStopError, Robot
from tvist_client.unlock import unlock
from tvist_protocol.codec import encode
from tvist_protocol.errors import RefusedError
from tvist_protocol.replies import Done, Refused
from tvist_protocol.stream import Event


def test_a_robot_that_is_ready_is_left_alone(realtime, endpoint):
    realtime.robot.told = {"robot_mode": 7, "safety_mode": 1}
    report = unlock(endpoint)
    assert (report.ok, report.done, report.robot) == (True, [], "ur5e")
    assert realtime.robot.commands == []


def test_a_robot_that_another_controls_is_left_alone_and_the_other_is_named(realtime, endpoint):
    realtime.robot.told = {"robot_mode": 7, "safety_mode": 3}
    realtime.robot.holder = "somebody"
    with pytest.raises(RefusedError, match="somebody"):
        unlock(endpoint)


async def test_in_real_time_an_unlock_that_does_not_hold_is_an_error_with_the_event(realtime, endpoint):
    fake = realtime.robot
    told = []

    def stop_again(_):
        for event in told:
            fake.put("event", event)
        return Done()

    async with await Robot.connect(endpoint) as robot, robot.control("me") as arm:
        await arm.unlock_protective_stop()
        # The event of the stop that is unlocked comes late; that of the next one counts.
        for why, tick in (("before", fake.tick), ("now", fake.tick + 10_000)):
            told.append(Event(tick=tick, kind="protective_stop", code="limit_torque", why=why))
        fake._unlock_protective_stop = stop_again
        with pytest.raises(ProtectiveStopError, match=r"another protective stop.*: now") as caught:
            await arm.unlock_protective_stop()
        assert caught.value.event == told[-1]
        fake.answers["unlock_protective_stop"] = encode(Refused(code="wrong_mode", where="", why="none"))
        with pytest.raises(RefusedError):
            await arm.unlock_protective_stop()
