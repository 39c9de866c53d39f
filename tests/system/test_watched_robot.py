"""`tvist serve --plant ur://…` watches a robot in another process: every row once, and nothing moves it."""

import socket
import threading

import pytest
from tests.conformance.served import Served, refused_to_start
from tests.places import free_port, own_address
from tests.system.rtde_link import RtdeLink
from tests.system.shell import tvist

from tvist_client import RefusedError
from tvist_client.blocking import Robot
from tvist_lab.metrics.motion import motions
from tvist_lab.recordings.mcap_file import read
from tvist_protocol import commands as c
from tvist_server.rtde.codec import PackageKind

pytestmark = pytest.mark.realtime

HOST, OTHER = own_address(47), own_address(48)
READS = {
    PackageKind.REQUEST_PROTOCOL_VERSION,
    PackageKind.GET_URCONTROL_VERSION,
    PackageKind.SETUP_OUTPUTS,
    PackageKind.START,
}
"""What is sent to a robot that is watched."""


def a_robot(address=HOST):
    return Served("--hidden", "1001", "--ur", "--ur-address", address, "--profile", "real")


@pytest.fixture(scope="module")
def arm():
    with a_robot() as served:
        yield served


@pytest.fixture
def link():
    with RtdeLink(f"tcp/{HOST}:30004", seed=3) as link:
        yield link


def place(link):
    return link.endpoint.replace("tcp/", "ur://")


def watched(link, *options):
    return Served("--plant", place(link), *options, name="watched")


def move(served, change):
    with Robot.connect(served.endpoint) as robot, robot.control("me") as arm:
        q = list(robot.state().target_q)
        q[0] += change
        arm.move_j(q)
        robot.advance(500)


@pytest.mark.parametrize("slow", [False, True])
def test_every_row_becomes_one_state_with_the_robot_s_time(arm, link, tmp_path, slow):
    link.slow, link.lost, link.repeated = slow, 0.02, 0.02
    file = tmp_path / "watched.mcap"
    with watched(link, "--record", str(file)) as served:
        served.wait_until_said("is watched")
        move(arm, 0.1)
        move(arm, -0.1)
        assert tvist("check", served.endpoint, "--name", "watched", "--json").json["robot_mode"] == "RUNNING"
    passed = link.passed[-1]
    recording = read(file).recording
    rows = len(recording)
    assert recording.time.tolist() == pytest.approx(passed[:rows], abs=1e-9)
    due = round((recording.time[-1] - recording.time[0]) / (0.008 if slow else 0.002)) + 1
    assert recording["missed_ticks"][-1] == due - rows > 0
    assert set(link.sent) == READS
    assert [motion for motion in motions(recording) if motion.duration(recording) > 0.1][1:]
    assert "reference_q" not in recording
    assert recording.foreign


def test_the_state_is_the_robot_s(arm, link):
    with (
        watched(link) as served,
        Robot.connect(served.endpoint, "watched") as here,
        Robot.connect(arm.endpoint) as there,
    ):
        own = there.state()
        for name, tolerance in (
            ("actual_q", 1e-3), ("actual_TCP_pose", 2e-3), ("actual_tool_accelerometer", 0.5),
            ("actual_moment", 3.0),
        ):  # fmt: skip
            assert getattr(here.state(), name) == pytest.approx(getattr(own, name), abs=tolerance), name
        assert here.info().payload == there.info().payload
        assert here.info().watched == place(link)


def test_what_concerns_the_arm_is_refused_with_one_sentence(arm, link):
    with watched(link) as served, Robot.connect(served.endpoint, "watched") as robot:
        before = robot.state().actual_q
        with robot.control("me") as control:
            q = [angle + 0.1 for angle in before]
            for command in (
                lambda: control.move_j(q),
                control.power_off,
                lambda: control.set_speed(0.5),
                control.unlock_protective_stop,
            ):
                with pytest.raises(RefusedError, match="only watched") as refused:
                    command()
                assert refused.value.reply.code == "wrong_mode"
        with pytest.raises(RefusedError, match="nothing is sent to it"):
            robot.request(c.Stop())
        assert robot.state().actual_q == pytest.approx(before, abs=1e-3)
        tvist("unlock", served.endpoint, "--name", "watched").assert_failed(1, "only watched")
        tvist("stop", "watched", "--endpoint", served.endpoint).assert_failed(1, "only watched")
    assert set(link.sent) == READS


def test_a_lost_connection_is_told_and_comes_back(arm, link):
    with watched(link) as served:
        served.wait_until_said("is watched")
        link.cut()
        served.wait_until_said("the state stands still")
        checked = tvist("check", served.endpoint, "--name", "watched")
        checked.assert_failed(1, f"{place(link)} is not connected", "every second")
        link.restore()
        served.wait_until_said("is back after")
        with Robot.connect(served.endpoint, "watched") as robot:
            robot.advance(10)
            assert robot.state().robot_mode == 7
            assert robot.state().missed_ticks > 100
        tvist("check", served.endpoint, "--name", "watched").assert_done()


def test_a_stop_of_the_robot_is_told_and_a_restart_survived():
    with RtdeLink(f"tcp/{OTHER}:30004") as link:
        with a_robot(OTHER) as arm:
            served = watched(link)
            served.wait_until_ready()
            served.wait_until_said("is watched")
            with Robot.connect(arm.endpoint) as robot, robot.control("me") as control:
                control.inject("protective_stop")
            served.wait_until_said("PROTECTIVE_STOP")
            checked = tvist("check", served.endpoint, "--name", "watched", "--json").json
            assert checked["safety_mode"] == "PROTECTIVE_STOP"
            assert "at the robot" in checked["next"]
        served.wait_until_said("the state stands still")
        with Robot.connect(served.endpoint, "watched") as robot:
            before = robot.info().tick
        with a_robot(OTHER), served:
            served.wait_until_said("its clock began anew")
            with Robot.connect(served.endpoint, "watched") as robot:
                robot.advance(10)
                assert robot.state().tick > before
                assert robot.state().safety_mode == 1


def test_bad_starts_are_one_sentence(arm, link):
    for options, words in (
        (("--plant", f"ur://127.0.0.1:{free_port()}"), ["no robot answers", "Next:"]),
        (("--plant", f"ur://{HOST}:29999"), ["does not answer as RTDE", "30004"]),
        (("--plant", place(link), "--robot", "ur10e"), ["is no UR10e", "--robot"]),
        (("--plant", place(link), "--shaper", "zv"), ["only watched", "shaper"]),
    ):
        code, said = refused_to_start(*options)
        assert code == 2, said
        assert all(word in said for word in words), said


def test_whoever_sends_no_rows_is_no_robot():
    """Its port is open, and it never answers."""
    with socket.create_server(("127.0.0.1", 0)) as silent:
        kept = []
        threading.Thread(target=lambda: kept.append(silent.accept()), daemon=True).start()
        _, said = refused_to_start("--plant", f"ur://127.0.0.1:{silent.getsockname()[1]}")
    for connection, _ in kept:
        connection.close()
    assert "does not answer as RTDE does within 3 s" in said
