"""The one-joint arm, as a user meets it: every command works for a robot with two joints, with nothing else given."""

from tests.conformance.served import Served
from tests.conformance.wire import Wire
from tests.system.shell import tvist

from tvist_plant.description import fingerprint, load
from tvist_protocol.calibration import calibration_from_json


def test_it_takes_the_names_of_its_own_poses_and_is_recorded_analyzed_and_replayed(tmp_path):
    path = tmp_path / "served.mcap"
    options = ("--robot", "one-joint", "--truth", "--clock", "lockstep", "--record", str(path))
    with Served(*options) as served:
        at = ("--endpoint", served.endpoint)
        assert "2 joints" in tvist("check", served.endpoint).assert_done().out
        refused = tvist("move", "0,-3,0,-1.5,0,0", *at)
        refused.assert_failed(1, "q has 6 values: must be 2")
        for pose in ("Q3", "q1"):
            assert "moved to" in tvist("move", pose, *at).assert_done().out
        with Wire(served.endpoint) as wire, wire.control() as token:
            assert len(wire.step(token, 400)["actual_q"]) == 2  # what rings after the motion
    found = tvist("log", "analyze", path, "--figures", tmp_path, "--json").assert_done().json["motions"]
    assert len(found) == 2
    assert (tmp_path / "motion_2.png").exists()
    assert tvist("log", "replay", path, "--json").assert_done().json["equal"]


def test_its_moves_are_evaluated_beside_every_baseline():
    same = ("--robot", "one-joint", "--moves", 2, "--payload", 1)
    said = tvist("study", "moves", *same, "--json").assert_done().json
    assert said["calibration"] == "one-joint_1kg"
    assert {move["payload_kg"] for move in said["moves"]} == {1.0}
    first, *others = said["summary"]
    assert "fixed_ei3" in {one["shaper"] for one in others}
    assert first["reduction_percent_median"] > 90.0


def test_it_is_identified_at_its_own_poses(tmp_path):
    path = tmp_path / "mine.json"
    options = ("--ring-downs", 14, "--payload", 1, "--output", path)
    said = tvist("identify", "--robot", "one-joint", *options).assert_done().out
    assert f"tvist serve --calibration {path} --robot one-joint" in " ".join(said.split())
    calibration = calibration_from_json(path.read_bytes())
    assert calibration.robot == "one-joint arm"
    assert calibration.polynomial.joints == (1,)
    assert calibration.provenance.configurations >= 6
    assert calibration.provenance.arm == fingerprint(load("one-joint"))


def test_the_lesson_is_a_file_that_is_there(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    said = "".join(tvist("lesson").assert_done().out.split("\n"))
    assert "try.html: open it in any browser" in said
