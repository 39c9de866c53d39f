"""The commands of the client are their messages: arguments, defaults and descriptions."""

import inspect
import pydoc

import numpy as np
import pytest

from tvist_client import Arm, LoopbackTransport, Motion, Robot, blocking
from tvist_client.arguments import given
from tvist_client.command import Sent
from tvist_client.commands import Commands, Questions

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


@pytest.mark.parametrize("name", SENT)
def test_help_describes_every_argument_of_a_command(name):
    for owner in (Arm, blocking.Arm, Robot, blocking.Robot):
        method = getattr(owner, name, None)
        if method is not None and (owner, name) not in {(Robot, "stop"), (blocking.Robot, "stop")}:
            arguments = list(inspect.signature(method).parameters)[1:]
            assert all(f"    {argument}: " in method.__doc__ for argument in arguments)
            assert "null" not in method.__doc__
            assert "RefusedError: " in pydoc.render_doc(method)


def test_arguments_that_may_be_given_by_position_stay():
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
        (
            lambda arm: arm.move_j([0.0] * 6, speed=1),
            r"move_j\(\): got an unexpected keyword argument 'speed'",
        ),
    ],
)
def test_an_argument_that_a_command_lacks_is_named_with_it(fake, wrong, said):
    with blocking.Robot.over(LoopbackTransport(fake)) as robot, robot.control("me") as arm:
        with pytest.raises(TypeError, match=said):
            wrong(arm)
        assert isinstance(arm.move_j([0.5, 0, 0, 0, 0, 0], wait=False), blocking.Motion)


async def test_an_unknown_argument_is_an_error_at_the_call_and_a_forgotten_await_names_the_command(fake):
    async with Robot.over(LoopbackTransport(fake)) as robot, robot.control("me") as arm:
        with pytest.raises(TypeError, match="speed"):
            arm.move_j([0.0] * 6, speed=1)
        forgotten = arm.move_j([0.0] * 6)
        assert forgotten.__qualname__.endswith(".move_j")
        forgotten.close()


@pytest.mark.parametrize("value", [1.5, -1, float("nan"), 1j, 10**400, "yes"])
def test_what_is_neither_true_nor_false_reaches_the_codec_as_it_is(value):
    assert given(bool).convert(value, "shaped") is value
    assert given(bool).convert(np.True_, "shaped") is True


def test_attributes_without_await_are_described_and_only_read(fake):
    assert blocking.Motion.done.__doc__.startswith("Tick at which its shaped reference came to rest")
    assert blocking.Motion.ended.__doc__ == inspect.getdoc(Motion.ended)
    with (
        blocking.Robot.over(LoopbackTransport(fake)) as robot,
        robot.control("me") as arm,
        pytest.raises(AttributeError),
    ):
        arm.token = "another"
