"""One client holds the clock over the network: it alone lets time pass, and others are served within its steps."""

import asyncio
import math
import signal

import msgpack
import pytest
from tests.conformance.served import PATIENCE, Served
from tests.conformance.wire import Q1, Wire

from tvist_client.robot import Robot
from tvist_lab.collect import collect
from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import replay_file
from tvist_protocol.errors import RefusedError

NEAR = [0.3, -2.9, 0.2, -1.4, 0.1, -0.1]
FAR = [1.5, -3.0, 0.2, -1.5, 0.1, 0.3]
LONG = 100_000


def send(wire, type, **fields):  # noqa: A002  the wire's name
    """Send a command without waiting for its answer, which comes into what this returns."""
    payload = msgpack.packb({"type": type, **fields})
    return wire.session.get(wire.key("command"), payload=payload, timeout=PATIENCE)


def answer(replies):
    (reply,) = replies
    return msgpack.unpackb(reply.ok.payload.to_bytes())


def take(wire, right, client):
    wire.announce(client)
    taken = wire.command(f"take_{right}", client=client)
    assert taken["type"] == "accepted", taken
    return taken["token"]


def commands(path):
    """Tick and type of each command of a recording, whose replay is equal to the last bit."""
    content = read(path)
    assert content.complete
    assert replay_file(content).first_difference is None
    told = [(entry.tick, entry.message["type"]) for entry in content.journal if entry.kind == "command"]
    return told, content


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_stop_of_another_client_takes_effect_within_a_long_step_and_a_signal_ends_it(number, tmp_path):
    path = tmp_path / "run.mcap"
    with (
        Served("--clock", "lockstep", "--record", str(path)) as served,
        Wire(served.endpoint) as stepper,
        Wire(served.endpoint) as mover,
    ):
        clock, token = take(stepper, "clock", "stepper"), take(mover, "control", "mover")
        mover.listen("state", "event")
        assert mover.command("move_j", token=token, q=FAR)["type"] == "accepted"
        replies = send(stepper, "simulation.step", token=clock, ticks=LONG)
        mover.wait("state", lambda state: state["target_qd"][0] > 0.2)
        assert mover.command("stop")["type"] == "done"
        stopped = mover.wait("event", lambda event: event["kind"] == "motion_stopped")
        assert stopped["why"] == "a stop was commanded"
        assert mover.info()["stepper"] == "stepper"
        assert replies.try_recv() is None
        assert served.end(number) == 0
    told, content = commands(path)
    assert [kind for _, kind in told] == ["take_clock", "take_control", "move_j", "simulation.step", "stop"]
    assert 1 < told[-1][0] <= stopped["tick"] <= content.states[-1].tick < LONG


def test_set_points_of_another_client_are_played_within_a_step_at_the_ticks_of_the_journal(tmp_path):
    path = tmp_path / "run.mcap"
    with (
        Served("--clock", "lockstep", "--record", str(path)) as served,
        Wire(served.endpoint) as stepper,
        Wire(served.endpoint) as mover,
    ):
        clock, token = take(stepper, "clock", "stepper"), take(mover, "control", "mover")
        mover.listen("state")
        assert mover.command("servo_start", token=token)["type"] == "done"
        send(stepper, "simulation.step", token=clock, ticks=LONG)
        for sequence in range(5):
            mover.setpoint(token=token, sequence=sequence, q=Q1)
            mover.wait("state", lambda state, played=sequence: state["setpoint_sequence"] == played)
        assert served.end() == 0
    _, content = commands(path)
    ticks = [entry.tick for entry in content.journal if entry.kind == "setpoint"]
    assert len(ticks) == 5
    assert ticks == sorted(set(ticks))


def test_a_client_s_own_commands_keep_their_order_and_are_answered_in_it(tmp_path):
    path = tmp_path / "run.mcap"
    with Served("--clock", "lockstep", "--record", str(path)) as served:
        with Wire(served.endpoint) as wire:
            clock, token = take(wire, "clock", "one"), take(wire, "control", "one")
            replies = [
                send(wire, "simulation.step", token=clock, ticks=300),
                send(wire, "move_j", token=token, q=FAR),
                send(wire, "simulation.step", token=clock, ticks=300),
                send(wire, "stop", token=token),
                send(wire, "simulation.step", token=clock, ticks=300),
            ]
            assert [answer(reply) for reply in replies] == [
                {"type": "done", "tick": 300},
                {"type": "accepted", "id": 1},
                {"type": "done", "tick": 600},
                {"type": "done"},
                {"type": "done", "tick": 900},
            ]
        assert served.end() == 0
    told, _ = commands(path)
    assert told[2:] == [
        (1, "simulation.step"),
        (301, "move_j"),
        (301, "simulation.step"),
        (601, "stop"),
        (601, "simulation.step"),
    ]


