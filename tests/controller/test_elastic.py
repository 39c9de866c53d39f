"""Feed-forward of the arm's elasticity."""

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.controller.robots import PAPER, Q1, Q2, Q3, UR5E, H, Line, Robot, calibration, cut, spring_loads

from tvist_controller.kinematics.arm import Arm
from tvist_controller.line.elastic_feed_forward import ElasticFeedForward
from tvist_controller.line.elastic_lead import MOST, ROTOR, follow
from tvist_controller.line.inverse_dynamics import InverseDynamics
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.setup import Setup, body, paper_payload
from tvist_controller.sources.calibrations import drivetrain, load
from tvist_controller.trajectory import JointLine, MotionLimits, quickest_motion
from tvist_plant.description import Payload
from tvist_plant.model import flexible_model
from tvist_protocol import commands as c
from tvist_protocol.motions import SpeedJ
from tvist_protocol.replies import Done

MODAL = load("ur5e_modal")
LIMIT = np.array(UR5E.limits.torque)
NAMES = ("elastic", "elastic-position", "elastic-auto")


def stage(description=UR5E, **how) -> ElasticFeedForward:
    springs = drivetrain(MODAL.modal.parameters, description, flexible_model(description, Payload()))
    stiffness = np.array(springs.stiffness)
    return ElasticFeedForward(description, stiffness, np.array(springs.damping) / stiffness, H, **how)


def line(shaper: str, q=Q1, *, mass=5.0, believed=None, description=UR5E, plant=None) -> Line:
    """A control line with a filter by name, as a server makes it."""
    declared = paper_payload(description, mass if believed is None else believed)
    setup = Setup(description, tuple(q), declared, MODAL, shaper=shaper)
    first = FilterPlanner(setup).first()
    return Line(
        description, first.tvist, elastic=first.elastic, q=np.array(q), declared=body(declared),
        carried=body(paper_payload(description, mass)), seed=1, plant=plant,
    )  # fmt: skip


def move(cycle: Line, target, limits=PAPER):
    """Make a motion, and return its samples with 0.6 s of rest and the plant's truth for each."""
    cycle.begin(quickest_motion(JointLine(cycle.sample.reference, np.array(target)), limits, H))
    cycle.tvist.aim(np.array(target))
    samples, truths, rest = [], [], 0
    while rest < 300:
        samples.append(cycle.step())
        truths.append(cycle.plant.truth())
        rest = rest + 1 if cycle.mode.at_rest else 0
    return samples, truths


def ringing(truths, rest=300):
    force = np.array([truth.specific_force for truth in truths])
    return np.linalg.norm(force - force[-1], axis=1)[-rest + 5 :].max()


# ------------------------------------------------------------------ the formula


def test_one_joint_leads_by_its_inertia_times_acceleration_over_stiffness():
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


def test_nothing_of_springs_and_gains_in_the_robot_file_is_used():
    drives = UR5E.drives
    other = {
        name: tuple(3.0 * value for value in getattr(drives, name))
        for name in (
            "gear_stiffness", "gear_damping", "velocity_gain", "position_gain", "integral_gain", "windup_feedforward",
        )
    }  # fmt: skip
    flexible = msgspec.structs.replace(UR5E.link_flexibility, stiffness=(1e3, 1e3), damping_time=1.0)
    strange = msgspec.structs.replace(
        UR5E, drives=msgspec.structs.replace(drives, **other), link_flexibility=flexible
    )
    commands = []
    for description in (UR5E, strange):
        feed, dynamics = stage(description), InverseDynamics(description, UR5E.payload)
        for k in range(20):
            target = np.array([Q3 + 1e-4 * k**2, np.full(6, 0.1 * k), np.full(6, 50.0)])
            command = feed.command(np.vstack((target, dynamics.torque(*target))), dynamics.payload_parameters)
        commands.append(np.concatenate([command.q, command.qd, command.torque]))
    assert commands[0].tobytes() == commands[1].tobytes()


def test_a_payload_counts_like_a_body_of_the_model():
    heavy, light = (InverseDynamics(UR5E, payload) for payload in (UR5E.payload, Payload()))
    target = np.array([Q3, np.zeros(6), [1.0, -2.0, 3.0, 1.0, 0.5, 2.0]])
    loads = {}
    for name, dynamics in (("heavy", heavy), ("light", light)):
        feed = stage()
        feed.carry(dynamics.payload_parameters)
        loads[name] = spring_loads(feed.lead, target)[feed.lead.joints.astype(int)]
    rigid = {
        name: dynamics.torque(*target) - dynamics.gravity(target[0])
        for name, dynamics in (("heavy", heavy), ("light", light))
    }
    assert loads["heavy"] - loads["light"] == pytest.approx(rigid["heavy"] - rigid["light"], abs=1e-9)


