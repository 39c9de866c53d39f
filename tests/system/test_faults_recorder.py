"""A full disk and a moved recording are reported; the robot continues.

A disk that does not answer: tests/server/test_recording.py.
"""

import resource

import pytest
from tests.conformance.served import Served

from tvist_lab.recordings.mcap_file import read

from .bystander import Bystander

pytestmark = pytest.mark.realtime


def test_full_disk_ends_the_recording_and_is_reported(tmp_path):
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
    # It has all ticks from the first one on.
    assert [state.tick for state in content.states] == list(range(1, len(content.states) + 1))


def test_moved_recording_continues_in_its_new_place(tmp_path):
    path, new = tmp_path / "run.mcap", tmp_path / "moved.mcap"
    with Served("--record", str(path)) as served:
        with Bystander(served.endpoint) as bystander:
            path.rename(new)
            served.wait_until_said("was moved away")
            why = f"the recording {path} was moved away: it continues in {new}"
            bystander.wait("event", lambda event: event.get("why") == why)
            bystander.until_later(200)
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
