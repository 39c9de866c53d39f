"""`python -m tvist_client check`: tells a robot that works from one that does not."""

import json

import pytest

from tvist_client.__main__ import main
from tvist_client.check import check
from tvist_protocol.codec import encode
from tvist_protocol.replies import Done, Refused


def test_a_robot_that_works_is_well_and_unchanged(realtime, endpoint):
    report = check(endpoint, "ur5e")
    assert report.ok
    assert (report.robot, report.protocol) == ("ur5e", 1)
    assert report.state_rate_hz > 0.0
    assert [finding.what for finding in report.findings] == ["connect", "info", "state", "refusal"]
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
        ["ok", step] for step in ("connect", "info", "state", "refusal")
    ]


def test_nobody_there_is_a_failure_that_says_what_to_check(endpoint, capsys):
    assert main(["check", endpoint]) == 1
    assert "check that the server runs" in capsys.readouterr().out
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
        (Done(), "does not guard control"),
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
