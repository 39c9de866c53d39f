"""The fixtures as users' tests use them: robots are separate, ready, and step their own time."""

import itertools
import os
import signal
import socket
import subprocess
import sys

import numpy as np
import pytest

from tvist_client import MotionStoppedError
from tvist_client.errors import ClientError
from tvist_lab.recordings import mcap_file
from tvist_plant.plant import Measurement
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_testing import assert_settles_within
from tvist_testing import robots as making
from tvist_testing.markers import ROBOTS

TARGET = [0.5, -3.1, 0.2, -1.6, 0.0, 0.0]
OTHER_PROGRAM = """
import sys
from tvist_client.blocking import Robot
with Robot.connect(sys.argv[1]) as robot, robot.control("other") as arm:
    arm.move_j([0.5, -3.1, 0.2, -1.6, 0.0, 0.0])
"""


class Echo:
    """An arm that follows its commands exactly, and has no truth to publish."""

    def __init__(self, _description, payload):
        self.payload = payload

    def reset(self, command, **_):
        return self.step(command)

    def step(self, command):
        return Measurement(command.q, command.qd, np.zeros_like(command.q), np.zeros(3))


@pytest.mark.tvist_plant(f"{__file__}:Echo")
def test_own_plant_works_without_truth(tvist_robot):
    with tvist_robot.control("me") as arm:
        arm.move_j(TARGET)
    assert tvist_robot.state().actual_q == pytest.approx(TARGET, abs=1e-2)
    assert_settles_within(tvist_robot, seconds=0.1)


@pytest.mark.tvist_cell("clients/examples/cell.toml")
def test_cell_is_simulated_around_the_robot(tvist_robot):
    assert tvist_robot.io().tcp_offset[2] == 0.163
    assert tvist_robot.io().payload.mass == 0.92
    with tvist_robot.control("me") as arm:
        arm.set_digital_output(1, True)
        tvist_robot.advance(250)
    assert tvist_robot.io().actual_digital_input_bits == 8


def test_robot_starts_at_rest_with_its_own_log_and_recording(tvist_robot):
    state = tvist_robot.state()
    assert (state.tick, state.robot_mode) == (0, RobotMode.RUNNING)
    assert state.reference_q == list(tvist_robot.info().poses["Q1"])
    with tvist_robot.control("me") as arm:
        motion = arm.move_j(TARGET)
    assert motion.done > motion.started
    assert tvist_robot.state().reference_q == TARGET
    assert "motion_started" in tvist_robot.log.read_text()
    assert tvist_robot.recording.is_file()


def test_kept_robot_leaves_a_complete_recording_and_its_log(tvist_robot, request, tmp_path):
    tvist_robot.advance(5)
    (of_test,) = request.node.stash[ROBOTS]
    of_test.kept = tmp_path
    of_test.keep()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["ur5e.log", "ur5e.mcap"]
    assert mcap_file.read(tmp_path / "ur5e.mcap").complete


class TestTime:
    def test_simulated_time_passes_while_a_call_waits(self, tvist_robot):
        assert tvist_robot.advance(10) == 10
        assert tvist_robot.rest().tick > 10

    def test_advances_by_one_tick_per_state_and_until_an_event(self, tvist_robot):
        ticks = [state.tick for state in itertools.islice(tvist_robot.states(), 20)]
        assert ticks == list(range(1, 21))
        events = tvist_robot.events()
        with tvist_robot.control("me") as arm:
            motion = arm.move_j(TARGET, wait=False)
            while next(events).kind != "motion_done":
                pass
        assert motion.ended

    def test_is_left_to_another_program_that_has_control(self, tvist_robot):
        subprocess.run([sys.executable, "-c", OTHER_PROGRAM, tvist_robot.endpoint], check=True, timeout=300)
        assert tvist_robot.rest().reference_q == TARGET


