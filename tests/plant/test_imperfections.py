"""Arms that have more than their description says; without that they are the described arm."""

import numpy as np
import pytest

from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.imperfections import Imperfections, YieldingBase

from .arms import hold
from .reference import commands

IMPERFECT = {
    "stribeck": Imperfections(breakaway=1.5),
    "hysteresis": Imperfections(hysteresis=0.3),
    "soft": Imperfections(soft=0.75),
    "base": Imperfections(base=YieldingBase()),
    "stiction": Imperfections(stiction=(1.0,) * 6, stiction_load=0.02),
    "all": Imperfections(breakaway=1.5, hysteresis=0.3, soft=0.75, base=YieldingBase()),
}


def felt(description, drive, imperfections):
    arm = FlexibleArm(description, description.payload, imperfections=imperfections)
    arm.reset(drive[0], seed=3)
    return np.array([arm.step(command).accelerometer for command in drive[1:]])


@pytest.fixture(scope="module")
def drive(ur5e):
    return commands(ur5e, ur5e.poses["Q1"], ur5e.poses["Q3"], 500)


def test_without_anything_it_is_the_described_arm_to_the_last_bit(ur5e, drive):
    np.testing.assert_array_equal(felt(ur5e, drive, Imperfections()), felt(ur5e, drive, None))


@pytest.mark.parametrize("imperfections", IMPERFECT.values(), ids=IMPERFECT)
def test_each_imperfection_is_felt_in_motion(ur5e, drive, imperfections):
    assert np.abs(felt(ur5e, drive, imperfections) - felt(ur5e, drive, None)).max() > 0.01


@pytest.mark.parametrize("imperfections", [None, *IMPERFECT.values()], ids=["described", *IMPERFECT])
@pytest.mark.parametrize("pose", ["Q1", "Q3"])
def test_the_start_has_no_transient(ur5e, imperfections, pose):
    arm = FlexibleArm(ur5e, ur5e.payload, imperfections=imperfections)
    command = hold(ur5e, ur5e.poses[pose])
    arm.reset(command, seed=2)
    place = arm.truth().flange_position
    for _ in range(300):
        arm.step(command)
        assert np.max(np.abs(arm.truth().flange_position - place)) < 1e-9


@pytest.mark.parametrize("imperfections", IMPERFECT.values(), ids=IMPERFECT)
def test_a_reset_starts_the_same_run_again(ur5e, drive, imperfections):
    arm = FlexibleArm(ur5e, ur5e.payload, imperfections=imperfections)
    runs = []
    for _ in range(2):
        arm.reset(drive[0], seed=1)
        runs.append([arm.step(command).q for command in drive[1:300]])
    np.testing.assert_array_equal(*runs)


@pytest.mark.parametrize(
    ("make", "numbers", "said"),
    [
        (Imperfections, {"soft": 0.0}, "soft is 0.0: must be above 0 and at most 1"),
        (Imperfections, {"soft": 1.5}, "soft is 1.5"),
        (Imperfections, {"breakaway": 0.9}, "breakaway is 0.9: must be at least 1"),
        (Imperfections, {"stribeck_speed": 0.0}, "stribeck_speed is 0.0: must be above 0"),
        (Imperfections, {"hysteresis": -0.1}, "hysteresis is -0.1"),
        (Imperfections, {"hysteresis_torque": 0.0}, "hysteresis_torque is 0.0"),
        (Imperfections, {"soft_torque": np.nan}, "soft_torque is nan"),
        (YieldingBase, {"stiffness": np.inf}, "base.stiffness is inf"),
        (YieldingBase, {"damping_time": -1e-3}, "base.damping_time is -0.001: must be at least 0"),
    ],
)
def test_numbers_without_sense_are_refused(make, numbers, said):
    with pytest.raises(ValueError, match=said):
        make(**numbers)


def test_an_imperfect_arm_can_be_pushed(ur5e):
    """It gives way as far as its gears let it, the described arm's way in the mean."""
    turned = {}
    for name, imperfections in {"described": None, **IMPERFECT}.items():
        arm = FlexibleArm(ur5e, ur5e.payload, imperfections=imperfections)
        command = DriveCommand(np.array(ur5e.poses["Q3"]), np.zeros(6), np.zeros(6))
        start = arm.reset(command).q
        arm.push(np.array([30.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
        for _ in range(100):
            measured = arm.step(command)
        turned[name] = measured.q[0] - start[0]
    assert turned["described"] > 1e-4
    for way in turned.values():
        assert way == pytest.approx(turned["described"], rel=0.6)
    assert turned["soft"] > turned["described"]
