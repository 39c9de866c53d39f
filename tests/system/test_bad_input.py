"""Whatever a client sends: a refusal that says what is wrong, nothing changed, and a server that goes on.

Which content is refused is tested without a network: protocol/test_bad_input.py, controller/test_refusals.py.
"""

import math
from importlib import resources

import msgpack
import msgspec
import pytest
from tests.conformance.wire import Q1, STOPPED, Wire


def pack(type, **fields):  # noqa: A002  the wire's name
    return msgpack.packb({"type": type, **fields})


def settled(info):
    return {name: value for name, value in info.items() if name not in {"type", "tick"}}


@pytest.fixture(scope="module")
def wire(realtime):
    with Wire(realtime.endpoint) as wire, wire.control("guard", lease_s=600.0) as wire.token:
        yield wire.listen("state", "telemetry")
        realtime.assert_quiet()


def of(type, **fields):  # noqa: A002
    """A command with the token of the lease, which is known only when the test runs."""
    return lambda token: pack(type, token=token, **fields)


def unless(field, value):
    """Q1 with one angle changed."""
    return [value if number == field else angle for number, angle in enumerate(Q1)]


def calibration(**changes):
    """The calibration of the package as a map, with keys changed."""
    text = (resources.files("tvist_controller.sources") / "ur5e_5kg.json").read_bytes()
    return {key: value for key, value in {**msgspec.json.decode(text), **changes}.items() if value is not ...}


CASES = [
    (b"", "malformed", ""),
    (b"\xdf\xff\xff\xff\xff", "malformed", ""),  # a length beyond memory
    (b"\x81\xa4type" + b"\x91" * 1000, "malformed", "type"),
    (lambda token: pack("move_j", token=token, q=Q1)[:-5], "malformed", ""),
    (pack("dance"), "unknown_type", "type"),
    (of("move_j", q=Q1, vel=1.0), "unknown_field", "vel"),
    (of("move_j"), "missing_field", "q"),
    (of("move_j", q=unless(3, "half")), "malformed", "q[3]"),
    (of("move_j", q=unless(2, math.nan)), "out_of_range", "q[2]"),
    (of("move_j", q=unless(1, 6.3)), "limit_position", "q[1]"),
    (of("move_j", q=Q1, velocity=4.0), "limit_velocity", "velocity"),
    (pack("move_j", token="other#1", q=Q1), "stale_token", "token"),
    (pack("take_control", client="other"), "no_control", "token"),
    (pack("take_control", client="guard", protocol=2), "unsupported_version", "protocol"),
    (of("set_estimator", name="polynomial", calibration="/etc/passwd"), "unknown_calibration", "calibration"),
    (
        of("set_estimator", name="polynomial", calibration=calibration(colour="red")),
        "unknown_field",
        "calibration.colour",
    ),
    (
        of("set_estimator", name="polynomial", calibration=calibration(payload=...)),
        "missing_field",
        "calibration.payload",
    ),
    (of("simulation.step", ticks=1), "wrong_mode", "type"),
    (of("servo_stop"), "wrong_mode", ""),
]


@pytest.mark.parametrize(("payload", "code", "where"), CASES, ids=lambda _: "")
def test_a_bad_command_is_refused_by_code_and_field_and_changes_nothing(wire, payload, code, where):
    info, state = wire.info(), wire.state()
    answer = wire.raw(payload(wire.token) if callable(payload) else payload)
    assert (answer["type"], answer["code"], answer["where"]) == ("refused", code, where), answer
    assert 0 < len(answer["why"]) < 400
    later = wire.state()
    assert settled(wire.info()) == settled(info)
    assert later["tick"] > state["tick"]
    assert later["target_q"] == state["target_q"]
    assert later["runtime_state"] == STOPPED


def test_a_sound_calibration_as_a_map_is_taken(wire):
    sound = of("set_estimator", name="polynomial", calibration=calibration(name="mine"))(wire.token)
    assert wire.raw(sound) == {"type": "done"}
    assert wire.info()["calibration"]["name"] == "mine"
    assert wire.command("set_estimator", token=wire.token, name="polynomial") == {"type": "done"}
    assert wire.info()["calibration"]["name"] == "ur5e_5kg"


def test_bad_set_points_of_a_stream_are_refused_and_counted_and_the_good_one_is_played(wire):
    """Nobody waits for an answer to a set-point."""
    good = {"token": wire.token, "sequence": 0, "q": Q1}
    near = unless(0, 0.01)
    spoilt = (
        {"token": "stale", "q": near}, {"token": 3, "q": near}, {"q": Q1[:5]}, {"q": unless(0, math.nan)},
        {"q": unless(0, 6.5)}, {"q": "home"}, {"q": near, "sequence": -1}, {"q": near, "speed": 1.0},
    )  # fmt: skip
    raw = (b"", b"\xc1", pack("setpoint", **good)[:-3], pack("stop"), pack("move_j", q=Q1))
    before, state = wire.next("telemetry"), wire.state()
    assert wire.command("servo_start", token=wire.token) == {"type": "done"}
    for changes in spoilt:
        wire.setpoint(**{**good, **changes})
    for payload in raw:
        wire.put(payload)
    for key in ("tvist/*/setpoint", "tvist/**"):  # access control drops these: they would reach others, too
        wire.session.put(key, pack("setpoint", **good))
    wire.setpoint(**good)
    wire.next("state", lambda state: state["setpoint_sequence"] == 0)
    assert wire.command("servo_stop", token=wire.token) == {"type": "done"}
    wire.next("state", lambda state: state["runtime_state"] == STOPPED)
    tick = wire.info()["tick"]  # a query goes the same way: what was put before has arrived
    after = wire.wait("telemetry", lambda telemetry: telemetry["tick"] > tick)
    assert wire.state()["target_q"] == state["target_q"]
    refused = len(spoilt) + len(raw)
    assert after["setpoints_received"] - before["setpoints_received"] == refused + 1
    assert after["setpoints_refused"] - before["setpoints_refused"] == refused
