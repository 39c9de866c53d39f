"""Plants by name are what their names say, for the arm, for what it carries, and for any number of joints."""

import pickle

import msgspec
import numpy as np
import pytest

from tvist_plant.description import Payload, load
from tvist_plant.robot_checks import is_real_body
from tvist_plant.variants import (
    BACKLASH,
    CENTRE,
    DRIVES,
    LINKS,
    MASS,
    TORSION,
    VARIANTS,
    hidden,
    hidden_payload,
    variant,
)

from .arms import chain, hold


@pytest.mark.parametrize("name", [*VARIANTS, "hidden-3"])
def test_every_plant_moves_and_differs_from_the_described_arm(ur5e, name):
    """Each holds its pose, and feels a push otherwise than the described arm does."""
    felt = []
    for one in (variant(name), variant("calibrated")):
        arm = one.make(ur5e, ur5e.payload, 4)
        command = hold(ur5e, ur5e.poses["Q3"])
        assert np.abs(arm.reset(command, seed=1).q - command.q).max() < 0.02
        arm.push(np.array([40.0, 40.0, 0.0, 0.0, 0.0, 0.0]))
        felt.append(np.array([arm.step(command).q for _ in range(100)]))
    assert bool(np.abs(felt[0] - felt[1]).max() > 1e-7) == (name != "calibrated")


@pytest.mark.parametrize("robot", ["ur5e", "ur5-light"])
@pytest.mark.parametrize("plant", ["calibrated", "stribeck"])
def test_an_arm_of_a_pickled_description_moves_bit_for_bit_alike(robot, plant):
    made, moved = (load(robot), variant(plant)), []
    for description, named in (made, pickle.loads(pickle.dumps(made))):  # noqa: S301  our own
        arm = named.make(description, description.payload, 0)
        command = hold(description, [0.3] * description.joints)
        arm.reset(command, seed=1)
        arm.push(np.array([40.0, 40.0, 0.0, 0.0, 0.0, 0.0]))
        moved.append([arm.step(command).q for _ in range(20)])
    np.testing.assert_array_equal(*moved)


def test_plants_have_the_parameters_of_their_labels(ur5e):
    """Friction, springs, torsion and backlash are those that tables of perturbations quote."""
    stribeck = variant("stribeck").make(ur5e, ur5e.payload, 0)
    assert stribeck.description.drives.friction_width == pytest.approx(0.3 * ur5e.drives.friction_width)
    assert stribeck._imperfections.breakaway == 1.5
    for name, factor in (("springs-30", 0.7), ("springs+30", 1.3)):
        arm = variant(name).make(ur5e, ur5e.payload, 0).description
        np.testing.assert_allclose(arm.drives.gear_stiffness, factor * np.array(ur5e.drives.gear_stiffness))
        np.testing.assert_allclose(
            arm.link_flexibility.stiffness, factor * np.array(ur5e.link_flexibility.stiffness)
        )
        assert arm.drives.velocity_gain == ur5e.drives.velocity_gain
    assert variant("torsion").make(ur5e, ur5e.payload, 0)._imperfections.torsion == TORSION
    np.testing.assert_array_equal(variant("backlash").make(ur5e, ur5e.payload, 0)._joints.backlash, BACKLASH)
    combined = variant("combined").make(ur5e, ur5e.payload, 7)
    ratio = np.array(combined.description.drives.gear_stiffness) / ur5e.drives.gear_stiffness
    np.testing.assert_allclose(np.abs(ratio - 1.0), 0.15)
    assert combined.description.drives.velocity_gain == ur5e.drives.velocity_gain
    assert np.degrees(combined._imperfections.tilt) == pytest.approx(1.0)
    assert combined._imperfections.torsion == TORSION


@pytest.mark.parametrize("name", ["combined", "hidden-8"])
def test_plant_carries_another_payload_than_declared(ur5e, name):
    """At the start, at a reset and in motion the arm carries the other payload, and tells the one it was told."""
    told, lighter = ur5e.payload, Payload(mass=2.0, com=(0.0, 0.0, 0.05))
    arm, truly = variant(name).make(ur5e, told, 0), variant(name).carries
    command = hold(ur5e, ur5e.poses["Q1"])

    def carried():
        model = arm._flexible.model
        return sum(body.mass for body in model.inertias) - sum(arm.description.links.mass)

    assert carried() == pytest.approx(truly(told).mass)
    assert abs(truly(told).mass / told.mass - 1.0) > 0.01
    arm.reset(command, payload=lighter)
    assert (arm.payload, carried()) == (lighter, pytest.approx(truly(lighter).mass))
    arm.load(told)
    assert (arm.payload, carried()) == (told, pytest.approx(truly(told).mass))
    arm.reset(command, payload=Payload())
    assert carried() == pytest.approx(0.0, abs=1e-12)


def test_backlash_of_other_arms_is_that_of_the_corresponding_joints():
    """Seven joints, and a chain of three, get a width for each joint; an arm with rigid links cannot twist."""
    for joints in (3, 7):
        arm = chain(joints)
        assert len(variant("backlash").make(arm, arm.payload, 0)._joints.backlash) == joints
    with pytest.raises(ValueError, match="torsion is 20000 N m/rad, but no link"):
        variant("torsion").make(load("one-joint"), Payload(), 0)


@pytest.mark.parametrize("name", ["stribek", "hidden", "hidden-", "hidden--1", "hidden-1e3", "hidden-²", ""])
def test_unknown_plant_is_refused_with_the_known_names(name):
    with pytest.raises(ValueError, match=r"must be hidden-SEED or one of calibrated, coulomb"):
        variant(name)


@pytest.mark.parametrize("robot", ["ur5e", "one-joint"])
def test_hidden_robot_differs_from_its_file_only_within_the_shares(robot: str) -> None:
    """All drawn values are within their shares over many seeds, reach both halves, and nothing else changes."""
    known = load(robot)
    assert hidden(known, 11) == hidden(known, 11) != hidden(known, 12)
    ratios: dict[str, list[float]] = {name: [] for name in (*DRIVES, *LINKS)}
    for seed in range(60):
        found = hidden(known, seed)
        for table, shares in (("drives", DRIVES), ("link_flexibility", LINKS)):
            for name, share in shares.items():
                before, after = (np.atleast_1d(getattr(getattr(one, table), name)) for one in (known, found))
                assert np.all(np.abs(after - before) <= share * before * (1.0 + 1e-12))
                ratios[name] += (after[before > 0.0] / before[before > 0.0]).tolist()
        back = {
            table: msgspec.structs.replace(
                getattr(found, table), **{name: getattr(getattr(known, table), name) for name in shares}
            )
            for table, shares in (("drives", DRIVES), ("link_flexibility", LINKS))
        }
        assert msgspec.structs.replace(found, **back) == known
    for name, share in (DRIVES | LINKS).items():
        if ratios[name]:
            assert min(ratios[name]) < 1.0 - 0.8 * share
            assert max(ratios[name]) > 1.0 + 0.8 * share


def test_hidden_payload_is_a_possible_body_near_the_declared_one(ur5e):
    """Mass and centre are within their limits, no payload stays none, and inertia grows with the mass."""
    for seed in range(60):
        carried, told = hidden_payload(ur5e.payload, seed), ur5e.payload
        assert abs(carried.mass / told.mass - 1.0) <= MASS
        assert np.max(np.abs(np.array(carried.com) - told.com)) <= CENTRE
        assert is_real_body(carried.inertia)
        assert carried.inertia[0] / told.inertia[0] == pytest.approx(carried.mass / told.mass)
        assert hidden_payload(Payload(), seed) == Payload()
