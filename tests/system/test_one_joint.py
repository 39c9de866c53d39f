"""The one-joint arm, as a user meets it: every command works for a robot with two joints, with nothing else given."""

import json

import pytest
from tests.conformance.served import Served
from tests.conformance.wire import Wire
from tests.system.test_command_line import tvist

from tvist_plant.description import fingerprint, load
from tvist_protocol.calibration import calibration_from_json


@pytest.fixture(scope="module")
def served():
    """The arm in real time, but slower, so that no busy machine overloads it."""
    with Served("--robot", "one-joint", "--speed", "0.1") as served:
        yield served


class TestServed:
    @pytest.mark.realtime
    def test_angles_of_another_arm_are_refused(self, served):
        ended = tvist("move", "0,-3,0,-1.5,0,0", "--endpoint", served.endpoint)
        ended.assert_failed(1, "q has 6 angles; the arm has 2")

    @pytest.mark.realtime
    def test_it_is_checked_and_watched(self, served):
        assert "2 joints" in tvist("check", served.endpoint).assert_done().out
        said = tvist("watch", served.endpoint, "--seconds", 1, "--json").assert_done().out
        states = [json.loads(line) for line in said.splitlines()]
        assert states
        assert all(len(state["actual_q"]) == 2 for state in states)

    def test_it_takes_the_names_of_its_own_poses_and_is_recorded_analyzed_and_replayed(self, tmp_path):
        path, seen = tmp_path / "served.mcap", tmp_path / "seen.mcap"
        options = ("--robot", "one-joint", "--truth", "--clock", "lockstep", "--record", str(path))
        with Served(*options) as served:
            at = ("--endpoint", served.endpoint)
            tvist("log", "record", seen, *at, "--seconds", 1).assert_done()
            assert tvist("log", "analyze", seen, "--json").assert_done().json["motions"] == []
            for pose in ("Q3", "q1"):
                assert "moved to" in tvist("move", pose, *at).assert_done().out
            with Wire(served.endpoint) as wire, wire.control() as token:
                wire.step(token, 400)  # what rings after the motion
        found = tvist("log", "analyze", path, "--figures", tmp_path, "--json").assert_done().json["motions"]
        assert len(found) == 2
        assert (tmp_path / "motion_2.png").exists()
        assert tvist("log", "replay", path, "--json").assert_done().json["equal"]


def test_its_moves_are_evaluated_beside_every_baseline():
    same = ("--robot", "one-joint", "--moves", 3, "--payload", 1)
    said = tvist("study", "moves", *same, "--json").assert_done().json
    assert said["calibration"] == "one-joint_1kg"
    assert {move["payload_kg"] for move in said["moves"]} == {1.0}
    first, *others = said["summary"]
    assert "fixed_ei3" in {one["shaper"] for one in others}
    assert first["reduction_percent_median"] > 90.0


def test_it_is_identified_at_its_own_poses(tmp_path):
    path = tmp_path / "mine.json"
    options = ("--ring-downs", 16, "--payload", 1, "--output", path)
    said = tvist("identify", "--robot", "one-joint", *options).assert_done().out
    assert f"tvist serve --calibration {path} --robot one-joint" in " ".join(said.split())
    calibration = calibration_from_json(path.read_bytes())
    assert calibration.robot == "one-joint arm"
    assert calibration.polynomial.joints == (1,)
    assert calibration.provenance.configurations >= 14
    assert calibration.provenance.arm == fingerprint(load("one-joint"))


def test_what_it_carries_is_not_identified():
    ended = tvist("identify", "--robot", "one-joint", "--payload")
    assert ended.assert_failed(1, "no joint of a one-joint arm carries weight").out == ""


def test_the_lesson_is_a_file_that_is_there(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    said = "".join(tvist("lesson").assert_done().out.split("\n"))
    assert "try.html: open it in any browser" in said
