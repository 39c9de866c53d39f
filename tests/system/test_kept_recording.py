"""`tvist serve --record FILE --keep DURATION`, ended by signals."""

import signal
from contextlib import suppress

import pytest
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


@pytest.mark.parametrize("options", [(), ("--robots", "ur5e*2", "--workers", "2")])
async def test_killed_and_restarted_service_loses_no_recording(options, tmp_path):
    """A restart policy uses the same options and path again."""
    robots = {"run.mcap": "ur5e"}
    if options:
        robots = {f"run-ur5e-{number}.mcap": f"ur5e-{number}" for number in (1, 2)}
    path, started = tmp_path / "run.mcap", {"name": None if options else "ur5e"}
    given = ("--clock", "lockstep", "--record", str(path), "--keep", "1s", *options)
    for number, ticks in ((signal.SIGKILL, TICKS), (signal.SIGTERM, 200)):
        with Served(*given, **started) as served:
            for name in robots.values():
                async with await Robot.connect(served.endpoint, name) as robot, robot.control("a"):
                    await robot.advance(ticks)
            if number is signal.SIGKILL:
                for name in robots:
                    eventually(lambda path=tmp_path / name: first_tick(path) == FIRST)
            served.end(number)
    for name in robots:
        killed, ended = read(tmp_path / segment_name(name, 1, None)), read(tmp_path / name)
        # Workers end in order when the first process is killed.
        assert (killed.complete, ended.complete) == ("--workers" in options, True)
        seen = [state.tick for state in killed.states]
        assert seen == list(range(FIRST, seen[-1] + 1))
        assert FIRST + 500 <= seen[-1] + 1 <= TICKS + 1
        assert [state.tick for state in ended.states] == list(range(1, 201))
