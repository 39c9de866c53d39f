"""The client of a robot in process: deterministic, in the caller's own thread."""

import numpy as np
import pytest

from tvist_client import (
    LoopbackTransport,
    MisuseError,
    MotionStoppedError,
    NotConnectedError,
    RefusedError,
    Robot,
    StreamStoppedError,
    UnexpectedReplyError,
    make_payload,
)
from tvist_client.connection import CHUNK
from tvist_protocol import commands as c
from tvist_protocol.codec import encode
from tvist_protocol.commands import KeepAlive
from tvist_protocol.replies import Done
from tvist_protocol.simulation import SimulationInject, SimulationReset, SimulationStep

Q = (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)


async def test_a_move_is_waited_for_by_letting_a_deterministic_number_of_ticks_pass(fake, free):
    async with free.control("me") as arm:
        motion = await arm.move_j(Q)
        assert (motion.id, motion.started, motion.done) == (1, 1, 120)
        assert motion.ended
        assert fake.tick == 3 * CHUNK
        assert (await free.state()).target_q == list(Q)


async def test_a_move_that_is_not_waited_for_can_be_waited_for_later(fake, free):
    async with free.control("me") as arm:
        motion = await arm.move_j(Q, wait=False)
        assert (motion.started, motion.done, motion.ended) == (1, None, False)
        assert await free.advance(10) == 10
        assert (await motion.wait()).done == 120


async def test_a_stopped_motion_raises_with_its_event(fake, free):
    async with free.control("me") as arm:
        motion = await arm.move_j(Q, wait=False)
        await free.advance(5)
        await arm.stop()
        with pytest.raises(MotionStoppedError, match="motion 1 was stopped at tick 6: a stop") as raised:
            await motion.wait()
        assert raised.value.event.id == 1
        assert motion.stopped == raised.value.event


async def test_anyone_may_stop(fake, free):
    await free.stop()
    assert fake.commands == [c.Stop()]


async def test_every_state_event_and_truth_comes_in_order_while_time_passes(free):
    seen = []
    free.on_state(lambda state: seen.append(("state", state.tick)))
    free.on_truth(lambda truth: seen.append(("truth", truth.tick)))
    free.on_event(lambda event: seen.append((event.kind, event.tick)))
    async with free.control("me") as arm:
        await arm.move_j(Q)
    ticks = [("state", t) if k == 0 else ("truth", t) for t in range(1, 151) for k in (0, 1)]
    ticks.insert(0, ("motion_started", 1))
    ticks.insert(ticks.index(("state", 120)), ("motion_done", 120))
    assert seen == ticks


async def test_advance_steps_in_chunks_of_at_most_a_thousand(fake, free):
    async with free.control("me"):
        assert await free.advance(2500) == 2500
    assert [x.ticks for x in fake.commands if isinstance(x, SimulationStep)] == [1000, 1000, 500]


async def test_time_passes_only_for_who_holds_control(free):
    with pytest.raises(MisuseError, match="control"):
        await free.advance(1)
    async with free.control("me"):
        await free.advance(1)
    with pytest.raises(MisuseError):
        await free.advance(1)


async def test_a_host_that_tells_no_state_before_the_first_tick_is_said_to_tell_none(free):
    with pytest.raises(MisuseError, match="advance"):
        await free.state()
    async with free.control("me"):
        await free.advance(3)
        assert (await free.state()).tick == 3


async def test_setpoints_are_stepped_through_one_a_tick_and_numbered_on(fake, free):
    async with free.control("me") as arm:
        async with arm.servo() as servo:
            await servo.step_through([[k / 1000.0] * 6 for k in range(1500)])
            await servo.step_through([[2.0] * 6])
            assert servo.sequence == 1501
        assert [(tick, sequence) for tick, sequence, _ in fake.setpoints] == [(k, k) for k in range(1501)]
        steps = [x.ticks for x in fake.commands if isinstance(x, SimulationStep)]
        assert steps == [1000, 500, 1, CHUNK]  # the last one to see the arm at rest


async def test_slow_setpoints_last_their_period(fake, free):
    async with free.control("me") as arm, arm.servo(period=0.008) as servo:
        assert await servo.step_through([Q] * 5) == 20
    assert [(tick, sequence) for tick, sequence, _ in fake.setpoints] == [(4 * k, k) for k in range(5)]


async def test_a_stream_the_robot_ended_is_said_to_have_ended(fake, free):
    async def stream(arm, why, more):
        async with arm.servo() as servo:
            fake.end_stream(why)
            if more:
                servo.set(Q)

    async with free.control("me") as arm:
        for more in (True, False):
            with pytest.raises(StreamStoppedError, match="ended at tick 1: a reason"):
                await stream(arm, "a reason", more)
    assert not fake.setpoints


async def test_an_error_inside_a_stream_is_the_one_that_comes_out(fake, free):
    async def stream(arm):
        async with arm.servo() as servo:
            with pytest.raises(MisuseError, match="no set-points"):
                await servo.step_through([])
            fake.end_stream("gone already")
            raise KeyError("mine")

    async with free.control("me") as arm:
        with pytest.raises(KeyError, match="mine"):
            await stream(arm)


