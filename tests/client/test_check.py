"""`python -m tvist_client check` finds out whether a robot works and is ready to move."""

import json
import math
import re
from itertools import product

import pytest
from msgspec.structs import replace

from tvist_cli.commands.check import check as check_command
from tvist_cli.commands.watch import _load
from tvist_cli.connection import Connection
from tvist_cli.failure import Failure
from tvist_client import check as checking
from tvist_client.__main__ import main
from tvist_client.check import check
from tvist_client.fleet import Fleet
from tvist_client.readiness import mode_name, readiness
from tvist_protocol.codec import decode
from tvist_protocol.info import Info, StopReason
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.replies import Done, Refused

from .conftest import Served


@pytest.fixture(autouse=True)
def _waits_are_short(monkeypatch):
    """States come 500 times a second here, and a robot that starts answers at once."""
    monkeypatch.setattr(checking, "LISTEN_S", 0.1)
    monkeypatch.setattr(checking, "RETRY_S", 0.0)
    monkeypatch.setattr("tvist_client.transports.zenoh.FIND_S", 0.1)


STEPS = ["connect", "info", "state", "refusal", "ready", "load"]


def test_check_passes_for_a_working_robot_and_changes_nothing(realtime, endpoint):
    report = check(endpoint, "ur5e")
    assert report.ok
    assert (report.robot, report.protocol) == ("ur5e", 1)
    assert report.state_rate_hz > 0.0
    assert [finding.what for finding in report.findings] == STEPS
    assert (report.overloaded, report.due_per_second) == (False, 10.0)
    assert {type(command).__name__ for command in realtime.robot.commands} == {"MoveJ"}


