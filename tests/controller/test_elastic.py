"""Feed-forward of the arm's elasticity."""

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples
from tests.plant.arms import changed

from tvist_controller.kinematics.arm import InverseDynamics
from tvist_controller.line.elastic_feed_forward import ElasticFeedForward
from tvist_controller.line.elastic_lead import follow
from tvist_controller.line.joint_controllers import LAWS, STICTION, described_friction
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.setup import Setup, body, paper_payload
from tvist_controller.sources.calibrations import drivetrain, load
from tvist_controller.trajectory import JointLine, MotionLimits, quickest_motion
from tvist_plant import description as robot_files
from tvist_plant.description import Payload
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.integrator import rows
from tvist_plant.model import flexible_model
from tvist_plant.robot_tables import RobotDescription
from tvist_protocol import commands as c
from tvist_protocol.motions import SpeedJ
from tvist_protocol.replies import Done

from .robots import PAPER, Q1, Q2, Q3, UR5E, H, Line, Robot, calibration, cut

MODAL = load("ur5e_modal")
LIMIT = np.array(UR5E.limits.torque)
NAMES = ("elastic", "elastic-position", "elastic-auto")


def stage(description=UR5E, **how) -> ElasticFeedForward:
    springs = drivetrain(MODAL.modal.parameters, description, flexible_model(description, Payload()))
    stiffness = np.array(springs.stiffness)
    return ElasticFeedForward(description, stiffness, np.array(springs.damping) / stiffness, H, **how)


def planned(shaper, description=UR5E, calibration=MODAL, *, q=Q1, mass=None):
    """Return a filter by name, as a server makes it."""
    setup = Setup(description, tuple(q), paper_payload(description, mass), calibration, shaper=shaper)
    return FilterPlanner(setup).first()


def line(shaper: str, q=Q1, *, mass=None, description=UR5E, calibration=MODAL, plant=None) -> Line:
    """Return a control line with such a filter."""
    chosen = planned(shaper, description, calibration, q=q, mass=mass)
    payload = body(paper_payload(description, mass))
    return Line(
        description, chosen.tvist, elastic=chosen.elastic, law=chosen.law, q=np.array(q), declared=payload,
        carried=payload, seed=1, plant=plant,
    )  # fmt: skip


def moves(cycle: Line, target, limits=PAPER):
    """Make a motion; yield its samples and those of 0.6 s of rest."""
    cycle.begin(quickest_motion(JointLine(cycle.sample.reference, np.array(target)), limits))
    cycle.tvist.aim(np.array(target))
    rest = 0
    while rest < 300:
        yield cycle.step()
        rest = rest + 1 if cycle.mode.at_rest else 0


def ringing(cycle, target):
    """Return the tool's largest true acceleration later than 10 ms after the motion's end [m/s²]."""
    force = np.array([cycle.plant.truth().specific_force for _ in moves(cycle, target)])
    return np.linalg.norm(force - force[-1], axis=1)[-295:].max()


def test_a_single_joint_leads_by_inertia_times_acceleration_over_stiffness():
    description, stiffness = cut(1), 20_000.0
    feed = ElasticFeedForward(description, np.array([stiffness]), np.zeros(1), H)
    dynamics = InverseDynamics(description, Payload())
    inertia = dynamics.inertia(np.zeros(1))[0, 0]
    for k in range(60):
        time = k * H
        target = np.array([[time**3], [3.0 * time**2], [6.0 * time], [inertia * 6.0 * time]])
        command = feed.command(target, dynamics.payload_parameters)
    earlier = time - H
    assert command.q[0] - earlier**3 == pytest.approx(inertia * 6.0 * earlier / stiffness, rel=1e-9)
    assert command.qd[0] - 3.0 * earlier**2 == pytest.approx(inertia * 6.0 / stiffness, rel=1e-6)
    assert feed.motors[1, 0] == pytest.approx(6.0 * earlier, abs=1e-6)


def test_elastic_feed_forward_ignores_springs_and_gains_of_the_robot_file():
    gains = [f"{what}_gain" for what in ("velocity", "position", "integral")]
    names = ["gear_stiffness", "gear_damping", *gains, "windup_feedforward"]
    other = {name: tuple(3.0 * value for value in getattr(UR5E.drives, name)) for name in names}
    strange = changed(UR5E, "link_flexibility", stiffness=(1e3, 1e3), damping_time=1.0)
    strange = changed(strange, "drives", **other)
    commands = []
    for description in (UR5E, strange):
        feed, dynamics = stage(description), InverseDynamics(description, UR5E.payload)
        for k in range(20):
            target = np.array([Q3 + 1e-4 * k**2, np.full(6, 0.1 * k), np.full(6, 50.0)])
            command = feed.command(np.vstack((target, dynamics.torque(*target))), dynamics.payload_parameters)
        commands.append(np.concatenate([command.q, command.qd, command.torque]))
    assert commands[0].tobytes() == commands[1].tobytes()


