"""The one-joint arm, as a user meets it: every command works for a robot with two joints, with nothing else given."""

import json

import pytest
from tests.conformance.served import Served
from tests.conformance.wire import Wire

from tvist_plant.description import fingerprint, load
from tvist_protocol.calibration import calibration_from_json


@pytest.fixture
def done(called):
    """Run a command in this process; return what it prints."""

    def run(*arguments):
        code, out, err = called(*map(str, arguments))
        assert code == 0, err
        return out

    return run


def test_one_joint_arm_moves_to_named_poses_and_replays(called, done, tmp_path):
    path = tmp_path / "served.mcap"
    options = ("--robot", "one-joint", "--truth", "--clock", "lockstep", "--record", str(path))
    with Served(*options) as served:
        at = ("--endpoint", served.endpoint)
        assert "2 joints" in done("check", served.endpoint)
        code, _, err = called("move", "0,-3,0,-1.5,0,0", *at)
        assert code == 1
        assert "q has 6 values: must be 2" in err
        for pose in ("Q3", "q1"):
            assert "moved to" in done("move", pose, *at)
        with Wire(served.endpoint) as wire, wire.control() as token:
            assert len(wire.step(token, 400)["actual_q"]) == 2  # what rings after the motion
    assert len(json.loads(done("log", "analyze", path, "--figures", tmp_path, "--json"))["motions"]) == 2
    assert (tmp_path / "motion_2.png").exists()
    assert json.loads(done("log", "replay", path, "--json"))["equal"]


def test_moves_of_one_joint_arm_are_evaluated_with_every_baseline(done):
    same = ("--robot", "one-joint", "--moves", 1, "--payload", 1)
    said = json.loads(done("study", "moves", *same, "--json"))
    assert said["calibration"] == "one-joint_1kg"
    assert {move["payload_kg"] for move in said["moves"]} == {1.0}
    first, *others = said["summary"]
    assert "fixed_ei3" in {one["shaper"] for one in others}
    assert first["reduction_percent_median"] > 90.0


def test_one_joint_arm_is_identified(done, tmp_path):
    path = tmp_path / "mine.json"
    options = ("--ring-downs", 4, "--payload", 1, "--output", path)
    said = done("identify", "--robot", "one-joint", *options)
    assert f"tvist serve --calibration {path} --robot one-joint" in " ".join(said.split())
    calibration = calibration_from_json(path.read_bytes())
    assert calibration.robot == "one-joint arm"
    assert calibration.provenance.ring_downs == 4
    assert calibration.provenance.arm == fingerprint(load("one-joint"))


def test_command_lesson_prints_the_path_of_its_page(done, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert "try.html: open it in any browser" in done("lesson").replace("\n", "")
