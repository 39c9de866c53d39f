"""Arms with and without what adds to their description: energy, friction, backlash, torsion and tilt."""

import itertools
import math

import numpy as np
import pinocchio as pin
import pytest

from tvist_plant.arm_memory import GRAVITY, LAST, NOW
from tvist_plant.description import load
from tvist_plant.drives import DriveCommand, joint_parameters, static_twist
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.imperfections import Imperfections, YieldingBase
from tvist_plant.integrator import rows
from tvist_plant.model import flexible_model, rigid_model
from tvist_plant.robot_tables import Payload
from tvist_plant.stiction import relaxed, stiction_after

from .arms import changed, conservative, energy, frames, hold, quiet, rested, standing
from .reference import commands

IMPERFECT = {
    "stribeck": Imperfections(breakaway=1.5),
    "hysteresis": Imperfections(hysteresis=0.3),
    "soft": Imperfections(soft=0.75),
    "base": Imperfections(base=YieldingBase()),
    "stiction": Imperfections(stiction=(1.0,) * 6, stiction_load=0.02),
    "all": Imperfections(breakaway=1.5, hysteresis=0.3, soft=0.75, base=YieldingBase()),
}


def felt(description, drive, imperfections, substeps=None):
    arm = FlexibleArm(description, description.payload, imperfections=imperfections, substeps=substeps)
    arm.reset(drive[0], seed=3)
    return np.array([arm.step(command).accelerometer for command in drive[1:]])


@pytest.fixture(scope="module")
def drive(ur5e):
    return commands(ur5e, ur5e.poses["Q1"], ur5e.poses["Q3"], 500)


@pytest.mark.parametrize("imperfections", [None, *IMPERFECT.values()], ids=["described", *IMPERFECT])
@pytest.mark.parametrize("pose", ["Q1", "Q3"])
def test_start_has_no_transient(ur5e, imperfections, pose):
    arm = FlexibleArm(ur5e, ur5e.payload, imperfections=imperfections)
    command = hold(ur5e, ur5e.poses[pose])
    arm.reset(command, seed=2)
    place = arm.truth().flange_position
    for _ in range(300):
        arm.step(command)
        assert np.max(np.abs(arm.truth().flange_position - place)) < 1e-9


@pytest.mark.parametrize("imperfections", IMPERFECT.values(), ids=IMPERFECT)
def test_reset_repeats_the_same_run(ur5e, drive, imperfections):
    arm = FlexibleArm(ur5e, ur5e.payload, imperfections=imperfections)
    runs = []
    for _ in range(2):
        arm.reset(drive[0], seed=1)
        runs.append([arm.step(command).q for command in drive[1:300]])
    np.testing.assert_array_equal(*runs)


STICKS = load("ur5e_stiction")
LAW = STICKS.imperfections


def stiction_of(arm):
    """The stiction of the motors, and its stiffness before it breaks away."""
    *_, d, _ = rows(arm._arm.state, arm.description.joints)
    return d, arm._joints.stiction_stiffness


@pytest.mark.parametrize("start", [-1.0, 0.4, 3.0])
@pytest.mark.parametrize("way", [-2e-5, 1e-7])
def test_dahl_step_matches_many_steps_and_the_differential_equation(start, way):
    """Beyond the break-away torque, too, where stiction is for a moment after it has fallen."""
    stiffness, most, parts = 7e5, 1.2, 200_000
    small = integrated = start
    for _ in range(parts):
        small = relaxed(small, way / parts, stiffness, most)
        integrated += stiffness * (1.0 - integrated * math.copysign(1.0, way) / most) * way / parts
    once = relaxed(start, way, stiffness, most)
    assert once == pytest.approx(small, abs=1e-9)
    assert once == pytest.approx(integrated, abs=1e-3)


@pytest.mark.parametrize("turn", [1e-7, 1e-5, 1e-3], ids=["held", "breaking away", "sliding"])
def test_stiction_never_returns_more_energy_than_it_takes(turn):
    """With the plant's scheme: the torque after half of the turn acts over all of it."""
    random, d, taken, stiffness = np.random.default_rng(5), 0.0, 0.0, 7e5
    for _ in range(20_000):
        way, speed, load = turn * random.normal(), 0.05 * random.normal(), 100.0 * random.normal()
        law = speed, load, 0.5, 0.015, 0.03, stiffness
        before = 0.5 * d * d / stiffness
        work = way * stiction_after(d, 0.5 * way, *law)
        d = stiction_after(d, way, *law)
        taken += work
        assert work >= 0.5 * d * d / stiffness - before - 1e-18
    assert taken > 0.0


