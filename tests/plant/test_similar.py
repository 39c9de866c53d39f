"""Springs and drives by the rule of dynamic similarity, and the robot files that follow it."""

import tomllib
from importlib import resources

import numpy as np
import pytest
from msgspec.structs import asdict, replace

from tvist_plant.description import DescriptionError, load
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.robot_tables import Kinematics
from tvist_plant.similar import RULE, Scale, counterpart

UR = ("ur3e", "ur10e", "ur16e", "ur20", "ur30")
UR5E = load("ur5e")


def file_of(name):
    return (resources.files("tvist_plant") / "robots" / f"{name}.toml").read_text(encoding="utf-8")


def test_the_ur5e_is_similar_to_itself():
    scale = Scale(UR5E.kinematics, UR5E.limits.torque)
    assert {
        key: list(value) if isinstance(value, tuple) else value for key, value in asdict(UR5E.drives).items()
    } == {key: list(value) if isinstance(value, tuple) else value for key, value in scale.drives().items()}
    links = scale.link_flexibility(UR5E.kinematics)
    assert (tuple(links["links"]), tuple(links["stiffness"])) == (
        UR5E.link_flexibility.links,
        UR5E.link_flexibility.stiffness,
    )


@pytest.mark.parametrize("name", UR)
def test_a_file_leaves_springs_and_drives_to_the_rule_and_says_so(name):
    assert not {"drives", "link_flexibility"} & set(tomllib.loads(file_of(name)))
    arm = load(name)
    assert arm.provenance["drives"] == arm.provenance["link_flexibility"] == RULE


@pytest.mark.parametrize("name", UR)
def test_a_gear_twists_by_the_ur5e_s_angle_at_its_largest_torque(name):
    arm = load(name)
    twist = np.divide(arm.limits.torque, arm.drives.gear_stiffness)
    np.testing.assert_allclose(twist, np.divide(UR5E.limits.torque, UR5E.drives.gear_stiffness), rtol=1e-3)


@pytest.mark.parametrize("name", UR)
def test_a_loaded_arm_is_damped_like_the_ur5e_and_slower_if_it_is_longer(name, measured):
    arm = load(name)
    found, own = (FlexibleArm(a, a.payload).modes(np.array(a.poses["Q1"])) for a in (arm, UR5E))
    measured(f"{name}: f_d at Q1 [Hz]", found.f_d[0])
    assert found.zeta[0] == pytest.approx(own.zeta[0], rel=0.1)
    scale = Scale(arm.kinematics, arm.limits.torque)
    assert bool(found.f_d[0] < own.f_d[0]) == (scale.length > 1.0)


def test_a_copy_of_twice_the_length_and_eight_times_the_torque_has_scaled_modes():
    """With lengths times 2, masses times 4 and inertias times 16, the Froude number stays: frequencies fall by √2."""
    k, links, drives = UR5E.kinematics, UR5E.links, UR5E.drives
    twice = Kinematics(a=tuple(2 * a for a in k.a), d=tuple(2 * d for d in k.d), alpha=k.alpha)
    scale = Scale(twice, [8.0 * torque for torque in UR5E.limits.torque])
    assert scale.length == pytest.approx(2.0)
    scaled = {
        key: tuple(value) if isinstance(value, list) else value for key, value in scale.drives().items()
    }
    flexibility = scale.link_flexibility(twice)
    big = replace(
        UR5E,
        kinematics=twice,
        links=replace(
            links,
            mass=tuple(4 * m for m in links.mass),
            com=tuple(tuple(2 * x for x in com) for com in links.com),
            inertia=tuple(tuple(16 * x for x in tensor) for tensor in links.inertia),
        ),
        payload=replace(
            UR5E.payload,
            mass=20.0,
            com=tuple(2 * x for x in UR5E.payload.com),
            inertia=tuple(16 * x for x in UR5E.payload.inertia),
        ),
        drives=replace(drives, **scaled),
        link_flexibility=replace(
            UR5E.link_flexibility,
            stiffness=tuple(flexibility["stiffness"]),
            damping_time=flexibility["damping_time"],
        ),
    )
    for pose in UR5E.poses.values():
        own, found = (FlexibleArm(arm, arm.payload).modes(np.array(pose)) for arm in (UR5E, big))
        np.testing.assert_allclose(found.f_d[:3] * np.sqrt(2.0), own.f_d[:3], rtol=2e-3)
        np.testing.assert_allclose(found.zeta[:3], own.zeta[:3], rtol=5e-3)


@pytest.mark.parametrize(
    ("joints", "expected"),
    [(1, [0]), (4, [0, 1, 2, 3]), (5, [0, 2, 3, 4, 5]), (6, [0, 1, 2, 3, 4, 5]), (7, [0, 1, 1, 2, 3, 4, 5])],
)
def test_joints_have_counterparts(joints, expected):
    assert [counterpart(joint, joints) for joint in range(joints)] == expected


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('kinematics = "published', 'kinematic = "published', "provenance.kinematic: there is no such table"),
        ('drives           = "measured:', 'drives = "guessed:', "must be one of published, measured"),
        ("[27500.0,", "[-27500.0,", "drives.gear_stiffness[0] is -27500.0: must be more than 0"),
        ("a     = [", "b     = [", "kinematics.b is not a key"),
    ],
)
def test_a_wrong_table_is_refused_in_a_sentence(old, new, said, tmp_path):
    text = file_of("ur5e")
    assert old in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(DescriptionError) as error:
        load(path)
    assert said in str(error.value)
