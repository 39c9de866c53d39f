"""The one-joint arm, as a user meets it: commands work for a robot with two joints, with nothing else given."""

from tests.conformance.served import Served
from tests.conformance.wire import Wire


def test_one_joint_arm_moves_to_a_named_pose_and_replays(called, tmp_path):
    path = tmp_path / "served.mcap"
    options = ("--robot", "one-joint", "--truth", "--clock", "lockstep", "--record", str(path))
    with Served(*options) as served:
        at = ("--endpoint", served.endpoint)
        assert "2 joints" in called("check", served.endpoint).assert_done().out
        called("move", "0,-3,0,-1.5,0,0", *at).assert_failed(1, "q has 6 values: must be 2")
        assert "moved to" in called("move", "Q3", *at).assert_done().out
        with Wire(served.endpoint) as wire, wire.control() as token:
            assert len(wire.step(token, 200)["actual_q"]) == 2  # what rings after the motion
    told = called("log", "analyze", path, "--figures", tmp_path, "--json").assert_done().json
    assert len(told["motions"]) == 1
    assert (tmp_path / "motion_1.png").exists()
    assert called("log", "replay", path, "--json").assert_done().json["equal"]


def test_moves_of_one_joint_arm_are_evaluated_with_every_baseline(called):
    same = ("--robot", "one-joint", "--moves", 1, "--payload", 1)
    said = called("study", "moves", *same, "--json").assert_done().json
    assert said["calibration"] == "one-joint_1kg"
    assert {move["payload_kg"] for move in said["moves"]} == {1.0}
    first, *others = said["summary"]
    assert "fixed_ei3" in {one["shaper"] for one in others}
    assert first["reduction_percent_median"] > 90.0


def test_command_lesson_prints_the_path_of_its_page(called, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert "try.html: open it in any browser" in called("lesson").assert_done().out.replace("\n", "")
