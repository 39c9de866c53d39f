"""`tvist serve --record FILE --keep DURATION`, killed and ended."""

import signal
from contextlib import suppress

import pytest
from tests.conformance.served import Served
from tests.system.waiting import eventually

from tvist_client.robot import Robot
from tvist_lab.recordings.mcap_file import RecordingFileError, read
from tvist_protocol.recorded import segment_name

TICKS = 1300


def until_written(path):
    """Wait until all but the last chunk is in the file: what a process has not written yet ends with it."""

    def last():
        with suppress(RecordingFileError):
            return read(path).states[-1].tick
        return 0

    eventually(lambda: last() > TICKS - 600)


async def advance_and_send(number, path):
    with Served("--clock", "lockstep", "--record", str(path), "--keep", "1s") as served:
        async with await Robot.connect(served.endpoint, "ur5e") as robot, robot.control("a"):
            await robot.advance(TICKS)
        until_written(path)
        served.end(number)
    content = read(path)
    ticks = [state.tick for state in content.states]
    assert ticks == list(range(ticks[0], ticks[-1] + 1))
    assert content.from_tick == (None if ticks[0] == 1 else ticks[0])
    return content, ticks


async def test_a_server_that_ends_leaves_complete_files_with_the_last_second(tmp_path):
    content, ticks = await advance_and_send(signal.SIGTERM, tmp_path / "run.mcap")
    assert content.complete
    assert ticks[0] == 751
    assert ticks[-1] >= TICKS
    assert sorted(tmp_path.iterdir()) == [tmp_path / f"run-1-part{number:04}.mcap" for number in range(7, 12)]


@pytest.mark.parametrize("options", [(), ("--robots", "ur5e*2", "--workers", "2")])
async def test_a_service_that_is_killed_and_started_again_loses_no_recording(options, tmp_path):
    """As with a restart policy: the same options, the same path, and SIGKILL in between."""
    robots = (
        {f"run-ur5e-{number}.mcap": f"ur5e-{number}" for number in (1, 2)}
        if options
        else {"run.mcap": "ur5e"}
    )
    path, started = tmp_path / "run.mcap", {"name": None if options else "ur5e"}
    given = ("--clock", "lockstep", "--record", str(path), "--keep", "1s", *options)
    for number, ticks in ((signal.SIGKILL, TICKS), (signal.SIGTERM, 200)):
        with Served(*given, **started) as served:
            for name in robots.values():
                async with await Robot.connect(served.endpoint, name) as robot, robot.control("a"):
                    await robot.advance(ticks)
            if number is signal.SIGKILL:
                for name in robots:
                    until_written(tmp_path / name)
            served.end(number)
    for name in robots:
        killed, ended = read(tmp_path / segment_name(name, 1, None)), read(tmp_path / name)
        # Processes of --workers end in order when the first one is killed.
        assert (killed.complete, ended.complete) == ("--workers" in options, True)
        seen = [state.tick for state in killed.states]
        assert seen == list(range(seen[0], seen[-1] + 1))
        assert TICKS - 600 < seen[-1] <= TICKS
        assert [state.tick for state in ended.states] == list(range(1, 201))
