"""Invalid messages are refused with code, field, message and limit."""

import math
import struct
from functools import partial

import msgpack
import msgspec
import numpy as np
import pytest

from tvist_protocol import (
    MAX_BYTES,
    Done,
    MoveJ,
    Payload,
    ProtocolError,
    Refused,
    RobotMode,
    SetEstimator,
    Setpoint,
    SimulationReset,
    SimulationStep,
    StepSetpoint,
    check,
    decode,
    decode_command,
    decode_reply,
    encode,
    refusal,
)
from tvist_protocol.channels import REPLIES, tag
from tvist_protocol.generate import FOLDER
from tvist_protocol.info import Info
from tvist_protocol.replies import Accepted
from tvist_protocol.stream import Event, State, Telemetry, Truth

MOVE = {"type": "move_j", "token": "t", "q": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]}
STREAM = {"type": "setpoint", "token": "t", "sequence": 3, "q": [0.1, 0.2]}
LOAD = {"type": "set_payload", "token": "t", "mass": 5, "com": [0, 0, 0.04], "inertia": [1, 0, 0, 1, 0, 1]}
RESET = {"type": "simulation.reset", "token": "t"}
STEP = {"type": "simulation.step", "token": "t", "ticks": 1}
FIXED = {"type": "set_estimator", "token": "t", "name": "fixed"}
TAKE = {"type": "take_control", "client": "me"}
LINE = {"type": "line", "pose": [0.0] * 6}
PATH = {"type": "move_path", "token": "t"}


def wrong(action):
    with pytest.raises(ProtocolError) as caught:
        action()
    return caught.value


def refused(decode, message):
    return wrong(partial(decode, message if isinstance(message, bytes) else msgpack.packb(message)))


