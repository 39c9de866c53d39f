"""The contract over the wire, seen by a client that has only eclipse-zenoh and msgpack."""

import json
import math
from functools import cache
from pathlib import Path

import jsonschema
import msgpack
import pytest

from .served import Served, free_endpoint
from .wire import PATIENCE, PLAYING, Q1, STATE_FIELDS, STOPPED, TICK, Wire

Q_NEAR = [angle + 0.1 for angle in Q1]
BENT = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
SCHEMAS = Path(__file__).parents[2] / "protocol" / "schemas"


@cache
def schema_of(kind):
    return jsonschema.Draft202012Validator(json.loads((SCHEMAS / f"{kind}.json").read_text(encoding="utf-8")))


def validate(message):
    validator = schema_of(message["type"])
    validator.validate(message)
    undocumented = set(message) - set(validator.schema["properties"])
    assert not undocumented, f"{message['type']} has fields that no schema names: {undocumented}"


def ticks_of(messages):
    return [message["tick"] for message in messages]


class TestStates:
    def test_real_time_states_arrive_once_and_in_order(self, live):
        """On a busy machine some are dropped, as the protocol allows in real time."""
        live.listen("state")
        last = live.until(live.wait("state")["tick"] + 100)
        states = [state for state in list(live.received["state"]) if state["tick"] <= last["tick"]]
        ticks = ticks_of(states)
        assert ticks == sorted(set(ticks))
        assert all(state["timestamp"] == state["tick"] * TICK for state in states)

    def test_lockstep_sends_exactly_the_requested_ticks(self, stepped):
        stepped.listen("state", "truth")
        with stepped.control() as token:
            before = stepped.step(token, 1)["tick"]
            after = stepped.step(token, 250)["tick"]
            stepped.wait("truth", lambda truth: truth["tick"] == after)
        assert after == before + 250
        for topic in ("state", "truth"):
            ticks = [tick for tick in ticks_of(stepped.received[topic]) if tick >= before]
            assert list(dict.fromkeys(ticks)) == list(range(before, after + 1)), topic
        assert all(state["timestamp"] == state["tick"] * TICK for state in stepped.received["state"])

    def test_a_state_has_the_fields_of_the_interface_and_no_other(self, live):
        state = live.state()
        assert set(state) == STATE_FIELDS
        joints = (name for name in STATE_FIELDS if name.endswith(("_q", "_qd", "_qdd", "_moment")))
        assert all(state[name] is None or len(state[name]) == 6 for name in joints)
        # Without a shaped motion, the reference before shaping is the target itself and is left out; so is what only
        # elastic feed-forward knows, and a force sensor.
        left_out = {name for name in STATE_FIELDS if state[name] is None}
        assert all(name.startswith(("unshaped_", "setpoint_", "motor_", "flange_")) for name in left_out)
        assert sum(a * a for a in state["actual_tool_accelerometer"]) ** 0.5 == pytest.approx(9.81, abs=0.3)
        assert (state["robot_mode"], state["safety_mode"], state["runtime_state"]) == (7, 1, STOPPED)
        assert state["setpoint_sequence"] is None

    def test_a_late_subscriber_in_lockstep_gets_the_last_state(self, lockstep, stepped):
        with stepped.control() as token:
            last = stepped.step(token, 3)
            with Wire(lockstep.endpoint) as late:
                late.listen("state")
                assert late.wait("state") == last
                assert late.info()["tick"] == last["tick"]


