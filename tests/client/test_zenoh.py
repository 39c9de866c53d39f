"""The client over real Zenoh sessions."""

import asyncio
import gc
import socket
import struct
import threading

import pytest
import zenoh

from tvist_client import MisuseError, NotConnectedError, Robot, ZenohTransport
from tvist_client.errors import AnswerTimeoutError, MotionStoppedError
from tvist_client.fleet import Fleet, RobotPlace
from tvist_client.transports import certificates
from tvist_client.transports import zenoh as zenoh_transport
from tvist_client.transports.zenoh import robots_at
from tvist_protocol.codec import encode
from tvist_protocol.commands import KeepAlive
from tvist_protocol.replies import Accepted
from tvist_protocol.stream import Event

from .conftest import NEAR, Served

FAR = (1.0, *NEAR[1:])


@pytest.fixture
async def robot(request, endpoint):
    """A client of whichever robot the test serves."""
    served = {"realtime", "lockstep"} & set(request.fixturenames)
    request.getfixturevalue(served.pop())
    async with await Robot.connect(endpoint) as robot:
        yield robot


async def test_a_session_is_closed_if_opening_is_cancelled(monkeypatch):
    go, closed = threading.Event(), []
    monkeypatch.setattr(zenoh_transport, "open_session", lambda *_: go.wait())
    monkeypatch.setattr(zenoh_transport, "close_session", closed.append)
    opening = asyncio.create_task(ZenohTransport.open("tcp/nowhere", "ur5e"))
    for step in (opening.cancel, go.set):
        asyncio.get_running_loop().call_later(0.0, step)
    with pytest.raises(asyncio.CancelledError):
        await opening
    assert closed == [True]


async def test_connecting_to_an_unknown_robot_names_the_robots_there(realtime, endpoint, monkeypatch):
    monkeypatch.setattr(zenoh_transport, "FIND_S", 0.1)
    monkeypatch.setattr(zenoh_transport, "LATE_S", 0.2)
    with pytest.raises(NotConnectedError, match=r"no robot 'ur3' .*; the robots there are ur5e: check name"):
        await Robot.connect(endpoint, "ur3")
    where = f"'ur5e' at {endpoint} in namespace hall-3; none answered in 0.2 s: check name, namespace and endpoint"
    with pytest.raises(NotConnectedError, match=where):
        await Robot.connect(endpoint, namespace="hall-3")


async def test_a_liveliness_token_with_an_invalid_name_is_ignored(endpoint):
    config = zenoh.Config.from_json5(f'{{mode: "router", listen: {{endpoints: ["{endpoint}"]}}}}')
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config) as other:
        tokens = [
            other.liveliness().declare_token(key)
            for key in ("tvist/\x1b[2J/alive", "a\x1b/tvist/ur5e/alive", "tvist/ur3/alive")
        ]
        assert await robots_at(endpoint) == ["ur3"]
        async with Fleet(endpoint) as fleet:
            assert fleet.places == {RobotPlace("", "ur3")}
        assert len(tokens) == 3


async def test_an_event_that_precedes_the_answer_is_not_lost(realtime, robot):
    def begins():
        realtime.robot.publish(Event(tick=7, kind="motion_started", id=4))
        realtime.robot.publish(Event(tick=9, kind="motion_done", id=4))
        return Accepted(id=4)

    realtime.robot.answers["move_j"] = begins
    async with robot.control("me") as arm:
        motion = await arm.move_j(NEAR)
    assert (motion.id, motion.started, motion.done) == (4, 7, 9)


async def test_the_liveliness_token_exists_while_control_is_held(realtime, robot, note):
    async with robot.control("me"):
        pass
    noted = [n for n in await note(realtime, "gone me") if n != "keep_alive"]
    assert noted == ["seen me", "take_control", "release_control", "gone me"]


async def test_the_lease_is_renewed_until_control_is_lost(realtime, robot, note, caplog):
    async with robot.control("me", lease_s=0.9):
        for _ in range(3):
            await note(realtime, "keep_alive")
        realtime.post(realtime.robot.controller.session.release)
        realtime.post(lambda: realtime.robot.notes.put("released"))
        await note(realtime, "released")  # and what was noted before
        await note(realtime, "keep_alive")
        await robot.info()  # its answer comes after the refusal
    assert "control is lost" in caplog.text


async def test_lockstep_needs_no_lease_renewal(lockstep, robot):
    async with robot.control("me", lease_s=0.1) as arm:
        for q in (NEAR, FAR, NEAR):
            await arm.move_j(q)
    assert not any(isinstance(command, KeepAlive) for command in lockstep.robot.commands)