def test_a_clock_that_is_taken_within_a_step_of_who_has_control_ends_the_step(lockstep):
    with Wire(lockstep.endpoint) as mover, Wire(lockstep.endpoint) as stepper:
        mover.listen("state")
        token = take(mover, "control", "mover")
        before = mover.info()["tick"]
        replies = send(mover, "simulation.step", token=token, ticks=LONG)
        mover.until(before + 10)
        clock = take(stepper, "clock", "stepper")
        ended = answer(replies)
        assert ended["type"] == "done"
        assert before + 10 <= ended["tick"] < before + LONG
        assert stepper.info()["tick"] == ended["tick"]
        refused = mover.command("simulation.step", token=token, ticks=1)
        assert (refused["code"], refused["where"]) == ("no_control", "token")
        assert "'stepper'" in refused["why"]
        assert stepper.command("simulation.step", token=clock, ticks=5) == {
            "type": "done",
            "tick": ended["tick"] + 5,
        }
        assert stepper.command("release_clock", token=clock) == {"type": "done"}
        assert mover.command("simulation.step", token=token, ticks=1)["tick"] == ended["tick"] + 6
        assert mover.command("release_control", token=token) == {"type": "done"}


def test_set_points_of_a_step_take_control_beside_the_clock(lockstep):
    played = [{"sequence": 0, "q": Q1}]
    with Wire(lockstep.endpoint) as wire, wire.control("mover") as token:
        clock = take(wire, "clock", "stepper")
        wire.command("simulation.reset", token=token, q=Q1)
        assert wire.command("servo_start", token=token) == {"type": "done"}

        def step(**fields):
            return wire.command("simulation.step", token=clock, ticks=1, setpoints=played, **fields)

        for fields, code in (
            ({}, "missing_field"),
            ({"motion_token": clock}, "stale_token"),
            ({"motion_token": "x"}, "stale_token"),
        ):
            refused = step(**fields)
            assert (refused["code"], refused["where"]) == (code, "motion_token")
        assert step(motion_token=token)["type"] == "done"
        assert wire.state()["setpoint_sequence"] == 0
        assert wire.command("release_clock", token=clock) == {"type": "done"}


def test_in_real_time_nobody_holds_the_clock(realtime):
    with Wire(realtime.endpoint) as wire:
        refused = wire.command("take_clock", client="stepper")
        assert (refused["code"], refused["where"]) == ("wrong_mode", "type")
        assert "--clock lockstep" in refused["why"]
        info = wire.info()
        assert info["stepper"] is None
        assert info["commands"]["take_clock"] == ["client", "protocol"]


async def test_in_python_one_client_steps_while_another_moves_and_waits_for_its_motion(lockstep):
    async with (
        await Robot.connect(lockstep.endpoint) as robot,
        await Robot.connect(lockstep.endpoint) as other,
    ):
        async with robot.clock_control("stepper") as stepper, other.control("mover") as arm:
            with pytest.raises(RefusedError, match="'stepper'"):
                await other.advance(1)
            with pytest.raises(RefusedError, match="'stepper'"):
                async with other.clock_control("mover"):
                    pass
            await arm.reset(q=Q1)
            moving = asyncio.create_task(arm.move_j(NEAR))
            while not moving.done():
                await stepper.advance(500)
            assert (await moving).done is not None
            resting = asyncio.create_task(other.rest())
            await stepper.step(5000)
            assert (await resting).target_q == pytest.approx(NEAR, abs=1e-7)
        assert (await robot.info()).stepper is None


async def test_a_client_may_have_both_rights_under_one_name_and_keep_either(lockstep):
    async with await Robot.connect(lockstep.endpoint) as robot:
        async with robot.clock_control("one"):
            async with robot.control("one") as arm:
                await arm.reset(q=Q1)
                await arm.move_j(NEAR)
            tick = (await robot.info()).tick
            assert (await robot.info()).stepper == "one"
            assert await robot.advance(3) == tick + 3
        async with robot.control("one"):
            async with robot.clock_control("one"):
                pass
            info = await robot.info()
            assert (info.control, info.stepper) == ("one", None)
            assert await robot.advance(3) == tick + 6


async def script(robot, *, clock):
    """Moves and a stream; what the robot told meanwhile."""
    with collect(robot) as told:
        async with robot.control("one") as arm:
            if clock:
                async with robot.clock_control("one"):
                    await motions(robot, arm)
            else:
                await motions(robot, arm)
    return told


async def motions(robot, arm):
    await arm.reset(q=Q1, seed=5)
    await arm.move_j(NEAR)
    async with arm.servo() as servo:
        await servo.step_through([NEAR[0] + 0.05 * math.sin(0.005 * n) ** 2, *NEAR[1:]] for n in range(1200))
    await robot.advance(100)


async def test_whichever_right_lets_time_pass_the_states_are_equal_to_the_last_bit():
    told = []
    for clock in (False, True):
        with Served("--clock", "lockstep") as served:
            async with await Robot.connect(served.endpoint) as robot:
                told.append(await script(robot, clock=clock))
    by_control, by_clock = told
    assert len(by_clock.states) > 1500
    assert by_control.states == by_clock.states
    assert by_control.events == by_clock.events
