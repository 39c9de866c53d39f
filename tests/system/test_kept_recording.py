"""Recordings of servers that are killed or fail."""

import signal

import pytest
from tests.conformance.served import Served, finished, free_endpoint
from tests.conformance.wire import Wire
from tests.system.waiting import eventually, recorded_ticks

from tvist_client.robot import Robot
from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import replay_file
from tvist_protocol.recorded import segment_name

TICKS = 700
FAR = [1.5, -3.0, 0.2, -1.5, 0.1, 0.3]
FIRST = 126  # first kept tick, since one segment of 125 ticks has been deleted


async def test_killed_and_restarted_service_loses_no_recording(tmp_path):
    """A restart policy uses the same options and path again."""
    path = tmp_path / "run.mcap"
    for number, ticks in ((signal.SIGKILL, TICKS), (signal.SIGTERM, 200)):
        with Served("--clock", "lockstep", "--record", str(path), "--keep", "1s") as served:
            async with await Robot.connect(served.endpoint) as robot, robot.control("a"):
                await robot.advance(ticks)
            if number is signal.SIGKILL:
                eventually(lambda: recorded_ticks(path)[:1] == [FIRST])
            served.end(number)
    killed, ended = read(tmp_path / segment_name(path.name, 1, None)), read(path)
    assert (killed.complete, ended.complete) == (False, True)
    seen = [state.tick for state in killed.states]
    assert seen == list(range(FIRST, seen[-1] + 1))
    assert FIRST + 500 <= seen[-1] + 1 <= TICKS + 1
    assert [state.tick for state in ended.states] == list(range(1, 201))


def test_killed_server_leaves_a_recording_that_can_be_read_and_replayed(tmp_path):
    path = tmp_path / "run.mcap"
    with Served("--clock", "lockstep", "--record", str(path)) as served:
        with Wire(served.endpoint) as wire, wire.control() as token:
            wire.command("move_j", token=token, q=FAR)
            wire.step(token, 250)
        eventually(lambda: recorded_ticks(path)[-1:] >= [150])  # at most a chunk of some 70 states is lost
        served.process.kill()
        served.wait()
    content = read(path)
    assert not content.complete
    assert "was not closed" in content.note
    ticks = [state.tick for state in content.states]
    assert ticks == list(range(1, ticks[-1] + 1))
    assert replay_file(content).first_difference is None


@pytest.mark.realtime
def test_failing_controller_ends_the_server_with_exit_code_1_and_a_recording(tmp_path):
    """A server that answers but no longer ticks would be worse than none."""
    path = tmp_path / "run.mcap"
    program = """
import sys
from tvist_cli.main import main
from tvist_controller.controller import Controller
tick = Controller.complete_tick
def failing(self):
    if self.tick_number == 100:
        raise ArithmeticError("on purpose")
    return tick(self)
Controller.complete_tick = failing
sys.argv = ["tvist", "serve", *sys.argv[1:]]
main()
"""
    ended = finished("-c", program, "--listen", free_endpoint(), "--record", str(path))
    assert ended.returncode == 1
    assert "ArithmeticError: on purpose" in ended.stderr
    assert ended.stderr.splitlines()[-1].startswith("tvist: ")
    content = read(path)
    assert content.complete
    assert content.states[-1].tick == 100
