"""A user's own plant, given to `tvist serve` by an option: clients move it, and its faults are reported."""

import json
import sys

import pytest
from tests.conformance.served import Served
from tests.own_arm import STANDS
from tests.system.waiting import eventually

from tvist_client import RefusedError
from tvist_client.blocking import Robot

pytestmark = pytest.mark.realtime

PLACE = f"{sys.modules['tests.own_arm'].__file__}:OwnArm"
CLOSE = 5e-3  # the drives compensate for gear twist, which this arm does not have [rad]


@pytest.fixture(scope="module")
def broken(tmp_path_factory):
    return tmp_path_factory.mktemp("arm") / "fault"


@pytest.fixture(scope="module")
def served(broken):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("OWN_ARM_BROKEN", str(broken))
        with Served("--plant", PLACE, "--no-floor") as served:
            yield served


def beside(change):
    return [float(STANDS[0]) + change, *map(float, STANDS[1:])]


def test_robot_starts_at_the_posture_of_the_arm_and_a_client_moves_it(served):
    with Robot.connect(served.endpoint) as robot:
        assert robot.state().actual_q == pytest.approx(STANDS, abs=CLOSE)
        with robot.control("me") as arm:
            arm.move_j(beside(0.2))
        assert robot.state().target_q == pytest.approx(beside(0.2), abs=CLOSE)
        first = robot.state().tick
        eventually(lambda: robot.state().tick > first)  # the arm gives the ticks


def test_arm_that_cannot_be_reset_refuses_a_reset(served):
    with (
        Robot.connect(served.endpoint) as robot,
        robot.control("me") as arm,
        pytest.raises(RefusedError, match="OwnArm"),
    ):
        arm.reset(q=beside(0.0))


def test_fault_of_the_arm_stops_the_robot_and_is_reported(served, broken):
    with Robot.connect(served.endpoint) as robot:
        written = broken.with_suffix(".new")
        written.write_text("joint 3 is too warm")
        written.replace(broken)  # the arm never reads half of it
        try:
            eventually(lambda: robot.state().safety_mode == 9)
            assert robot.state().robot_mode == 3
            assert "too warm" in json.dumps(str(robot.info()))
        finally:
            broken.unlink()
        with robot.control("me") as arm:
            arm.restart_safety()
            arm.power_on()
            eventually(lambda: _moves(arm))


def _moves(arm):
    try:
        arm.move_j(beside(0.0))
    except RefusedError as refused:
        return "not ready" not in str(refused)
    return True
