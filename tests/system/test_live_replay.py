"""A run in real time, recorded by the server: replayed bit by bit, analysed, and compared with what a client saw."""

import asyncio
import json
import math

import msgspec
import pytest
from tests.conformance.served import Served, finished

from tvist_client.robot import Robot
from tvist_lab.collect import collect
from tvist_lab.recordings.mcap_file import read

pytestmark = pytest.mark.realtime
Q1 = (0.0, -math.pi, 0.0, -math.pi / 2, 0.0, 0.0)
NEAR = (0.4, -2.8, 0.3, -1.4, 0.1, -0.1)
PERIOD = 0.008
STRIDE = 4
"""Ticks from one set-point to the next."""


def tvist(*arguments):
    """Run `tvist`; its exit code, the JSON object it printed, and its stderr."""
    done = finished("-m", "tvist_cli", *arguments, "--json")
    return done.returncode, json.loads(done.stdout), done.stderr


async def use(endpoint, told):
    """Move, stream at 125 Hz by the robot's own ticks, stop in mid-motion."""
    async with await Robot.connect(endpoint) as robot, robot.control("live") as arm:
        with collect(robot) as collected:
            told.append(collected)
            await robot.advance(50)
            await arm.move_j(NEAR, acceleration=2.5)
            await robot.advance(700)
            q = (await robot.state()).target_q
            async with arm.servo(period=PERIOD, acceleration=2.5) as servo:
                async for state in robot.states():
                    if state.tick % STRIDE == 0:
                        t = servo.sequence * PERIOD
                        offset = 0.05 * min(1.0, t) ** 2 * math.sin(2.0 * math.pi * t)
                        servo.set([q[0] + offset, *q[1:]])
                    if servo.sequence == 200:
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
    code, said, _ = tvist("log", "replay", live[0])
    assert code == 0
    assert said["equal"] is True
    assert said["first_difference"] is None
    assert said["ticks"] >= len(live[1].states)


def test_the_recording_holds_every_state_and_truth_that_a_client_saw(live):
    path, seen = live
    content = read(path)
    for recorded, live_ones in ((content.states, seen.states), (content.truths, seen.truths)):
        by_tick = {message.tick: message for message in recorded}
        assert live_ones
        assert all(msgspec.json.encode(by_tick[m.tick]) == msgspec.json.encode(m) for m in live_ones)
    first, last = seen.states[0].tick, seen.states[-1].tick
    assert [event for event in content.events if first < event.tick <= last] == [
        event for event in seen.events if first < event.tick <= last
    ]


def test_the_recording_has_every_tick_from_the_first_on_and_lost_nothing(live):
    content = read(live[0])
    assert [state.tick for state in content.states] == list(range(1, len(content.states) + 1))
    assert content.complete
    assert content.note is None
    assert not any(content.dropped.values())


def test_analyze_finds_the_motions_and_measures_them(live):
    code, said, _ = tvist("log", "analyze", live[0])
    assert code == 0
    first = said["motions"][0]
    assert len(said["motions"]) >= 2
    for key in (
        "start_s", "stop_s", "stabilisation_ms", "cycle_ms", "overshoot_m", "residual_vibration_m_s2",
        "still_after_ms", "f_d_hz", "zeta",
    ):  # fmt: skip
        assert key in first
        assert first[key] is not None or key in first["notes"]
    assert first["stop_s"] > first["start_s"]


def test_a_replay_can_be_recorded_and_is_the_same_recording(live, tmp_path):
    code, _, said = tvist("log", "replay", live[0], tmp_path / "again.mcap")
    assert code == 0, said
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
    assert max(state.setpoint_sequence or 0 for state in live[1].states) > 100  # the last may meet the stop