def followed(wanted, room):
    """Follow the values of one joint; return the leads, and whether acceleration was limited."""
    led, window, out, limited = np.full((3, 1), wanted[0]), np.full((3, 1), wanted[0]), [], False
    for value in wanted:
        window[1:] = window[:-1].copy()
        window[0] = value
        limited |= follow(window, led, np.array([room]), H)
        out.append(led[0, 0])
    return np.array(out), limited


@examples(50)
@given(seed=st.integers(0, 2**32 - 1), room=st.floats(1.0, 100.0))
def test_a_rough_lead_is_followed_with_limited_acceleration(seed, room):
    steps = np.repeat(np.random.default_rng(seed).uniform(-2e-3, 2e-3, 6), 60)
    wanted = np.concatenate([[0.0] * 5, steps, [steps[-1]] * 600])
    led, limited = followed(wanted, room)
    assert limited
    assert np.abs(np.diff(led, 2)).max() / H**2 <= room * (1.0 + 1e-9)
    assert led[-1] == pytest.approx(wanted[-1], abs=1e-7)
    assert np.abs(led).max() <= 3.0 * np.abs(wanted).max()
    smooth = 1e-3 * np.sin(np.linspace(0.0, 6.0, 500)) ** 4
    led, limited = followed(smooth, 1e9)
    assert not limited
    assert led == pytest.approx(smooth, abs=1e-15)


def test_elastic_shapers_leave_little_residual_vibration():
    clean = UR5E.clean()
    left = {name: ringing(line(name, Q3, mass=5.0, description=clean), Q2) for name in ("none", *NAMES)}
    assert left["elastic"] < 0.05 * left["none"]
    assert left["elastic-auto"] < 0.01 * left["none"]
    assert left["elastic-position"] < 0.25 * left["none"]


@pytest.mark.parametrize("name", ["elastic-position", "elastic-auto"])
def test_an_elastic_shaper_publishes_motor_motion_within_torque_limits(name):
    robot = Robot(calibration=calibration())
    assert robot.tick().motor_qd is None
    assert robot.send(c.SetShaper, name=name) == Done()
    robot.send(c.MoveJ, q=tuple(Q3))
    robot.until_rest()
    moments = np.array([state.motor_moment for state in robot.states if state.motor_moment is not None])
    assert len(moments) > 500
    assert (np.abs(moments) < LIMIT).all()
    assert robot.tick(10).motor_qd == pytest.approx([0.0] * 6, abs=1e-5)
    assert not any(state.motor_limited for state in robot.states)
    assert robot.send(c.SetShaper, name="zv") == Done()
    assert robot.tick().motor_qd is None


QUICK = {"velocity": 2.0, "acceleration": 4.0, "jerk": 2000.0}
ACTS = {
    c.Stop: lambda _: {},
    c.SetPayload: lambda random: msgspec.structs.asdict(paper_payload(UR5E, random.uniform(0.0, 5.0))),
    c.Pause: lambda _: {},
    c.Resume: lambda _: {},
    c.SetSpeed: lambda random: {"fraction": random.uniform(0.2, 1.0)},
    c.MoveJ: lambda random: QUICK | {"q": tuple(Q3 + random.uniform(0.1, 0.6) * (Q1 - Q3))},
    SpeedJ: lambda random: {"qd": tuple(random.uniform(-0.3, 0.3, 6)), "acceleration": 5.0},
    c.SetShaper: lambda random: {"name": str(random.choice(["none", "zv", "elastic", "elastic-auto"]))},
}


@examples(4)
@given(seed=st.integers(0, 2**32 - 1))
def test_motor_position_and_velocity_stay_continuous_through_random_commands(seed):
    random = np.random.default_rng(seed)
    robot = Robot(calibration=calibration(), shaper="elastic", q=tuple(Q3))
    commands = watched_commands(robot)
    robot.send(c.MoveJ, **ACTS[c.MoveJ](random))
    for _ in range(12):
        robot.tick(int(random.integers(2, 200)))
        kind = random.choice([*ACTS, *[c.SetShaper] * 3])  # a shaper as often as each of four other commands
        robot.send(kind, **ACTS[kind](random))
    robot.send(c.Stop)
    robot.until_rest()
    q, qd = (np.array([getattr(command, name) for command in commands]) for name in ("q", "qd"))
    torque = np.array([command.torque for command in commands])
    moved = np.diff(q, axis=0) / H
    # Velocities are the positions' derivatives, but for those of the wind-up in a stop, which lag by half a tick.
    assert np.abs(moved - 0.5 * (qd[1:] + qd[:-1])).max() < 0.3
    assert np.abs(np.diff(moved, axis=0)).max() / H < 200.0
    assert (np.abs(torque) <= LIMIT).all()


