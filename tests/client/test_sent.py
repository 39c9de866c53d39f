"""What each call of the client sends, the same from both faces, and what it makes of the answer."""

import inspect
import pydoc
from itertools import product

import msgspec
import numpy as np
import pytest

from tvist_client import (
    ArcSegment,
    ArgumentError,
    Arm,
    JointSegment,
    LineSegment,
    LoopbackTransport,
    Motion,
    ProcessSegment,
    Robot,
    UnexpectedReplyError,
    blocking,
    make_payload,
)
from tvist_client.arguments import built
from tvist_client.command import Sent
from tvist_client.commands import Commands, Questions
from tvist_protocol import commands as c
from tvist_protocol import forces as f
from tvist_protocol import kinematics as k
from tvist_protocol import motions as m
from tvist_protocol.codec import check
from tvist_protocol.replies import Accepted, Done, Posture, ToolPose
from tvist_protocol.simulation import SimulationInject, SimulationReset

POSE = (0.4, 0.1, 0.5, 0.0, 3.0, 0.0)
FRAME = (1.0, 0.0, 0.0, 0.0, 0.0, 1.5)
Q = (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
ARRAY, ONE = np.array(POSE), np.float64(1.0)
PAYLOAD = make_payload(2.0, (0.1, 0.0, 0.0), range(6))
T = {"token": "?"}
MOTION, DONE = Accepted(id=1), Done(tick=0)

COMMANDS = {
    "move_j": (
        lambda arm: arm.move_j(np.array(Q, dtype=np.float32), duration=2, wait=False),
        c.MoveJ(**T, q=Q, duration=2.0), MOTION,
    ),
    "move_l": (
        lambda arm: arm.move_l(ARRAY, frame=list(FRAME), velocity=ONE, acceleration=2, jerk=3, wait=False),
        m.MoveL(**T, pose=POSE, frame=FRAME, velocity=1.0, acceleration=2.0, jerk=3.0), MOTION,
    ),
    "move_c": (
        lambda arm: arm.move_c(ARRAY, list(POSE), frame=FRAME, orientation="tangent", velocity=1, wait=False),
        m.MoveC(**T, via=POSE, pose=POSE, frame=FRAME, orientation="tangent", velocity=1.0), MOTION,
    ),
    "move_path": (
        lambda arm: arm.move_path(
            [
                LineSegment(pose=ARRAY, blend=np.float64(0.01), duration=1),
                ArcSegment(via=list(POSE), pose=ARRAY, orientation="tangent"),
                ProcessSegment(pose=list(POSE), velocity=1),
                JointSegment(q=np.array(Q), acceleration=1),
            ],
            frame=FRAME, jerk=50, wait=False,
        ),
        m.MovePath(
            **T,
            segments=(
                LineSegment(pose=POSE, blend=0.01, duration=1.0),
                ArcSegment(via=POSE, pose=POSE, orientation="tangent"),
                ProcessSegment(pose=POSE, velocity=1.0),
                JointSegment(q=Q, acceleration=1.0),
            ),
            frame=FRAME, jerk=50.0,
        ),
        MOTION,
    ),
    "servo_j": (
        lambda arm: arm.servo_j(Q, lookahead=0.05, gain=500, shaped=True),
        m.ServoJ(**T, q=Q, lookahead=0.05, gain=500.0, shaped=True), MOTION,
    ),
    "speed_j": (
        lambda arm: arm.speed_j(Q, 2, shaped=True),
        m.SpeedJ(**T, qd=Q, acceleration=2.0, shaped=True), MOTION,
    ),
    "speed_l": (
        lambda arm: arm.speed_l(ARRAY, 2, angular_acceleration=3),
        m.SpeedL(**T, xd=POSE, acceleration=2.0, angular_acceleration=3.0), MOTION,
    ),
    "force_mode": (
        lambda arm: arm.force_mode(
            [0, 0, 1, True, False, 0], ARRAY, limits=[0.1] * 6, frame=FRAME, frame_type=3, damping=1, gain=2
        ),
        f.ForceMode(
            **T, compliant=(False, False, True, True, False, False), wrench=POSE, limits=(0.1,) * 6,
            frame=FRAME, frame_type=3, damping=1.0, gain=2.0,
        ),
        MOTION,
    ),
    "freedrive": (
        lambda arm: arm.freedrive([1, 1, 1, 0, 0, 0], list(FRAME)),
        f.Freedrive(**T, free=(True, True, True, False, False, False), frame=FRAME), MOTION,
    ),
    "zero_ftsensor": (lambda arm: arm.zero_ftsensor(), f.ZeroFtsensor(**T), DONE),
    "end_force_mode": (lambda arm: arm.end_force_mode(), f.EndForceMode(**T), DONE),
    "stop_j": (lambda arm: arm.stop_j(3), m.StopJ(**T, acceleration=3.0), DONE),
    "stop_l": (
        lambda arm: arm.stop_l(3, angular_acceleration=4),
        m.StopL(**T, acceleration=3.0, angular_acceleration=4.0), DONE,
    ),
    "stop": (lambda arm: arm.stop(ONE), c.Stop(**T, deceleration=1.0), DONE),
    "pause": (lambda arm: arm.pause(), c.Pause(**T), DONE),
    "resume": (lambda arm: arm.resume(), c.Resume(**T), DONE),
    "set_speed": (lambda arm: arm.set_speed(1), c.SetSpeed(**T, fraction=1.0), DONE),
    "set_shaper": (lambda arm: arm.set_shaper("zv", modes=np.int64(1)), c.SetShaper(**T, name="zv", modes=1), DONE),
    "fixed estimator": (
        lambda arm: arm.set_estimator("fixed", f_d=np.array([6.7]), zeta=np.float64(0.34)),
        c.SetEstimator(**T, name="fixed", f_d=(6.7,), zeta=(0.34,)), DONE,
    ),
    "calibrated estimator": (
        lambda arm: arm.set_estimator("polynomial", calibration={"a": 1}),
        c.SetEstimator(**T, name="polynomial", calibration={"a": 1}), DONE,
    ),
    "set_payload": (
        lambda arm: arm.set_payload(ONE, np.zeros(3), np.zeros(6)),
        c.SetPayload(**T, mass=1.0, com=(0.0,) * 3, inertia=(0.0,) * 6), DONE,
    ),
    "reset": (
        lambda arm: arm.reset(Q, seed=np.int64(3), payload=PAYLOAD, mode="RUNNING", shaper="zvd"),
        SimulationReset(**T, q=Q, seed=3, payload=PAYLOAD, mode="RUNNING", shaper="zvd"), DONE,
    ),
    "inject": (
        lambda arm: arm.inject("torque", joint=1, seconds=1, value=-30),
        SimulationInject(**T, fault="torque", joint=1, seconds=1.0, value=-30.0), DONE,
    ),
    "power_off": (lambda arm: arm.power_off(), c.PowerOff(**T), DONE),
    "power_on": (lambda arm: arm.power_on(), c.PowerOn(**T), DONE),
    "unlock_protective_stop": (lambda arm: arm.unlock_protective_stop(), c.UnlockProtectiveStop(**T), DONE),
    "restart_safety": (lambda arm: arm.restart_safety(), c.RestartSafety(**T), DONE),
    "hand_over": (lambda arm: arm.hand_over("you"), c.HandOver(**T, client="you"), DONE),
}  # fmt: skip
POSTURE, TOOL = Posture(q=(0.5,) * 6), ToolPose(pose=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6))
QUESTIONS = {
    "inverse": (
        lambda robot: robot.inverse_kinematics(ARRAY, near=list(Q), tcp_offset=POSE, frame=FRAME),
        k.InverseKinematics(pose=POSE, near=Q, tcp_offset=POSE, frame=FRAME), POSTURE,
    ),
    "inverse, defaults": (
        lambda robot: robot.inverse_kinematics(POSE), k.InverseKinematics(pose=POSE), POSTURE,
    ),
    "forward": (
        lambda robot: robot.forward_kinematics(list(Q), tcp_offset=ARRAY, frame=FRAME),
        k.ForwardKinematics(q=Q, tcp_offset=POSE, frame=FRAME), TOOL,
    ),
    "forward, defaults": (lambda robot: robot.forward_kinematics(), k.ForwardKinematics(), TOOL),
}  # fmt: skip
"""What is called, what is sent, and what is answered."""


