"""Rights of clients of a secured robot by their roles, with real certificates."""

import queue

import msgpack
import pytest
import zenoh
from tests.conformance.wire import PATIENCE, Q1
from zenoh.handlers import Callback

from tvist_client import Robot
from tvist_client.blocking import Robot as BlockingRobot
from tvist_client.errors import DeniedError, NotConnectedError
from tvist_client.fleet import Fleet, RobotPlace
from tvist_client.transports import zenoh as transport
from tvist_view.pilot import Pilot

from .conftest import STREAMS

pytestmark = pytest.mark.realtime

NEAR, FAR = ([angle, *Q1[1:]] for angle in (0.1, 1.0))
REMOTE = zenoh.Locality.REMOTE


@pytest.fixture(params=["client", "router"])
def viewer(session, request):
    """A viewer, also as a Zenoh router, which receives most and forwards messages of others."""
    return session("wall", mode=request.param)


def arrived(wire):
    """Wait until everything that this session has sent has arrived, by a query on the same way."""
    return wire.info()


def counted(operator, since):
    """Return the first telemetry after a tick."""
    return operator.wait("telemetry", lambda telemetry: telemetry["tick"] > since)


def everything(wire):
    """Return a queue of everything that reaches a session from outside on any key."""
    heard = queue.Queue()
    direct = Callback(heard.put, indirect=False)
    leaves = (*STREAMS, "setpoint", "command", "info", "alive", "client/*")
    for key in ("**", "tvist/**", "tvist/ur5e/*", "tvist/*/alive", *map(wire.key, leaves)):
        wire.session.declare_subscriber(key, direct, allowed_origin=REMOTE)
        wire.session.declare_queryable(key, direct, allowed_origin=REMOTE)
        wire.session.liveliness().declare_subscriber(key, direct, history=True)
    return heard


def keys_in(heard):
    found = set()
    while not heard.empty():
        item = heard.get()
        found.add(str(item.key_expr))
        if isinstance(item, zenoh.Query):
            item.drop()
    return found


def stream_once(operator):
    """Play a set-point, and wait until telemetry has counted it."""
    with operator.control("anna") as token:
        operator.command("servo_start", token=token)
        operator.setpoint(token=token, sequence=0, q=Q1)
        operator.next("state", lambda state: state["setpoint_sequence"] == 0)
    operator.next("telemetry")


def test_operator_moves_and_streams_and_receives_everything(operator):
    with operator.control("anna") as token:
        motion = operator.command("move_j", token=token, q=NEAR)["id"]
        done = operator.wait("event", lambda event: event["kind"] == "motion_done" and event["id"] == motion)
        assert operator.until(done["tick"])["target_q"] == pytest.approx(NEAR, abs=1e-6)
        assert operator.wait("truth")["type"] == "truth"
    stream_once(operator)


