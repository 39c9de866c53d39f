"""`python -m tvist_client check`: tells a robot that works from one that does not."""

import json

import pytest

from tvist_client.__main__ import main
from tvist_client.check import check
from tvist_protocol.codec import encode
from tvist_protocol.info import StopReason
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.replies import Done, Refused


def test_a_robot_that_works_is_well_and_unchanged(realtime, endpoint):
    report = check(endpoint, "ur5e")
    assert report.ok
    assert (report.robot, report.protocol) == ("ur5e", 1)
    assert report.state_rate_hz > 0.0
    assert [finding.what for finding in report.findings] == ["connect", "info", "state", "refusal", "ready"]
    assert {type(command).__name__ for command in realtime.robot.commands} == {"MoveJ"}
    assert realtime.robot.motions == 0


def test_in_lockstep_there_is_no_rate(lockstep, endpoint):
    report = check(endpoint)
    assert report.ok
    assert report.state_rate_hz is None


def test_json_is_one_object_with_what_is_promised(realtime, endpoint, capsys):
    assert main(["check", endpoint, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert {"ok", "robot", "protocol", "state_rate_hz"} <= set(printed)
    assert printed["ok"] is True


def test_a_person_reads_a_line_a_step(realtime, endpoint, capsys):
    assert main(["check", endpoint]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[:2] for line in lines] == [
        ["ok", step] for step in ("connect", "info", "state", "refusal", "ready")
    ]


def test_nobody_there_is_a_failure_that_says_what_to_check(endpoint, capsys):
    assert main(["check", endpoint]) == 1
    assert "check that it is running" in capsys.readouterr().out
    assert main(["check", endpoint, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["protocol"] is None


def test_misuse_is_told_from_failure(capsys):
    for arguments in ([], ["check", "--nonsense"], ["what"]):
        with pytest.raises(SystemExit) as ended:
            main(arguments)
        assert ended.value.code == 2
    capsys.readouterr()


def test_a_name_that_is_none_is_a_failure(capsys):
    assert main(["check", "--name", "Not A Name"]) == 1
    assert "robot is 'Not A Name'" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("answer", "sentence"),
    [
        (Done(), "does not check control"),
        (Refused(code="busy", where="", why="not now"), "busy: not now"),
    ],
)
def test_a_robot_that_does_not_guard_control_is_not_well(realtime, endpoint, answer, sentence):
    realtime.robot.answers["move_j"] = encode(answer)
    report = check(endpoint)
    assert not report.ok
    assert sentence in report.findings[-1].said


def test_a_robot_of_another_protocol_is_not_well(realtime, endpoint):
    realtime.robot.protocol = 2
    report = check(endpoint)
    assert (report.ok, report.protocol) == (False, 2)
    assert "protocol 2" in report.findings[-1].said


def test_a_robot_that_stands_still_is_not_well(realtime, endpoint, monkeypatch):
    monkeypatch.setattr("tvist_client.robot.STATE_S", 0.1)
    monkeypatch.setattr(realtime.robot, "pass_tick", lambda: None)
    report = check(endpoint)
    assert not report.ok
    assert report.findings[-1].what == "state"


STOPPED = StopReason(tick=12, code="limit_torque", why="torque of joint elbow is 171 N m")


def test_a_robot_that_stands_is_not_ready_and_says_why_since_when_and_what_to_do(realtime, endpoint, capsys):
    realtime.robot.told = {"robot_mode": 7, "safety_mode": 3, "stop": STOPPED}
    report = check(endpoint)
    assert (report.ok, report.ready, report.stop) == (False, False, STOPPED)
    assert (report.robot_mode, report.safety_mode) == ("RUNNING", "PROTECTIVE_STOP")
    said = report.findings[-1].said
    assert "safety_mode is PROTECTIVE_STOP since tick 12: torque of joint elbow is 171 N m" in said
    assert f"tvist unlock {endpoint}" in report.next
    assert report.next in said
    assert main(["check", endpoint, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["stop"]["code"] == "limit_torque"


@pytest.mark.parametrize("mode", sorted({*SafetyMode} - {SafetyMode.NORMAL, SafetyMode.REDUCED}))
def test_only_normal_and_reduced_are_ready(realtime, endpoint, mode):
    realtime.robot.modes = (RobotMode.RUNNING, mode)
    report = check(endpoint)
    assert (report.ok, report.safety_mode) == (False, mode.name)
    realtime.robot.modes = (RobotMode.RUNNING, SafetyMode.REDUCED)
    assert check(endpoint).ready


@pytest.mark.parametrize("mode", [RobotMode.POWER_OFF, RobotMode.IDLE])
def test_an_arm_without_power_or_with_its_brakes_closed_is_not_ready(realtime, endpoint, mode):
    realtime.robot.modes = (mode, SafetyMode.NORMAL)
    report = check(endpoint)
    assert not report.ok
    assert f"robot_mode is {mode.name}" in report.findings[-1].said
    assert "--power-on" in report.next


def test_a_mode_nobody_knows_is_not_ready(realtime, endpoint):
    realtime.robot.modes = (RobotMode.RUNNING, 99)
    assert "safety_mode is 99" in check(endpoint).findings[-1].said


def test_before_the_first_tick_info_alone_says_it(lockstep, endpoint):
    lockstep.robot.told = {"robot_mode": 3, "safety_mode": 1}
    report = check(endpoint)
    assert (report.ok, report.robot_mode) == (False, "POWER_OFF")


def test_alive_looks_at_the_server_alone(realtime, endpoint, capsys):
    realtime.robot.modes = (RobotMode.POWER_OFF, SafetyMode.VIOLATION)
    assert main(["check", "--alive", endpoint]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[1] for line in lines] == ["connect", "info", "state"]
    report = check(endpoint, alive=True)
    assert (report.ok, report.ready) == (True, None)
    assert realtime.robot.commands == []


def test_a_robot_that_stands_still_is_not_alive(realtime, endpoint, monkeypatch):
    monkeypatch.setattr("tvist_client.robot.STATE_S", 0.1)
    monkeypatch.setattr(realtime.robot, "pass_tick", lambda: None)
    assert not check(endpoint, alive=True).ok
