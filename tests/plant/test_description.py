"""A robot file is read, checked and refused in one sentence that names file and key."""

import re
import tomllib
from importlib import resources, util
from pathlib import Path

import msgspec
import numpy as np
import pinocchio as pin
import pytest

from tvist_plant.description import (
    DISTURBANCES,
    DescriptionError,
    RobotDescription,
    fingerprint,
    is_real_body,
    load,
)
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.model import rigid_model
from tvist_plant.robot_tables import Payload
from tvist_plant.similar import RULE, Scale
from tvist_plant.user_file import UserFileError

from .arms import changed


def file_of(name):
    return (resources.files("tvist_plant") / "robots" / f"{name}.toml").read_text(encoding="utf-8")


TEXT = file_of("ur5e")
MASS = "mass = [3.761, 8.058, 2.846, 1.37, 1.3, 0.365]"
NAMES = 'joints = ["base", "shoulder", "elbow", "wrist_1", "wrist_2", "wrist_3"]'


def refusal(path, text):
    """Return the sentence with which a robot file of this text is refused."""
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DescriptionError) as refused:
        load(path)
    sentence = str(refused.value)
    assert isinstance(refused.value, UserFileError)
    assert path.name in sentence
    assert "\n" not in sentence
    return sentence


def test_robot_file_by_path_equals_the_robot_by_name(tmp_path, ur5e):
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
        (MASS, "mass = [3.761, 8.058]", "links.mass"),
        (MASS, MASS.replace("3.761", "0.0"), "links.mass"),
        ("[0.0, -0.02561, 0.00193]", "[0.0, -0.02561]", "links.com"),
        (NAMES, "joints = []", "robot.joints"),
        (NAMES, 'joints = ["a", "b", "c", "d", "e", "f", "g", "h"]', "robot.joints"),
        ("links        = [1, 2]", "links        = [1, 6]", "link_flexibility.links"),
        ("links        = [1, 2]", "links        = [1, 3]", "link_flexibility.links"),
        ("links        = [1, 2]", "links        = [1, 1]", "link_flexibility.links"),
        ("links        = [1, 2]", "links        = [1]", "link_flexibility.stiffness"),
        ("gear_error_waves     = 202", "gear_error_waves     = 0", "drives.gear_error_waves"),
        ("[0.00018694, 6e-8", "[0.00018694, 6e-2", "links.inertia[5]"),
        ("0.00586, 0.0, 0.0, 0.00586, 0.0, 0.00625", "0.0, 0, 0, 0, 0, 1", "payload.inertia"),
        ("Q1 = [0.0, ", "Q1 = [", "poses.Q1"),
        ("[robot]", "[robot", "line 8"),
        ('kinematics = "published', 'kinematic = "published', "provenance.kinematic"),
        ('drives           = "measured:', 'drives = "guessed:', "must be one of published, measured"),
        ("[27500.0,", "[-27500.0,", "drives.gear_stiffness[0] is -27500.0: must be more than 0"),
        ("a     = [", "b     = [", "kinematics.b"),
    ],
)
def test_invalid_robot_file_is_refused_with_file_and_key(tmp_path, old, new, key):
    assert TEXT.count(old) == 1
    assert key in refusal(tmp_path / "wrong.toml", TEXT.replace(old, new))


def test_unknown_robot_lists_the_known_ones():
    with pytest.raises(DescriptionError, match=r"ur6e.*ur5e"):
        load("ur6e")


@pytest.mark.parametrize(
    ("key", "degrees", "said"),
    [
        ("position", 360, r"limits\.position\[1\] is 360 rad: .* 62\.8 rad; .*degrees.* 6\.28319 rad"),
        ("position", 120, r"limits\.position\[1\] is 120 rad: .* 2\.0944 rad"),
        ("velocity", 180, r"limits\.velocity\[1\] is 180 rad/s: .* 50\.3 rad/s; .*degrees.* 3\.14159 rad/s"),
    ],
)
def test_limits_in_degrees_are_refused_with_the_value_in_radians(tmp_path, key, degrees, said):
    text, count = re.subn(rf"(\n{key} +=) \[([^,]+), [^,]+,", rf"\1 [\2, {degrees}.0,", TEXT)
    assert count == 1
    assert re.search(said, refusal(tmp_path / "degrees.toml", text))


