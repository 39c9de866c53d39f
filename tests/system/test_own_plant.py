"""A user's own plant, given to `tvist serve` by an option: clients move it, and it gives the ticks."""

import sys

import pytest
from tests.conformance.served import Served
from tests.own_arm import STANDS
from tests.system.waiting import eventually

from tvist_client.blocking import Robot

PLACE = f"{sys.modules['tests.own_arm'].__file__}:OwnArm"
CLOSE = 5e-3  # the drives compensate for gear twist, which this arm does not have [rad]


@pytest.mark.realtime
def test_robot_starts_at_the_posture_of_the_arm_and_a_client_moves_it():
    goal = [float(STANDS[0]) + 0.2, *map(float, STANDS[1:])]
    with Served("--plant", PLACE, "--no-floor") as served, Robot.connect(served.endpoint) as robot:
        assert robot.state().actual_q == pytest.approx(STANDS, abs=CLOSE)
        with robot.control("me") as arm:
            arm.move_j(goal)
        assert robot.state().target_q == pytest.approx(goal, abs=CLOSE)
        first = robot.state().tick
        eventually(lambda: robot.state().tick > first)  # the arm gives the ticks
