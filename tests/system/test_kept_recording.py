"""`tvist serve --record FILE --keep DURATION`, ended by signals."""

import signal
from contextlib import suppress

from tests.conformance.served import Served
from tests.system.waiting import eventually

from tvist_client.robot import Robot
from tvist_lab.recordings.mcap_file import RecordingFileError, read
from tvist_protocol.recorded import segment_name

TICKS = 700
FIRST = 126  # first kept tick, since one segment of 125 ticks has been deleted


def first_tick(path):
    with suppress(RecordingFileError):
        return read(path).states[0].tick
    return 0


async def test_killed_and_restarted_service_loses_no_recording(tmp_path):
    """A restart policy uses the same options and path again."""
    path = tmp_path / "run.mcap"
    for number, ticks in ((signal.SIGKILL, TICKS), (signal.SIGTERM, 200)):
        with Served("--clock", "lockstep", "--record", str(path), "--keep", "1s") as served:
            async with await Robot.connect(served.endpoint) as robot, robot.control("a"):
                await robot.advance(ticks)
            if number is signal.SIGKILL:
                eventually(lambda: first_tick(path) == FIRST)
            served.end(number)
    killed, ended = read(tmp_path / segment_name(path.name, 1, None)), read(path)
    assert (killed.complete, ended.complete) == (False, True)
    seen = [state.tick for state in killed.states]
    assert seen == list(range(FIRST, seen[-1] + 1))
    assert FIRST + 500 <= seen[-1] + 1 <= TICKS + 1
    assert [state.tick for state in ended.states] == list(range(1, 201))