def tag(command):
    return type(command).__struct_config__.tag


def sent(host, wanted):
    """The command of a type, as the robot received it; any token counts as the one of the table."""
    (command,) = (one for one in host.commands if type(one) is type(wanted))
    return command if getattr(wanted, "token", None) is None else msgspec.structs.replace(command, **T)


@pytest.mark.parametrize("name", COMMANDS)
async def test_a_method_sends_its_command(host, robot, name):
    call, wanted, host.answers[tag(COMMANDS[name][1])] = COMMANDS[name]
    async with robot.control("me") as arm:
        await call(arm)
    assert sent(host, wanted) == check(wanted)


@pytest.mark.parametrize("name", QUESTIONS)
async def test_kinematics_need_no_control_and_return_tuples(host, robot, name):
    call, wanted, host.answers[tag(QUESTIONS[name][1])] = QUESTIONS[name]
    (answer,) = msgspec.structs.astuple(QUESTIONS[name][2])
    assert await call(robot) == answer
    assert host.commands == [check(wanted)]


def test_the_blocking_client_sends_the_same_commands(host):
    with blocking.Robot.over(LoopbackTransport(host)) as robot, robot.control("me") as arm:
        for name, (call, wanted, answer) in (COMMANDS | QUESTIONS).items():
            host.answers, host.commands = {tag(wanted): answer}, []
            call(robot if name in QUESTIONS else arm)
            assert sent(host, wanted) == check(wanted), name
        host.answers = {}