WRONG = [
    # message, code, where, a part of the sentence, limit
    (MOVE | {"q": [0.1, "0.2"]}, "malformed", "q[1]", "q[1] is '0.2': must be a number", None),
    (MOVE | {"q": [0.1, True]}, "malformed", "q[1]", "a number, not a boolean", None),
    (MOVE | {"q": [0.1, None]}, "malformed", "q[1]", "not null", None),
    (MOVE | {"q": 0.1}, "malformed", "q", "q is 0.1: must be a list", None),
    (MOVE | {"q": {"0": 1.0}}, "malformed", "q", "a list, not a map", None),
    (MOVE | {"token": 7}, "malformed", "token", "token is 7: must be a string", None),
    (MOVE | {"token": b"t"}, "malformed", "token", "not a byte string", None),
    (MOVE | {"velocity": msgpack.ExtType(5, b"x")}, "malformed", "velocity", "an extension value", None),
    (MOVE | {"type": 7}, "malformed", "type", "must be a string", None),
    (MOVE | {"type": None}, "malformed", "type", "must be a string", None),
    (MOVE | {1: 2}, "malformed", "", "the message has a key that is not a string", None),
    (RESET | {"payload": {1: 2}}, "malformed", "payload", "payload has a key that is not a string", None),
    (RESET | {"payload": 5}, "malformed", "payload", "payload is 5: must be a map or null", None),
    (STEP | {"ticks": 1.0}, "malformed", "ticks", "ticks is 1.0: must be an integer", None),
    (STEP | {"ticks": True}, "malformed", "ticks", "not a boolean", None),
    ([MOVE], "malformed", "", "the message must be a map, not a list", None),
    (3, "malformed", "", "the message is 3: must be a map", None),
    (None, "malformed", "", "not null", None),
    ("move_j", "malformed", "", "must be a map", None),
    (MOVE | {"type": "movej"}, "unknown_type", "type", "did you mean 'move_j'", None),
    (MOVE | {"type": ""}, "unknown_type", "type", "''", None),
    (MOVE | {"type": "x" * 10_000}, "unknown_type", "type", "…", None),
    (MOVE | {"velocty": 1.0}, "unknown_field", "velocty", "did you mean 'velocity'", None),
    (MOVE | {"$.q": 1.0}, "unknown_field", "$.q", "no field '$.q'", None),
    (MOVE | {"": 1.0}, "unknown_field", "", "no field ''", None),
    (MOVE | {"a`b\n - at `$.q`": 1.0}, "unknown_field", "a`b� - at `$.q`", "has no field", None),
    (RESET | {"payload": LOAD}, "unknown_field", "payload.type", "payload has no field 'type'", None),
    ({"token": "t"}, "missing_field", "type", "type is missing", None),
    ({}, "missing_field", "type", "type is missing", None),
    ({"type": "move_j", "q": [0.1]}, "missing_field", "token", "token is missing", None),
    (RESET | {"payload": {"mass": 1, "com": [0, 0, 0]}}, "missing_field", "payload.inertia", "missing", None),
    (STEP | {"setpoints": [{"sequence": 0}]}, "missing_field", "setpoints[0].q", "missing", None),
    (MOVE | {"q": [0.1, math.nan]}, "out_of_range", "q[1]", "q[1] is NaN", None),
    (MOVE | {"velocity": math.nan}, "out_of_range", "velocity", "NaN", None),
    (MOVE | {"q": [math.inf]}, "out_of_range", "q[0]", "is inf: must be at most 1000", 1e3),
    (MOVE | {"q": [-math.inf]}, "out_of_range", "q[0]", "is -inf: must be at least -1000", -1e3),
    (MOVE | {"q": []}, "out_of_range", "q", "0 entries: must have at least 1", 1),
    (MOVE | {"q": [0.0] * 8}, "out_of_range", "q", "8 entries: must have at most 7", 7),
    (MOVE | {"velocity": 0}, "out_of_range", "velocity", "is 0: must be more than 0", 0),
    (MOVE | {"velocity": -1.5}, "out_of_range", "velocity", "-1.5", 0),
    (MOVE | {"jerk": 10**18}, "out_of_range", "jerk", "at most 10000000", 1e7),
    (MOVE | {"token": "t" * 129}, "out_of_range", "token", "129 characters: must have at most 128", 128),
    (LOAD | {"com": [0, 0]}, "out_of_range", "com", "2 entries: must have exactly 3", 3),
    (LOAD | {"inertia": [0] * 7}, "out_of_range", "inertia", "exactly 6", 6),
    (LOAD | {"mass": -0.001}, "out_of_range", "mass", "at least 0", 0),
    (RESET | {"seed": -1}, "out_of_range", "seed", "at least 0", 0),
    (RESET | {"seed": 2**63}, "out_of_range", "seed", "at most", 2.0**63),
    (RESET | {"mode": "running"}, "out_of_range", "mode", "one of 'RUNNING', 'IDLE', 'POWER_OFF'", None),
    (RESET | {"shaper": ""}, "out_of_range", "shaper", "at least 1", 1),
    (STEP | {"ticks": 0}, "out_of_range", "ticks", "at least 1", 1),
    (STEP | {"ticks": 100_001}, "out_of_range", "ticks", "at most 100000", 100_000),
    (STEP | {"setpoints": [{"sequence": -1, "q": [0]}]}, "out_of_range", "setpoints[0].sequence", "-1", 0),
    (STEP | {"setpoints": [{"sequence": 0, "q": [9e9]}]}, "out_of_range", "setpoints[0].q[0]", "1000", 1e3),
    (STEP | {"setpoints": [{"sequence": 0, "q": [0]}] * 1001}, "out_of_range", "setpoints", "1000", 1000),
    (FIXED | {"f_d": [0.05], "zeta": [0.1]}, "out_of_range", "f_d[0]", "at least 0.1", 0.1),
    (FIXED | {"f_d": [5.0], "zeta": [1.0]}, "out_of_range", "zeta[0]", "less than 1", 1),
    (FIXED | {"f_d": [5.0] * 9}, "out_of_range", "f_d", "at most 8", 8),
    (FIXED | {"calibration": {"a": [0.0, math.nan]}}, "out_of_range", "calibration.a[1]", "nan", None),
    (FIXED | {"calibration": {"a": {"b": math.inf}}}, "out_of_range", "calibration.a.b", "inf", None),
    (FIXED | {"calibration": {"a": b"x"}}, "malformed", "calibration.a", "bytes", None),
    (FIXED | {"calibration": {"a": {1: 2}}}, "malformed", "calibration.a", "not a string", None),
    (FIXED | {"calibration": {"a": msgpack.ExtType(9, b"x")}}, "malformed", "calibration.a", "Ext", None),
    (FIXED | {"calibration": {"a": msgpack.Timestamp(1)}}, "malformed", "calibration.a", "datetime", None),
    (PATH | {"segments": []}, "out_of_range", "segments", "0 entries: must have at least 1", 1),
    (PATH | {"segments": [LINE] * 501}, "out_of_range", "segments", "must have at most 500", 500),
    (PATH | {"segments": [5]}, "malformed", "segments[0]", "segments[0] is 5: must be a map", None),
    (PATH | {"segments": [{"pose": [0.0] * 6}]}, "missing_field", "segments[0].type", "is missing", None),
    (PATH | {"segments": [LINE | {"type": 7}]}, "malformed", "segments[0].type", "a string", None),
    (PATH | {"segments": [LINE, {"type": "joint"}]}, "missing_field", "segments[1].q", "is missing", None),
    (PATH | {"segments": [LINE | {"pos": 1}]}, "unknown_field", "segments[0].pos", "you mean 'pose'", None),
    (PATH | {"segments": [LINE | {"pose": [0] * 5}]}, "out_of_range", "segments[0].pose", "exactly 6", 6),
    (TAKE | {"client": ""}, "out_of_range", "client", "1 to 64 printable", None),
    (TAKE | {"client": "a\n"}, "out_of_range", "client", "printable", None),
    (TAKE | {"client": "**"}, "out_of_range", "client", "printable", None),
    (TAKE | {"client": "@me"}, "out_of_range", "client", "the first not @", None),
    (TAKE | {"lease_s": 0.05}, "out_of_range", "lease_s", "0.1", 0.1),
    (TAKE | {"lease_s": 3601}, "out_of_range", "lease_s", "3600", 3600),
    (STREAM | {"type": "set_point"}, "unknown_type", "type", "did you mean 'setpoint'", None),
    ({"token": "t", "sequence": 3, "q": [0.1]}, "missing_field", "type", "type is missing", None),
    (STREAM | {"sequence": -1}, "out_of_range", "sequence", "sequence is -1: must be at least 0", 0),
    (STREAM | {"sequence": 3.0}, "malformed", "sequence", "sequence is 3.0: must be an integer", None),
    (STREAM | {"q": [math.nan]}, "out_of_range", "q[0]", "q[0] is NaN", None),
    (STREAM | {"velocity": 1.0}, "unknown_field", "velocity", "no field 'velocity'", None),
]