def test_impossible_moments_of_inertia_are_detected():
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


UR5E = load("ur5e")


def scaled(table: str, key: str, factor: float = 1.001) -> RobotDescription:
    values = getattr(getattr(UR5E, table), key)
    return changed(UR5E, table, **{key: (values[0] * factor, *values[1:])})


@pytest.mark.parametrize("description", [
    scaled("drives", "gear_stiffness"), scaled("drives", "gear_damping"), scaled("drives", "rotor_inertia"),
    scaled("drives", "velocity_gain"), scaled("drives", "position_gain"), scaled("drives", "integral_gain"),
    scaled("drives", "coulomb_friction"), scaled("links", "mass"), scaled("link_flexibility", "stiffness"),
    changed(UR5E, "link_flexibility", links=(), stiffness=()),
    changed(UR5E, "kinematics", a=(0.0, -0.5, -0.4, 0.0, 0.0, 0.0)),
])  # fmt: skip
def test_fingerprint_changes_with_parameters_that_change_vibration(description):
    assert fingerprint(description) != fingerprint(UR5E)


@pytest.mark.parametrize("description", [
    changed(UR5E, "robot", name="left", model="Other"),
    scaled("limits", "position"), scaled("limits", "torque"),
    changed(UR5E, "payload", mass=1.0), changed(UR5E, "sensors", accelerometer_noise=1.0),
    changed(UR5E, "drives", gear_error_amplitude=0.0), changed(UR5E, "drives", friction_feedforward=0.0),
    msgspec.structs.replace(UR5E, poses={}), UR5E.clean(), UR5E.quiet(),
])  # fmt: skip
def test_fingerprint_ignores_names_limits_and_sensors(description):
    assert fingerprint(description) == fingerprint(UR5E)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("hysteresis = -1", "hysteresis is -1: must be at least 0"),
        ("hysteresis_torque = 0", "hysteresis_torque is 0: must be more than 0"),
        ("breakaway = 0.9", "breakaway is 0.9: must be at least 1"),
        ("stribeck_speed = 0", "stribeck_speed is 0: must be more than 0"),
        ("soft = 0", "soft is 0: must be more than 0"),
        ("soft = 1.5", "soft is 1.5: must be at most 1"),
        ("soft_torque = nan", "soft_torque is nan"),
        ("base = {stiffness = inf}", "base.stiffness is inf"),
        ("base = {damping_time = -1e-3}", "base.damping_time is -0.001: must be at least 0"),
        ("tilt = 1", "tilt is 1: must be at most 0.523599"),
        ("backlash = [0.1, -1e-4]", r"backlash\[1\] is -0.0001: must be at least 0"),
        ("torsion = 0", "torsion is 0: must be more than 0"),
        ("hysteresi = 1", "imperfections.hysteresi is not a key"),
        ("stiction = [0.5, 0.5, 0.5, 0.1, 0.1, -0.1]", r"stiction\[5\] is -0.1: must be at least 0"),
        ("stiction = [0.5]", "imperfections: stiction has 1 values: must have 6, one per joint"),
        ("stiction_load = -0.01", "stiction_load is -0.01: must be at least 0"),
        ("stiction_speed = 0", "stiction_speed is 0: must be more than 0"),
        ("stiction_stiffness = inf", "stiction_stiffness is inf: must be at most 1e"),
        ("hysteresis = 'a'", "imperfections.hysteresis is text, 'a': must be a number"),
        ("rotor = 0", "rotor is 0: must be more than 0"),
        ("base = {stiff = 1}", "imperfections.base.stiff is not a key"),
        ("base = {mass = 0}", "base.mass is 0: must be more than 0"),
        ("backlash = [1e-4]", "imperfections: backlash has 1 values: must have 6"),
        ("torsion = 1e4", "imperfections: torsion is 10000 N m/rad, but no link"),
    ],
)
def test_invalid_imperfection_is_refused_by_name(tmp_path, line, said):
    text = file_of("one-joint") if "torsion" in line else TEXT
    assert re.search(said, refusal(tmp_path / "wrong.toml", f"{text}\n[imperfections]\n{line}\n"))


