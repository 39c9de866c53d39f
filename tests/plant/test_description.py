"""A robot file is read, checked and refused in one sentence that names file and key."""

import math
import re
from importlib import resources

import msgspec
import numpy as np
import pytest

from tvist_plant.description import (
    DISTURBANCES,
    DescriptionError,
    RobotDescription,
    is_real_body,
    load,
    robots,
)
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.robot_checks import check
from tvist_plant.user_file import UserFileError

from .arms import chain, hold

TEXT = (resources.files("tvist_plant") / "robots" / "ur5e.toml").read_text(encoding="utf-8")
MASS = "mass = [3.761, 8.058, 2.846, 1.37, 1.3, 0.365]"
NAMES = 'joints = ["base", "shoulder", "elbow", "wrist_1", "wrist_2", "wrist_3"]'


def test_ur5e_comes_with_the_package(ur5e):
    assert "ur5e" in robots()
    assert ur5e.joints == 6
    assert {"Q1", "Q2", "Q3"} <= ur5e.poses.keys()
    assert ur5e.payload.mass == 5.0


def test_a_file_by_its_path_is_the_same_as_the_name(tmp_path, ur5e):
    file = tmp_path / "mine.toml"
    file.write_text(TEXT, encoding="utf-8")
    assert load(file) == load(str(file)) == ur5e


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("repeatability = 3.0e-5", "repeatability = 3.0e-5\nrepeatabilty = 1.0", "repeatabilty"),
        ("[sensors]", "[sensor]", "sensor"),
        ("repeatability = 3.0e-5", "", "repeatability"),
        ("[payload] #", "[[payload]] #", "payload"),
        ("mass    = 5.0", 'mass    = "5 kg"', "payload.mass"),
        ("mass    = 5.0", "mass    = nan", "payload.mass"),
        ("mass    = 5.0", "mass    = -1.0", "payload.mass"),
        ("d     = [0.1625", "d     = [nan", "kinematics.d"),
        ("d     = [0.1625", "d     = [inf", "kinematics.d"),
        ("d     = [0.1625", "d     = [-inf", "kinematics.d"),
        (MASS, "mass = [3.761, 8.058]", "links.mass"),
        (MASS, MASS.replace("3.761", "0.0"), "links.mass"),
        ("[0.0, -0.02561, 0.00193]", "[0.0, -0.02561]", "links.com"),
        (NAMES, "joints = []", "robot.joints"),
        (NAMES, 'joints = ["a", "b", "c", "d", "e", "f", "g", "h"]', "robot.joints"),
        ("links        = [1, 2]", "links        = [1, 6]", "link_flexibility.links"),
        ("links        = [1, 2]", "links        = [1, 3]", "link_flexibility.links"),
        ("links        = [1, 2]", "links        = [1, 1]", "link_flexibility.links"),
        ("links        = [1, 2]", "links        = [1, 99]", "link_flexibility.links"),
        ("links        = [1, 2]", "links        = [1]", "link_flexibility.stiffness"),
        ("gear_error_waves     = 202", "gear_error_waves     = 0", "drives.gear_error_waves"),
        ("[0.00018694, 6e-8", "[0.00018694, 6e-2", "links.inertia[5]"),
        (
            "inertia = [0.00586, 0.0, 0.0, 0.00586, 0.0, 0.00625]",
            "inertia = [0.0, 0, 0, 0, 0, 1]",
            "payload.inertia",
        ),
        ("Q1 = [0.0, ", "Q1 = [", "poses.Q1"),
        ("[robot]", "[robot", "line 8"),
    ],
)
def test_a_wrong_file_is_one_sentence_that_names_file_and_key(tmp_path, old, new, key):
    assert TEXT.count(old) == 1
    file = tmp_path / "wrong.toml"
    file.write_text(TEXT.replace(old, new), encoding="utf-8")
    with pytest.raises(DescriptionError) as refused:
        load(file)
    sentence = str(refused.value)
    assert "wrong.toml" in sentence
    assert key in sentence
    assert "\n" not in sentence


def test_an_unknown_robot_is_answered_with_the_known_ones():
    with pytest.raises(DescriptionError, match=r"ur6e.*ur5e"):
        load("ur6e")


def test_what_cannot_be_read_is_named(tmp_path):
    with pytest.raises(UserFileError, match="is a directory"):
        load(tmp_path)
    file = tmp_path / "binary.toml"
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UserFileError, match=r"binary\.toml"):
        load(file)


