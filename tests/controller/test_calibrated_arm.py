"""A calibration belongs to the arm it was measured on, and a robot says so where it is another one."""

import msgspec
import pytest

from tvist_controller.about import info_of
from tvist_controller.sources.calibrations import available, load
from tvist_plant.description import fingerprint, robots
from tvist_plant.description import load as load_robot
from tvist_protocol import commands as c
from tvist_protocol.replies import Done

from .robots import UR5E, Robot, calibration

REPLACE = msgspec.structs.replace
SHIPPED = [load_robot(name) for name in robots()]
SOFT = REPLACE(
    UR5E,
    drives=REPLACE(UR5E.drives, gear_stiffness=tuple(0.5 * k for k in UR5E.drives.gear_stiffness)),
)
RENAMED = REPLACE(
    UR5E,
    robot=REPLACE(UR5E.robot, name="left"),
    limits=REPLACE(UR5E.limits, position=(3.2,) * 6),
)


def warnings(robot):
    robot.tick()
    return [event.why for event in robot.events if event.kind == "warning"]


@pytest.mark.parametrize("name", available())
def test_the_calibrations_of_the_package_are_of_its_robot(name):
    calibration = load(name)
    (arm,) = (arm for arm in SHIPPED if arm.robot.model == calibration.robot)
    assert calibration.provenance.arm == fingerprint(arm)


@pytest.mark.parametrize("description", [UR5E, RENAMED], ids=["ur5e", "renamed"])
def test_where_the_arm_is_the_one_measured_nothing_is_said(description):
    robot = Robot(description, calibration=load("ur5e_5kg"))
    assert warnings(robot) == []
    assert info_of(robot.controller).calibration.fits_arm is True


def test_a_softer_arm_with_the_calibration_of_the_package_is_a_warning_at_the_start():
    robot = Robot(SOFT, calibration=load("ur5e_5kg"))
    (why,) = warnings(robot)
    assert "'ur5e_5kg' was measured on a different arm" in why
    assert "tvist identify" in why
    assert info_of(robot.controller).calibration.fits_arm is False


def test_a_calibration_that_does_not_say_on_which_arm_is_taken_at_its_word():
    robot = Robot(SOFT, calibration=calibration())
    assert warnings(robot) == []
    assert info_of(robot.controller).calibration.fits_arm is None


def test_a_calibration_of_its_own_is_none_of_another_arm():
    own = load("ur5e_5kg")
    own = REPLACE(own, provenance=REPLACE(own.provenance, arm=fingerprint(SOFT)))
    robot = Robot(SOFT, calibration=own)
    assert warnings(robot) == []
    # `auto` takes the modal calibration of the package, which is another arm's.
    assert robot.send(c.SetShaper, name="auto") == Done()
    (why,) = warnings(robot)
    assert "'ur5e_modal'" in why
    assert robot.send(c.SetShaper, name="auto-target") == Done()
    assert len(warnings(robot)) == 1, "once, as long as it is the same calibration"