UR = ("ur3e", "ur10e", "ur16e", "ur20", "ur30")


def test_scaling_the_ur5e_to_itself_changes_nothing():
    scale = Scale(UR5E.kinematics, UR5E.limits.torque)
    tables = {"drives": scale.drives(), "link_flexibility": scale.link_flexibility(UR5E.kinematics)}
    for name, table in tables.items():
        own = getattr(UR5E, name)
        assert msgspec.convert(table, type(own)) == own


@pytest.mark.parametrize("name", UR)
def test_scaled_robots_have_drives_by_the_similarity_rule(name):
    assert not {"drives", "link_flexibility"} & set(tomllib.loads(file_of(name)))
    arm = load(name)
    assert arm.provenance["drives"] == arm.provenance["link_flexibility"] == RULE


@pytest.mark.parametrize("name", UR)
def test_scaled_gears_twist_by_the_same_angle_at_their_largest_torque(name):
    arm = load(name)
    twist = np.divide(arm.limits.torque, arm.drives.gear_stiffness)
    np.testing.assert_allclose(twist, np.divide(UR5E.limits.torque, UR5E.drives.gear_stiffness), rtol=1e-3)


@pytest.mark.parametrize("name", UR)
def test_scaled_arm_is_damped_like_the_ur5e_and_slower_if_longer(name, measured):
    arm = load(name)
    found, own = (FlexibleArm(a, a.payload).modes(np.array(a.poses["Q1"])) for a in (arm, UR5E))
    measured(f"{name}: f_d at Q1 [Hz]", found.f_d[0])
    assert found.zeta[0] == pytest.approx(own.zeta[0], rel=0.1)
    scale = Scale(arm.kinematics, arm.limits.torque)
    assert bool(found.f_d[0] < own.f_d[0]) == (scale.length > 1.0)


SEVEN = Path(__file__).parent / "urdf" / "seven.urdf"


def examples():
    """URDFs of the package example-robot-data, if it is installed."""
    found = util.find_spec("cmeel")
    if found is None or found.origin is None:
        return []
    folder = (
        Path(found.origin).parents[1] / "cmeel.prefix/share/example-robot-data/robots/ur_description/urdf"
    )
    return [path for name in ("ur3", "ur5", "ur10") if (path := folder / f"{name}_robot.urdf").exists()]


ARMS = [
    pytest.param(SEVEN, "base", id="seven"),
    *(pytest.param(path, "base_link", id=path.stem) for path in examples()),
]


@pytest.mark.parametrize(("path", "base"), ARMS)
def test_urdf_torques_and_flange_match_pinocchios_reader(path, base):
    own, other = rigid_model(load(path), Payload()), pin.buildModelFromUrdf(str(path))
    own_data, data = own.createData(), other.createData()
    placed = other.frames[other.getFrameId(base)].placement.translation
    random = np.random.default_rng(0)
    for _ in range(5):
        q, qd, qdd = random.uniform(-2.0, 2.0, (3, own.nq))
        expected = pin.rnea(other, data, q, qd, qdd)
        np.testing.assert_allclose(pin.rnea(own, own_data, q, qd, qdd), expected, rtol=1e-8, atol=1e-8)
        pin.framesForwardKinematics(own, own_data, q)
        pin.framesForwardKinematics(other, data, q)
        flange, tool = own_data.oMf[own.getFrameId("flange")], data.oMf[other.getFrameId("tool0")]
        np.testing.assert_allclose(flange.rotation, tool.rotation, atol=1e-9)
        np.testing.assert_allclose(flange.translation[:2], tool.translation[:2] - placed[:2], atol=1e-9)
        np.testing.assert_allclose(flange.translation[2], tool.translation[2], atol=1e-9)