def test_check_prints_a_line_for_each_step_or_one_json_object(realtime, endpoint, capsys):
    """What a robot says of itself gives a terminal no commands."""
    realtime.robot.told = {"model": "\x1b]0;owned\x07"}
    assert main(["check", endpoint]) == 0
    said = capsys.readouterr().out
    assert [line.split()[:2] for line in said.splitlines()] == [["ok", step] for step in STEPS]
    assert not set(said) & set("\x1b\x07")
    assert main(["check", endpoint, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert {"ok", "robot", "protocol", "state_rate_hz"} <= set(printed)
    assert printed["ok"] is True


def test_check_fails_without_a_server_and_names_the_next_step(endpoint, capsys):
    assert main(["check", endpoint]) == 1
    assert "check that it is running" in capsys.readouterr().out
    assert main(["check", endpoint, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["protocol"] is None


@pytest.mark.parametrize(
    ("told", "answers", "words"),
    [
        ({"protocol": 2}, {}, "protocol 2"),
        ({}, {"move_j": Done()}, "does not check control"),
        ({}, {"move_j": Refused(code="busy", where="", why="not now")}, "busy: not now"),
    ],
)
def test_check_fails_for_another_protocol_and_without_control(realtime, endpoint, told, answers, words):
    realtime.robot.told, realtime.robot.answers = told, answers
    report = check(endpoint)
    assert not report.ok
    assert words in report.findings[-1].said


def test_check_fails_if_the_robot_does_not_tick(realtime, endpoint, monkeypatch):
    monkeypatch.setattr("tvist_client.connection.STATE_S", 0.1)
    monkeypatch.setattr(realtime.robot, "tick", lambda: None)
    report = check(endpoint, alive=True)
    assert not report.ok
    assert report.findings[-1].what == "state"


STOPPED = StopReason(tick=12, code="limit_torque", why="torque of joint elbow is 171 N m")


def test_a_stopped_robot_is_not_ready_and_reports_reason_tick_and_remedy(realtime, endpoint, capsys):
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


def test_only_a_powered_arm_in_normal_or_reduced_mode_is_ready(host):
    info, ready = decode(Info, host.info()), {SafetyMode.NORMAL, SafetyMode.REDUCED}
    for robot, safety in product([*RobotMode, 99], [*SafetyMode, 99]):
        found = readiness(replace(info, robot_mode=robot, safety_mode=safety), None)
        assert found.ready == (robot == RobotMode.RUNNING and safety in ready)
        if safety not in ready:
            assert f"safety_mode is {mode_name(SafetyMode, safety)}" in found.why
        elif not found.ready:
            assert f"robot_mode is {mode_name(RobotMode, robot)}" in found.why
            assert "--power-on" in found.next


def test_alive_checks_only_the_server(realtime, endpoint, capsys):
    realtime.robot.told = {"robot_mode": RobotMode.POWER_OFF, "safety_mode": SafetyMode.VIOLATION}
    assert main(["check", "--alive", endpoint]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[1] for line in lines] == ["connect", "info", "state"]
    report = check(endpoint, alive=True)
    assert (report.ok, report.ready) == (True, None)
    assert realtime.robot.commands == []


@pytest.mark.parametrize(("ticks", "remedy"), [(1e5, "look at the network"), (1.0, "end other programs")])
def test_a_low_rate_is_reported_with_a_remedy(realtime, endpoint, monkeypatch, ticks, remedy):
    monkeypatch.setattr("tvist_client.check.TOO_SLOW", 0.0)
    realtime.robot.promised = {"due_per_second": 1e5, "ticks_per_second": ticks}
    report = check(endpoint, alive=True)
    assert report.ok
    assert re.search(rf"Hz of 100000 due, \d %: .*{remedy}", report.findings[-1].said)


@pytest.mark.parametrize(
    "promised",
    [
        {"due_per_second": 10.0, "overloaded": True, "missed_ticks": 40, "due_ticks": 50},
        {"due_per_second": 1e6, "missed_ticks": 40, "due_ticks": 50},
    ],
    ids=["it says so", "it says nothing, and its ticks show it"],
)
def test_an_overloaded_robot_is_alive_but_fails_with_the_measured_rate(realtime, endpoint, promised):
    realtime.robot.promised = promised
    report = check(endpoint)
    assert (report.ok, report.ready, report.overloaded) == (False, True, True)
    said = report.findings[-1].said
    assert report.findings[-1].what == "load"
    assert f"{report.state_rate_hz:.1f} states/s received of {promised['due_per_second']:g} due" in said
    assert "missed 40 of 50 control periods. Next:" in said
    assert check(endpoint, alive=True).ok


@pytest.mark.parametrize(("waited", "named"), [(45e3, True), (2e3, False)])
def test_a_tick_that_waited_for_a_processor_is_reported(realtime, endpoint, waited, named):
    realtime.robot.promised = {"due_per_second": 10.0, "late_max_us": 40e3, "processor_wait_us": waited}
    said = check(endpoint, alive=True).findings[-1].said
    assert ("began 40 ms late, as its thread waited for a processor: on Linux, kernel.sc" in said) == named


def test_the_rate_counts_received_states_not_ticks(realtime, endpoint, monkeypatch):
    """Of eight states one comes, as on a network that loses most of them."""
    tells = realtime.robot.report
    monkeypatch.setattr(realtime.robot, "report", lambda report: report.state.tick % 8 == 0 and tells(report))
    seen, measure = [], checking._rate

    async def noted(robot):
        seen.append(await measure(robot))
        return seen[-1]

    monkeypatch.setattr(checking, "_rate", noted)
    report = check(endpoint)
    ((rate, ticks),) = seen
    assert report.state_rate_hz == rate == pytest.approx(ticks / 8)


def test_without_telemetry_the_load_is_judged_by_the_nominal_rate(realtime, endpoint, monkeypatch):
    monkeypatch.setattr("tvist_client.check.TELEMETRY_S", 0.01)
    realtime.robot.promised, realtime.robot.told = None, {"rate_hz": 1e6}
    assert check(endpoint).overloaded
    realtime.robot.told = {"rate_hz": 10.0}
    assert check(endpoint).ok


async def test_fleet_and_watch_show_an_overloaded_robot(realtime, endpoint):
    told = {"due_per_second": 500.0, "ticks_per_second": 60.0, "overloaded": True}
    realtime.robot.promised = told
    async with Fleet(endpoint) as fleet:
        await fleet.listen()
        (row,) = await fleet.look()
    assert (row.overloaded, row.ready) == (True, True)
    assert row.said.startswith("overloaded: 60 of 500 ticks/s. Next: ")
    given = {"missed_ticks": 3, "due_ticks": 9, "late_p99_us": 7.0, "load": 0.25}
    shown = str(_load([replace(realtime.robot.telemetry(), **given)]))
    assert shown == "60.0 ticks/s   missed 3 of 9   late p99 7 µs   load 25.0 %   overloaded"


def test_a_starting_robot_is_not_ready_and_reports_its_progress(starting, endpoint):
    starting.starting.note(45, 102)
    report = check(endpoint)
    assert (report.ok, report.starting, report.ready) == (False, True, None)
    assert report.findings[-1].said == "the robot is starting: 45 of 102 kernels are compiled; try again"
    assert not check(endpoint, alive=True, wait=1e-9).ok  # an orchestrator waits for it, too
    with pytest.raises(Failure, match=r"^the robot is starting: 45 of 102"):
        check_command(Connection(endpoint=endpoint))


def test_check_waits_for_a_starting_robot_and_reports_its_progress(starting, endpoint):
    heard = []

    def tell(said):
        heard.append(said)
        starting.starting.note(45 + len(heard), 102)
        if len(heard) == 3:
            starting.get_ready()

    report = check(endpoint, wait=math.inf, tell=tell)
    assert report.ok, report
    shares = ["", "46 of 102 kernels are compiled; ", "47 of 102 kernels are compiled; "]
    assert heard == [f"the robot is starting: {share}try again" for share in shares]


def test_check_waits_for_a_server(endpoint):
    served = []
    report = check(endpoint, wait=math.inf, tell=lambda _: served.append(Served("lockstep", endpoint)))
    served[0].close()
    assert report.ok, report


def test_wait_without_a_number_waits_until_the_robot_is_ready(starting, endpoint, capsys, monkeypatch):
    monkeypatch.setattr(checking.time, "sleep", lambda _: starting.get_ready())
    assert main(["check", endpoint, "--wait"]) == 0
    assert capsys.readouterr().err == "the robot is starting: try again\n"