async def test_refusals_carry_the_reply_and_end_neither_control_nor_the_robot(fake, free):
    async with free.control("me") as arm:
        with pytest.raises(RefusedError, match="limit_position: too far") as raised:
            await arm.move_j([9.0] * 6)
        assert (raised.value.reply.where, raised.value.reply.limit) == ("q[0]", 6.3)
        await arm.move_j(Q)
        fake.token = "another"
        with pytest.raises(RefusedError, match="stale_token"):
            await arm.keep_alive()
    assert fake.holder == "me"  # released with a stale token: not ours any more


async def test_control_held_by_another_is_refused_with_its_name(fake, free):
    fake.holder = "the other"
    with pytest.raises(RefusedError, match="the other"):
        async with free.control("me"):
            pass


async def test_control_is_released_when_the_block_fails(fake, free):
    with pytest.raises(ZeroDivisionError):
        async with free.control("me"):
            raise ZeroDivisionError
    assert fake.holder is None


async def test_arrays_and_their_numbers_are_taken_wherever_numbers_are(fake, free):
    one = np.float64(1.0)
    async with free.control("me", lease_s=np.float32(20)) as arm:
        await arm.move_j(np.array(Q, dtype=np.float32), velocity=one, acceleration=one, jerk=one)
        async with arm.servo(period=np.float64(0.002), velocity=one) as servo:
            servo.set(np.zeros(6))
            await servo.step_through(np.zeros((3, 6)))
        await arm.step(np.int64(3))
        await arm.set_shaper("zv", modes=np.int64(1))
        await arm.set_estimator("fixed", f_d=np.array([6.7]), zeta=np.float64(0.34))
        await arm.set_payload(one, np.zeros(3), np.zeros(6))
        await arm.reset(np.zeros(6), seed=np.int64(4), payload=make_payload(one, np.zeros(3), np.zeros(6)))
        await arm.stop(one)
    estimator = next(x for x in fake.commands if isinstance(x, c.SetEstimator))
    assert (estimator.f_d, estimator.zeta) == ((6.7,), (0.34,))


async def test_what_is_said_reaches_the_robot_as_it_was_said(fake, free):
    payload = make_payload(2.0, (0.1, 0.0, 0.0), range(6))
    async with free.control("me", lease_s=7) as arm:
        await arm.set_estimator("polynomial", calibration="paper")
        await arm.set_estimator("polynomial", calibration={"a": 1})
        assert await arm.reset(Q, seed=3, payload=payload, mode="RUNNING", shaper="zvd") == 0
        await arm.stop(2.5)
        await arm.pause()
        await arm.resume()
        await arm.set_speed(1)
        await arm.power_off()
        await arm.power_on()
        await arm.inject("torque", joint=1, seconds=1, value=-30)
        await arm.unlock_protective_stop()
        await arm.restart_safety()
        await arm.hand_over("you")
    token = "me#1"
    assert fake.commands == [
        c.TakeControl(client="me", lease_s=7.0),
        c.SetEstimator(token=token, name="polynomial", calibration="paper"),
        c.SetEstimator(token=token, name="polynomial", calibration={"a": 1}),
        SimulationReset(token=token, q=Q, seed=3, payload=payload, mode="RUNNING", shaper="zvd"),
        c.Stop(token=token, deceleration=2.5),
        c.Pause(token=token),
        c.Resume(token=token),
        c.SetSpeed(token=token, fraction=1.0),
        c.PowerOff(token=token),
        c.PowerOn(token=token),
        SimulationInject(token=token, fault="torque", joint=1, seconds=1.0, value=-30.0),
        c.UnlockProtectiveStop(token=token),
        c.RestartSafety(token=token),
        c.HandOver(token=token, client="you"),
        c.ReleaseControl(token=token),
    ]


async def test_any_command_of_the_protocol_can_be_sent(fake, free):
    async with free.control("me") as arm:
        assert await free.request(KeepAlive(token=arm.token)) == Done()


@pytest.mark.parametrize("answer", [b"", b"\xc1", encode(Done()), b"\x81\xa4type\xa4what"])
async def test_an_answer_that_is_none_is_an_error_that_says_so(fake, free, answer):
    fake.answers["take_control"] = answer or b"\x80"
    with pytest.raises(UnexpectedReplyError):
        async with free.control("me"):
            pass


async def test_a_closed_robot_says_that_it_is_closed_and_hears_nothing_more(fake):
    robot = Robot.over(LoopbackTransport(fake))
    states = robot.states()
    async with robot.control("me"):
        await robot.advance(2)
    await robot.close()
    fake.pass_tick()
    assert [state.tick async for state in states] == [1, 2]
    for use in (robot.info, robot.stop):
        with pytest.raises(NotConnectedError, match="closed"):
            await use()
    await robot.close()
