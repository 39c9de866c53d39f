"""Equal messages at equal ticks give bit-equal states, over the network in lockstep and in process."""

import contextlib
import math

import msgspec
import pytest
from tests.conformance.served import NOT_REPEATED, Served
from tests.conformance.wire import Q1

from tvist_client.errors import StreamStoppedError
from tvist_client.robot import Robot
from tvist_lab.collect import collect
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_protocol.errors import RefusedError

NEAR = [0.1, -3.0, 0.1, -1.5, 0.05, -0.05]
FAR = [1.2, -2.0, 1.0, -1.8, 0.4, 0.5]


async def script(robot):
    """Move the arm in different ways; return the messages of the robot."""
    with collect(robot) as told:
        async with robot.control("script") as arm:
            await arm.reset(q=Q1, seed=3)
            await arm.move_j(NEAR)
            await arm.set_shaper("zvd")
            motion = await arm.move_j(FAR, velocity=1.0, wait=False)
            await robot.advance(200)
            await arm.stop()
            await robot.rest()
            assert motion.stopped is not None
            await arm.reset(q=NEAR, seed=4, shaper="ei")
            async with arm.servo() as servo:
                await servo.step_through(swing(n * 0.002) for n in range(150))
            await arm.set_estimator("fixed", f_d=8.0, zeta=0.2)
            with contextlib.suppress(RefusedError, StreamStoppedError):  # the stream has already ended
                async with arm.servo(period=0.008) as servo:
                    await servo.step_through(swing(n * 0.008) for n in range(50))
                    await arm.stop(deceleration=3.0)
            await robot.rest()
            await arm.set_estimator("polynomial")
            await arm.set_payload(3.0, (0.0, 0.0, 0.05), (0.01, 0.0, 0.0, 0.01, 0.0, 0.01))
            await arm.move_j(Q1)
            await robot.advance(100)
    return told


def swing(t):
    """Return a sine around NEAR that fades in."""
    offset = 0.1 * min(1.0, t) ** 2 * math.sin(2.0 * math.pi * t)
    return [angle + offset for angle in NEAR]


async def test_lockstep_over_the_network_and_in_process_give_bit_equal_states():
    with Served("--clock", "lockstep", "--truth", constants=NOT_REPEATED) as served:
        async with await Robot.connect(served.endpoint) as robot:
            one = await script(robot)
    async with robot_in_process(free_setup()) as robot:
        other = await script(robot)
    assert [state.tick for state in one.states] == [state.tick for state in other.states]
    for before, after in zip(one.states, other.states, strict=True):
        if before != after:  # equality of floats: to the last bit, but for the sign of zero
            fields = before.__struct_fields__
            differ = [name for name in fields if getattr(before, name) != getattr(after, name)]
            pytest.fail(f"tick {before.tick}: {differ} differ")
    assert msgspec.json.encode(one.states) == msgspec.json.encode(other.states)
    assert one.events == other.events
    assert one.truths == other.truths
    ticks = [state.tick for state in one.states]
    assert ticks == list(range(ticks[0], ticks[-1] + 1))
    assert {event.kind for event in one.events} == {
        "motion_started", "motion_done", "motion_stopped", "stream_stopped", "shaper_changed", "warning",
    }  # fmt: skip
    assert max(state.target_q[0] for state in one.states) > 0.2