@pytest.mark.parametrize(
    ("mass", "pose", "speed", "factor"),
    [(0.0, "Q1", 1e-4, 10.0), (5.0, "Q3", 1e-3, 1.0), (5.0, "Q1", 1e-2, 10.0), (0.0, "Q3", 0.1, 1.0)],
)
def test_ringing_arm_without_drives_only_loses_energy_to_stiction(pose, mass, speed, factor, measured):
    """An undamped arm is struck while its motors hang on springs, and turns back hundreds of times."""
    arm, spring = conservative(STICKS), 5e3
    arm = changed(arm, "payload", mass=mass) if mass else arm
    arm = changed(arm, "drives", gear_error_amplitude=0.0)
    sticks = Imperfections(
        stiction=tuple(factor * value for value in LAW.stiction), stiction_load=factor * LAW.stiction_load
    )
    plant = FlexibleArm(arm, arm.payload if mass else Payload(), imperfections=sticks)
    plant._flexible.model.gravity.linear = np.zeros(3)
    plant.memory[GRAVITY] = 0.0
    start = np.array(arm.poses[pose])
    command = DriveCommand(start, np.zeros(6), np.zeros(6))
    plant.reset(command)
    links, random = len(plant._q), np.random.default_rng(1)
    plant._arm.springs[0, links:] += spring
    plant._arm.joints[2] = spring  # the position gains, which are springs without a damper
    plant._qd[:], plant._speed[:] = speed * random.normal(size=links), speed * random.normal(size=6)
    plant._evaluate()
    plant._arm.dynamics[LAST] = plant._arm.dynamics[NOW]
    d, stiffness = stiction_of(plant)
    energies = []
    for _ in range(1000):
        held = 0.5 * np.sum(d**2 / stiffness) + 0.5 * spring * np.sum((plant._motor - start) ** 2)
        energies.append(energy(plant) + held)
        plant.step(command)
    risen = np.max(energies - np.minimum.accumulate(energies)) / energies[0]
    measured("largest rise and rest of the energy at the start", (risen, energies[-1] / energies[0]))
    assert risen < 5e-5  # of an arm without stiction: up to 6e-4, by the integrator
    assert energies[-1] < 0.3 * energies[0]


def test_motor_held_by_stiction_does_not_creep_and_springs_back():
    """The base alone has no drive. It turns as a spring that gives way, and back by what is elastic of that."""
    names = ("velocity_gain", "position_gain", "integral_gain")
    gains = {name: (0.0, *getattr(STICKS.drives, name)[1:]) for name in names}
    arm = changed(STICKS, "drives", gear_error_amplitude=0.0, **gains)
    plant = FlexibleArm(arm, arm.payload)
    command = DriveCommand(np.array(arm.poses["Q1"]), np.zeros(6), np.zeros(6))
    plant.reset(command)
    _, stiffness = stiction_of(plant)
    most = LAW.stiction[0]
    start, scale = plant._motor[0], most / stiffness[0]

    def turned(ticks, share, before):
        """Angles while a push goes within 2 s to a share of the stiction; a sudden one would swing beyond it."""
        for tick in range(ticks):
            way = math.sin(0.5 * math.pi * min(tick / 1000, 1.0)) ** 2
            plant.push(most * (before + way * (share - before)) * np.eye(6)[0])
            plant.step(command)
            yield plant._motor[0] - start

    held = list(turned(31_000, 0.5, 0.0))
    assert held[1000] == pytest.approx(math.log(2.0) * scale, rel=0.02)  # 0.5 µrad
    assert max(held) - held[1000] < 0.02 * scale
    *_, back = turned(5000, 0.0, 0.5)
    assert held[-1] - back == pytest.approx(math.log(1.5) * scale, rel=0.02)


def test_four_substeps_are_enough_for_stiction():
    drive = commands(STICKS, STICKS.poses["Q1"], STICKS.poses["Q3"], 700)
    silent = changed(STICKS, "sensors", accelerometer_noise=0.0)
    usual, fine, finer = (felt(silent, drive, None, substeps) for substeps in (None, 16, 64))
    assert FlexibleArm(STICKS, STICKS.payload)._substeps == 4
    assert np.abs(usual - finer).max() < 0.03
    assert np.abs(fine - finer).max() < 0.25 * np.abs(usual - finer).max()


def limp(description, period, gravity):
    """The UR5e let go: hung up deflected by its weight, or, without gravity, thrown."""
    arm = conservative(description)
    plant = FlexibleArm(arm, arm.payload, period=period)
    if not gravity:
        plant._flexible.model.gravity.linear = np.zeros(3)
        plant.memory[GRAVITY] = 0.0
    q = np.array(arm.poses["Q1"]) + np.array([0.0, 0.6, 0.5, 0.0, 0.3, 0.2])
    command = DriveCommand(q, np.zeros(6), np.zeros(6))
    plant.reset(command)
    if not gravity:
        plant._qd[plant._flexible.joints] = plant._speed[:] = [0.6, 0.4, -0.8, 0.5, 0.5, -0.5]
        plant._evaluate()
        plant._arm.dynamics[LAST] = plant._arm.dynamics[NOW]
    return plant, command