class TestMotion:
    def test_a_motion_sends_started_then_done_and_ends_at_its_target(self, live):
        live.listen("state", "event")
        with live.control() as token:
            answer = live.command("move_j", token=token, q=Q_NEAR)
            assert answer["type"] == "accepted"
            done = live.wait("event", lambda event: event["kind"] == "motion_done")
            still = live.until(done["tick"])
        events = [event for event in live.received["event"] if event.get("id") == answer["id"]]
        assert [event["kind"] for event in events] == ["motion_started", "motion_done"]
        assert events[0]["tick"] < events[1]["tick"]
        assert still["target_q"] == pytest.approx(Q_NEAR, abs=1e-6)
        moving = [s for s in live.received["state"] if events[0]["tick"] < s["tick"] < done["tick"]]
        assert {state["runtime_state"] for state in moving} == {PLAYING}
        assert still["runtime_state"] == STOPPED

    def test_a_stop_without_a_token_sends_one_motion_stopped(self, live):
        live.listen("state", "event")
        with live.control() as token:
            answer = live.command("move_j", token=token, q=[1.0, *Q1[1:]], velocity=0.4)
            live.wait("state", lambda state: state["target_qd"][0] > 0.3)
            assert live.command("stop") == {"type": "done"}
            live.wait("event", lambda event: event["kind"] == "motion_stopped")
            rest = live.next("state", lambda state: state["runtime_state"] == STOPPED)
        assert 0.0 < rest["target_q"][0] < 1.0
        told = [event["kind"] for event in live.received["event"] if event.get("id") == answer["id"]]
        assert told == ["motion_started", "motion_stopped"]

    def test_a_line_is_straight_and_ends_at_its_pose(self, stepped):
        def pose_at(q):
            return stepped.command("forward_kinematics", q=q)["pose"]

        stepped.listen("state", "event")
        x, y, z, *rotation = start = pose_at(BENT)
        goal = [x + 0.1, y + 0.1, z - 0.05, *rotation]
        with stepped.control() as token:
            stepped.command("simulation.reset", token=token, q=BENT, seed=0)
            before = stepped.step(token, 1)["tick"]
            answer = stepped.command("move_l", token=token, pose=goal)
            while (last := stepped.step(token, 100))["runtime_state"] != STOPPED:
                pass
            stepped.wait(
                "event", lambda event: event["kind"] == "motion_done" and event["id"] == answer["id"]
            )
        told = [event["kind"] for event in stepped.received["event"] if event.get("id") == answer["id"]]
        assert told == ["motion_started", "motion_done"]
        assert pose_at(last["target_q"]) == pytest.approx(goal, abs=1e-9)
        inside = stepped.command("forward_kinematics", q=last["target_q"], frame=goal)
        assert inside["pose"] == pytest.approx([0.0] * 6, abs=1e-9)
        way = math.dist(goal[:3], start[:3])
        states = [state for state in stepped.received["state"] if before <= state["tick"] <= last["tick"]]
        for state in states[::50]:
            at = pose_at(state["target_q"])
            there, left = math.dist(at[:3], start[:3]), math.dist(at[:3], goal[:3])
            assert there + left == pytest.approx(way, abs=1e-5)
            assert at[3:] == pytest.approx(rotation, abs=1e-5)

    def test_a_stream_is_played_and_its_sequence_is_published(self, stepped):
        with stepped.control() as token:
            assert stepped.command("servo_start", token=token) == {"type": "done"}
            setpoints = [{"sequence": n, "q": [Q1[0] + 1e-5 * n, *Q1[1:]]} for n in range(100)]
            state = stepped.step(token, 100, setpoints=setpoints)
            assert state["setpoint_sequence"] == 99
            assert state["reference_q"][0] == pytest.approx(99e-5, abs=1e-9)
            assert stepped.command("servo_stop", token=token) == {"type": "done"}


