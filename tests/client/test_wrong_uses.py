"""Wrong uses of the client raise its own errors, which name argument, value and limit."""

import math
import re

import pytest

from tvist_client import (
    ArgumentError,
    JointSegment,
    LineSegment,
    RefusedError,
    Robot,
    TvistError,
    make_payload,
)
from tvist_client.errors import MisuseError, NotConnectedError, StreamStoppedError
from tvist_protocol.errors import ProtocolError

POSE = (0.4, 0.1, 0.5, 0.0, 3.1, 0.0)
Q1 = (0.0, -3.1, 0.0, -1.57, 0.0, 0.0)
MSGSPEC = re.compile(r"Expected `|Object (missing|contains)|Invalid enum|at `\$")


COMMANDS = {
    "text for angles": (lambda arm: arm.move_j("Q1"), "q is 'Q1': must be a list"),
    "None for an angle": (lambda arm: arm.move_j([None] * 6), r"q\[0\] must be a number, not null"),
    "an angle out of range": (lambda arm: arm.move_j([9.0] * 6), r"q\[0\] is 9 rad: .* ±6.28"),
    "text in a pose": (lambda arm: arm.move_l([*POSE[:5], "0"]), r"pose\[5\] is '0': must be a number"),
    "no segments": (lambda arm: arm.move_path([]), "segments has 0 entries: must have at least 1"),
    "one segment alone": (lambda arm: arm.move_path(LineSegment(pose=POSE)), "segments must be a list"),
    "a pose for a segment": (lambda arm: arm.move_path([POSE]), r"segments\[0\] must be a map, not a list"),
    "text in a path": (
        lambda arm: arm.move_path([LineSegment(pose=POSE, blend="1 cm")]), r"segments\[0\].blend is '1 cm': must be"
    ),
    "text for a posture": (lambda arm: arm.move_path([JointSegment(q="Q1")]), r"segments\[0\].q is 'Q1': must be"),
    "to return in the past": (lambda arm: arm.speed_j([0] * 6, duration=-1), "duration is -1: must be more than 0"),
    "never to return": (lambda arm: arm.servo_j(Q1, duration=math.inf), "duration is inf: .* finite"),
    "an unknown shaper": (lambda arm: arm.set_shaper("zzz"), "'zzz'.*zvd"),
    "half a mode": (lambda arm: arm.set_shaper("zv", 1.5), "modes is 1.5: must be an integer"),
    "a negative output": (lambda arm: arm.set_digital_output(-1, on=True), "number is -1: must be from 0 to 17"),
    "no list of registers": (lambda arm: arm.set_registers("input_int", 1), "values is 1: must be a list"),
    "half a tick": (lambda arm: arm.robot.advance(0.5), "ticks is 0.5: must be a whole number"),
    "too many ticks": (lambda arm: arm.step(100_001), "ticks is 100001: must be from 1 to 100000"),
    "text for a mass": (lambda _: make_payload("5", 3 * (0,), 6 * (0,)), "mass is '5': must be a number"),
    "moments": (lambda _: make_payload(5, 3 * (0,), 3 * (0,)), "inertia has 3 entries: must have exactly 6"),
}  # fmt: skip


@pytest.mark.parametrize("case", COMMANDS)
async def test_invalid_arguments_raise_an_error_and_control_is_kept(robot, case):
    wrong, said = COMMANDS[case]
    async with robot.control("me") as arm:
        with pytest.raises(TvistError, match=said) as raised:
            await wrong(arm)
        assert not MSGSPEC.search(str(raised.value))
        assert isinstance(raised.value, RefusedError | ArgumentError)
        await arm.keep_alive()


SETPOINTS = {
    "five angles": (Q1[:5], r"q has 5 angles; this arm has 6 joints", "q", 6),
    "NaN": ((math.nan, *Q1[1:]), r"q\[0\] is nan: must be a finite number", "q[0]", None),
    "infinity": ((*Q1[:5], -math.inf), r"q\[5\] is -inf", "q[5]", None),
    "out of range": ((0, 7, *Q1[2:]), r"q\[1\] is 7 rad: joint shoulder allows -6.2", "q[1]", 2 * math.pi),
    "text": ("Q1", r"q is 'Q1': must be a list", "q", None),
}  # fmt: skip


@pytest.mark.parametrize("case", SETPOINTS)
async def test_an_invalid_set_point_is_not_sent_and_the_stream_continues(robot, case):
    q, said, where, limit = SETPOINTS[case]
    async with robot.control("me") as arm, arm.servo() as servo:
        with pytest.raises(ArgumentError, match=said) as raised:
            servo.set(q)
        assert raised.value.where == where
        assert raised.value.limit == (None if limit is None else pytest.approx(limit))
        with pytest.raises(ArgumentError, match=r"qs\[1\]"):
            await servo.step_through([Q1, q])
        assert servo.sequence == 0
        assert servo.set((await robot.state()).target_q) == 0


async def test_a_stream_accepts_no_set_points_after_its_block(robot):
    async with robot.control("me") as arm:
        async with arm.servo() as servo:
            pass
        with pytest.raises((MisuseError, StreamStoppedError), match="ended"):
            servo.set(Q1)


async def test_invalid_names_and_endpoints_are_refused_with_the_expected_form(robot):
    for name in ("", "a/b", "x" * 65, "ä", None):
        with pytest.raises(ProtocolError, match="printable ASCII"):
            async with robot.control(name):
                pass
    for endpoint in ("", "localhost", "127.0.0.1:7447", "tcp/x:0", "tcp/x:99999", None):
        with pytest.raises(NotConnectedError, match="tcp/<host>:<port>"):
            await Robot.connect(endpoint)