def drift(description, period, gravity):
    """Largest change of energy over 1 s and the largest kinetic energy [J]."""
    plant, command = limp(description, period, gravity)
    energies, kinetic = [energy(plant)], []
    for _ in range(round(1.0 / period)):
        plant.step(command)
        energies.append(energy(plant))
        kinetic.append(pin.computeKineticEnergy(plant._flexible.model, plant._data, plant._q, plant._qd))
    return np.max(np.abs(np.array(energies) - energies[0])), max(kinetic)


@pytest.mark.parametrize(("gravity", "limit"), [(True, 5e-4), (False, 1e-5)], ids=["falling", "thrown"])
def test_energy_is_conserved_and_its_drift_falls_with_the_period(ur5e, gravity, limit, measured):
    """The limit is the share of the kinetic energy reached, at 2 ms."""
    runs = [drift(ur5e, period, gravity) for period in (0.002, 0.001, 0.0005)]
    measured("energy drift over 1 s at 2, 1 and 0.5 ms [J], kinetic energy [J]", runs)
    changes = [change for change, _ in runs]
    assert changes[0] < limit * runs[0][1]
    for coarse, fine in itertools.pairwise(changes):
        assert coarse / fine > 2.5


TORSION, PLAY, TILT = 2.0e4, 1.0e-4, 0.05


def test_moment_twists_the_links_by_their_torsional_stiffness(ur5e):
    """Against the arm whose links do not twist, the flange turns about the links by 2 M/k more.

    The arm is stretched out along the upper arm's x axis, so that the moment twists both links alike.
    """
    arm, turned = quiet(ur5e), []
    for numbers in ({"rotor": 1.0}, {"torsion": TORSION}):
        one, command, _ = standing(arm, [0.3, -0.4, 0.0, 0.2, 0.3, 0.0], **numbers)
        before = one.truth().flange_rotation
        axis = frames(arm, command.q)[3][:3, 0]  # the forearm's x axis, and the upper arm's
        one.push_body("flange", moment=tuple(20.0 * axis))
        rested(one, command, 600)
        turned.append(pin.log3(one.truth().flange_rotation @ before.T) @ axis)
    assert turned[1] - turned[0] == pytest.approx(2.0 * 20.0 / TORSION, rel=0.02)


def test_twisting_link_rings_at_its_natural_frequency(ur5e):
    """With everything else stiff and no feed-back of gravity, f = √(k/J)/2π of the inertia beyond the spring."""
    rigid = tuple(1e3 * value for value in ur5e.drives.gear_stiffness)
    arm = changed(
        changed(quiet(ur5e), "drives", gear_stiffness=rigid, rotor_inertia=(1e4,) * 6),
        "link_flexibility", links=(2,), stiffness=(1e7,), damping_time=0.0,
    )  # fmt: skip
    q = np.array([0.0, -1.2, 0.8, 0.0, 0.4, 0.0])
    one, *_ = standing(arm, q, torsion=TORSION)
    model = flexible_model(arm, arm.payload, TORSION).model
    names = list(model.names)
    at = names.index("elbow_torsion") - 1
    full = np.zeros(model.nv)
    full[[names.index(joint) - 1 for joint in arm.robot.joints]] = q
    inertia = pin.crba(model, model.createData(), full)[at, at]
    by_hand = np.sqrt(TORSION / inertia) / (2.0 * np.pi)
    assert np.abs(one.modes(q).f_d / by_hand - 1.0).min() < 0.01
    # The same inertia without the model: all bodies beyond the spring about the forearm's axis.
    assert inertia == pytest.approx(beyond_the_elbow(arm, q), rel=1e-9)


def beyond_the_elbow(arm, q):
    """Moment of inertia of the far half of the forearm, the wrist and the payload about the forearm's centre line."""
    model = rigid_model(arm, arm.payload)
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    elbow = data.oMi[3]
    line = np.array([0.0, *arm.links.com[2][1:]])  # the forearm's frames at both ends have the same axes
    total = 0.5 * arm.links.inertia[2][0]
    for joint in (4, 5, 6):
        moved = (elbow.inverse() * data.oMi[joint]).act(model.inertias[joint])
        total += moved.inertia[0, 0] + moved.mass * np.sum((moved.lever - line)[1:] ** 2)
    return total


