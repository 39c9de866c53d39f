"""Compensation of sag: at rest the arm is where its target is, and nothing else changes."""

import numpy as np
import pytest
from tests.controller.robots import PAPER, Q1, Q2, Q3, UR5E, H, Line, Robot, cut

from tvist_controller.line.inverse_dynamics import SLEW
from tvist_controller.line.line_tick import Q
from tvist_controller.setup import body, paper_payload
from tvist_plant.description import Payload, load
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.imperfections import Imperfections
from tvist_protocol import commands as c
from tvist_protocol.simulation import SimulationReset
from tvist_shaping.catalogue import shaper
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.filter import TvistFilter

CLOSE = 1e-4
"""What is allowed between measured and target angles at rest [rad]."""


def line(description=UR5E, mass=5.0, q=Q1, *, compensated=True, name="none", **changes) -> Line:
    payload = changes.pop("payload", body(paper_payload(description, mass)))
    return Line(
        description,
        TvistFilter(shaper(name), Fixed((10.0,), (0.2,)), joints=description.joints),
        q=np.array(q),
        declared=payload,
        carried=payload,
        seed=0,
        compensate_sag=compensated,
        **changes,
    )


def commands_of(cycle):
    """Commands to the drives from now on, and the references that they belong to."""
    found, made = [], cycle.drives.command

    def watched(signals, *arguments, **options):
        found.append((made(signals, *arguments, **options), signals[Q]))
        return found[-1][0]

    cycle.drives.command = watched
    return found


def off_target(sample):
    return np.abs(sample.measured.q - sample.target.q).max()


def play(cycle, trajectory, rest=0):
    samples = []
    cycle.begin(trajectory)
    while not cycle.mode.at_rest:
        samples.append(cycle.step())
    return samples + [cycle.step() for _ in range(rest)]


def random_payload(random):
    """A payload of up to 5 kg, with its centre anywhere near the flange."""
    mass = random.uniform(0, 5)
    return Payload(
        mass=mass, com=tuple(random.uniform(-0.1, 0.1, 3)), inertia=(0.01, 0.0, 0.0, 0.01, 0.0, 0.01)
    )


@pytest.mark.parametrize("arm", [UR5E, UR5E.clean(), UR5E.quiet()], ids=["real", "clean", "quiet"])
def test_a_resting_arm_is_on_its_target_in_any_posture_with_any_payload(arm):
    random, sagged = np.random.default_rng(7), 0.0
    compensated, plain = line(arm), line(arm, compensated=False)
    for _ in range(40):
        q, payload = random.uniform(-3.1, 3.1, 6), random_payload(random)
        for cycle in (compensated, plain):
            cycle.dynamics.declare(payload)
            cycle.reset(q, carried=payload)
        assert off_target(compensated.sample) < CLOSE
        for _ in range(50):
            still = compensated.step()
        assert off_target(still) < CLOSE
        sagged = max(sagged, off_target(plain.sample))
    assert sagged > 10 * CLOSE


@pytest.mark.parametrize("joints", [1, 2, 5])
def test_so_is_an_arm_with_fewer_joints(joints):
    arm = cut(joints)
    assert off_target(line(arm, q=arm.poses["Q3"]).sample) < CLOSE


def test_an_arm_whose_axes_are_vertical_has_nothing_to_compensate():
    arm = load("one-joint")
    with_it, without = (line(arm, q=arm.poses["Q1"], compensated=on).sample for on in (True, False))
    np.testing.assert_array_equal(with_it.measured.q, without.measured.q)


@pytest.mark.parametrize("name", ["none", "zv"])
@pytest.mark.parametrize("mass", [0.0, 2.5, 5.0])
def test_friction_leaves_the_arm_on_its_target_a_fifth_of_a_second_after_a_move(name, mass):
    for start, end in ((Q1, Q3), (Q3, Q1), (Q1, Q2)):
        cycle = line(mass=mass, q=start, name=name)
        samples = play(cycle, cycle.plan(end, PAPER), rest=600)
        assert max(map(off_target, samples[-500:])) < CLOSE


def test_the_arm_starts_in_static_equilibrium():
    cycle = line(UR5E.clean(), q=Q3)
    first = cycle.sample.measured
    for _ in range(500):
        sample = cycle.step()
        assert np.abs(sample.measured.q - first.q).max() < 1e-10
        assert np.abs(sample.measured.qd).max() < 1e-9
        assert np.abs(sample.measured.accelerometer - first.accelerometer).max() < 1e-5


