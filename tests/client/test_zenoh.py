"""The client over real Zenoh sessions, to a robot that does what it is told."""

import asyncio
import threading

import pytest
import zenoh

from tvist_client import (
    AnswerTimeoutError,
    MisuseError,
    MotionStoppedError,
    NotConnectedError,
    Robot,
    StreamStoppedError,
    ZenohTransport,
)
from tvist_client.across import Place
from tvist_client.connection import CHUNK
from tvist_client.fleet import Fleet
from tvist_client.transports import zenoh as zenoh_transport
from tvist_client.transports.zenoh import robots_at
from tvist_protocol.codec import encode
from tvist_protocol.commands import KeepAlive
from tvist_protocol.stream import Event

Q = (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.fixture
async def robot(request, endpoint):
    """A client of whichever robot the test serves."""
    served = {"realtime", "lockstep"} & set(request.fixturenames)
    request.getfixturevalue(served.pop())
    async with await Robot.connect(endpoint) as robot:
        yield robot


async def test_the_handshake_says_what_the_robot_is(realtime, robot):
    info = await robot.info()
    assert (info.name, info.clock, len(info.joints)) == ("ur5e", "realtime", 6)
    assert await robot.clock() == "realtime"


async def test_states_come_in_order_and_the_present_one_is_new(realtime, robot):
    states = robot.states()
    ticks = [(await anext(states)).tick for _ in range(50)]
    assert ticks == sorted(set(ticks))
    assert (await robot.state()).tick > ticks[-1]
    before = (await robot.state()).tick
    assert await robot.advance(20) >= before + 20


async def test_nobody_listening_is_said_at_once(endpoint):
    with pytest.raises(NotConnectedError, match=f"no server answers at {endpoint}: check that it is running"):
        await Robot.connect(endpoint)


async def test_a_connection_that_is_cancelled_while_it_opens_is_closed_again(monkeypatch):
    go, closed = threading.Event(), []
    monkeypatch.setattr(zenoh_transport, "open_session", lambda *_: go.wait())
    monkeypatch.setattr(zenoh_transport, "close_session", closed.append)
    opening = asyncio.create_task(ZenohTransport.open("tcp/nowhere", "ur5e"))
    for step in (opening.cancel, go.set):
        asyncio.get_running_loop().call_later(0.0, step)
    with pytest.raises(asyncio.CancelledError):
        await opening
    assert closed == [True]


async def test_another_robots_endpoint_is_said_to_be_that(realtime, endpoint):
    with pytest.raises(NotConnectedError, match=r"no robot 'ur3' .*; the robots there are ur5e: check name"):
        await Robot.connect(endpoint, "ur3")
    where = (
        f"'ur5e' at {endpoint} in namespace hall-3; none answered in 3 s: check name, namespace and endpoint"
    )
    with pytest.raises(NotConnectedError, match=where):
        await Robot.connect(endpoint, namespace="hall-3")


async def test_a_token_whose_name_is_none_is_no_robot(endpoint):
    config = zenoh.Config.from_json5(f'{{mode: "router", listen: {{endpoints: ["{endpoint}"]}}}}')
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config) as other:
        tokens = [
            other.liveliness().declare_token(key)
            for key in ("tvist/\x1b[2J/alive", "a\x1b/tvist/ur5e/alive", "tvist/ur3/alive")
        ]
        assert await robots_at(endpoint) == ["ur3"]
        async with Fleet(endpoint) as fleet:
            assert fleet.places == {Place("", "ur3")}
        assert len(tokens) == 3


async def test_an_event_that_overtakes_the_answer_is_not_lost(realtime, robot):
    async with robot.control("me") as arm:
        motion = await arm.move_j(Q)
    assert motion.done - motion.started >= 100
    assert robot.motions.motion(motion.id) is motion


async def test_presence_is_announced_before_control_is_taken_and_withdrawn_after_its_release(
    realtime, robot, note
):
    async with robot.control("me"):
        pass
    noted = [n for n in await note(realtime, "gone me") if n != "keep_alive"]
    assert noted == ["seen me", "take_control", "release_control", "gone me"]


async def test_presence_ends_with_a_client_that_just_goes(realtime, endpoint, note):
    transport = await ZenohTransport.open(endpoint, "ur5e")
    await transport.announce("me")
    await note(realtime, "seen me")
    await transport.close()
    await note(realtime, "gone me")


async def test_the_lease_is_kept_alive_while_nothing_is_sent(realtime, robot, note):
    async with robot.control("me", lease_s=0.1):
        for _ in range(3):
            await note(realtime, "keep_alive")


async def test_keeping_alive_ends_when_control_is_lost_and_the_block_ends_in_peace(
    realtime, robot, note, caplog
):
    async with robot.control("me", lease_s=0.1):
        await note(realtime, "keep_alive")
        realtime.robot.token = "of another"
        await note(realtime, "keep_alive")
        await robot.info()  # its answer comes after the refusal
    assert "control is lost" in caplog.text


async def test_in_lockstep_nothing_is_kept_alive_and_the_ticks_are_deterministic(lockstep, robot):
    async with robot.control("me", lease_s=0.1) as arm:
        for number in range(1, 6):
            motion = await arm.move_j(Q)
            assert motion.done == motion.started + 119
            assert lockstep.robot.tick == number * 3 * CHUNK
    assert not any(isinstance(command, KeepAlive) for command in lockstep.robot.commands)


