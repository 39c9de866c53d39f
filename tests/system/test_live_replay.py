"""A recording of a real-time run replays bit by bit, and has all that a client received."""

import asyncio
import math

import msgspec
import pytest
from tests.conformance.served import SLOWER, Served

from tvist_client.robot import Robot
from tvist_lab.collect import collect
from tvist_lab.recordings.mcap_file import read

pytestmark = pytest.mark.realtime
Q1 = (0.0, -math.pi, 0.0, -math.pi / 2, 0.0, 0.0)
NEAR = (0.1, -3.1, 0.1, -1.5, 0.05, -0.05)
KINDS = ("motion_started", "motion_done", "motion_stopped", "stream_stopped")
PERIOD = 0.008
STRIDE = 4  # ticks from one set-point to the next


async def use(endpoint, told):
    """Move, stream at 125 Hz according to the robot's ticks, and stop in a motion."""
    async with await Robot.connect(endpoint) as robot, robot.control("live") as arm:
        with collect(robot) as collected:
            told.append(collected)
            await robot.advance(20)
            await arm.move_j(NEAR, acceleration=2.5)
            await robot.advance(50)
            q = (await robot.state()).target_q
            async with arm.servo(period=PERIOD, acceleration=2.5) as servo:
                async for state in robot.states():
                    if state.tick % STRIDE == 0:
                        t = servo.sequence * PERIOD
                        offset = 0.05 * min(1.0, t) ** 2 * math.sin(2.0 * math.pi * t)
                        servo.set([q[0] + offset, *q[1:]])
                    if servo.sequence == 40:
                        break
            motion = await arm.move_j(Q1, velocity=0.1, wait=False)
            await robot.advance(60)
            await arm.stop()
            await robot.rest()
            await robot.advance(20)
            assert motion.stopped is not None


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    """Path of the recording, and what a client received."""
    path, told = tmp_path_factory.mktemp("live") / "run.mcap", []
    with Served("--record", str(path), "--truth", "--seed", "5", *SLOWER) as served:
        asyncio.run(use(served.endpoint, told))
    return path, told[0]


def test_recording_has_every_tick_and_all_that_a_client_received(live):
    path, seen = live
    content = read(path)
    for recorded, live_ones in ((content.states, seen.states), (content.truths, seen.truths)):
        by_tick = {message.tick: message for message in recorded}
        assert live_ones
        assert all(msgspec.json.encode(by_tick[m.tick]) == msgspec.json.encode(m) for m in live_ones)
    kinds = [event.kind for event in seen.events]
    assert [kinds.count(kind) for kind in KINDS] == [2, 1, 1, 1]
    # The stop may come before the last set-points.
    assert max(state.setpoint_sequence or 0 for state in seen.states) > 20
    first, last = seen.states[0].tick, seen.states[-1].tick
    recorded, told = ([one for one in of if first < one.tick <= last] for of in (content.events, seen.events))
    assert recorded == told
    assert [state.tick for state in content.states] == list(range(1, len(content.states) + 1))
    assert (content.complete, content.note, any(content.dropped.values())) == (True, None, False)


def test_replay_is_equal_to_the_last_bit_and_can_be_recorded(live, called, tmp_path):
    said = called("log", "replay", live[0], tmp_path / "again.mcap", "--json").assert_done().json
    assert (said["equal"], said["first_difference"]) == (True, None)
    before, after = read(live[0]), read(tmp_path / "again.mcap")
    assert after.states == before.states
    # A replay has no events about the load of the machine.
    told = tuple(event for event in before.events if "the control loop is" not in (event.why or ""))
    assert after.events == told
    assert after.truths == before.truths
    assert after.journal == before.journal
