"""The client of a robot in process: deterministic, in the caller's own thread."""

import asyncio

import numpy as np
import pytest

from tvist_client import LoopbackTransport, MisuseError, NotConnectedError, RefusedError, Robot
from tvist_client.connection import CHUNK
from tvist_client.errors import MotionStoppedError, StreamStoppedError, UnexpectedReplyError
from tvist_protocol import commands as c
from tvist_protocol import motions as m
from tvist_protocol.codec import encode
from tvist_protocol.replies import Done
from tvist_protocol.simulation import SimulationStep

from .conftest import NEAR

SLOW = (0.1, 0.0, 0.0, 0.0, 0.0, 0.0)  # velocities of a motion that is guided


def steps(host):
    return [command.ticks for command in host.commands if isinstance(command, SimulationStep)]


async def test_a_move_steps_a_deterministic_number_of_ticks(host, robot):
    async with robot.control("me") as arm:
        motion = await arm.move_j(NEAR)
        assert (motion.id, motion.started, motion.ended) == (1, 1, True)
        assert set(steps(host)) == {CHUNK}
        assert sum(steps(host)) - CHUNK < motion.done <= sum(steps(host)) == host.controller.tick_number
        assert (await robot.state()).target_q == pytest.approx(NEAR)


@pytest.mark.parametrize("kind", ["move_j", "speed_j"])
async def test_a_stopped_motion_raises_with_its_event(robot, kind):
    async with robot.control("me") as arm:
        motion = await (arm.move_j(NEAR, wait=False) if kind == "move_j" else arm.speed_j(SLOW))
        assert (motion.started, motion.done, motion.ended) == (None, None, False)
        assert await robot.advance(5) == 5
        assert motion.started == 1
        await arm.stop()
        with pytest.raises(MotionStoppedError, match=r"motion 1 was stopped at tick \d+: ") as raised:
            await motion.wait()
        assert raised.value.event.id == 1
        assert motion.stopped == raised.value.event


async def test_states_events_and_truths_arrive_in_order(host, robot):
    seen = []
    robot.on_state(lambda state: seen.append(("state", state.tick)))
    robot.on_truth(lambda truth: seen.append(("truth", truth.tick)))
    robot.on_event(lambda event: seen.append((event.kind, event.tick)))
    async with robot.control("me") as arm:
        motion = await arm.move_j(NEAR)
    everything = range(1, host.controller.tick_number + 1)
    passed = [(kind, tick) for tick in everything for kind in ("state", "truth")]
    assert [one for one in seen if one[1] and one[0] in {"state", "truth"}] == passed
    assert {("motion_started", 1), ("motion_done", motion.done)} <= set(seen)
    ticks = [tick for _, tick in seen]
    assert ticks == sorted(ticks)


async def test_only_the_client_in_control_steps_time_in_steps_of_a_thousand_ticks(host, robot):
    with pytest.raises(MisuseError, match="control"):
        await robot.advance(1)
    async with robot.control("me"):
        assert await robot.advance(2500) == 2500
    assert steps(host) == [1000, 1000, 500]
    with pytest.raises(MisuseError):
        await robot.advance(1)


