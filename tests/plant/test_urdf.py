"""Robots from URDF files, compared with pinocchio's own reader, and what is refused."""

from importlib import util
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from tvist_plant.description import DescriptionError, load
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.model import rigid_model, rotation_of
from tvist_plant.robot_tables import Payload

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
def test_torques_and_the_flange_are_those_of_pinocchio_s_reader(path, base):
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
def test_it_vibrates_and_says_what_was_assumed(path, base):
    arm = load(path)
    found = FlexibleArm(arm, arm.payload).modes(np.array(arm.poses["Q2"]))
    assert 1.0 < found.f_d[0] < 40.0
    assert 0.05 < found.zeta[0] < 0.6
    assert arm.provenance["drives"].startswith("assumed")
    assert arm.provenance["kinematics"].startswith("given")


def test_angles_give_the_rotation_back():
    random = np.random.default_rng(0)
    for angle in [*random.uniform(-3.0, 3.0, (50, 3)), (0.3, np.pi / 2, 0.2), (0.0, -np.pi / 2, 1.0)]:
        turn = rotation_of(*angle)
        np.testing.assert_allclose(pin.rpy.rpyToMatrix(*angle), turn, atol=1e-12)
        np.testing.assert_allclose(rotation_of(*pin.rpy.matrixToRpy(turn)), turn, atol=1e-7)


BRANCH = '<link name="x"/><joint name="jx" type="{}"><parent link="elbow"/><child link="x"/><limit effort="1" velocity="1" lower="0" upper="1"/></joint></robot>'  # noqa: E501


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('<mass value="2.7"/>', '<mass value="0"/>', "link elbow has no <inertial> with a mass"),
        (
            "</robot>",
            BRANCH.format("revolute"),
            "the chain branches after link elbow, into the joints j5, jx",
        ),
        (
            'name="j5" type="revolute"',
            'name="j5" type="prismatic"',
            "joint j5 is prismatic: must be revolute",
        ),
        ('effort="60" velocity="2.4"', 'effort="0" velocity="2.4"', "joint j5: <limit> has effort 0"),
        ('lower="-3.05" upper="3.05"', 'lower="3" upper="-3"', "joint j7: <limit> has lower 3 and upper -3"),
        ('xyz="0 0 0.16"', 'xyz="0 0 up"', "joint j1: xyz is '0 0 up': must be 3 numbers"),
        ('<parent link="wrist"/>', '<parent link="wirst"/>', "joint j7: there is no link 'wirst'"),
        ('<parent link="base"/>', '<parent link="tool0"/>', "in a circle"),
        ('rpy="0 0 0.4"', 'rpy="1.5 0 0"', "the axis of joint j1 must point straight up"),
        ('ixx="0.03"', 'ixx="3.0"', "no body can have this"),
        ('<joint name="j7"', '<joint name="j5"', "two of joint j5: give each a name of its own"),
        ('<robot name="seven">', "<!DOCTYPE x><robot>", "it has a document type"),
        ('<robot name="seven">', '<robot name="seven"', "it is not valid XML"),
    ],
)
def test_what_cannot_be_simulated_is_refused_in_a_sentence(old, new, said, tmp_path):
    text = SEVEN.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "mine.urdf"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(DescriptionError) as error:
        load(path)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_limits_that_are_not_symmetric_are_widened_and_told(tmp_path):
    path = tmp_path / "mine.urdf"
    text = SEVEN.read_text(encoding="utf-8")
    path.write_text(text.replace('lower="-3.05" upper="3.05"', 'lower="-1" upper="3.05"'), encoding="utf-8")
    arm = load(path)
    assert arm.limits.position[-1] == 3.05
    assert arm.provenance["limits.position"] == "assumed: j7 -1 to 3.05 rad in the URDF, here ±3.05"


def test_numbers_are_read_whatever_blanks_stand_around_them(tmp_path):
    """pinocchio's parser alone would leave the whole body out."""
    path, text = tmp_path / "seven.urdf", SEVEN.read_text(encoding="utf-8")
    for old, new in (('mass value="2.7"', 'mass value=" 2.7 "'), ('ixx="0.03"', 'ixx=" 0.03 "')):
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text, encoding="utf-8")
    assert load(path).links == load(SEVEN).links


def test_a_link_that_is_called_like_the_flange_but_is_none_is_passed_over(tmp_path):
    path, text = tmp_path / "seven.urdf", SEVEN.read_text(encoding="utf-8")
    path.write_text(text.replace('"tool0"', '"flange"').replace('"elbow"', '"tool0"'), encoding="utf-8")
    assert load(path).kinematics == load(SEVEN).kinematics