async def test_in_lockstep_the_states_of_a_step_have_all_come_when_it_ends(lockstep, robot):
    seen, truths = [], []
    robot.on_state(lambda state: seen.append(state.tick))
    robot.on_truth(lambda truth: truths.append(truth.tick))
    async with robot.control("me"):
        for ticks in (1, 999, 1000, 500):
            assert await robot.advance(ticks) == seen[-1]
    assert seen == list(range(1, 2501))
    assert truths[:2499] == list(range(1, 2500))


async def test_setpoints_arrive_numbered_and_in_order(realtime, robot):
    """A network may drop some; what comes keeps its number and its place."""
    arrived, states = realtime.robot.setpoints, robot.states()
    async with robot.control("me") as arm, arm.servo(period=0.008) as servo:
        for number in range(100):
            assert servo.set([number / 100.0] * 6) == number
        while not arrived or arrived[-1][1] < 99:
            await anext(states)
            number += 1
            assert servo.set(Q) == number
        with pytest.raises(MisuseError, match=r"call set\(q\)"):
            await servo.step_through([Q])
    sequences = [sequence for _, sequence, _ in arrived]
    assert sequences == sorted(set(sequences))


async def test_a_stream_the_robot_ends_ends_here_too(realtime, robot):
    async def stream(arm):
        async with arm.servo() as servo:
            ended = robot.events()
            realtime.post(lambda: realtime.robot.end_stream("no set-point for 0.25 s"))
            await anext(ended)
            servo.set(Q)

    async with robot.control("me") as arm:
        with pytest.raises(StreamStoppedError, match=r"no set-point for 0\.25 s"):
            await stream(arm)


async def test_a_stop_by_anybody_ends_the_wait_for_a_motion(realtime, robot, endpoint):
    async with robot.control("me") as arm, await Robot.connect(endpoint) as bystander:
        started = bystander.events()
        waiting = asyncio.create_task(arm.move_j(Q))
        await anext(started)
        await bystander.stop()
        with pytest.raises(MotionStoppedError, match="a stop was commanded"):
            await waiting


async def test_everything_that_waits_fails_when_the_robot_goes_away(realtime, robot):
    realtime.robot.silent.add("keep_alive")
    arms, states, events = robot.control("me"), robot.states(), robot.events()
    async with arms as arm:
        started = robot.events()
        waits = [
            asyncio.create_task(coroutine)
            for coroutine in (arm.keep_alive(), arm.move_j(Q), robot.advance(10_000), _exhaust(states))
        ]
        await anext(started)
        await anext(events)
        waits.append(asyncio.create_task(_exhaust(events)))
        await asyncio.to_thread(realtime.close)
        for wait in waits:
            with pytest.raises(NotConnectedError, match=r"is gone|does not answer"):
                await wait
    with pytest.raises(NotConnectedError):
        await robot.info()


async def test_a_robot_that_comes_back_is_found_again(lockstep, robot, serving, note):
    states = robot.states()
    async with robot.control("me"):
        assert await robot.advance(300) == 300
    while (await anext(states)).tick < 300:
        pass
    await asyncio.to_thread(lockstep.close)
    with pytest.raises(NotConnectedError):
        await anext(states)
    back = serving("lockstep")
    # Zenoh tries again after one second, two, four.
    await robot._transport._alive.wait()
    async with robot.control("me") as arm:
        assert (await arm.move_j(Q)).done == 120
    assert (await anext(states)).tick == 1
    await note(back, "release_control")


async def test_a_robot_that_does_not_answer_is_said_not_to(realtime, robot):
    realtime.robot.silent.add("keep_alive")
    with pytest.raises(AnswerTimeoutError, match=r"did not answer within 0\.05 s"):
        await robot.request(KeepAlive(token=""), timeout_s=0.05)


async def test_a_request_given_up_leaves_nothing_behind(realtime, robot):
    realtime.robot.silent.add("keep_alive")
    waiting = asyncio.create_task(robot.request(KeepAlive(token="")))
    await asyncio.to_thread(realtime.robot.notes.get, timeout=60.0)
    waiting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await waiting
    assert not robot._transport._pending
    await robot.info()


async def test_what_is_put_on_a_wildcard_key_is_not_taken_for_the_robots(realtime, robot, endpoint):
    transport = await ZenohTransport.open(endpoint, "ur5e")
    events = robot.events()
    for key in ("tvist/*/event", "tvist/**"):
        transport._session.put(key, encode(Event(tick=0, kind="protective_stop")))
    await transport.info()  # the puts have passed
    realtime.post(lambda: realtime.robot.put("event", encode(Event(tick=1, kind="warning"))))
    assert (await anext(events)).kind == "warning"
    await transport.close()


async def test_closing_twice_and_using_what_is_closed_is_said(realtime, endpoint):
    robot = await Robot.connect(endpoint)
    states = robot.states()
    await robot.close()
    await robot.close()
    assert [state async for state in states if state is None] == []
    with pytest.raises(NotConnectedError, match="closed"):
        await robot.info()
    with pytest.raises(NotConnectedError, match="closed"):
        robot.put_setpoint(b"")
    with pytest.raises(NotConnectedError, match="closed"):
        robot.on_telemetry(print)


async def _exhaust(stream):
    async for _ in stream:
        pass