@pytest.mark.parametrize(("period", "ticks"), [(0.002, 1), (0.008, 4)])
async def test_step_through_plays_one_set_point_per_period_and_numbers_them(host, robot, period, ticks):
    seen = []
    async with robot.control("me") as arm:
        q = (await robot.state()).target_q
        robot.on_state(lambda state: seen.append(state.setpoint_sequence))
        async with arm.servo(period=period) as servo:
            await servo.step_through([[q[0] + 1e-5 * k, *q[1:]] for k in range(1500 // ticks)])
            await servo.step_through([[q[0] + 1e-5 * (1500 // ticks), *q[1:]]])
            count = servo.sequence
            numbered = [sequence for sequence in seen if sequence is not None]
    assert count == 1500 // ticks + 1
    assert numbered == sorted(numbered)
    assert set(numbered) == set(range(count))
    assert {numbered.count(number) for number in range(1, count - 1)} == {ticks}
    assert max(steps(host)) == (1000 if ticks == 1 else CHUNK)


@pytest.mark.parametrize("more", [True, False])
async def test_a_stream_ended_by_the_robot_raises_an_error(robot, more):
    async def stream(arm):
        async with arm.servo() as servo:
            await servo.step_through([(await robot.state()).target_q])
            await robot.stop()
            await robot.advance(50)
            if more:
                servo.set(NEAR)

    async with robot.control("me") as arm:
        with pytest.raises(StreamStoppedError, match=r"ended at tick \d+: a stop was commanded"):
            await stream(arm)


async def test_an_error_in_a_stream_is_raised_and_control_is_released(host, robot):
    async def stream(arm):
        async with arm.servo() as servo:
            with pytest.raises(MisuseError, match="no set-points"):
                await servo.step_through([])
            await servo.step_through([(await robot.state()).target_q])
            await robot.stop()
            await robot.advance(50)
            raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        async with robot.control("me") as arm:
            await stream(arm)
    assert host.holder is None


async def test_a_refusal_carries_the_reply_and_keeps_control(host, robot):
    async with robot.control("me") as arm:
        with pytest.raises(RefusedError, match="limit_position: ") as raised:
            await arm.move_j([9.0] * 6)
        assert (raised.value.reply.where, raised.value.reply.limit) == ("q[0]", pytest.approx(2 * np.pi))
        await arm.move_j(NEAR)
        assert await robot.request(c.KeepAlive(token=arm.token)) == Done()
        host.controller.receive(c.ReleaseControl(token=arm.token))
        host.controller.receive(c.TakeControl(client="another"))
        with pytest.raises(RefusedError, match=r"stale_token|no_control"):
            await arm.keep_alive()
    assert host.holder == "another"
    with pytest.raises(RefusedError, match="another"):
        async with robot.control("me"):
            pass


async def test_a_guided_motion_returns_after_its_duration_while_the_arm_moves(host, robot):
    async with robot.control("me") as arm:
        motion = await arm.speed_j(SLOW)
        assert (motion.id, motion.ended, host.controller.tick_number) == (1, False, 0)
        assert await arm.speed_j(SLOW, duration=0.5) is motion
        assert host.controller.tick_number == 250
        assert await arm.speed_j(SLOW, duration=1e-6) is motion
        assert host.controller.tick_number == 251
        assert not motion.ended
        await arm.stop_j()
        assert ((await robot.state()).runtime_state, motion.ended) == (1, True)
        with pytest.raises(ValueError, match="duration"):
            await arm.speed_j(SLOW, duration=0)
    assert len([one for one in host.commands if isinstance(one, m.SpeedJ)]) == 3


async def test_a_client_waits_for_ticks_stepped_by_another_client(host, robot):
    other = Robot.over(LoopbackTransport(host))
    async with other, other.clock_control("other") as clock, robot.control("me") as arm:
        with pytest.raises(RefusedError, match="'other'"):
            await robot.advance(1)
        assert (await robot.info()).stepper == "other"
        moving = asyncio.create_task(arm.speed_j(SLOW, duration=0.1))
        while not moving.done():
            await clock.step(1)
        assert 50 <= host.controller.tick_number <= 60
        assert not moving.result().ended


@pytest.mark.parametrize("answer", [b"\xc1", encode(Done()), b"\x81\xa4type\xa4what"])
async def test_an_invalid_answer_raises_an_error(host, robot, answer):
    host.answers["take_control"] = answer
    with pytest.raises(UnexpectedReplyError):
        async with robot.control("me"):
            pass


async def test_a_closed_connection_raises_errors_and_delivers_nothing(host):
    robot = Robot.over(LoopbackTransport(host))
    states = robot.states()
    async with robot.control("me"):
        await robot.advance(2)
    await robot.close()
    host.tick()
    assert [state.tick async for state in states][-2:] == [1, 2]
    for use in (robot.info, robot.stop):
        with pytest.raises(NotConnectedError, match="closed"):
            await use()
    await robot.close()