# ------------------------------------------------------------------ the limit of the lead's acceleration


def followed(wanted, room):
    """Follow a course of one joint; return the leads, and whether any acceleration was limited."""
    led, window, out, limited = np.full((3, 1), wanted[0]), np.full((3, 1), wanted[0]), [], []
    for value in wanted:
        window[1:] = window[:-1].copy()
        window[0] = value
        limited.append(follow(window, led, np.array([room]), H))
        out.append(led[0, 0])
    return np.array(out), np.array(limited)


def test_a_smooth_lead_is_followed_exactly():
    wanted = 1e-3 * np.sin(np.linspace(0.0, 6.0, 500)) ** 4
    led, limited = followed(wanted, 1e9)
    assert led == pytest.approx(wanted, abs=1e-15)
    assert not limited.any()


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), room=st.floats(1.0, 100.0))
def test_a_rough_lead_is_followed_with_limited_acceleration_and_caught_up(seed, room):
    random = np.random.default_rng(seed)
    steps = np.repeat(random.uniform(-2e-3, 2e-3, 6), 60)
    wanted = np.concatenate([[0.0] * 5, steps, [steps[-1]] * 600])
    led, limited = followed(wanted, room)
    assert np.abs(np.diff(led, 2)).max() / H**2 <= room * (1.0 + 1e-9)
    assert limited.any()
    assert led[-1] == pytest.approx(wanted[-1], abs=1e-7)
    assert np.abs(led).max() <= 3.0 * np.abs(wanted).max()


# ------------------------------------------------------------------ what it is for


@pytest.mark.parametrize(("mass", "start", "target"), [(0.0, Q1, Q3), (5.0, Q3, Q2)])
def test_the_arm_rests_a_hundred_milliseconds_earlier_than_it_would_and_nearly_still(mass, start, target):
    clean = UR5E.clean()
    left = {
        name: ringing(move(line(name, start, mass=mass, description=clean), target)[1])
        for name in ("none", *NAMES)
    }
    assert left["elastic"] < 0.05 * left["none"]
    assert left["elastic-auto"] < 0.01 * left["none"]
    assert left["elastic-position"] < 0.25 * left["none"]


def left_with(change) -> float:
    """Share of the vibration that `elastic` leaves if the controller's knowledge is changed."""
    description, left = UR5E.clean(), {}
    for name in ("none", "elastic"):
        cycle = line(name, Q1, description=description)
        if name == "elastic":
            change(cycle.drives.wanted)
        left[name] = ringing(move(cycle, Q3)[1])
    return left["elastic"] / left["none"]


def test_the_bending_of_links_is_indispensable_and_rotor_inertia_need_not_be_exact():
    def rigid_links(elastic):
        flexes, springs = elastic.lead.flexes.astype(int), elastic.lead.springs
        springs[0, flexes] = 1e12

    def other_rotors(elastic):
        elastic.lead.drives[ROTOR] *= 1.2

    known = left_with(lambda _: None)
    assert left_with(rigid_links) > 4.0 * known
    assert left_with(other_rotors) < 2.0 * known


@pytest.mark.parametrize(
    ("mass", "start", "target"),
    [
        (3.9, (-0.35, -0.82, 0.72, -0.48, 0.0, 0.0), (0.47, -1.64, 0.1, -0.9, 0.0, 0.0)),
        (3.8, (2.54, -2.88, 1.94, -2.96, 0.0, 0.0), (-1.34, -1.83, 2.3, -0.91, 0.0, 0.0)),
    ],
)
def test_the_acceleration_of_bending_links_counts_where_the_smoothing_is_short(mass, start, target):
    left = {}
    for smooth in (True, False):
        cycle = line("elastic-16", np.array(start), mass=mass, description=UR5E.clean())
        elastic = cycle.drives.wanted
        command = elastic.command
        elastic.command = lambda *what, smooth, counts=smooth, command=command: command(
            *what, smooth=smooth and counts
        )
        left[smooth] = ringing(move(cycle, target)[1])
    assert left[True] < 0.85 * left[False]


