"""Lines, arcs, paths, servoing, speeds and kinematics: what is sent, what is waited for, what comes back."""

import asyncio

import numpy as np
import pytest

from tvist_client import (
    ArcSegment,
    JointSegment,
    LineSegment,
    LoopbackTransport,
    MotionStoppedError,
    ProcessSegment,
    Robot,
    UnexpectedReplyError,
)
from tvist_client.blocking import Robot as BlockingRobot
from tvist_client.connection import CHUNK
from tvist_protocol import forces as f
from tvist_protocol import kinematics as k
from tvist_protocol import motions as m
from tvist_protocol.codec import check, encode
from tvist_protocol.commands import MoveJ
from tvist_protocol.replies import Accepted, Done, Posture, Refused
from tvist_protocol.simulation import SimulationStep

POSE = (0.4, 0.1, 0.5, 0.0, 3.0, 0.0)
FRAME = (1.0, 0.0, 0.0, 0.0, 0.0, 1.5)
Q = (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
ARRAY = np.array(POSE)

MOVES = {
    "move_j": (
        lambda arm: arm.move_j(Q, duration=2),
        MoveJ(token="me#1", q=Q, duration=2.0),
    ),
    "move_l": (
        lambda arm: arm.move_l(ARRAY, frame=list(FRAME), velocity=1, acceleration=2, jerk=3, duration=4),
        m.MoveL(
            token="me#1", pose=POSE, frame=FRAME, velocity=1.0, acceleration=2.0, jerk=3.0, duration=4.0
        ),
    ),
    "move_c": (
        lambda arm: arm.move_c(
            ARRAY, list(POSE), frame=FRAME, orientation="tangent", velocity=1, acceleration=2, jerk=3
        ),
        m.MoveC(
            token="me#1", via=POSE, pose=POSE, frame=FRAME, orientation="tangent", velocity=1.0,
            acceleration=2.0, jerk=3.0,
        ),
    ),
    "move_path": (
        lambda arm: arm.move_path(
            [
                LineSegment(pose=ARRAY, blend=np.float64(0.01), duration=1),
                ArcSegment(via=list(POSE), pose=ARRAY, orientation="tangent"),
                ProcessSegment(pose=list(POSE), velocity=1),
                JointSegment(q=np.array(Q), acceleration=1),
            ],
            frame=FRAME,
            jerk=50,
        ),
        m.MovePath(
            token="me#1",
            segments=(
                LineSegment(pose=POSE, blend=0.01, duration=1.0),
                ArcSegment(via=POSE, pose=POSE, orientation="tangent"),
                ProcessSegment(pose=POSE, velocity=1.0),
                JointSegment(q=Q, acceleration=1.0),
            ),
            frame=FRAME,
            jerk=50.0,
        ),
    ),
}  # fmt: skip
GUIDED = {
    "servo_j": (
        lambda arm, **more: arm.servo_j(Q, lookahead=0.05, gain=500, shaped=True, **more),
        m.ServoJ(token="me#1", q=Q, lookahead=0.05, gain=500.0, shaped=True),
    ),
    "speed_j": (
        lambda arm, **more: arm.speed_j(Q, 2, shaped=True, **more),
        m.SpeedJ(token="me#1", qd=Q, acceleration=2.0, shaped=True),
    ),
    "speed_l": (
        lambda arm, **more: arm.speed_l(ARRAY, 2, angular_acceleration=3, shaped=True, **more),
        m.SpeedL(token="me#1", xd=POSE, acceleration=2.0, angular_acceleration=3.0, shaped=True),
    ),
}
GIVING = {
    "force_mode": (
        lambda arm: arm.force_mode(
            [0, 0, 1, True, False, 0], ARRAY, limits=[0.1] * 6, frame=FRAME, frame_type=3, damping=1, gain=2
        ),
        f.ForceMode(
            token="me#1", compliant=(False, False, True, True, False, False), wrench=POSE, limits=(0.1,) * 6,
            frame=FRAME, frame_type=3, damping=1.0, gain=2.0,
        ),
    ),
    "freedrive": (
        lambda arm: arm.freedrive([1, 1, 1, 0, 0, 0], list(FRAME)),
        f.Freedrive(token="me#1", free=(True, True, True, False, False, False), frame=FRAME),
    ),
}  # fmt: skip
STOPS = {
    "end_force_mode": (lambda arm: arm.end_force_mode(), f.EndForceMode(token="me#1")),
    "stop_j": (lambda arm: arm.stop_j(3), m.StopJ(token="me#1", acceleration=3.0)),
    "stop_l": (
        lambda arm: arm.stop_l(3, angular_acceleration=4),
        m.StopL(token="me#1", acceleration=3.0, angular_acceleration=4.0),
    ),
}
QUESTIONS = {
    "inverse": (
        lambda robot: robot.inverse_kinematics(ARRAY, near=list(Q), tcp_offset=POSE, frame=FRAME),
        k.InverseKinematics(pose=POSE, near=Q, tcp_offset=POSE, frame=FRAME),
        (0.5,) * 6,
    ),
    "inverse, defaults": (
        lambda robot: robot.inverse_kinematics(POSE),
        k.InverseKinematics(pose=POSE),
        (0.5,) * 6,
    ),
    "forward": (
        lambda robot: robot.forward_kinematics(list(Q), tcp_offset=ARRAY, frame=FRAME),
        k.ForwardKinematics(q=Q, tcp_offset=POSE, frame=FRAME),
        (0.1, 0.2, 0.3, 0.4, 0.5, 0.6),
    ),
    "forward, defaults": (
        lambda robot: robot.forward_kinematics(),
        k.ForwardKinematics(),
        (0.1, 0.2, 0.3, 0.4, 0.5, 0.6),
    ),
}


def sent(fake, name):
    """The command of a type, as the robot received it."""
    (command,) = (one for one in fake.commands if type(one).__struct_config__.tag == name)
    return command


@pytest.mark.parametrize("name", GIVING)
async def test_giving_way_to_forces_is_sent_as_it_was_asked_for(fake, free, name):
    call, wanted = GIVING[name]
    async with free.control("me") as arm:
        motion = await call(arm)
        await arm.zero_ftsensor()
    assert motion.id == 1
    assert sent(fake, name) == wanted
    assert sent(fake, "zero_ftsensor") == f.ZeroFtsensor(token="me#1")


@pytest.mark.parametrize("name", MOVES)
async def test_a_motion_is_sent_as_it_was_asked_for_and_waited_for(fake, free, name):
    call, wanted = MOVES[name]
    async with free.control("me") as arm:
        motion = await call(arm)
    assert sent(fake, name) == check(wanted)
    assert (motion.id, motion.started, motion.done) == (1, 1, 120)
    assert fake.tick == 3 * CHUNK


@pytest.mark.parametrize("name", MOVES | GUIDED)
def test_the_blocking_client_sends_the_same(fake, name):
    call, wanted = (MOVES | GUIDED)[name]
    with BlockingRobot.over(LoopbackTransport(fake)) as robot, robot.control("me") as arm:
        assert call(arm).done == (120 if name in MOVES else None)
    assert sent(fake, name) == check(wanted)


async def test_a_motion_need_not_be_waited_for_and_its_stop_is_told(fake, free):
    async with free.control("me") as arm:
        for begin in (
            lambda: arm.move_l(POSE, wait=False),
            lambda: arm.move_c(POSE, POSE, wait=False),
            lambda: arm.move_path([LineSegment(pose=POSE)], wait=False),
        ):
            motion = await begin()
            assert not motion.ended
            await arm.stop_j()
            with pytest.raises(MotionStoppedError):
                await motion


@pytest.mark.parametrize("name", GUIDED)
async def test_a_guided_motion_is_sent_as_it_was_asked_for_and_returned_at_once(fake, free, name):
    call, wanted = GUIDED[name]
    async with free.control("me") as arm:
        motion = await call(arm)
        assert (motion.id, motion.ended, fake.tick) == (1, False, 0)
    assert sent(fake, name) == check(wanted)


@pytest.mark.parametrize("name", GUIDED)
async def test_with_a_duration_it_returns_after_that_and_the_arm_still_moves(fake, free, name):
    call, _ = GUIDED[name]
    async with free.control("me") as arm:
        motion = await call(arm, duration=0.5)
        assert fake.tick == 250
        assert await call(arm, duration=1e-6) is motion
        assert fake.tick == 251
        assert not motion.ended


@pytest.mark.parametrize("name", STOPS)
async def test_a_stop_returns_when_the_arm_rests(fake, free, name):
    call, wanted = STOPS[name]
    async with free.control("me") as arm:
        motion = await arm.speed_j(Q)
        await call(arm)
        assert (await free.state()).runtime_state == 1
        assert motion.ended
    assert sent(fake, name) == check(wanted)


@pytest.mark.parametrize("name", STOPS)
def test_the_blocking_client_stops_the_same(fake, name):
    call, wanted = STOPS[name]
    with BlockingRobot.over(LoopbackTransport(fake)) as robot, robot.control("me") as arm:
        arm.speed_l(POSE)
        call(arm)
    assert sent(fake, name) == check(wanted)


async def test_in_real_time_a_duration_is_waited_for(realtime, endpoint):
    async with await Robot.connect(endpoint) as robot, robot.control("me") as arm:
        before = (await robot.state()).tick
        await arm.speed_j(Q, duration=0.1)
        assert (await robot.state()).tick >= before + 50
        await arm.stop_j()


async def test_where_another_client_steps_its_ticks_are_waited_for(fake, free):
    fake.told["stepper"] = "other"
    fake.answers["simulation.step"] = encode(
        Refused(code="no_control", where="", why="'other' has the clock")
    )
    async with free.control("me") as arm:
        moving = asyncio.create_task(arm.speed_j(Q, duration=0.1))
        while not moving.done():
            fake.pass_tick()
            await asyncio.sleep(0)
    # The first tick passes before the command is sent.
    assert 50 <= fake.tick <= 60
    assert not moving.result().ended


@pytest.mark.parametrize("name", QUESTIONS)
async def test_questions_need_no_control_and_are_answered_by_tuples(fake, free, name):
    call, wanted, answer = QUESTIONS[name]
    assert await call(free) == answer
    assert fake.commands == [check(wanted)]


@pytest.mark.parametrize("name", QUESTIONS)
def test_the_blocking_client_asks_the_same(fake, name):
    call, wanted, answer = QUESTIONS[name]
    with BlockingRobot.over(LoopbackTransport(fake)) as robot:
        assert call(robot) == answer
    assert fake.commands == [check(wanted)]


@pytest.mark.parametrize(
    ("name", "call"),
    [(name, call) for name, (call, _) in {**MOVES, **GUIDED}.items()],
)
@pytest.mark.parametrize("answer", [Done(), Accepted(token="t"), Posture(q=Q)])
async def test_an_answer_without_a_motion_is_an_error(fake, free, name, call, answer):
    fake.answers[name] = encode(answer)
    async with free.control("me") as arm:
        with pytest.raises(UnexpectedReplyError, match=f"{name} was answered by {type(answer).__name__}"):
            await call(arm)


async def test_an_answer_of_another_kind_is_an_error(fake, free):
    fake.answers["inverse_kinematics"] = fake.answers["forward_kinematics"] = encode(Done())
    with pytest.raises(UnexpectedReplyError, match="inverse_kinematics was answered by Done"):
        await free.inverse_kinematics(POSE)
    with pytest.raises(UnexpectedReplyError, match="forward_kinematics was answered by Done"):
        await free.forward_kinematics()


async def test_a_wrong_duration_sends_nothing(fake, free):
    async with free.control("me") as arm:
        with pytest.raises(ValueError, match="duration"):
            await arm.speed_j(Q, duration=0)
    assert not any(isinstance(one, m.SpeedJ | SimulationStep) for one in fake.commands)
