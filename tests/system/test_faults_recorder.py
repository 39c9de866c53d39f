"""A disk that is full under the recorder, and a file that is moved: robot and clients go on, and are told.

A disk that does not answer is tests/server/test_recording.py.
"""

import resource

import pytest
from tests.conformance.served import Served

from tvist_lab.recordings.mcap_file import read

from .bystander import Bystander

pytestmark = pytest.mark.realtime


def test_a_disk_that_fills_up_ends_the_recording_and_is_named_and_counted(tmp_path):
    path, why = tmp_path / "run.mcap", "has stopped and is incomplete: File too large"
    with Served("--record", str(path)) as served:
        with Bystander(served.endpoint) as bystander, bystander.control("mover") as token:
            q = bystander.state()["target_q"]
            bystander.command("move_j", token=token, q=[q[0] + 0.5, *q[1:]])
            resource.prlimit(served.process.pid, resource.RLIMIT_FSIZE, (50_000, 50_000))
            served.wait_until_said(why)
            bystander.wait("event", lambda event: why in (event.get("why") or ""))
            bystander.next("telemetry", lambda telemetry: telemetry["recorder_dropped"] > 0)
            bystander.event("motion_done")
            bystander.assert_undisturbed()
        assert served.end() == 1
        assert served.lines[-1].startswith("tvist: the recording")
    content = read(path)
    assert not content.complete
    # What was written is there, from the first tick on and without a gap.
    assert [state.tick for state in content.states] == list(range(1, len(content.states) + 1))


def test_a_recording_that_is_moved_goes_on_there_and_is_told_to_all(tmp_path):
    path, new = tmp_path / "run.mcap", tmp_path / "moved.mcap"
    with Served("--record", str(path)) as served:
        with Bystander(served.endpoint) as bystander:
            path.rename(new)
            served.wait_until_said("was moved away")
            why = f"the recording {path} was moved away: it continues in {new}"
            bystander.wait("event", lambda event: event.get("why") == why)
            bystander.until_later(500)
            last = bystander.received["state"][-1]["tick"]
            bystander.assert_undisturbed()
        assert served.end() == 0
        assert served.said.count(why) == 1
        assert f"recorded into {new}" in served.lines[-1]
        assert f"recorded into {path}" not in served.said
    content = read(new)
    assert content.complete
    assert [state.tick for state in content.states] == list(range(1, content.states[-1].tick + 1))
    assert content.states[-1].tick >= last
