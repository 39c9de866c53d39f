"""A disk that is full or does not answer, under the recorder: the robot and its clients do not notice.

A disk that is full after 50 kB is `test_exits`'s, too.
"""

import subprocess

import pytest
from tests.conformance.served import Served

from tvist_lab.recordings.mcap_file import read

from .bystander import Bystander
from .interposed import Interposed

pytestmark = pytest.mark.realtime


@pytest.fixture
def system(tmp_path, monkeypatch):
    """The system as the served process sees it."""
    system = Interposed(tmp_path)
    for name, value in system.environment.items():
        monkeypatch.setenv(name, value)
    yield system
    system.release_disk()


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 128 kB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=128k", "tmpfs", folder], capture_output=True, check=False
    )
    if mounted.returncode != 0:
        pytest.skip(f"no disk can be mounted here: {mounted.stderr.decode().strip()}")
    yield folder
    subprocess.run(["umount", folder], check=True)


def test_a_disk_that_fills_up_ends_the_recording_and_is_named_and_counted(small_disk):
    path = small_disk / "run.mcap"
    with Served("--record", str(path)) as served:
        with Bystander(served.endpoint) as bystander, bystander.control("mover") as token:
            q = bystander.state()["target_q"]
            bystander.command("move_j", token=token, q=[q[0] + 1.0, *q[1:]])
            served.wait_until_said("has stopped and is incomplete: No space left on device")
            warning = bystander.event("warning")
            assert "has stopped and is incomplete: No space left on device" in warning["why"]
            bystander.next("telemetry", lambda telemetry: telemetry["recorder_dropped"] > 0)
            bystander.event("motion_done")
            bystander.assert_undisturbed()
        assert served.end() == 1
        assert "No space left on device" in served.lines[-1]
    content = read(path)
    assert not content.complete
    # What was written is there, from the first tick on and without a gap.
    assert [state.tick for state in content.states] == list(range(1, len(content.states) + 1))


def test_a_recording_that_is_deleted_is_told_to_all_and_not_claimed_at_the_end(tmp_path):
    path = tmp_path / "run.mcap"
    with Served("--record", str(path)) as served:
        with Bystander(served.endpoint) as bystander:
            path.unlink()
            served.wait_until_said("was deleted")
            assert f"the recording {path} was deleted" in bystander.event("warning")["why"]
            bystander.next("telemetry", lambda telemetry: telemetry["recorder_dropped"] > 0)
            bystander.assert_undisturbed()
        assert served.end() == 1
        assert f"the recording {path} was deleted" in served.lines[-1]
        assert "recorded into" not in served.said
    assert not list(tmp_path.iterdir())


def test_a_recording_that_is_moved_goes_on_there_and_is_told_to_all(tmp_path):
    path, new = tmp_path / "run.mcap", tmp_path / "moved.mcap"
    with Served("--record", str(path)) as served:
        with Bystander(served.endpoint) as bystander:
            path.rename(new)
            served.wait_until_said("was moved away")
            why = f"the recording {path} was moved away: it continues in {new}"
            assert bystander.event("warning")["why"] == why
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


def test_a_disk_that_does_not_answer_for_a_second_costs_nothing(system, tmp_path):
    path = tmp_path / "run.mcap"
    with (
        Served("--record", str(path), "--truth", cold=True) as served,
        Bystander(served.endpoint) as bystander,
    ):
        assert system.in_force(served.process.pid)
        system.stop_disk()
        while not system.writes_held:
            bystander.until_later(50)
        bystander.until_later(500)
        system.release_disk()
        bystander.assert_undisturbed()
        assert bystander.next("telemetry")["recorder_dropped"] == 0
        last = bystander.received["state"][-1]["tick"]
        assert served.end() == 0
    content = read(path)
    assert content.complete
    assert [state.tick for state in content.states] == list(range(1, content.states[-1].tick + 1))
    assert content.states[-1].tick >= last


@pytest.mark.nightly
def test_a_disk_that_does_not_answer_for_longer_loses_what_is_counted_and_nothing_else(system, tmp_path):
    path = tmp_path / "run.mcap"
    # Twice as fast, with the truth: the recorder's queue is full after about four seconds.
    with (
        Served("--record", str(path), "--truth", "--speed", "2", cold=True) as served,
        Bystander(served.endpoint) as bystander,
    ):
        system.stop_disk()
        bystander.next("telemetry", lambda telemetry: telemetry["recorder_dropped"] > 1000)
        bystander.assert_undisturbed()
        system.release_disk()
        dropped, after = 0, bystander.next("telemetry")["recorder_dropped"]
        while after > dropped:  # until there is room again
            dropped, after = after, bystander.next("telemetry")["recorder_dropped"]
        assert served.end() == 0
    content = read(path)
    assert content.complete
    assert sum(content.dropped.values()) >= dropped
    assert content.recording.missing_ticks == content.dropped["state"] > 0
