"""A client's own mistakes: what a constructor lets through, `check` and `encode` find as the server would."""

import msgspec
import numpy as np
import pytest

from tvist_protocol import (
    Done,
    MoveJ,
    Payload,
    ProtocolError,
    Refused,
    RefusedError,
    RobotMode,
    SetEstimator,
    Setpoint,
    SimulationReset,
    SimulationStep,
    StepSetpoint,
    TvistError,
    check,
    decode,
    encode,
)
from tvist_protocol.generate import FOLDER
from tvist_protocol.stream import State

LEASE = "t"
HALF = "\ud800"


def wrong(action):
    with pytest.raises(ProtocolError) as caught:
        action()
    return caught.value


def test_check_finds_what_the_constructor_let_through():
    message = MoveJ(token=LEASE, q=(9e9,) * 6)
    error = wrong(lambda: check(message))
    assert (error.code, error.where, error.limit) == ("out_of_range", "q[0]", 1e3)


def test_check_gives_the_message_back_as_the_server_sees_it():
    message = check(Setpoint(token=LEASE, sequence=1, q=[1, 2]))
    assert message == Setpoint(token=LEASE, sequence=1, q=(1.0, 2.0))
    assert isinstance(message.q[0], float)


@pytest.mark.parametrize(
    ("message", "where", "kind"),
    [
        (MoveJ(token=LEASE, q=(0.0, np.float64(1.0))), "q[1]", "numpy.float64"),
        (MoveJ(token=LEASE, q=np.zeros(6)), "q", "numpy.ndarray"),
        (MoveJ(token=LEASE, q=(0.0,), velocity=np.float32(1.0)), "velocity", "numpy.float32"),
        (SimulationReset(token=LEASE, payload=Payload(mass=np.int64(1), com=(0, 0, 0), inertia=(0,) * 6)),
         "payload.mass", "numpy.int64"),
        (SimulationStep(token=LEASE, ticks=1, setpoints=(StepSetpoint(sequence=0, q=(np.float64(0),)),)),
         "setpoints[0].q[0]", "numpy.float64"),
        (Done(tick=object()), "tick", "object"),
    ],
)  # fmt: skip
def test_encode_names_the_field_that_holds_no_plain_value(message, where, kind):
    error = wrong(lambda: encode(message))
    assert (error.code, error.where) == ("malformed", where)
    assert kind in error.why


@pytest.mark.parametrize("number", [2**64, -(2**63) - 1, 10**400])
def test_an_integer_beyond_64_bits_is_out_of_range(number):
    error = wrong(lambda: check(Setpoint(token=LEASE, sequence=number, q=(0.0,))))
    assert (error.code, error.where) == ("out_of_range", "sequence")


def test_half_a_surrogate_pair_is_no_text():
    error = wrong(lambda: encode(MoveJ(token=HALF, q=(0.0,))))
    assert (error.code, error.where) == ("malformed", "token")


def test_a_message_that_holds_itself_is_malformed():
    loop = []
    loop.append(loop)
    assert wrong(lambda: encode(MoveJ(token=LEASE, q=loop))).code == "malformed"


@pytest.mark.parametrize("content", [{"a": float("nan")}, {"a": np.float32(1)}, {1: 2}, {"a": {1, 2}}])
def test_a_calibration_that_cannot_be_sent_fails_where_it_is_built(content):
    assert wrong(lambda: SetEstimator(token=LEASE, name="polynomial", calibration=content)).where == (
        "calibration" if 1 in content else "calibration.a"
    )


@pytest.mark.parametrize(
    ("content", "code", "where"),
    [
        ({"a": [2**64]}, "out_of_range", "calibration.a[0]"),
        ({"a": HALF}, "malformed", "calibration.a"),
        ({HALF: 1}, "malformed", "calibration"),
    ],
)
def test_what_messagepack_cannot_hold_in_a_calibration_is_named(content, code, where):
    message = SetEstimator(token=LEASE, name="polynomial", calibration=content)
    error = wrong(lambda: check(message))
    assert (error.code, error.where) == (code, where)


def test_what_is_no_message_is_not_checked_as_one():
    assert wrong(lambda: check(Payload(mass=1.0, com=(0, 0, 0), inertia=(0,) * 6))).code == "unknown_type"


def test_a_named_mode_travels_as_its_number():
    state = decode(State, (FOLDER / "fixtures" / "v1" / "state.msgpack").read_bytes())
    idle = check(msgspec.structs.replace(state, robot_mode=RobotMode.IDLE))
    assert idle.robot_mode == 5
    assert type(idle.robot_mode) is int


def test_all_errors_have_one_root():
    reply = Refused(code="busy", where="", why="the arm is moving")
    assert isinstance(RefusedError(reply), TvistError)
    assert str(RefusedError(reply)) == "busy: the arm is moving"
    assert RefusedError(reply).reply is reply
    assert issubclass(ProtocolError, TvistError)
