"""The arms that come with the package: each is described, calibrated, and stilled by auto."""

import json

import numpy as np
import pytest
from tests.conformance.served import finished
from tools.tables.pages import page_of

from tvist_controller.sources.calibrations import available
from tvist_controller.sources.calibrations import load as load_calibration
from tvist_lab.studies.arms.about import about
from tvist_lab.studies.arms.measure import sag_error
from tvist_plant.description import fingerprint, load, robots

UR = ("ur3e", "ur10e", "ur16e", "ur20", "ur30", "ur5e")


@pytest.mark.parametrize("name", [*UR, "ur5-light", "ur5e_stiction"])
def test_calibration_of_an_arm_has_its_stiffness(name):
    arm = load(name)
    own = [one for one in map(load_calibration, available()) if one.robot == arm.robot.model and one.modal]
    assert [one.provenance.arm for one in own] == [fingerprint(arm)]


@pytest.mark.parametrize("name", UR)
def test_gear_deflection_at_rest_is_gravity_torque_over_stiffness(name, measured):
    error = sag_error(load(name), seed=0)
    measured(f"{name}: sag off by [%]", error)
    assert error < 1.0


def test_every_table_of_a_robot_file_has_a_provenance():
    for name in robots():
        told = {key.partition(".")[0] for kind in about(name, load(name))["origins"].values() for key in kind}
        assert {"kinematics", "links", "limits", "drives"} <= told, name


def test_shaper_auto_reduces_vibration_of_three_arms_by_default():
    """By the command that the reference page names, with fewer moves."""
    command = ("robots", "ur3e", "ur10e", "ur20", "--measure", "--random", "4", "--json")
    ended = finished("-m", "tvist_cli", *command)
    assert ended.returncode == 0, ended.stderr
    result = json.loads(ended.stdout)
    page = page_of("robots", result)
    for one in result["robots"]:
        (found,) = one["measured"]
        assert found["reduction_percent"]["median"] >= 95.0, one["name"]
        assert np.max(found["f_d_error_percent"]) < 3.0
        assert found["sag_error_percent"] < 1.0
        assert f"| `{one['name']}` | 1 |" in page