def test_gear_turns_freely_within_its_backlash_and_elastically_beyond(ur5e):
    """A slow reversal of the torque at the base, which gravity does not load, moves the link by 2 (b + τ/K)."""
    arm = changed(quiet(ur5e), "drives", windup_feedforward=(0.0,) * 6)
    one, command, _ = standing(arm, arm.poses["Q3"], backlash=(PLAY,) * 6)
    torque, K = 5.0, arm.drives.gear_stiffness[0]
    found = []
    for share in (1.0, 0.5, 0.0, -0.5, -1.0):
        one.push(np.array([share * torque, 0.0, 0.0, 0.0, 0.0, 0.0]))
        rested(one, command, 300)
        found.append(one.truth().gear_deflection[0])
    assert found[0] - found[-1] == pytest.approx(2.0 * (PLAY + torque / K), rel=1e-3)
    # Still loaded, it has given way as a spring beyond the gap; between the flanks it transmits nothing.
    assert found[0] - found[1] == pytest.approx(0.5 * torque / K, rel=1e-3)
    assert abs(found[2]) <= PLAY * (1.0 + 1e-6)
    assert found[1] == pytest.approx(PLAY + 0.5 * torque / K, rel=1e-3)


def test_static_twist_with_backlash_and_softness_matches_the_kernel(ur5e):
    """The twist under gravity that a reset computes is where the integrator stays, and it is the law's."""
    numbers = {"backlash": (PLAY,) * 6, "soft": 0.75}
    joints = joint_parameters(ur5e, Imperfections(**numbers))
    one, command, _ = standing(quiet(ur5e), ur5e.poses["Q1"], **numbers)
    start = one.truth().gear_deflection
    rested(one, command, 500)
    np.testing.assert_allclose(one.truth().gear_deflection, start, atol=1e-8)
    twist = static_twist(joints, np.array([0.0, 30.0, -30.0, 1.0, -1.0, 0.0]))
    K, limit = np.array(ur5e.drives.gear_stiffness), np.array(ur5e.limits.torque)
    assert twist[1] == pytest.approx(PLAY + 0.1 * limit[1] / (0.75 * K[1]) + (30.0 - 0.1 * limit[1]) / K[1])
    assert twist[2] == pytest.approx(-twist[1])
    assert twist[3] == pytest.approx(PLAY + 1.0 / (0.75 * K[3]))
    assert twist[0] == 0.0


def test_backlash_adds_no_energy_and_loses_less_with_shorter_periods(ur5e):
    """Without drives and dampers, a falling arm keeps its energy, counted with springs that begin at the flanks."""
    arm = conservative(ur5e)
    K, drift = np.array(arm.drives.gear_stiffness), []
    for period in (2e-3, 1e-3):
        one = FlexibleArm(
            arm, arm.payload, imperfections=Imperfections(backlash=(PLAY,) * 6), period=period, substeps=8
        )
        one.reset(hold(arm, [0.0, -1.2, 1.4, -0.3, 0.5, 0.0]))
        limp, energies = DriveCommand(np.zeros(6), np.zeros(6), np.zeros(6)), []
        for _ in range(round(0.5 / period) + 1):
            twist = one.truth().gear_deflection
            beyond = np.maximum(np.abs(twist) - PLAY, 0.0)
            energies.append(energy(one) + 0.5 * float(K @ (beyond**2 - twist**2)))
            one.step(limp)
        model = one._flexible.model
        kinetic = pin.computeKineticEnergy(model, model.createData(), one._q, one._qd)
        assert kinetic > 40.0
        assert max(energies) - energies[0] < 1e-4 * kinetic
        drift.append(energies[0] - min(energies))
        assert drift[-1] < 3e-3 * kinetic
    assert drift[0] > 2.5 * drift[1]


def test_tilted_arm_carries_tilted_gravity(ur5e):
    """Its drives hold the torques of gravity turned the other way, and its accelerometer sees that direction."""
    arm = quiet(ur5e)
    one = FlexibleArm(arm, arm.payload, imperfections=Imperfections(tilt=TILT))
    q = np.array([0.4, -1.0, 1.2, -0.5, 0.3, 0.2])
    measured = one.reset(DriveCommand(q, np.zeros(6), np.zeros(6)))
    model = rigid_model(arm, arm.payload)
    down = np.array([0.0, -9.81 * np.sin(TILT), -9.81 * np.cos(TILT)])
    model.gravity.linear = down
    data = model.createData()
    # The arm sags by some mrad, which moves the weight a little.
    np.testing.assert_allclose(measured.moment, pin.computeGeneralizedGravity(model, data, q), atol=0.3)
    assert abs(measured.moment[0]) > 0.5  # the first axis is no longer vertical
    pin.framesForwardKinematics(model, data, q)
    flange = data.oMf[model.getFrameId("flange")].rotation
    np.testing.assert_allclose(measured.accelerometer, -flange.T @ down, atol=0.1)
    # In the world, whose vertical the truth is given in, what is felt at rest points up.
    truth = one.truth()
    np.testing.assert_allclose(truth.flange_rotation @ truth.specific_force, [0.0, 0.0, 9.81], atol=1e-6)
