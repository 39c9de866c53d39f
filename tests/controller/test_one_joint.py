"""A robot with two joints, without gravity in any of them, is a robot like any other."""

import numpy as np
import pytest

from tvist_controller.about import info_of
from tvist_controller.setup import paper_payload
from tvist_controller.sources.calibrations import default_for, load
from tvist_plant.description import load as load_robot
from tvist_protocol import commands as c

from .robots import UR5E, Robot

ONE_JOINT = load_robot("one-joint")


@pytest.fixture
def robot():
    return Robot(ONE_JOINT, calibration=load(default_for(ONE_JOINT.robot.model)))


def test_info_tells_the_poses_of_the_robot_file(robot):
    assert info_of(robot.controller).poses == ONE_JOINT.poses
    assert info_of(Robot().controller).poses == UR5E.poses


def test_the_default_calibration_is_of_the_arm_itself_and_says_nothing_of_others(robot):
    assert info_of(robot.controller).calibration.fits_arm is True
    assert default_for("UR5e") == "ur5e_5kg"
    assert default_for("nobody's arm") is None


@pytest.mark.parametrize("mass", [0.0, 1.0, 2.0])
@pytest.mark.parametrize("acceleration", [2.0, 10.0])
def test_the_first_move_after_a_rest_is_no_reason_to_doubt_the_payload(mass, acceleration):
    """While the soft spring winds up, the motor carries nothing yet."""
    for elbow in np.radians([-120.0, 0.0, 30.0, 90.0, 150.0]):
        robot = Robot(ONE_JOINT, q=(0.0, elbow), payload=paper_payload(ONE_JOINT, mass))
        robot.send(c.SetShaper, name="none")
        robot.tick(1000)
        robot.send(c.MoveJ, q=(-0.1, elbow - 0.1), acceleration=acceleration)
        robot.until_rest()
        assert "warning" not in robot.kinds()


def test_a_move_over_the_whole_range_follows_the_frequency(robot):
    for name in ("Q3", "Q1"):
        robot.send(c.MoveJ, q=ONE_JOINT.poses[name])
        robot.until_rest()
        robot.tick(5)
        f_d = robot.states[-1].estimated_f_d[0]
        assert f_d == pytest.approx({"Q1": 4.99, "Q3": 9.62}[name], rel=0.01)


def test_a_forearm_folded_beyond_its_limit_is_refused(robot):
    reply = robot.send(c.MoveJ, q=(0.0, 2.9))
    assert reply.code == "limit_position"
