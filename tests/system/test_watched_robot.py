"""`tvist serve --plant ur://…` watches a robot of another process: each row becomes a state, nothing is sent."""

import contextlib
import socket

import pytest
from tests.conformance.served import Served
from tests.places import free_endpoint, free_port, own_address
from tests.system.rtde_link import RtdeLink
from tests.system.shell import tvist
from tests.system.test_wrong_invocations import assert_said
from tests.system.waiting import eventually

from tvist_client import RefusedError
from tvist_client.blocking import Robot
from tvist_client.check import check
from tvist_lab.metrics.motion import motions
from tvist_lab.recordings.mcap_file import read
from tvist_protocol import commands as c
from tvist_protocol.modes import RobotMode
from tvist_server.rtde.codec import PackageKind
from tvist_server.watching import connection

pytestmark = pytest.mark.realtime

HOST = own_address(47)
READS = {
    PackageKind.REQUEST_PROTOCOL_VERSION, PackageKind.GET_URCONTROL_VERSION, PackageKind.SETUP_OUTPUTS,
    PackageKind.START,
}  # fmt: skip
"""Kinds of packages that a watched robot receives."""


@pytest.fixture(scope="module")
def arm():
    with Served("--hidden", "1001", "--ur", "--ur-address", HOST, "--profile", "real") as served:
        yield served


@pytest.fixture(scope="module")
def link(arm):
    with RtdeLink(f"tcp/{HOST}:30004", seed=3) as link:
        yield link


@pytest.fixture(scope="module")
def watcher(link):
    with watched(link) as served:
        served.wait_until_said("is watched")
        yield served


def place(link):
    return link.endpoint.replace("tcp/", "ur://")


def watched(link, *options):
    return Served("--plant", place(link), *options, name="watched")


def move(served, *changes):
    with Robot.connect(served.endpoint) as robot, robot.control("me") as arm:
        for change in changes:
            first, *others = robot.state().target_q
            arm.move_j([first + change, *others])
            robot.advance(100)


def test_each_row_becomes_one_state_with_the_time_of_the_robot(arm, tmp_path):
    files = {period: tmp_path / f"{period}.mcap" for period in (0.002, 0.008)}
    with contextlib.ExitStack() as stack:
        links = {period: stack.enter_context(RtdeLink(f"tcp/{HOST}:30004", seed=3)) for period in files}
        for period, link in links.items():
            link.slow, link.lost, link.repeated = period > 0.002, 0.05, 0.05
            served = stack.enter_context(watched(link, "--record", str(files[period])))
            served.wait_until_said("is watched")
        move(arm, 0.05, -0.05)
    for period, link in links.items():
        recording = read(files[period]).recording
        rows = len(recording)
        assert recording.time.tolist() == pytest.approx(link.passed[-1][:rows], abs=1e-9)
        due = round((recording.time[-1] - recording.time[0]) / period) + 1
        assert recording["missed_ticks"][-1] == due - rows > 0
        assert set(link.sent) == READS
        assert [motion for motion in motions(recording) if motion.duration(recording) > 0.1][1:]
        assert "reference_q" not in recording
        assert recording.foreign


def test_state_is_that_of_the_robot(arm, link, watcher):
    with Robot.connect(watcher.endpoint, "watched") as here, Robot.connect(arm.endpoint) as there:
        own = there.state()
        for name, tolerance in (
            ("actual_q", 1e-3), ("actual_TCP_pose", 2e-3), ("actual_tool_accelerometer", 0.5),
            ("actual_moment", 3.0),
        ):  # fmt: skip
            assert getattr(here.state(), name) == pytest.approx(getattr(own, name), abs=tolerance), name
        assert here.state().robot_mode == RobotMode.RUNNING
        assert here.info().payload == there.info().payload
        assert here.info().watched == place(link)


def test_commands_to_the_arm_are_refused(link, watcher):
    with Robot.connect(watcher.endpoint, "watched") as robot:
        before = robot.state().actual_q
        with robot.control("me") as control:
            q = [angle + 0.1 for angle in before]
            moves = (lambda: control.move_j(q), lambda: control.set_speed(0.5))
            for command in (*moves, control.power_off, control.unlock_protective_stop):
                with pytest.raises(RefusedError, match="only watched") as refused:
                    command()
                assert refused.value.reply.code == "wrong_mode"
        with pytest.raises(RefusedError, match="nothing is sent to it"):
            robot.request(c.Stop())
        assert robot.state().actual_q == pytest.approx(before, abs=1e-3)
        tvist("unlock", watcher.endpoint, "--name", "watched").assert_failed(1, "only watched")
        tvist("stop", "watched", "--endpoint", watcher.endpoint).assert_failed(1, "only watched")
    assert set(link.sent) == READS


def test_lost_connection_is_reported_and_restored(link, watcher):
    link.cut()
    watcher.wait_until_said("the state stands still")
    checked = tvist("check", watcher.endpoint, "--name", "watched")
    checked.assert_failed(1, f"{place(link)} is not connected", "every second")
    link.restore()
    watcher.wait_until_said("is back after")
    with Robot.connect(watcher.endpoint, "watched") as robot:
        robot.advance(10)
        assert robot.state().robot_mode == RobotMode.RUNNING
        assert robot.state().missed_ticks > 100


def test_stop_of_the_robot_is_reported_and_its_restart_survived(arm):
    with RtdeLink(f"tcp/{HOST}:30004") as link, watched(link) as served:
        served.wait_until_said("is watched")
        with Robot.connect(arm.endpoint) as robot, robot.control("me") as control:
            control.inject("protective_stop")
            served.wait_until_said("PROTECTIVE_STOP")
            checked = check(served.endpoint, "watched")
            assert checked.safety_mode == "PROTECTIVE_STOP"
            assert "at the robot" in checked.next
            control.unlock_protective_stop()
        told = []  # stderr may omit some
        with Robot.connect(served.endpoint, "watched") as robot:
            robot.on_event(lambda event: told.append(event.why or ""))
            link.cut()
            eventually(lambda: any("the state stands still" in why for why in told))
            before = robot.info().tick
            link.earlier = 30.0
            link.restore()
            eventually(lambda: any("its clock began anew" in why for why in told))
            robot.advance(10)
            assert robot.state().tick > before
            assert robot.state().safety_mode == 1


def refused(called, words, plant, *options):
    assert_said(called("serve", "--listen", free_endpoint(), "--plant", plant, *options), 2, words)


def test_bad_start_options_are_refused(called, arm):
    refused(called, ["no robot answers", "Next:"], f"ur://127.0.0.1:{free_port()}")
    refused(called, ["is no UR10e", "--robot"], f"ur://{HOST}", "--robot", "ur10e")
    refused(called, ["only watched", "shaper"], f"ur://{HOST}", "--shaper", "zv")


def test_server_that_does_not_speak_rtde_is_refused(called, arm, monkeypatch):
    monkeypatch.setattr(connection, "ANSWERS", 0.5)
    refused(called, ["does not answer as RTDE", "30004"], f"ur://{HOST}:29999")
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"ur://127.0.0.1:{silent.getsockname()[1]}"
        refused(called, ["does not answer as RTDE does within 0.5 s"], address)