@pytest.mark.parametrize(
    ("name", "reply"), [("move_j", Done()), ("move_l", Accepted(token="t")), ("inverse", Done())]
)
async def test_an_answer_of_another_type_raises_an_error_naming_both_types(host, robot, name, reply):
    call, wanted, _ = (COMMANDS | QUESTIONS)[name]
    host.answers[tag(wanted)] = reply
    async with robot.control("me") as arm:
        with pytest.raises(
            UnexpectedReplyError, match=f"{tag(wanted)} was answered by {type(reply).__name__}"
        ):
            await call(robot if name in QUESTIONS else arm)


SENT = {
    name: member
    for owner in (Commands, Questions)
    for name, member in vars(owner).items()
    if type(member) is Sent
}
POSITIONAL = """
    forward_kinematics(q) force_mode(compliant,wrench) freedrive(free,frame) hand_over(client) inject(fault)
    inverse_kinematics(pose) load_program(name,text) move_c(via,pose) move_j(q) move_l(pose) move_path(segments)
    reset(q) run_program(text) servo_j(q) set_estimator(name) set_payload(mass,com,inertia)
    set_registers(bank,values,first) set_shaper(name,modes) set_speed(fraction) set_tcp(offset) speed_j(qd,acceleration)
    speed_l(xd,acceleration) stop(deceleration) stop_j(acceleration) stop_l(acceleration)
"""
"""Arguments that programs may give without their names."""


def test_help_describes_every_argument_of_a_command():
    for name, owner in product(SENT, (Arm, blocking.Arm, Robot, blocking.Robot)):
        method = getattr(owner, name, None)
        if method is not None and (owner, name) not in {(Robot, "stop"), (blocking.Robot, "stop")}:
            arguments = list(inspect.signature(method).parameters)[1:]
            assert all(f"    {argument}: " in method.__doc__ for argument in arguments)
            assert "null" not in method.__doc__
            assert "RefusedError: " in pydoc.render_doc(method)


def test_positional_arguments_stay_positional():
    found = {}
    for name, method in SENT.items():
        parameters = list(inspect.signature(method).parameters.values())[1:]
        places = [one.name for one in parameters if one.kind is one.POSITIONAL_OR_KEYWORD]
        if places:
            found[name] = f"{name}({','.join(places)})"
    assert sorted(found.values()) == sorted(POSITIONAL.split())


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda arm: arm.move_j(), r"move_j\(\): missing a required argument: 'q'"),
        (lambda arm: arm.move_j([0.0] * 6, 1.5), r"move_j\(\): too many positional arguments"),
        (lambda arm: arm.move_j(Q, speed=1), r"move_j\(\): got an unexpected keyword argument 'speed'"),
    ],
)
def test_a_missing_or_unknown_argument_is_named_with_its_command(host, wrong, said):
    robot = blocking.Robot.over(LoopbackTransport(host))
    with robot, robot.control("me") as arm, pytest.raises(TypeError, match=said):
        wrong(arm)


async def test_unknown_arguments_fail_at_the_call_and_a_missing_await_names_the_command(robot):
    async with robot.control("me") as arm:
        with pytest.raises(TypeError, match="speed"):
            arm.move_j([0.0] * 6, speed=1)
        forgotten = arm.move_j([0.0] * 6)
        assert forgotten.__qualname__.endswith(".move_j")
        forgotten.close()


@pytest.mark.parametrize("value", [1.5, -1, float("nan"), 1j, 10**400, "yes"])
def test_only_0_1_and_numpy_booleans_are_taken_for_booleans(value):
    for true in (1, 1.0, np.True_):
        assert built(m.ServoJ, {"q": Q, "shaped": true}, token="").shaped is True
    with pytest.raises(ArgumentError, match="shaped"):
        built(m.ServoJ, {"q": Q, "shaped": value}, token="")


def test_blocking_attributes_have_docstrings_and_are_read_only(host):
    assert blocking.Motion.done.__doc__.startswith("Tick at which its shaped reference came to rest")
    assert blocking.Motion.ended.__doc__ == inspect.getdoc(Motion.ended)
    robot = blocking.Robot.over(LoopbackTransport(host))
    with robot, robot.control("me") as arm, pytest.raises(AttributeError):
        arm.token = "another"
