"""Whatever a client sends: a refusal that says what is wrong, nothing changed, and a server that goes on."""

import math
import random

import msgpack
import pytest
from tests.conformance.wire import Q1, STOPPED, Wire

NAN, INF = math.nan, math.inf
MEGABYTES = bytes(5_000_000)
UNSETTLED = {"type", "tick", "control"}


def pack(type, **fields):  # noqa: A002  the wire's name
    return msgpack.packb({"type": type, **fields})


def settled(info):
    return {name: value for name, value in info.items() if name not in UNSETTLED}


class Guard:
    """Sends a command that must be refused, and looks whether anything has changed."""

    def __init__(self, served, wire, token):
        self.served, self.wire, self.token = served, wire, token

    def refuses(self, payload, code, where):
        wire = self.wire
        info, state = wire.info(), wire.state()
        answer = wire.raw(payload)
        assert answer["type"] == "refused", answer
        assert (answer["code"], answer["where"]) == (code, where), answer["why"]
        assert answer["why"]
        assert len(answer["why"]) < 400
        self.unchanged(info, state)
        return answer

    def unchanged(self, info, state):
        after, later = self.wire.info(), self.wire.state()
        assert settled(after) == settled(info)
        assert after["control"] == info["control"]
        assert later["tick"] > state["tick"]
        assert later["target_q"] == state["target_q"]
        assert later["runtime_state"] == STOPPED
        self.served.assert_quiet()


@pytest.fixture(scope="module")
def guard(realtime):
    with Wire(realtime.endpoint) as wire, wire.control("guard", lease_s=600.0) as token:
        yield Guard(realtime, wire.listen("state", "event", "telemetry"), token)


def of(type, **fields):  # noqa: A002
    """A command with the token of the lease, which is known only when the test runs."""
    return lambda token: pack(type, token=token, **fields)


def cut(token):
    return pack("move_j", token=token, q=Q1)[:-5]


def trailing(token):
    return pack("move_j", token=token, q=Q1) + b"\x00"


def unless(field, value):
    """Q1 with one angle changed."""
    return [value if number == field else angle for number, angle in enumerate(Q1)]


def calibration(**changes):
    """A calibration sent as a map, with keys changed."""
    content = {
        "name": "mine", "robot": "UR5e",
        "payload": {"mass": 5.0, "com": [0.0, 0.0, 0.05], "inertia": [0.01, 0.0, 0.0, 0.01, 0.0, 0.01]},
        "polynomial": {
            "joints": [1], "degree": 0, "f_d_coefficients": [10.0], "zeta_coefficients": [0.2],
            "f_d_range": [5.0, 20.0], "zeta_range": [0.1, 0.4],
        },
        "provenance": {
            "command": "by hand", "version": "1", "seed": None, "configurations": 1, "ring_downs": 1, "rejected": 0,
            "measured_f_d_range": [5.0, 20.0], "measured_zeta_range": [0.1, 0.4],
            **{
                f"{how}_{what}_percent": {"median": 1.0, "p90": 2.0}
                for how in ("residual", "cross_validated") for what in ("f_d", "zeta")
            },
        },
        **changes,
    }  # fmt: skip
    return {key: value for key, value in content.items() if value is not ...}


def estimator(**changes):
    return of("set_estimator", name="polynomial", calibration=calibration(**changes))