async def test_all_states_of_a_lockstep_step_have_arrived_when_it_returns(lockstep, robot):
    seen, truths = [], []
    robot.on_state(lambda state: seen.append(state.tick))
    robot.on_truth(lambda truth: truths.append(truth.tick))
    async with robot.control("me"):
        for ticks in (1, 999, 1000, 500):
            assert await robot.advance(ticks) == seen[-1]
    assert seen == list(range(1, 2501))
    assert truths[:2499] == list(range(1, 2500))


async def test_set_points_arrive_numbered_and_in_order(realtime, robot, monkeypatch):
    """A network may drop some; what comes keeps its number and its place."""
    monkeypatch.setattr("tvist_controller.motion.setpoints.TIMEOUT", 60.0)
    arrived, states = realtime.robot.setpoints, robot.states()
    async with robot.control("me") as arm, arm.servo(period=0.008) as servo:
        q = (await anext(states)).target_q
        for number in range(100):
            assert servo.set(q) == number
        while not arrived or arrived[-1] < 99:
            await anext(states)
            number += 1
            assert servo.set(q) == number
        with pytest.raises(MisuseError, match=r"call set\(q\)"):
            await servo.step_through([q])
    assert arrived == sorted(set(arrived))


async def test_a_stop_by_another_client_ends_the_wait_for_a_motion(realtime, robot, endpoint):
    async with robot.control("me") as arm, await Robot.connect(endpoint) as bystander:
        started = bystander.events()
        waiting = asyncio.create_task(arm.move_j(FAR, velocity=0.05))
        await anext(started)
        await bystander.stop()
        with pytest.raises(MotionStoppedError, match="stop"):
            await waiting


async def test_pending_calls_fail_when_the_robot_disconnects(realtime, robot):
    realtime.robot.silent.add("keep_alive")
    arms, states, events = robot.control("me"), robot.states(), robot.events()
    async with arms as arm:
        started = robot.events()
        moves = arm.move_j(FAR, velocity=0.05)
        waiting = (arm.keep_alive(), moves, robot.advance(10_000), _exhaust(states))
        waits = [asyncio.create_task(one) for one in waiting]
        await anext(started)
        await anext(events)
        waits.append(asyncio.create_task(_exhaust(events)))
        await asyncio.to_thread(realtime.close)
        for wait in waits:
            with pytest.raises(NotConnectedError, match=r"is gone|does not answer"):
                await wait
    with pytest.raises(NotConnectedError):
        await robot.info()


async def test_a_client_reconnects_to_a_restarted_robot(lockstep, robot, endpoint, note):
    states = robot.states()
    async with robot.control("me"):
        assert await robot.advance(300) == 300
    while (await anext(states)).tick < 300:
        pass
    await asyncio.to_thread(lockstep.close)
    with pytest.raises(NotConnectedError):
        await anext(states)
    back = await asyncio.to_thread(Served, "lockstep", endpoint)
    # Zenoh tries again after one second, two, four.
    await robot._transport._alive.wait()
    async with robot.control("me") as arm:
        assert (await arm.move_j(NEAR)).started == 1
    assert (await anext(states)).tick <= 1
    await note(back, "release_control")
    await asyncio.to_thread(back.close)


async def test_a_request_without_an_answer_times_out(realtime, robot):
    realtime.robot.silent.add("keep_alive")
    with pytest.raises(AnswerTimeoutError, match=r"did not answer within 0\.05 s"):
        await robot.request(KeepAlive(token=""), timeout_s=0.05)


async def test_messages_on_wildcard_keys_are_ignored(realtime, robot, endpoint):
    transport = await ZenohTransport.open(endpoint, "ur5e")
    events = robot.events()
    for key in ("tvist/*/event", "tvist/**"):
        transport._session.put(key, encode(Event(tick=0, kind="protective_stop")))
    await transport.info()  # the puts have passed
    realtime.post(lambda: realtime.robot.publish(Event(tick=1, kind="warning")))
    assert (await anext(events)).kind == "warning"
    await transport.close()


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
def test_a_reset_connection_gives_no_reason_and_is_closed(monkeypatch):
    """The peer has reset each connection before its client can say a word."""
    connect = socket.create_connection
    with socket.create_server(("127.0.0.1", 0)) as server:

        def connected(*args):
            made = connect(*args)
            peer, _ = server.accept()
            peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            peer.close()
            return made

        monkeypatch.setattr(socket, "create_connection", connected)
        assert certificates.why_refused(f"tls/127.0.0.1:{server.getsockname()[1]}", None) is None
    gc.collect()


async def _exhaust(stream):
    async for _ in stream:
        pass
