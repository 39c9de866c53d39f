"""`tvist log replay --publish` publishes a recording to clients of robots."""

from itertools import pairwise

import pytest
from tests.conformance.served import Served, finished

from tvist_client.robot import Robot
from tvist_lab.recordings.mcap_file import read
from tvist_protocol.errors import RefusedError


class PublishedRecording(Served):
    program = ("-m", "tvist_cli", "log", "replay")


@pytest.mark.realtime
async def test_client_reads_a_published_recording_like_a_robot(tmp_path):
    path, script = tmp_path / "run.mcap", tmp_path / "move.script"
    script.write_text("movej([-1.5, -1.7, -2.2, -0.8, 1.6, 0])\n")
    ended = finished("-m", "tvist_cli", "run", script, "--lockstep", "--truth", "--record", path)
    assert ended.returncode == 0, ended.stderr
    recorded = read(path).states
    with PublishedRecording(str(path), "--publish", "--loop", name="ghost") as served:
        async with await Robot.connect(served.endpoint, "ghost") as robot:
            info, io = await robot.info(), await robot.io()
            states, truths, events = [], [], []
            robot.on_truth(truths.append)
            robot.on_event(events.append)
            async for state in robot.states():
                states.append(state)
                if len(states) >= 300 and events and truths:
                    break
            with pytest.raises(RefusedError, match=r"wrong_mode: .*takes no commands"):
                async with robot.control("anna"):
                    pass
    assert (info.name, info.model, info.control) == ("ghost", "UR5e", None)
    assert io.tick > 0
    assert all(after.tick > before.tick for before, after in pairwise(states))
    first = recorded[0].tick
    assert all(state.actual_q == recorded[(state.tick - first) % len(recorded)].actual_q for state in states)
    assert events[0].kind in {"motion_started", "motion_done", "program_started", "program_stopped"}