@pytest.mark.parametrize(("message", "code", "where", "why", "limit"), WRONG)
def test_an_invalid_message_is_refused_with_code_field_message_and_limit(message, code, where, why, limit):
    """In other words than msgspec's, and in a reply that can be sent."""
    is_setpoint = isinstance(message, dict) and "sequence" in message
    error = refused(partial(decode, Setpoint) if is_setpoint else decode_command, message)
    assert (error.code, error.where, error.limit) == (code, where, limit)
    assert why in error.why
    assert len(error.why) < 250
    assert "Expected" not in error.why
    assert decode_reply(encode(refusal(error))) == refusal(error)


@pytest.mark.parametrize(("before", "given"), [(3, " is 'lin':"), (300, "")])
def test_an_unknown_path_segment_is_refused_with_its_index_and_the_valid_types(before, given):
    """In a long message the value is not named."""
    error = refused(decode_command, PATH | {"segments": [LINE] * before + [LINE | {"type": "lin"}]})
    assert (error.code, error.where) == ("unknown_type", f"segments[{before}].type")
    assert error.why == f"{error.where}{given} must be one of 'joint', 'line', 'process', 'arc'"


def test_truncated_messages_and_trailing_bytes_are_malformed():
    data = msgpack.packb(MOVE)
    for length in range(len(data)):
        error = refused(decode_command, data[:length])
        assert error.code == "malformed"
        assert "truncated" in error.why
    error = refused(decode_command, data + b"\x00")
    assert (error.code, error.where) == ("malformed", "")
    assert "trailing" in error.why


@pytest.mark.parametrize("read", [decode_command, decode_reply, partial(decode, State)])
def test_a_message_of_five_megabytes_is_refused_without_decoding(read):
    error = refused(read, b"\xc1" * 5_000_000)
    assert (error.code, error.where, error.limit) == ("malformed", "", MAX_BYTES)
    assert "5000000" in error.why


def test_the_largest_useful_message_fits():
    setpoints = [{"sequence": 2**64 - 1 - n, "q": [math.pi] * 7} for n in range(1000)]
    data = msgpack.packb(STEP | {"ticks": 1000, "setpoints": setpoints})
    assert len(data) < MAX_BYTES / 2
    assert len(decode_command(data).setpoints) == 1000


def with_calibration(tail):
    packed = msgpack.packb(FIXED | {"calibration": {"a": None}})
    assert packed.endswith(b"\xc0")
    return packed[:-1] + tail


