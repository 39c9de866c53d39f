"""The commands that methods of both clients send, and their results."""

import inspect
import json
import pydoc
from itertools import product

import msgspec
import numpy as np
import pytest

from tvist_client import ArgumentError, Arm, LoopbackTransport, Motion, Robot, UnexpectedReplyError, blocking
from tvist_client.arguments import arguments, built, make_payload
from tvist_client.command import Sent, begin, guide, move
from tvist_client.commands import Commands, Questions
from tvist_protocol import commands as c
from tvist_protocol import forces as f
from tvist_protocol import motions as m
from tvist_protocol.codec import check
from tvist_protocol.generate import FOLDER
from tvist_protocol.motions import ArcSegment, JointSegment, LineSegment, ProcessSegment
from tvist_protocol.replies import Accepted, Done, Posture, ToolPose
from tvist_protocol.simulation import SimulationReset

POSE = (0.4, 0.1, 0.5, 0.0, 3.0, 0.0)
FRAME = (1.0, 0.0, 0.0, 0.0, 0.0, 1.5)
Q = (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
ARRAY, ONE = np.array(POSE), np.float64(1.0)
PAYLOAD = make_payload(2.0, (0.1, 0.0, 0.0), range(6))
T = {"token": "?"}
MOTION, DONE = Accepted(id=1), Done(tick=0)

CONVERTED = {
    "numpy's numbers and whole ones": (
        lambda arm: arm.move_j(np.array(Q, dtype=np.float32), duration=2, velocity=ONE, wait=False),
        c.MoveJ(**T, q=Q, duration=2.0, velocity=1.0), MOTION,
    ),
    "segments": (
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
    "switches": (
        lambda arm: arm.force_mode([0, 0, 1, True, np.False_, 0], ARRAY, frame_type=3),
        f.ForceMode(**T, compliant=(False, False, True, True, False, False), wrench=POSE, frame_type=3), MOTION,
    ),
    "a posture or a word": (lambda arm: arm.freedrive([1] * 6, list(FRAME)), f.Freedrive(**T, frame=FRAME), MOTION),
    "an iterator": (lambda arm: arm.speed_j((x for x in Q), 2), m.SpeedJ(**T, qd=Q, acceleration=2.0), MOTION),
    "one mode": (
        lambda arm: arm.set_estimator("fixed", f_d=np.array([6.7]), zeta=np.float64(0.34)),
        c.SetEstimator(**T, name="fixed", f_d=(6.7,), zeta=(0.34,)), DONE,
    ),
    "a payload": (
        lambda arm: arm.reset(payload=PAYLOAD, seed=np.int64(3)), SimulationReset(**T, payload=PAYLOAD, seed=3), DONE,
    ),
}  # fmt: skip
"""What is called, what is sent, and what is answered."""
POSTURE, TOOL = Posture(q=(0.5,) * 6), ToolPose(pose=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6))
SENT = {
    name: member
    for owner in (Commands, Questions)
    for name, member in vars(owner).items()
    if type(member) is Sent
}


def tag(command):
    return type(command).__struct_config__.tag


def sent(host, wanted):
    """The command of a type, as the robot received it; any token counts as the one of the table."""
    (command,) = (one for one in host.commands if type(one) is type(wanted))
    return command if getattr(wanted, "token", None) is None else msgspec.structs.replace(command, **T)


def type_of(name):
    if name == "close_popup" or name.endswith("_program"):
        return f"program.{name.removesuffix('_program')}"
    return f"simulation.{name}" if name in {"reset", "inject"} else name


def golden(name):
    """The golden message of a method, its arguments, and an answer to it."""
    kind, carry_out = SENT[name]._kind, SENT[name]._carry_out
    fields = json.loads((FOLDER / "fixtures/v1" / f"{type_of(name)}.json").read_text(encoding="utf-8"))
    given = {key: value for key, value in fields.items() if key in arguments(kind)}
    more = {"wait": False} if carry_out is move else {}
    answers = {"inverse_kinematics": POSTURE, "forward_kinematics": TOOL}
    answer = answers.get(name, MOTION if carry_out in {begin, move, guide} else DONE)
    wanted = msgspec.convert(fields | (T if "token" in fields else {}), kind)
    return wanted, given | more, answer


@pytest.mark.parametrize("name", SENT)
async def test_a_method_sends_its_command(host, robot, name):
    wanted, given, answer = golden(name)
    host.answers[tag(wanted)] = answer
    async with robot.control("me") as arm:
        result = await getattr(arm if name in vars(Commands) else robot, name)(**given)
    assert sent(host, wanted) == wanted
    assert tag(wanted) == type_of(name)
    if name in vars(Questions):
        assert (result,) == msgspec.structs.astuple(answer)


@pytest.mark.parametrize("name", CONVERTED)
async def test_arguments_are_converted_to_the_types_of_the_message(host, robot, name):
    call, wanted, host.answers[tag(CONVERTED[name][1])] = CONVERTED[name]
    async with robot.control("me") as arm:
        await call(arm)
    assert sent(host, wanted) == check(wanted)


def test_the_blocking_client_sends_the_same_commands(host):
    with blocking.Robot.over(LoopbackTransport(host)) as robot, robot.control("me") as arm:
        for name in SENT:
            wanted, given, answer = golden(name)
            host.answers, host.commands = {tag(wanted): answer}, []
            getattr(arm if name in vars(Commands) else robot, name)(**given)
            assert sent(host, wanted) == wanted, name
        host.answers = {}


@pytest.mark.parametrize(
    ("name", "reply"), [("move_j", Done()), ("move_l", Accepted(token="t")), ("inverse_kinematics", Done())]
)
async def test_an_answer_of_another_type_raises_an_error_naming_both_types(host, robot, name, reply):
    wanted, given, _ = golden(name)
    host.answers[tag(wanted)] = reply
    async with robot.control("me") as arm:
        with pytest.raises(
            UnexpectedReplyError, match=f"{tag(wanted)} was answered by {type(reply).__name__}"
        ):
            await getattr(arm if name in vars(Commands) else robot, name)(**given)


POSITIONAL = """
    forward_kinematics(q) force_mode(compliant,wrench) freedrive(free,frame) hand_over(client) inject(fault)
    inverse_kinematics(pose) load_program(name,text) move_c(via,pose) move_j(q) move_l(pose) move_path(segments)
    move_trajectory(points)
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