CASES = {
    # no message at all
    "empty payload": (b"", "malformed", ""),
    "no map": (msgpack.packb([1, 2, 3]), "malformed", ""),
    "a number": (msgpack.packb(7), "malformed", ""),
    "text": (b"take_control please", "malformed", ""),
    "truncated": (cut, "malformed", ""),
    "trailing byte": (trailing, "malformed", ""),
    "5 MB of zeros": (MEGABYTES, "malformed", ""),
    "5 MB in a field": (msgpack.packb({"type": "stop", "token": "x" * 5_000_000}), "malformed", ""),
    "a declared length beyond memory": (b"\xdf\xff\xff\xff\xff", "malformed", ""),
    "nested a thousand deep": (b"\x81\xa4type" + b"\x91" * 1000, "malformed", "type"),
    "text that is no UTF-8": (b"\x81\xa4type\xa4\xff\xfe\xfd\xfc", "malformed", ""),
    # type
    "no type": (msgpack.packb({"token": "x"}), "missing_field", "type"),
    "unknown type": (pack("dance"), "unknown_type", "type"),
    "type is a number": (msgpack.packb({"type": 3}), "malformed", "type"),
    # fields
    "unknown field": (of("move_j", q=Q1, vel=1.0), "unknown_field", "vel"),
    "missing field": (of("move_j"), "missing_field", "q"),
    "missing token": (pack("move_j", q=Q1), "missing_field", "token"),
    "wrong type of a number": (of("move_j", q=Q1, velocity="fast"), "malformed", "velocity"),
    "wrong type of an angle": (of("move_j", q=unless(3, "half")), "malformed", "q[3]"),
    "null for a number": (of("move_j", q=Q1, jerk=None), "malformed", "jerk"),
    "a boolean for a number": (of("move_j", q=Q1, velocity=True), "malformed", "velocity"),
    "a scalar for a list": (of("move_j", q=1.0), "malformed", "q"),
    "NaN": (of("move_j", q=Q1, velocity=NAN), "out_of_range", "velocity"),
    "NaN angle": (of("move_j", q=unless(2, NAN)), "out_of_range", "q[2]"),
    "infinity": (of("move_j", q=unless(5, INF)), "out_of_range", "q[5]"),
    "minus infinity": (of("stop", deceleration=-INF), "out_of_range", "deceleration"),
    "zero velocity": (of("move_j", q=Q1, velocity=0.0), "out_of_range", "velocity"),
    "five joints": (of("move_j", q=Q1[:5]), "out_of_range", "q"),
    "seven joints": (of("move_j", q=[*Q1, 0.0]), "out_of_range", "q"),
    "eight joints": (of("move_j", q=[*Q1, 0.0, 0.0]), "out_of_range", "q"),
    "no joints": (of("move_j", q=[]), "out_of_range", "q"),
    # limits of the arm
    "target outside the limits": (of("move_j", q=unless(1, 6.3)), "limit_position", "q[1]"),
    "velocity above the limit": (of("move_j", q=Q1, velocity=4.0), "limit_velocity", "velocity"),
    "acceleration above the limit": (of("move_j", q=Q1, acceleration=41.0), "limit_acceleration", "acceleration"),
    "jerk above the limit": (of("servo_start", jerk=1e5), "out_of_range", "jerk"),
    "stream faster than the tick": (of("servo_start", period=0.001), "out_of_range", "period"),
    "reset outside the limits": (of("simulation.reset", q=unless(0, 7.0)), "limit_position", "q[0]"),
    "payload too heavy": (
        of("set_payload", mass=50.0, com=[0, 0, 0], inertia=[1, 0, 0, 1, 0, 1]), "out_of_range", "mass"
    ),
    "payload that no body is": (
        of("set_payload", mass=1.0, com=[0, 0, 0], inertia=[1, 0, 0, 0.1, 0, 0.1]), "out_of_range", "inertia"
    ),
    # lease
    "no token at all": (pack("servo_stop"), "missing_field", "token"),
    "empty token": (pack("move_j", token="", q=Q1), "stale_token", "token"),
    "another's token": (pack("move_j", token="other#1", q=Q1), "stale_token", "token"),
    "stop with another's token": (pack("stop", token="other#1"), "stale_token", "token"),
    "take what another holds": (pack("take_control", client="other"), "no_control", "token"),
    "a client's name with a slash": (pack("take_control", client="a/b"), "out_of_range", "client"),
    "a lease that ends at once": (pack("take_control", client="other", lease_s=0.0), "out_of_range", "lease_s"),
    "another protocol": (pack("take_control", client="guard", protocol=2), "unsupported_version", "protocol"),
    # names
    "unknown shaper": (of("set_shaper", name="zvx"), "unknown_shaper", "name"),
    "another number of modes": (of("set_shaper", name="auto", modes=2), "out_of_range", "modes"),
    "unknown shaper in a reset": (of("simulation.reset", shaper="zvx"), "unknown_shaper", "shaper"),
    "unknown estimator": (of("set_estimator", name="oracle"), "unknown_estimator", "name"),
    "unknown calibration": (
        of("set_estimator", name="polynomial", calibration="nope"), "unknown_calibration", "calibration"
    ),
    "a path for a calibration": (
        of("set_estimator", name="polynomial", calibration="/etc/passwd"), "unknown_calibration", "calibration"
    ),
    "fixed without its damping": (of("set_estimator", name="fixed", f_d=[10.0]), "missing_field", "zeta"),
    # a calibration as a map
    "calibration with an unknown key": (estimator(colour="red"), "unknown_field", "calibration.colour"),
    "calibration with a missing key": (estimator(payload=...), "missing_field", "calibration.payload"),
    "calibration of another arm": (estimator(robot="UR3"), "out_of_range", "calibration.robot"),
    "calibration with NaN": (estimator(name=NAN), "out_of_range", "calibration.name"),
    "calibration with too few coefficients": (
        estimator(polynomial={**calibration()["polynomial"], "degree": 3}), "out_of_range", "calibration"
    ),
    # what does not fit now
    "steps in real time": (of("simulation.step", ticks=1), "wrong_mode", "type"),
    "too many steps": (of("simulation.step", ticks=100_001), "out_of_range", "ticks"),
    "servo_stop without a stream": (of("servo_stop"), "wrong_mode", ""),
    "an unknown mode": (of("simulation.reset", mode="DANCING"), "out_of_range", "mode"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_a_bad_command_is_refused_by_code_and_field_and_changes_nothing(guard, case):
    payload, code, where = CASES[case]
    guard.refuses(payload(guard.token) if callable(payload) else payload, code, where)


def test_the_sentence_about_a_calibration_names_the_key(guard):
    said = guard.refuses(estimator(colour="red")(guard.token), "unknown_field", "calibration.colour")["why"]
    assert "colour" in said
    said = guard.refuses(estimator(payload=...)(guard.token), "missing_field", "calibration.payload")["why"]
    assert "payload" in said


def test_a_sound_calibration_as_a_map_is_taken(guard):
    wire = guard.wire
    assert wire.raw(estimator()(guard.token)) == {"type": "done"}
    assert wire.info()["calibration"]["name"] == "mine"
    assert wire.command("set_estimator", token=guard.token, name="polynomial") == {"type": "done"}
    assert wire.info()["calibration"]["name"] == "ur5e_5kg"


def test_a_query_without_a_payload_is_refused(guard):
    info, state = guard.wire.info(), guard.wire.state()
    (answer,) = guard.wire.ask(guard.wire.key("command"))
    assert (answer["type"], answer["code"]) == ("refused", "malformed")
    guard.unchanged(info, state)


@pytest.mark.parametrize("key", ["tvist/*/command", "tvist/ur5e/*", "tvist/**", "**"])
def test_a_command_on_a_key_with_a_wildcard_is_refused(guard, key):
    info, state = guard.wire.info(), guard.wire.state()
    answers = guard.wire.ask(key, pack("stop", token=guard.token))
    assert answers
    assert {(answer["code"], answer["where"]) for answer in answers} == {("malformed", "key")}
    guard.unchanged(info, state)


def test_five_hundred_payloads_of_random_bytes_are_refused(guard):
    rng = random.Random(0)
    info, state = guard.wire.info(), guard.wire.state()
    whole = pack("move_j", token=guard.token, q=Q1)
    for _ in range(250):
        assert guard.wire.raw(rng.randbytes(rng.randrange(1, 60)))["type"] == "refused"
        spoilt = bytearray(whole[: rng.randrange(1, len(whole))])
        spoilt[rng.randrange(len(spoilt))] = rng.randrange(256)
        assert guard.wire.raw(bytes(spoilt))["type"] == "refused"
    guard.unchanged(info, state)


NEEDS_REST = {
    "move_j": {"q": Q1},
    "servo_start": {},
}


class TestWhileMoving:
    """Some commands are sound, only not now."""

    def test_what_needs_rest_is_busy_and_the_motion_goes_on_to_its_end(self, guard):
        wire, token = guard.wire, guard.token
        before = wire.info()
        motion = wire.command("move_j", token=token, q=unless(0, 0.5))["id"]
        wire.wait("state", lambda state: state["target_qd"][0] > 0.2)
        for kind, fields in NEEDS_REST.items():
            answer = wire.command(kind, token=token, **fields)
            assert (answer["type"], answer["code"]) == ("refused", "busy"), kind
        done = wire.wait("event", lambda event: event["kind"] == "motion_done" and event["id"] == motion)
        assert wire.until(done["tick"])["target_q"] == pytest.approx(unless(0, 0.5), abs=1e-6)
        assert settled(wire.info()) == settled(before)
        assert wire.command("simulation.reset", token=token, q=Q1)["type"] == "done"
        wire.next("state", lambda state: state["target_q"] == Q1)


class TestSetpoints:
    """Nobody waits for an answer to a set-point: what is wrong with one is counted in telemetry, and dropped."""

    def counted(self, guard, puts):
        """Put set-points; how many more were received and refused by the next telemetry that has seen them."""
        wire = guard.wire
        before = wire.next("telemetry")
        state = wire.state()
        puts()
        tick = wire.info()["tick"]  # a query goes the same way: what was put before has arrived
        after = wire.wait("telemetry", lambda telemetry: telemetry["tick"] > tick)
        later = wire.state()
        assert later["target_q"] == state["target_q"]
        guard.served.assert_quiet()
        return tuple(after[name] - before[name] for name in ("setpoints_received", "setpoints_refused"))

    def test_without_a_stream_they_are_refused_and_the_arm_does_not_move(self, guard):
        def puts():
            for sequence in range(5):
                guard.wire.setpoint(token=guard.token, sequence=sequence, q=unless(0, 0.1))

        assert self.counted(guard, puts) == (5, 5)

    def test_in_a_stream_the_bad_ones_are_refused_and_the_good_one_is_played(self, guard):
        wire, token = guard.wire, guard.token
        good = {"token": token, "sequence": 0, "q": Q1}

        def puts():
            wire.put(MEGABYTES)  # which may take longer than a stream waits for its first set-point
            assert wire.command("servo_start", token=token) == {"type": "done"}
            for spoilt in (
                {"token": "stale"}, {"token": 3}, {"q": Q1[:5]}, {"q": [*Q1, 0.0]}, {"q": unless(0, NAN)},
                {"q": unless(0, INF)}, {"q": unless(0, 6.5)}, {"q": "home"}, {"sequence": -1}, {"sequence": 1.5},
                {"speed": 1.0},
            ):  # fmt: skip
                wire.setpoint(**{**good, **spoilt})
            for payload in (
                b"",
                b"\xc1",
                pack("setpoint", **good)[:-3],
                pack("stop"),
                pack("move_j", q=Q1),
            ):
                wire.put(payload)
            for key in (
                "tvist/*/setpoint",
                "tvist/**",
            ):  # access control drops these: they would reach others, too
                wire.session.put(key, pack("setpoint", **good))
            wire.setpoint(**good)
            wire.next("state", lambda state: state["setpoint_sequence"] == 0)
            assert wire.command("servo_stop", token=token) == {"type": "done"}
            wire.next("state", lambda state: state["runtime_state"] == STOPPED)

        assert self.counted(guard, puts) == (18, 17)

    def test_one_that_would_move_the_arm_is_not_played_without_the_token(self, guard):
        wire, token = guard.wire, guard.token
        assert wire.command("servo_start", token=token) == {"type": "done"}
        first = wire.state()
        for sequence in range(50):
            wire.setpoint(token="stale", sequence=sequence, q=unless(0, 0.01 * sequence))
        stopped = wire.wait(
            "event", lambda event: event["kind"] == "stream_stopped" and event["tick"] > first["tick"]
        )
        states = [
            state for state in wire.received["state"] if first["tick"] <= state["tick"] <= stopped["tick"]
        ]
        assert all(state["target_q"] == first["target_q"] for state in states)
        assert {state["setpoint_sequence"] for state in states} == {None}


def test_after_all_this_the_arm_still_moves_and_the_refused_were_counted(guard):
    wire = guard.wire
    telemetry = wire.next("telemetry")
    assert telemetry["refused"] > len(CASES)
    assert telemetry["commands"] > telemetry["refused"]
    motion = wire.command("move_j", token=guard.token, q=unless(0, 0.05))["id"]
    wire.wait("event", lambda event: event["kind"] == "motion_done" and event["id"] == motion)
    guard.served.assert_quiet()