def leads(found):
    """Angles by which the motors lead, their velocities and accelerations, from tick to tick."""
    lead = np.array([command.q - q for command, q in found])
    return lead, np.diff(lead, axis=0) / H, np.diff(lead, 2, axis=0) / H**2


def test_in_motion_the_lead_moves_without_steps_and_as_little_as_the_twist_that_it_compensates():
    """Of 3.3 mrad, over a motion of two seconds; the wind-up feed-forward is the same with and without."""
    found = {}
    for compensated in (True, False):
        cycle = line(compensated=compensated)
        found[compensated] = commands_of(cycle)
        play(cycle, cycle.plan(Q3, PAPER), rest=10)
    parts = [a - b for a, b in zip(*map(leads, (found[True], found[False])), strict=True)]
    lead, velocity, acceleration = (np.abs(part).max() for part in parts)
    limit = np.array(UR5E.limits.torque) / np.array(UR5E.drives.gear_stiffness)
    assert 2e-3 < lead < limit.max()
    assert velocity < 0.01
    assert acceleration < 0.05
    assert np.abs(np.diff(parts[2], axis=0)).max() < 0.002  # not a step anywhere
    assert not parts[1][-5:].any()


def test_a_payload_that_is_declared_at_rest_moves_the_motors_gently_to_their_new_lead():
    cycle = line(mass=0.0)
    found = commands_of(cycle)
    cycle.dynamics.declare(body(paper_payload(UR5E, 5.0)))
    for _ in range(SLEW + 20):
        cycle.step()
    lead, velocity, acceleration = leads(found)
    assert 1e-3 < np.abs(lead[-1] - lead[0]).max() < 2e-3
    assert np.abs(velocity).max() < 0.01
    assert np.abs(acceleration).max() < 0.05
    assert not velocity[-10:].any()


@pytest.mark.parametrize("name", ["none", "zv"])
@pytest.mark.parametrize(("start", "end"), [(Q1, Q2), (Q1, Q3), (Q3, Q1)])
def test_vibration_is_the_same(name, start, end):
    """After a move, of the clean arm and within a hundredth of what it is unshaped: about 1 m/s²."""
    tails = []
    for compensated in (True, False):
        cycle = line(UR5E.clean(), q=start, name=name, compensated=compensated)
        moving = len(play(cycle, cycle.plan(end, PAPER)))
        assert moving > 500
        felt = np.array([cycle.step().measured.accelerometer for _ in range(500)])
        tails.append(np.linalg.norm(felt - felt[-1], axis=1))
    assert np.abs(tails[0] - tails[1]).max() < 0.02
    assert tails[0].max() > 0.01


@pytest.mark.parametrize(
    ("imperfections", "left"),
    [
        (Imperfections(breakaway=1.5), CLOSE),
        (Imperfections(hysteresis=0.3), CLOSE),
        (Imperfections(soft=0.75), 2e-4),
    ],
    ids=["stribeck", "hysteresis", "soft"],
)
def test_what_is_left_on_an_arm_whose_gears_are_not_as_described(imperfections, left):
    for mass in (0.0, 5.0):
        payload = body(paper_payload(UR5E, mass))
        arm = FlexibleArm(UR5E, payload, imperfections=imperfections, substeps=8)
        cycle = line(mass=mass, q=Q3, plant=arm)
        samples = play(cycle, cycle.plan(Q1, PAPER), rest=600)
        assert max(map(off_target, samples[-500:])) < left


def test_a_wrong_declaration_leaves_its_own_part():
    declared, carried = paper_payload(UR5E, 4.0), paper_payload(UR5E, 5.0)
    arm = Robot(payload=declared, carried=carried, compensate_sag=True).tick()
    left = np.abs(np.array(arm.actual_q) - arm.target_q).max()
    assert CLOSE < left < 4e-4


def test_a_reset_by_a_client_puts_the_arm_on_its_target_too():
    robot, light = Robot(compensate_sag=True), paper_payload(UR5E, 1.0)
    robot.send(c.SetPayload, mass=light.mass, com=light.com, inertia=light.inertia)
    robot.send(SimulationReset, q=tuple(Q3), payload=light)
    robot.tick(100)
    assert np.abs(robot.column("actual_q") - robot.column("target_q")).max() < CLOSE