def test_the_flange_accelerates_as_a_rigid_arms_would():
    """Independent of the lead's formula: the flexible arm's flange beside the rigid kinematics of its target."""
    wrong, arm = {}, Arm(UR5E)
    for name, late in (("none", 0), ("elastic", 1)):
        samples, truths = move(line(name, Q1, description=UR5E.clean()), Q3)
        flange = np.array([truth.flange_position for truth in truths])[late:]
        rigid = np.array([arm.pose(sample.target.q)[1] for sample in samples])
        away = flange - rigid[: len(flange)]
        wrong[name] = np.sqrt((np.diff(away, 2, axis=0) ** 2).sum(axis=1).mean()) / H**2
    assert wrong["elastic"] < 0.25 * wrong["none"]


# ------------------------------------------------------------------ choosing it


@pytest.mark.parametrize("name", NAMES)
def test_it_is_chosen_like_any_other_shaper_and_says_what_the_motors_do(name):
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


def test_without_springs_it_is_refused_with_the_way_to_get_them():
    other = msgspec.structs.replace(UR5E, robot=msgspec.structs.replace(UR5E.robot, model="strange"))
    robot = Robot(description=other, calibration=calibration(robot="strange"))
    reply = robot.send(c.SetShaper, name="elastic")
    assert (reply.code, reply.where) == ("out_of_range", "name")
    assert "tvist identify" in reply.why


def test_the_drives_tick_counts_in_the_delay_that_is_published():
    robot = Robot(calibration=calibration(), shaper="elastic")
    state, tvist = robot.tick(), robot.controller.cycle.tvist
    assert state.shaper_delay == pytest.approx(tvist.delay + H)


# ------------------------------------------------------------------ stops, changes, rough references


ACTS = (
    "stop",
    "none",
    "zv",
    "elastic",
    "elastic-auto",
    "payload",
    "pause",
    "resume",
    "slider",
    "move",
    "speed_j",
)


def act(robot, name, random):
    if name == "stop":
        robot.send(c.Stop)
    elif name == "payload":
        robot.send(c.SetPayload, **msgspec.structs.asdict(paper_payload(UR5E, random.uniform(0.0, 5.0))))
    elif name in {"pause", "resume"}:
        robot.send(c.Pause if name == "pause" else c.Resume)
    elif name == "slider":
        robot.send(c.SetSpeed, fraction=random.uniform(0.2, 1.0))
    elif name == "move":
        q = Q3 + random.uniform(0.1, 0.6) * (Q1 - Q3)
        robot.send(c.MoveJ, q=tuple(q), velocity=2.0, acceleration=4.0, jerk=2000.0)
    elif name == "speed_j":
        robot.send(SpeedJ, qd=tuple(random.uniform(-0.3, 0.3, 6)), acceleration=5.0)
    else:
        robot.send(c.SetShaper, name=name)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_position_and_velocity_of_the_motors_stay_continuous_through_whatever_happens(seed):
    random = np.random.default_rng(seed)
    robot = Robot(calibration=calibration(), shaper="elastic", q=tuple(Q3))
    commands = watched_commands(robot)
    act(robot, "move", random)
    for _ in range(12):
        robot.tick(int(random.integers(2, 200)))
        act(robot, str(random.choice(ACTS)), random)
    robot.send(c.Stop)
    robot.until_rest()
    q, qd = (np.array([getattr(command, name) for command in commands]) for name in ("q", "qd"))
    torque = np.array([command.torque for command in commands])
    moved = np.diff(q, axis=0) / H
    # Velocities are the positions' derivatives, but for those of the wind-up in a stop, which lag by half a tick.
    assert np.abs(moved - 0.5 * (qd[1:] + qd[:-1])).max() < 0.3
    assert np.abs(np.diff(moved, axis=0)).max() / H < 200.0
    assert (np.abs(torque) <= LIMIT).all()