class TestControl:
    def test_a_second_client_is_refused_control_with_the_name_of_the_first(self, live):
        with live.control("first") as token:
            assert live.info()["control"] == "first"
            refused = live.command("take_control", client="second")
            assert (refused["type"], refused["code"]) == ("refused", "no_control")
            assert "first" in refused["why"]
            assert live.command("keep_alive", token=token) == {"type": "done"}
        assert live.info()["control"] is None

    def test_take_control_returns_the_granted_lease(self, live):
        answer = live.command("take_control", client="short", lease_s=12.5)
        assert answer == {"type": "accepted", "token": answer["token"], "lease_s": 12.5}
        assert live.command("release_control", token=answer["token"]) == {"type": "done"}

    def test_a_refusal_contains_code_field_reason_and_limit(self, live):
        refused = live.command("move_j", token="", q=Q1)  # `raw` asserts that it is no reply_err
        assert refused.keys() == {"type", "code", "where", "why", "limit"}
        assert (refused["type"], refused["code"], refused["where"]) == ("refused", "no_control", "token")
        with live.control() as token:
            refused = live.command("simulation.step", token=token, ticks=1)
            assert (refused["type"], refused["code"]) == ("refused", "wrong_mode")
            setpoint = msgpack.packb({"type": "setpoint", "token": token, "sequence": 0, "q": Q1})
            for data, code, where in ((setpoint, "unknown_type", "type"), (b"", "malformed", "")):
                refused = live.raw(data)
                assert (refused["code"], refused["where"]) == (code, where)

    def test_a_reset_places_the_arm_at_rest_and_keeps_lease_and_tick(self, stepped):
        with stepped.control() as token:
            before = stepped.step(token, 5)["tick"]
            answer = stepped.command("simulation.reset", token=token, q=Q_NEAR, seed=7)
            assert answer == {"type": "done", "tick": before}
            state = stepped.step(token, 1)
        assert state["tick"] == before + 1
        assert state["target_q"] == Q_NEAR
        assert state["target_qd"] == [0.0] * 6

    def test_kinematics_are_answered_without_control(self, stepped):
        pose = stepped.command("forward_kinematics", q=BENT)
        answer = stepped.command("inverse_kinematics", pose=pose["pose"], near=BENT)
        validate(pose)
        validate(answer)
        assert answer["q"] == pytest.approx(BENT, abs=1e-9)
        refused = stepped.command("inverse_kinematics", pose=[2.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        assert (refused["type"], refused["code"], refused["where"]) == ("refused", "no_solution", "pose")


class TestIo:
    def test_io_is_sent_before_the_state_of_a_change_and_once_a_second(self, stepped):
        stepped.listen("state", "io")
        with stepped.control() as token:
            stepped.step(token, 1)
            answer = stepped.command("set_io", token=token, digital_output_mask=0x101, digital_outputs=0x100)
            assert answer == {"type": "done"}
            tick = stepped.step(token, 3)["tick"]
            told = list(stepped.received["io"])
        # Telemetry may have sent the inputs and outputs of the same tick before they changed.
        *_, io = (message for message in told if message["tick"] == tick - 2)
        assert io["actual_digital_output_bits"] == 0x100
        again = stepped.next("io")
        assert again == {**io, **{name: again[name] for name in ("tick", "actual_TCP_force")}}
        assert again["tick"] > io["tick"]

    def test_only_output_registers_require_control(self, live):
        live.listen("io")
        io = live.wait("io")  # a late client gets it, too
        assert (io["tcp_offset"], io["payload"]["mass"], io["target_speed_fraction"]) == ([0.0] * 6, 5.0, 1.0)
        written = live.command("set_registers", bank="input_double", first=24, values=[1.5, -2])
        assert written == {"type": "done"}
        io = live.wait("io", lambda io: io["input_double_register"][24] == 1.5)
        assert io["input_double_register"][25] == -2.0
        refused = live.command("set_registers", bank="output_int", values=[1])
        assert (refused["code"], refused["where"]) == ("missing_field", "token")
        with live.control() as token:
            assert live.command("set_registers", token=token, bank="output_int", values=[7])["type"] == "done"
            live.wait("io", lambda io: io["output_int_register"][0] == 7)

    def test_a_tool_centre_point_moves_the_pose(self, stepped):
        with stepped.control() as token:
            before = stepped.step(token, 1)["actual_TCP_pose"]
            assert stepped.command("set_tcp", token=token, offset=[0, 0, 0.1, 0, 0, 0])["type"] == "done"
            after = stepped.step(token, 2)["actual_TCP_pose"]
            assert math.dist(after[:3], before[:3]) == pytest.approx(0.1, abs=1e-4)
            assert stepped.command("set_tcp", token=token, offset=[0] * 6)["type"] == "done"


class TestMessages:
    def test_every_kind_of_message_fits_its_schema(self, stepped):
        stepped.listen("state", "event", "truth", "telemetry", "io")
        with stepped.control() as token:
            said = [stepped.info(), stepped.command("keep_alive", token="stale")]
            said.append(stepped.command("move_j", token=token, q=Q_NEAR))
            stepped.step(token, 100)
            said.append(stepped.command("stop"))
            stepped.step(token, 200)
            said.append(stepped.command("set_shaper", token=token, name="zvd"))
            stepped.step(token, 1)
            stepped.wait("telemetry")
            stepped.wait("io")
        for messages in stepped.received.values():
            said += messages
        kinds = {message["type"] for message in said}
        assert kinds == {"info", "refused", "accepted", "done", "state", "event", "truth", "telemetry", "io"}
        for message in {json.dumps(message): message for message in said}.values():
            validate(message)

    def test_info_describes_protocol_model_limits_and_settings(self, live):
        info = live.info()
        said = tuple(info[name] for name in ("name", "protocol", "model", "clock", "shaper", "estimator"))
        assert said == ("ur5e", 1, "UR5e", "realtime", "zv", "polynomial")
        assert info["rate_hz"] == 500.0
        assert len(info["joints"]) == len(info["limits"]["position"]) == 6
        assert info["payload"]["mass"] == 5.0
        assert info["calibration"]["fits_payload"] is True
        assert {"none", "zv", "zvd", "ei", "mzv", "ei2", "ei3"} <= set(info["shapers"])

    def test_telemetry_repeats_and_contains_the_tick_rate(self, live):
        """The rate is 500 if the machine is fast enough."""
        live.listen("telemetry")
        first, second = live.next("telemetry"), live.next("telemetry")
        assert second["tick"] > first["tick"]
        assert second["ticks_per_second"] > 0.0

    def test_truth_is_published_with_the_option_and_on_the_local_machine(self, live, stepped):
        live.listen("truth")
        live.wait("truth")
        stepped.listen("truth")
        with stepped.control() as token:
            tick = stepped.step(token, 2)["tick"]
        truth = stepped.wait("truth", lambda truth: truth["tick"] == tick)
        assert truth["timestamp"] == tick * TICK
        assert truth["f_d"][0] == pytest.approx(6.7, rel=0.05)

    def test_the_server_declares_its_liveliness(self, live):
        (reply,) = live.session.liveliness().get("tvist/*/alive", timeout=PATIENCE)
        assert str(reply.ok.key_expr) == "tvist/ur5e/alive"


def test_truth_is_not_published_to_other_machines_by_default():
    port = free_endpoint().rpartition(":")[2]
    with Served("--insecure", endpoint=f"tcp/0.0.0.0:{port}"), Wire(f"tcp/127.0.0.1:{port}") as wire:
        wire.listen("state", "truth")
        wire.until(wire.wait("state")["tick"] + 100)
        assert wire.received["truth"] == []


def test_reconnecting_under_the_same_name_replaces_the_lease(realtime, live):
    old = live.command("take_control", client="again")["token"]
    with Wire(realtime.endpoint) as other, other.control("again") as new:
        assert new != old
        refused = live.command("keep_alive", token=old)
        assert (refused["type"], refused["code"]) == ("refused", "stale_token")
