"""`tvist serve --record FILE --keep DURATION`, killed and ended."""

import signal

from tests.conformance.served import Served

from tvist_client.robot import Robot
from tvist_lab.recordings.mcap_file import read

TICKS = 1300


async def advance_and_send(number, path):
    with Served("--clock", "lockstep", "--record", str(path), "--keep", "1s") as served:
        async with await Robot.connect(served.endpoint, "ur5e") as robot, robot.control("a"):
            await robot.advance(TICKS)
        served.end(number)
    content = read(path)
    ticks = [state.tick for state in content.states]
    assert ticks == list(range(ticks[0], ticks[-1] + 1))
    assert content.from_tick == (None if ticks[0] == 1 else ticks[0])
    return content, ticks


async def test_a_server_that_ends_leaves_one_file_with_the_last_second(tmp_path):
    content, ticks = await advance_and_send(signal.SIGTERM, tmp_path / "run.mcap")
    assert content.complete
    assert ticks[0] == 501
    assert ticks[-1] >= TICKS
    assert [place.name for place in tmp_path.iterdir()] == ["run.mcap"]


async def test_after_a_kill_what_was_written_is_readable_without_a_gap(tmp_path):
    content, ticks = await advance_and_send(signal.SIGKILL, tmp_path / "run.mcap")
    assert not content.complete
    assert len(ticks) <= 1000