def test_robots_of_a_test_are_independent(tvist_robots):
    first, second, third = *tvist_robots(2), *tvist_robots(1)
    together = (first, second, third)
    assert [robot.name for robot in together] == ["ur5e-1", "ur5e-2", "ur5e-3"]
    assert [robot.seed for robot in together] == [0, 1, 2]
    assert len({robot.endpoint for robot in together}) == len({robot.pid for robot in together}) == 3
    first.advance(20)
    second.advance(20)
    assert first.state().actual_tool_accelerometer != second.state().actual_tool_accelerometer
    assert third.state().tick == 0
    os.kill(first.pid, signal.SIGKILL)
    with pytest.raises(ClientError):
        first.advance(10_000)
    os.kill(third.pid, signal.SIGSTOP)
    assert second.advance(5) == 25


class TestMarkers:
    @pytest.mark.tvist_payload(2.0)
    @pytest.mark.tvist_shaper("none")
    @pytest.mark.tvist_state("Q2")
    @pytest.mark.tvist_seed(3)
    def test_payload_shaper_pose_and_seed_are_set(self, tvist_robot):
        info = tvist_robot.info()
        assert (info.payload.mass, info.shaper, tvist_robot.seed) == (2.0, "none", 3)
        assert tvist_robot.state().reference_q == list(info.poses["Q2"])

    @pytest.mark.tvist_state(q=TARGET, mode="POWER_OFF")
    def test_fields_of_the_initial_state_are_set(self, tvist_robot):
        state = tvist_robot.state()
        assert state.reference_q == TARGET
        assert state.robot_mode == RobotMode.POWER_OFF

    @pytest.mark.tvist_faults("emergency_stop")
    def test_fault_is_injected_before_the_first_tick(self, tvist_robot):
        tvist_robot.advance(1)
        assert tvist_robot.state().safety_mode == SafetyMode.ROBOT_EMERGENCY_STOP

    @pytest.mark.tvist_faults("reduced", after=0.1)
    @pytest.mark.tvist_faults("torque", joint=1, value=-1000.0, seconds=0.1, after=0.3)
    def test_faults_are_injected_while_a_client_has_control(self, tvist_robot):
        events = []
        tvist_robot.on_event(events.append)
        with tvist_robot.control("me") as arm, pytest.raises(MotionStoppedError, match="shoulder"):
            arm.move_j(TARGET)
        stop = next(event for event in events if event.kind == "protective_stop")
        assert 150 < stop.tick < 170
        modes = {row.tick: row.moving for row in tvist_robot.history.rows}
        assert modes[150]

    @pytest.mark.tvist_program("def go():\n  movej([0.5, -3.1, 0.2, -1.6, 0, 0])\nend\n")
    def test_program_is_loaded(self, tvist_robot):
        with tvist_robot.control("me") as arm:
            arm.play_program()
            tvist_robot.advance(5)
            assert tvist_robot.rest().reference_q == pytest.approx(TARGET)


@pytest.mark.tvist_payload(3.0)
@pytest.mark.realtime
def test_ur_interfaces_answer_on_their_own_address_and_move_the_arm(tvist_ur):
    with socket.create_connection((tvist_ur.host, tvist_ur.ports["dashboard"])) as dashboard:
        assert dashboard.recv(1024).startswith(b"Connected")
        dashboard.sendall(b"robotmode\n")
        assert dashboard.recv(1024) == b"Robotmode: RUNNING\n"
    target = [angle + 0.02 for angle in tvist_ur.state().reference_q]
    with socket.create_connection((tvist_ur.host, tvist_ur.ports["secondary"])) as scripts:
        scripts.sendall(f"movej({target}, a=3, v=1)\n".encode())
        while tvist_ur.state().reference_q != pytest.approx(target, abs=1e-6):
            pass
    assert_settles_within(tvist_ur, 0.5)
    assert (tvist_ur.info().clock, tvist_ur.info().payload.mass) == ("realtime", 3.0)


def test_missing_packages_are_reported_with_what_to_install(monkeypatch):
    monkeypatch.setattr(making, "find_spec", lambda name: None if name == "numba" else object())
    said = "tvist's fixtures need the server's packages (numba is missing): pip install 'tvist[testing]'"
    assert making.unavailable() == said