def test_a_lead_beyond_the_torque_limit_is_limited_and_reported():
    weak = changed(UR5E, "limits", torque=tuple((0.05 * LIMIT).tolist()))
    feed, dynamics = stage(weak), InverseDynamics(weak, UR5E.payload)
    told = []
    for k in range(200):
        jerky = 20.0 * np.sign(np.sin(0.3 * k)) * np.ones(6)
        target = np.array([Q3, np.zeros(6), jerky])
        feed.command(np.vstack((target, dynamics.torque(*target))), dynamics.payload_parameters)
        told.append(feed.limited)
    assert any(told)


def watched_commands(robot):
    commands, step = [], robot.controller.cycle.plant.step

    def watched(command):
        commands.append(command)
        return step(command)

    robot.controller.cycle.plant.step = watched
    return commands


@pytest.mark.parametrize("other", ["zv", "elastic-auto"])
def test_a_new_shaper_after_a_stop_waits_until_the_motors_have_settled(other):
    robot = Robot(calibration=calibration(), shaper="elastic", q=tuple(Q3))
    robot.send(c.MoveJ, q=tuple(Q1), velocity=3.0, acceleration=8.0, jerk=2000.0)
    robot.tick(380)
    robot.send(c.Stop)
    robot.until_rest()
    commands = watched_commands(robot)
    robot.tick(2)
    assert robot.send(c.SetShaper, name=other) == Done()
    robot.tick(400)
    assert np.abs(np.diff([command.q for command in commands], 2, axis=0)).max() / H**2 < 60.0
    assert (robot.states[-1].motor_qd is None) == (other == "zv")


STICKS = robot_files.load("ur5e_stiction")
STICKING = load("ur5e_stiction_modal")
LARGEST = STICKS.imperfections.stiction[0]


def rigid(description: RobotDescription) -> RobotDescription:
    """Return the arm a hundred times as stiff, whose motors follow their commands."""
    drives, links = description.drives, description.link_flexibility
    gears = {
        name: tuple(100.0 * value for value in getattr(drives, name))
        for name in ("gear_stiffness", "velocity_gain")
    }
    none = {"windup_feedforward": (0.0,) * description.joints, "gear_error_amplitude": 0.0}
    stiff = changed(description, "drives", **gears, **none)
    stiff = changed(stiff, "link_flexibility", stiffness=tuple(100.0 * value for value in links.stiffness))
    softer = 0.01 * description.imperfections.stiction_stiffness
    return changed(stiff, "imperfections", stiction_stiffness=softer)


@pytest.mark.parametrize("limits", [PAPER, MotionLimits(0.05, 0.2, 10.0)], ids=["paper", "creeping"])
def test_fed_forward_stiction_equals_the_stiction_of_the_plant(limits, measured):
    """The arm moves to and fro, so that every motor reverses while it sticks."""
    description = rigid(STICKS)
    plant = FlexibleArm(description, description.payload, substeps=16)
    cycle = line("auto", description=description, calibration=STICKING, plant=plant)
    truly = rows(plant._arm.state, description.joints)[-2]  # the torque of stiction
    way = np.array(Q1) + 0.3 * (np.array(Q3) - np.array(Q1))
    found = [
        (cycle.drives.rows[STICTION].copy(), truly.copy())
        for target in (way, Q1)
        for sample in moves(cycle, target, limits)
        if sample.command.qd.any()
    ]
    fed, felt = np.array(found).transpose(1, 0, 2)
    rms, largest = np.sqrt(np.mean((fed - felt) ** 2)), np.abs(felt).max()
    measured("largest stiction, rms of the difference [N m]", (largest, rms))
    assert largest > LARGEST
    assert rms < 0.01 * largest


def test_filters_with_known_friction_use_the_friction_of_the_robot_file():
    for shaper in ("auto", "auto-target", "short", "elastic-16", *NAMES):
        np.testing.assert_array_equal(planned(shaper, STICKS, STICKING).law, described_friction(STICKS))
    assert described_friction(STICKS).shape == (LAWS, STICKS.joints)
    for shaper in ("none", "zv", "ei"):  # the paper's controller keeps its share of Coulomb friction
        assert planned(shaper, STICKS, STICKING).law is None
    assert described_friction(UR5E) is planned("auto").law is None
    drives, law = STICKS.drives, described_friction(STICKS.clean())
    assert (law[0] == 0.0).all()
    assert law[4] == pytest.approx(np.array(drives.coulomb_friction) / drives.friction_width)
