"""ur-rtde moves the robot: the client sends its program, unmodified, and steers it by registers."""

import math
import time

import pytest
from tests.conformance.served import PATIENCE, Served
from tests.conformance.wire import Wire
from tests.places import own_address
from tests.system.ur_object import Client

pytestmark = pytest.mark.realtime

pytest.importorskip("rtde_control")

HOST = own_address(3)
HOME = [-1.60, -1.727, -2.203, -0.808, 1.595, -0.031]
"""Posture at the start, URSim's."""


@pytest.fixture(scope="module")
def served():
    with Served("--ur", "--ur-address", HOST) as served:
        yield served


@pytest.fixture
def arm(served):
    with Client("rtde_control", "RTDEControlInterface", HOST) as arm:
        yield arm
        arm.stopScript()


@pytest.fixture
def seen(served):
    with Client("rtde_receive", "RTDEReceiveInterface", HOST) as seen:
        yield seen


def beside(*changes):
    """Joint positions beside those at the start: pairs of a joint and its change."""
    q = list(HOME)
    for joint, change in changes:
        q[joint] += change
    return q


def eventually(true):
    deadline = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < deadline, "it never was so"


def test_joint_and_line_moves_end_where_they_should(arm, seen):
    assert arm.moveJ(beside((0, 0.2), (2, 0.1)), 1.0, 1.5)
    eventually(lambda: seen.getActualQ() == pytest.approx(beside((0, 0.2), (2, 0.1)), abs=1e-3))
    assert arm.moveJ(HOME, 1.0, 1.5)
    pose = seen.getActualTCPPose()
    goal = [pose[0], pose[1], pose[2] + 0.1, *pose[3:]]
    assert arm.moveL(goal, 0.5, 1.5)
    eventually(lambda: seen.getActualTCPPose()[:3] == pytest.approx(goal[:3], abs=1e-3))
    assert arm.moveJ_IK(pose, 1.0, 1.5)
    eventually(lambda: seen.getActualTCPPose()[:3] == pytest.approx(pose[:3], abs=1e-3))


def test_a_path_with_blends_goes_past_its_corner(arm, seen, served):
    assert arm.moveJ(HOME, 1.0, 1.5)
    pose = seen.getActualTCPPose()
    corner = [pose[0], pose[1], pose[2] + 0.1, *pose[3:]]
    end = [pose[0], pose[1] - 0.1, pose[2] + 0.1, *pose[3:]]
    with Wire(served.endpoint) as wire:
        wire.listen("state")
        assert arm.moveL([[*corner, 0.2, 0.8, 0.03], [*end, 0.2, 0.8, 0.0]], True)
        eventually(lambda: arm.getAsyncOperationProgress() < 0)
        passed = [state["actual_TCP_pose"][:3] for state in wire.received["state"]]
    assert 0.003 < min(math.dist(place, corner[:3]) for place in passed) < 0.03
    eventually(lambda: seen.getActualTCPPose()[:3] == pytest.approx(end[:3], abs=1e-3))


def test_servoing_and_speeds_are_followed_and_stopped(arm, seen):
    assert arm.moveJ(HOME, 1.0, 1.5)
    for _ in range(200):
        assert arm.servoJ(beside((0, 0.02)), 0.0, 0.0, 0.002, 0.03, 1000.0)
    eventually(lambda: abs(seen.getActualQ()[0] - HOME[0] - 0.02) < 1e-3)
    assert arm.servoStop(2.0)
    assert arm.speedJ([0.0, 0.0, 0.0, 0.0, 0.0, 0.1], 1.0, 0.5)
    eventually(lambda: abs(seen.getTargetQd()[5] - 0.1) < 1e-6)
    assert arm.speedStop(2.0)
    assert max(map(abs, seen.getTargetQd())) < 1e-6


def test_kinematics_payload_and_tool_are_those_of_the_robot(arm, seen):
    assert arm.moveJ(HOME, 1.0, 1.5)
    pose = seen.getActualTCPPose()
    q = arm.getInverseKinematics(pose)
    assert q == pytest.approx(HOME, abs=1e-3)
    tool = [0.0, 0.0, 0.1, 0.0, 0.0, 0.0]
    longer = arm.getForwardKinematics(q, tool)
    assert math.dist(longer[:3], pose[:3]) == pytest.approx(0.1, abs=1e-9)
    assert not arm.getInverseKinematicsHasSolution([9.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert arm.setTcp([0.0, 0.0, 0.1, 0.0, 0.0, 0.0])
    assert arm.getTCPOffset() == [0.0, 0.0, 0.1, 0.0, 0.0, 0.0]
    assert arm.setTcp([0.0] * 6)
    assert arm.setPayload(1.0, [0.0, 0.0, 0.05])
    eventually(lambda: seen.getPayload() == 1.0)
    assert arm.setPayload(0.0, [0.0, 0.0, 0.0])


def test_a_script_of_the_users_own_runs_and_control_comes_back(arm, seen):
    assert arm.sendCustomScriptFunction("mine", "write_output_integer_register(12, 4711)\n")
    eventually(lambda: seen.getOutputIntRegister(12) == 4711)
    eventually(arm.isProgramRunning)  # the client has sent its own program again
    assert arm.moveJ(beside((5, 0.1)), 1.0, 1.5)


def test_force_mode_pushes_into_the_air_and_back(arm, seen):
    before = seen.getActualTCPPose()

    def height_pushed_by(force):
        arm.forceMode([0.0] * 6, [0, 0, 1, 0, 0, 0], [0, 0, force, 0, 0, 0], 2, [2, 2, 1.5, 1, 1, 1])
        return seen.getActualTCPPose()[2]

    eventually(lambda: height_pushed_by(-10.0) < before[2] - 0.001)
    eventually(lambda: height_pushed_by(10.0) > before[2] - 0.0005)
    assert arm.forceModeStop() is True
    assert seen.getActualTCPPose()[:3] == pytest.approx(before[:3], abs=0.02)


def test_the_arm_is_freed_and_held_again_and_contacts_are_looked_for(arm):
    assert arm.freedriveMode([1, 1, 1, 0, 0, 0], [0.0] * 6) is True
    assert arm.getFreedriveStatus() == 0
    assert arm.endFreedriveMode() is True
    assert arm.teachMode() is True
    assert arm.endTeachMode() is True
    assert arm.startContactDetection([0, 0, -1, 0, 0, 0]) is True
    assert arm.stopContactDetection() is False  # nothing was touched
    assert arm.isProgramRunning() is True


def test_a_protective_stop_ends_a_move_and_the_next_program_moves_again(arm, seen, served):
    arm.triggerProtectiveStop()  # False: the program is suspended before it can report that it is done
    eventually(seen.isProtectiveStopped)
    with Client("dashboard_client", "DashboardClient", HOST) as dashboard:
        dashboard.connect()
        dashboard.unlockProtectiveStop()
    eventually(lambda: not seen.isProtectiveStopped())
    assert arm.reuploadScript()
    eventually(arm.isProgramRunning)
    assert arm.moveJ(HOME, 1.0, 1.5)


@pytest.mark.parametrize("attempt", range(3))
def test_it_connects_from_cold(served, attempt):
    with Client("rtde_control", "RTDEControlInterface", HOST) as arm:
        assert arm.isProgramRunning()