@pytest.mark.parametrize(
    "data",
    [
        with_calibration(b"\x91" * 200_000),  # nested beyond the stack
        with_calibration(b"\x81\xa1a" * 60_000),
        with_calibration(b"\x91" * 20 + b"\xc0"),  # nested beyond what a calibration may be
        with_calibration(b"\xdd\xff\xff\xff\xff"),  # a list that says it has 2^32 - 1 entries
        with_calibration(b"\xdf\xff\xff\xff\xff"),  # a map
        with_calibration(b"\xdb\xff\xff\xff\xff"),  # a string
        with_calibration(b"\xc9\xff\xff\xff\xff\x01"),  # an extension value
        with_calibration(b"\xa2\xff\xfe"),  # text that is not UTF-8
        with_calibration(b"\x81\x80\x01"),  # a map as a key
        with_calibration(b"\xc7\x0c\xff" + b"\xff" * 12),  # a timestamp with 2^32 - 1 nanoseconds
        with_calibration(b"\xc1"),  # the byte MessagePack never uses
        b"\x82\xa4type\xa5pause\xa2\xff\xfe\x01",  # a key that is not UTF-8
        b"\x81\xa4type" + b"\x91" * 200_000,
        b"\x91" * 200_000,
        b"",
        b"\xc1",
        b"GET / HTTP/1.1\r\n\r\n",
    ],
)
def test_malicious_bytes_are_refused(data):
    assert refused(decode_command, data).code in {"malformed", "out_of_range"}


def test_nan_bits_of_every_kind_are_refused():
    for bits in (0x7FF8000000000000, 0xFFF8000000000001, 0x7FF0000000000001):
        packed = msgpack.packb(STREAM | {"q": [1.5]})
        data = packed.replace(struct.pack(">d", 1.5), struct.pack(">Q", bits))
        assert refused(partial(decode, Setpoint), data).where == "q[0]"


@pytest.mark.parametrize("kind", [State, Event, Truth, Telemetry, Info, Done, Accepted, Refused], ids=tag)
def test_clients_ignore_unknown_fields_of_received_messages(kind):
    name = tag(kind)
    read = decode_reply if kind in REPLIES else partial(decode, kind)
    data = (FOLDER / "fixtures" / "v1" / f"{name}.msgpack").read_bytes()
    more = msgpack.unpackb(data) | {"of_tomorrow": {"a": [1, None]}}
    assert read(msgpack.packb(more)) == read(data)


def test_check_validates_what_the_constructor_accepts():
    message = MoveJ(token="t", q=(9e9,) * 6)
    error = wrong(lambda: check(message))
    assert (error.code, error.where, error.limit) == ("out_of_range", "q[0]", 1e3)


@pytest.mark.parametrize(("message", "code", "where", "said"), [
    (MoveJ(token="t", q=(0.0, np.float64(1.0))), "malformed", "q[1]", "numpy.float64"),
    (MoveJ(token="t", q=np.zeros(6)), "malformed", "q", "numpy.ndarray"),
    (MoveJ(token="t", q=(0.0,), velocity=np.float32(1.0)), "malformed", "velocity", "numpy.float32"),
    (SimulationReset(token="t", payload=Payload(mass=np.int64(1), com=(0, 0, 0), inertia=(0,) * 6)),
     "malformed", "payload.mass", "numpy.int64"),
    (SimulationStep(token="t", ticks=1, setpoints=(StepSetpoint(sequence=0, q=(np.float64(0),)),)),
     "malformed", "setpoints[0].q[0]", "numpy.float64"),
    (Done(tick=object()), "malformed", "tick", "object"),
    (MoveJ(token="\ud800", q=(0.0,)), "malformed", "token", "not UTF-8"),
    *((Setpoint(token="t", sequence=number, q=(0.0,)), "out_of_range", "sequence", "64 bits")
      for number in (2**64, -(2**63) - 1, 10**400)),
])  # fmt: skip
def test_a_message_that_messagepack_cannot_express_is_refused_with_its_field(message, code, where, said):
    error = wrong(lambda: encode(message))
    assert (error.code, error.where) == (code, where)
    assert said in error.why


@pytest.mark.parametrize("content", [{"a": float("nan")}, {"a": np.float32(1)}, {1: 2}, {"a": {1, 2}}])
def test_a_calibration_that_cannot_be_encoded_is_refused_by_the_constructor(content):
    assert wrong(lambda: SetEstimator(token="t", name="polynomial", calibration=content)).where == (
        "calibration" if 1 in content else "calibration.a"
    )


def test_an_enumerated_mode_is_sent_as_a_number():
    state = decode(State, (FOLDER / "fixtures" / "v1" / "state.msgpack").read_bytes())
    idle = check(msgspec.structs.replace(state, robot_mode=RobotMode.IDLE))
    assert idle.robot_mode == 5
    assert type(idle.robot_mode) is int