@pytest.mark.parametrize(("ticks", "jitter"), [(1, False), (4, False), (4, True)])
@pytest.mark.parametrize("name", NAMES)
def test_rounded_setpoints_make_little_torque_ripple(name, ticks, jitter):
    """Set-points at 500 and 125 Hz, rounded to 1e-5 rad, some a tick late: at most 5 % of the rating."""
    random, torques = np.random.default_rng(5), []
    limits = MotionLimits(1.5, 2.4, 200.0)
    for rounding in (0.0, 1e-5):
        cycle = line(name, Q3, description=UR5E.clean())
        motion = quickest_motion(JointLine(Q3, Q3 + 0.4), PAPER, H)
        stream, found = cycle.stream(ticks * H, limits), []
        q = [motion.next() for _ in range(round(motion.duration / H))]
        late = random.integers(0, 2, len(q)) if jitter else np.zeros(len(q), int)
        due = {}
        for number, value in enumerate(q[::ticks]):
            sent = np.round(value / rounding) * rounding if rounding else value
            due.setdefault(number * ticks + int(late[number]) if rounding else number * ticks, []).append(
                (number, sent)
            )
        for tick in range(len(q)):
            for number, sent in due.get(tick, ()):
                stream.offer(number + 1, sent)
            found.append(cycle.step().command.torque)
        torques.append(np.array(found))
    assert (np.abs(torques[1] - torques[0]) / LIMIT).max() <= 0.05


def test_a_guided_motion_without_a_filter_goes_without_elastic_feed_forward_and_gets_it_back():
    robot = Robot(calibration=calibration(), shaper="elastic", q=tuple(Q1))
    robot.tick(3)
    for _ in range(400):
        robot.send(SpeedJ, qd=(0.2, 0.0, 0.0, 0.0, 0.0, 0.0), acceleration=1.0)
        robot.tick()
    assert robot.states[-1].motor_qd is None
    robot.send(c.Stop)
    robot.until_rest()
    assert robot.tick(2).motor_qd is not None


def test_a_lead_that_the_torque_does_not_permit_is_limited_and_told():
    weak = msgspec.structs.replace(
        UR5E, limits=msgspec.structs.replace(UR5E.limits, torque=tuple(0.05 * t for t in UR5E.limits.torque))
    )
    feed, dynamics = stage(weak), InverseDynamics(weak, UR5E.payload)
    told = []
    for k in range(200):
        jerky = 20.0 * np.sign(np.sin(0.3 * k)) * np.ones(6)
        target = np.array([Q3, np.zeros(6), jerky])
        feed.command(np.vstack((target, dynamics.torque(*target))), dynamics.payload_parameters)
        told.append(feed.limited)
    assert any(told)


def test_friction_that_is_less_at_breakaway_takes_as_much_of_the_torque_as_in_motion():
    law = np.array([[10.0], [0.5], [0.05], [0.03], [1e-9]]) * np.ones(6)
    assert stage(law=law).lead.drives[MOST] == pytest.approx(0.95 * LIMIT - 10.0)


def watched_commands(robot):
    """Commands that the drives get from now on."""
    commands, step = [], robot.controller.cycle.plant.step

    def watched(command):
        commands.append(command)
        return step(command)

    robot.controller.cycle.plant.step = watched
    return commands


def roughness(commands):
    """Largest acceleration of the commanded positions [rad/s^2]."""
    return np.abs(np.diff([command.q for command in commands], 2, axis=0)).max() / H**2


@pytest.mark.parametrize("other", ["zv", "elastic", "elastic-auto"])
def test_another_shaper_right_after_a_stop_waits_until_the_motors_have_come_back(other):
    robot = Robot(calibration=calibration(), shaper="elastic", q=tuple(Q3))
    robot.send(c.MoveJ, q=tuple(Q1), velocity=3.0, acceleration=8.0, jerk=2000.0)
    robot.tick(380)
    robot.send(c.Stop)
    robot.until_rest()
    commands = watched_commands(robot)
    robot.tick(2)
    assert robot.send(c.SetShaper, name=other) == Done()
    robot.tick(400)
    assert roughness(commands) < 60.0
    assert (robot.states[-1].motor_qd is None) == (other == "zv")


@pytest.mark.parametrize("speed", [0.3, 1.0])
def test_a_stop_of_a_guided_motion_is_no_rougher_than_without_elastic_feed_forward(speed):
    rough = {}
    for name in ("none", "elastic"):
        robot = Robot(calibration=calibration(), shaper=name, q=tuple(Q1))
        for _ in range(200):
            robot.send(SpeedJ, qd=(speed, 0.0, 0.5 * speed, 0.0, 0.0, 0.0), acceleration=5.0)
            robot.tick()
        commands = watched_commands(robot)
        robot.send(c.Stop)
        robot.until_rest()
        robot.tick(300)
        rough[name] = roughness(commands)
    assert rough["elastic"] <= 1.1 * rough["none"]