class TestViewer:
    def test_receives_all_topics(self, viewer, operator):
        viewer.listen(*STREAMS)
        assert viewer.info()["type"] == "info"
        with operator.control("anna") as token:
            motion = operator.command("move_j", token=token, q=[0.1, *Q1[1:]])["id"]
            viewer.wait("event", lambda event: event["kind"] == "motion_done" and event["id"] == motion)
        for topic in STREAMS:
            assert viewer.wait(topic)["tick"] > 0
        alive = list(viewer.session.liveliness().get("tvist/*/alive", timeout=PATIENCE))
        assert [str(reply.ok.key_expr) for reply in alive] == ["tvist/ur5e/alive"]

    def test_cannot_command_the_robot_even_with_the_token_of_the_lease(self, viewer, operator):
        everywhere = ("tvist/*/{}", "tvist/ur5e/*", "tvist/**", "**")
        with operator.control("anna") as token:
            operator.command("servo_start", token=token)
            operator.setpoint(token=token, sequence=0, q=Q1)
            began = operator.next("state", lambda state: state["setpoint_sequence"] == 0)
            before = counted(operator, arrived(operator)["tick"])
            for key in ("tvist/ur5e/command", *everywhere):
                for fields in ({"type": "move_j", "token": token, "q": FAR}, {"type": "stop"}):
                    assert viewer.ask(key.format("command"), msgpack.packb(fields)) == []
            for sequence, key in enumerate(("tvist/ur5e/setpoint", *everywhere), 1):
                spoilt = {"type": "setpoint", "token": token, "sequence": sequence, "q": [0.01, *Q1[1:]]}
                viewer.session.put(key.format("setpoint"), msgpack.packb(spoilt))
                viewer.session.delete(key.format("setpoint"))
            until = arrived(viewer)["tick"]
            after = counted(operator, until)
        states = [state for state in operator.received["state"] if state["tick"] >= began["tick"]]
        assert {state["setpoint_sequence"] for state in states} <= {0, None}
        assert all(state["target_q"] == Q1 for state in states)
        for name in ("commands", "setpoints_received"):
            assert after[name] == before[name]

    def test_cannot_end_the_lease_of_an_operator_by_a_liveliness_token_of_its_name(self, viewer, operator):
        # A lease ends with a liveliness token that existed when control was taken.
        forged = viewer.session.liveliness().declare_token("tvist/ur5e/client/anna")
        arrived(viewer)
        with operator.control("anna") as token:
            forged.undeclare()
            until = arrived(viewer)["tick"]
            operator.until(until + 10)
            assert operator.command("keep_alive", token=token) == {"type": "done"}

    def test_cannot_publish_or_answer_in_place_of_the_robot(self, viewer, operator, session):
        heard = everything(viewer)
        other = session("otto").listen("state", "event")
        for leaf in ("state", "event", "*"):
            forged = msgpack.packb({"type": "forged"})
            viewer.session.put(viewer.key(leaf), forged, encoding="application/msgpack")
        arrived(viewer)
        stream_once(operator)
        arrived(viewer)
        for wire in (operator, other):
            arrived(wire)
            messages = [message for topic in wire.received.values() for message in topic]
            assert "forged" not in {message["type"] for message in messages}
        assert keys_in(heard) == {f"tvist/ur5e/{topic}" for topic in (*STREAMS, "alive")}

    async def test_gets_the_reason_from_client_page_and_fleet(self, served, ring):
        said = []
        async with await Robot.connect(served.endpoint, security=ring / "wall") as robot:
            with pytest.raises(DeniedError, match="may only watch: use an operator's certificate"):
                async with robot.control("wall"):
                    pass
            pilot = Pilot(robot, "page", said.append)
            assert not await pilot.take(1)
            await pilot.stop()
        async with Fleet(served.endpoint, security=ring / "wall") as fleet:
            said += [report.said for report in await fleet.stop([RobotPlace("", "ur5e")])]
        assert len(said) == 3
        assert all("takes no commands from this client" in sentence for sentence in said)
        assert all("an operator's certificate" in sentence for sentence in said)


class TestStranger:
    @pytest.mark.parametrize("mode", ["client", "router"])
    def test_with_a_certificate_but_no_role_receives_nothing(self, session, operator, mode):
        stranger = session("gone", mode=mode)
        heard = everything(stranger)
        for key in ("tvist/ur5e/info", "tvist/ur5e/command", "tvist/ur5e/*", "tvist/**", "**"):
            asked = stranger.session.get(key, payload=b"", timeout=PATIENCE, allowed_destination=REMOTE)
            assert [*asked, *stranger.session.liveliness().get(key, timeout=PATIENCE)] == []
        assert list(stranger.session.liveliness().get("tvist/*/alive", timeout=PATIENCE)) == []
        stream_once(operator)
        assert keys_in(heard) == set()

    def test_gets_the_reason_from_the_client(self, served, ring, monkeypatch):
        monkeypatch.setattr(transport, "LATE_S", 1.2)
        with pytest.raises(NotConnectedError, match="that the robot lists the name of this certificate"):
            BlockingRobot.connect(served.endpoint, security=ring / "gone")