@pytest.mark.parametrize(
    ("key", "degrees", "said"),
    [
        ("position", 360, r"limits\.position\[1\] is 360 rad, .* 62\.8 rad .*degrees.* 6\.28319 rad"),
        ("position", 120, r"limits\.position\[1\] is 120 rad, .* 2\.0944 rad"),
        ("velocity", 180, r"limits\.velocity\[1\] is 180 rad/s, .* 50\.3 rad/s .*degrees.* 3\.14159 rad/s"),
    ],
)
def test_limits_in_degrees_are_refused_with_what_they_are_in_radians(tmp_path, key, degrees, said):
    file = tmp_path / "degrees.toml"
    text, count = re.subn(rf"(\n{key} +=) \[([^,]+), [^,]+,", rf"\1 [\2, {degrees}.0,", TEXT)
    assert count == 1
    file.write_text(text, encoding="utf-8")
    with pytest.raises(UserFileError, match=said) as refused:
        load(file)
    assert "degrees.toml" in str(refused.value)


def test_ten_turns_either_way_and_eight_a_second_are_limits_in_radians(ur5e):
    replace = msgspec.structs.replace
    most = replace(ur5e.limits, position=(20.0 * math.pi,) * 6, velocity=(16.0 * math.pi,) * 6)
    check(replace(ur5e, limits=most))


def test_a_body_of_points_is_real_and_one_with_a_too_large_moment_is_not():
    assert is_real_body((0.0,) * 6)
    assert is_real_body((1.0, 0.0, 0.0, 1.0, 0.0, 2.0))  # a thin disc: the limit
    assert not is_real_body((1.0, 0.0, 0.0, 1.0, 0.0, 2.1))
    assert not is_real_body((1.0, 1.1, 0.0, 1.0, 0.0, 1.0))


def test_disturbances_can_be_kept_one_by_one(ur5e):
    assert ur5e.disturbed_by(DISTURBANCES) == ur5e
    assert ur5e.disturbed_by(()) == ur5e.clean()
    for name in DISTURBANCES:
        alone = ur5e.disturbed_by([name])
        assert alone.drives.linear_friction == (name != "friction")
        assert (alone.drives.gear_error_amplitude > 0.0) == (name == "gear")
        assert (alone.sensors.accelerometer_noise > 0.0) == (name == "noise")
    with pytest.raises(DescriptionError, match=r"'wind'.*friction, gear, noise"):
        ur5e.disturbed_by(["gear", "wind"])


def test_clean_takes_away_what_is_not_linear(ur5e):
    clean = ur5e.clean()
    assert clean.drives.linear_friction
    assert clean.drives.gear_error_amplitude == clean.sensors.accelerometer_noise == 0.0
    assert clean.drives.coulomb_friction == ur5e.drives.coulomb_friction
    assert msgspec.structs.replace(clean, drives=ur5e.drives, sensors=ur5e.sensors) == ur5e


@pytest.mark.parametrize("joints", [1, 2, 3, 7])
def test_arms_of_other_sizes_stand_still_and_move(joints):
    arm = chain(joints)
    assert isinstance(arm, RobotDescription)
    plant = FlexibleArm(arm, arm.payload)
    command = hold(arm, np.linspace(0.3, -0.4, joints))
    first = plant.reset(command, seed=3)
    place = plant.truth().flange_position
    for _ in range(500):
        measured = plant.step(command)
    assert measured.q.shape == measured.qd.shape == measured.moment.shape == (joints,)
    np.testing.assert_allclose(measured.q, first.q, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(plant.truth().flange_position, place, rtol=0.0, atol=1e-9)
    target = hold(arm, command.q + 0.001)
    for _ in range(500):
        measured = plant.step(target)
    assert np.isfinite(measured.accelerometer).all()
    np.testing.assert_allclose(measured.q, plant.reset(target, seed=3).q, rtol=0.0, atol=1e-4)


def test_modes_are_found_for_any_number_of_joints():
    for joints in (1, 2, 3, 7):
        arm = chain(joints)
        found = FlexibleArm(arm, arm.payload).modes(np.zeros(joints))
        assert len(found.f_d) >= 1
        assert np.all(np.diff(found.f_d) >= 0.0)
        assert np.all((found.zeta > 0.0) & (found.zeta < 1.0))