@pytest.mark.parametrize(("path", "base"), ARMS)
def test_urdf_arm_has_modes_and_names_assumed_values(path, base):
    arm = load(path)
    found = FlexibleArm(arm, arm.payload).modes(np.array(arm.poses["Q2"]))
    assert 1.0 < found.f_d[0] < 40.0
    assert 0.05 < found.zeta[0] < 0.6
    assert arm.provenance["drives"].startswith("assumed")
    assert arm.provenance["kinematics"].startswith("given")


BRANCH = '<link name="x"/><joint name="jx" type="{}"><parent link="elbow"/><child link="x"/><limit effort="1" velocity="1" lower="0" upper="1"/></joint></robot>'  # noqa: E501


@pytest.mark.parametrize(("old", "new", "said"), [
    ('<mass value="2.7"/>', '<mass value="0"/>', "link elbow has no <inertial> with a mass"),
    ("</robot>", BRANCH.format("revolute"), "the chain branches after link elbow, into the joints j5, jx"),
    ('name="j5" type="revolute"', 'name="j5" type="prismatic"', "joint j5 is prismatic: must be revolute"),
    ('effort="60" velocity="2.4"', 'effort="0" velocity="2.4"', "joint j5: <limit> has effort 0"),
    ('lower="-3.05" upper="3.05"', 'lower="3" upper="-3"', "joint j7: <limit> has lower 3 and upper -3"),
    ('xyz="0 0 0.16"', 'xyz="0 0 up"', "joint j1: xyz is '0 0 up': must be 3 numbers"),
    ('<parent link="wrist"/>', '<parent link="wirst"/>', "joint j7: there is no link 'wirst'"),
    ('<parent link="base"/>', '<parent link="tool0"/>', "in a circle"),
    ('rpy="0 0 0.4"', 'rpy="1.5 0 0"', "the axis of joint j1 must point straight up"),
    ('ixx="0.03"', 'ixx="3.0"', "must be possible for a body"),
    ('<joint name="j7"', '<joint name="j5"', "two of joint j5: give each a name of its own"),
    ('<robot name="seven">', "<!DOCTYPE x><robot>", "it has a document type"),
    ('<robot name="seven">', '<robot name="seven"', "it is not valid XML"),
])  # fmt: skip
def test_urdf_that_cannot_be_simulated_is_refused(old, new, said, tmp_path):
    text = SEVEN.read_text(encoding="utf-8")
    assert old in text
    assert said in refusal(tmp_path / "mine.urdf", text.replace(old, new, 1))


def test_asymmetric_urdf_limits_are_widened_and_recorded(tmp_path):
    path = tmp_path / "mine.urdf"
    text = SEVEN.read_text(encoding="utf-8")
    path.write_text(text.replace('lower="-3.05" upper="3.05"', 'lower="-1" upper="3.05"'), encoding="utf-8")
    arm = load(path)
    assert arm.limits.position[-1] == 3.05
    assert arm.provenance["limits.position"] == "assumed: j7 -1 to 3.05 rad in the URDF, here ±3.05"


def test_urdf_numbers_may_have_blanks_around_them(tmp_path):
    """pinocchio's parser alone would leave the whole body out."""
    path, text = tmp_path / "seven.urdf", SEVEN.read_text(encoding="utf-8")
    for old, new in (('mass value="2.7"', 'mass value=" 2.7 "'), ('ixx="0.03"', 'ixx=" 0.03 "')):
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text, encoding="utf-8")
    assert load(path).links == load(SEVEN).links
