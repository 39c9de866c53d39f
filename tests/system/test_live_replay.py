"""A run in real time, recorded by the server: replayed bit by bit, and compared with what a client saw."""

import asyncio
import math

import msgspec
import pytest
from tests.conformance.served import Served
from tests.system.shell import tvist

from tvist_client.robot import Robot
from tvist_lab.collect import collect
from tvist_lab.recordings.mcap_file import read

pytestmark = pytest.mark.realtime
Q1 = (0.0, -math.pi, 0.0, -math.pi / 2, 0.0, 0.0)
NEAR = (0.4, -2.8, 0.3, -1.4, 0.1, -0.1)
PERIOD = 0.008
STRIDE = 4
"""Ticks from one set-point to the next."""


async def use(endpoint, told):
    """Move, stream at 125 Hz by the robot's own ticks, stop in mid-motion."""
    async with await Robot.connect(endpoint) as robot, robot.control("live") as arm:
        with collect(robot) as collected:
            told.append(collected)
            await robot.advance(50)
            await arm.move_j(NEAR, acceleration=2.5)
            await robot.advance(350)
            q = (await robot.state()).target_q
            async with arm.servo(period=PERIOD, acceleration=2.5) as servo:
                async for state in robot.states():
                    if state.tick % STRIDE == 0:
                        t = servo.sequence * PERIOD
                        offset = 0.05 * min(1.0, t) ** 2 * math.sin(2.0 * math.pi * t)
                        servo.set([q[0] + offset, *q[1:]])
                    if servo.sequence == 100:
                        break
            motion = await arm.move_j(Q1, velocity=0.2, wait=False)
            await robot.advance(250)
            await arm.stop()
            await robot.rest()
            await robot.advance(50)
            assert motion.stopped is not None


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    """The recording's path, and what a client saw."""
    path, told = tmp_path_factory.mktemp("live") / "run.mcap", []
    with Served("--record", str(path), "--truth", "--seed", "5") as served:
        asyncio.run(use(served.endpoint, told))
    return path, told[0]


def test_its_replay_is_equal_to_the_last_bit(live):
    said = tvist("log", "replay", live[0], "--json").assert_done().json
    assert (said["equal"], said["first_difference"]) == (True, None)
    assert said["ticks"] >= len(live[1].states)


def test_the_recording_holds_all_that_a_client_saw_and_every_tick(live):
    path, seen = live
    content = read(path)
    for recorded, live_ones in ((content.states, seen.states), (content.truths, seen.truths)):
        by_tick = {message.tick: message for message in recorded}
        assert live_ones
        assert all(msgspec.json.encode(by_tick[m.tick]) == msgspec.json.encode(m) for m in live_ones)
    first, last = seen.states[0].tick, seen.states[-1].tick
    recorded, told = ([one for one in of if first < one.tick <= last] for of in (content.events, seen.events))
    assert recorded == told
    assert [state.tick for state in content.states] == list(range(1, len(content.states) + 1))
    assert (content.complete, content.note, any(content.dropped.values())) == (True, None, False)


def test_a_replay_can_be_recorded_and_is_the_same_recording(live, tmp_path):
    tvist("log", "replay", live[0], tmp_path / "again.mcap", "--json").assert_done()
    before, after = read(live[0]), read(tmp_path / "again.mcap")
    assert after.states == before.states
    # How busy the machine was is told by the server, and is no part of a replay.
    told = tuple(event for event in before.events if "the control loop is" not in (event.why or ""))
    assert after.events == told
    assert after.truths == before.truths
    assert after.journal == before.journal


def test_the_stream_was_played_and_the_stop_stopped(live):
    kinds = [event.kind for event in live[1].events]
    assert kinds.count("motion_started") == 2
    assert kinds.count("motion_done") == kinds.count("motion_stopped") == kinds.count("stream_stopped") == 1
    assert max(state.setpoint_sequence or 0 for state in live[1].states) > 50  # the last may meet the stop


HOME = (-1.60, -1.727, -2.203, -0.808, 1.595, -0.031)
"""A posture away from singular ones, with room around it."""
WITH_A_CLIENT = f"""def with_a_client():
  global seen = 0
  thread watch():
    while True:
      seen = seen + read_input_integer_register(0)
      write_output_integer_register(0, seen)
      sync()
    end
  end
  run watch()
  movel(pose_add(get_target_tcp_pose(), p[0, 0.1, 0, 0, 0, 0]), a=0.8, v=0.3, r=0.03)
  write_output_integer_register(1, 1)
  movel(pose_add(get_forward_kin({list(HOME)}), p[0, 0.1, 0.1, 0, 0, 0]), a=0.8, v=0.3)
  speedj([0.2, 0, 0, 0.1, 0, 0], 1.0, 0.3)
  stopj(2)
  while read_input_integer_register(1) == 0:
    sync()
  end
  speedl([0, 0.1, 0, 0, 0, 0], 0.5, 0.2)
  protective_stop()
  sync()
  movej({list(HOME)}, a=1.4 + 0.0001 * seen)
  write_output_integer_register(1, 2)
end
"""
"""Moves as its client writes registers; the last move depends on when it wrote them."""


async def with_a_client(robot):
    """Run that program, write registers all the time, and unlock the protective stop; what the robot told."""
    with collect(robot) as told:
        async with robot.control("programs") as arm:
            await arm.run_program(WITH_A_CLIENT)
            for number in range(300):
                await arm.set_registers("input_int", [number % 7, int(number > 100)])
                await robot.advance(13)
                kinds = [event.kind for event in told.events]
                if "protective_stop" in kinds:
                    break
            await robot.rest()
            await arm.unlock_protective_stop()
            await robot.advance(50)
            await arm.play_program()
            while not any(event.kind == "program_stopped" for event in told.events):
                await robot.advance(50)
            await robot.advance(50)
            (stopped,) = (event for event in told.events if event.kind == "program_stopped")
            assert stopped.why is None
            assert not [event for event in told.events if event.line is not None]
    return told


def test_the_replay_of_a_program_with_a_client_is_equal_to_the_last_bit(tmp_path):
    path = tmp_path / "run.mcap"

    async def run():
        async with await Robot.connect(server.endpoint) as robot:
            return await with_a_client(robot)

    with Served("--start", ",".join(map(str, HOME)), "--record", str(path), "--truth") as server:
        told = asyncio.run(run())
    said = tvist("log", "replay", path, "--json").assert_done().json
    assert (said["equal"], said["first_difference"]) == (True, None)
    by_tick = {state.tick: state for state in read(path).states}
    assert told.states
    assert all(by_tick[state.tick] == state for state in told.states)
    kinds = [event.kind for event in told.events]
    assert kinds.count("program_started") == kinds.count("program_stopped") == 1
    assert kinds.count("motion_started") == 4
    assert kinds.count("protective_stop") == 1
