"""Force at the tool, force mode, freedrive and contacts: what gives way, what stays, and what ends it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_controller.instruments.snapshot import Instruments
from tvist_controller.trajectory.compliant import ForceTask, compliant_velocity
from tvist_plant.plant import PERIOD
from tvist_protocol import forces as f
from tvist_protocol import motions as m
from tvist_protocol.io import SetTcp
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.transitions import Activity
from tvist_protocol.values import Payload

from .forces import KINEMATICS, UR5E_IN_AIR, feeling, force_mode, places, pressed, touching
from .robots import UR5E, H, Robot
from .scripts import URSIM, failure, playing, said, start

# ---------------------------------------------------------------- the law

one = st.floats(-200.0, 200.0)
six = st.tuples(one, one, one, one, one, one).map(np.array)


@given(
    st.lists(six, min_size=1, max_size=30),
    st.floats(0.0, 1.0),
    st.floats(0.0, 2.0),
    st.floats(0.0, 2.0),
)
def test_the_law_keeps_its_speeds_and_takes_no_more_energy_than_the_force_gives(forces, damping, gain, limit):
    task = ForceTask(np.ones(6), np.zeros(6), np.full(6, limit), damping, gain)
    inertia = task.mass * np.repeat([1.0, 0.22**2], 3)
    velocity = np.zeros(6)
    for force in forces:
        before, velocity = velocity, compliant_velocity(task, velocity, force, PERIOD)
        assert np.abs(velocity).max() <= limit
        gained = 0.5 * inertia * (velocity**2 - before**2)
        assert (gained <= gain * PERIOD * np.abs(force * velocity) + 1e-12).all()


@given(six, st.integers(0, 2**6 - 1), st.floats(0.0, 1.0))
def test_axes_that_do_not_give_way_feel_nothing_and_lose_the_speed_they_had(force, chosen, speed):
    compliant = np.array([chosen >> k & 1 for k in range(6)], float)
    task, velocity = ForceTask(compliant, force, np.full(6, 10.0)), np.full(6, speed)
    for _ in range(round(speed / (3.0 * PERIOD)) + 1):
        velocity = compliant_velocity(task, velocity, force, PERIOD)
    assert (velocity[compliant == 0.0] == 0.0).all()


# ---------------------------------------------------------------- the force at the tool


def test_a_sensor_is_read_without_the_weight_of_the_payload_however_the_tool_turns():
    payload = Payload(mass=2.0, com=(0.01, -0.02, 0.05), inertia=(0.0,) * 6)
    robot, plant = feeling(payload=payload)
    plant.weight, plant.com, plant.pushed = (
        2.0,
        np.array(payload.com),
        np.array([4.0, -3.0, 12.0, 0.0, 0.0, 0.0]),
    )
    robot.send(SetTcp, offset=(0.0, 0.0, 0.1, 0.0, 0.0, 0.0))
    robot.send(m.SpeedJ, qd=(0.2, 0.3, -0.2, 0.4, 0.5, 0.6))
    instruments = Instruments(UR5E_IN_AIR)
    for _ in range(20):
        state = robot.tick(25)
        wrench = robot.controller.forces.wrench()
        assert wrench[:3] == pytest.approx([4.0, -3.0, 12.0], abs=1e-9)
        # The push acts at the flange, which is .1 m behind the tool centre point.
        lever = KINEMATICS.pose(np.array(state.actual_q))[0][:, 2] * -0.1
        assert wrench[3:] == pytest.approx(np.cross(lever, [4.0, -3.0, 12.0]), abs=1e-9)
        snapshot = instruments.snapshot(state, robot.controller.io())
        assert snapshot.actual_TCP_force == pytest.approx(wrench, abs=1e-9)
        assert snapshot.ft_raw_wrench == state.flange_wrench
        assert robot.controller.io().actual_TCP_force == pytest.approx(wrench, abs=1e-9)


def test_zeroing_a_sensor_takes_away_an_offset_of_its_own_frame():
    robot, plant = feeling()
    plant.weight = 0.5  # which nobody has declared, so it turns with gravity and not with the sensor
    robot.tick()
    assert robot.send(f.ZeroFtsensor) == Done()
    assert robot.controller.forces.wrench() == pytest.approx([0.0] * 6, abs=1e-12)
    plant.weight, plant.pushed = 0.0, np.array([0.0, 0.0, 5.0, 0.0, 0.0, 0.0])
    state = robot.tick()
    rotation = KINEMATICS.pose(np.array(state.actual_q))[0]
    zero = rotation @ np.array(robot.controller.io().tcp_force_zero[:3])
    assert robot.controller.forces.wrench()[:3] == pytest.approx(np.array([0.0, 0.0, 5.0]) - zero, abs=1e-9)


def test_an_arm_without_a_sensor_reports_no_wrench_of_one():
    robot = Robot(q=URSIM)
    assert robot.tick().flange_wrench is None


def test_a_sensor_of_ones_own_counts_when_a_program_says_so():
    robot, _ = feeling()
    assert robot.send(f.SetExternalWrench, wrench=(0.0, 0.0, 7.0, 0.0, 0.0, 0.0)) == Done()
    assert robot.tick().flange_wrench == pytest.approx([0.0] * 6)
    start(robot, "ft_rtde_input_enable(True, 0.3, [0.1, 0, 0], [0, 0, 0])", "sleep(0.1)")
    assert robot.tick(20).flange_wrench == pytest.approx([0.0, 0.0, 7.0, 0.0, -0.7, 0.0])
    robot.tick(60)
    start(robot, "enable_external_ft_sensor(False)")
    assert robot.tick(20).flange_wrench == pytest.approx([0.0] * 6)


# ---------------------------------------------------------------- force mode in the air and on surfaces


def test_in_the_air_the_tool_moves_along_the_wanted_force_and_in_no_other_direction():
    """As ROS 2's test of its controller: +10 N, damping 0.1, gain 0.8; more than 3 cm in 5 s, others below 1 mm."""
    robot, _ = touching(0.0)
    assert force_mode(robot, wrench=(0.0, 0.0, 10.0, 0.0, 0.0, 0.0), damping=0.1, gain=0.8) == Accepted(id=1)
    begun = np.array(robot.tick(1).actual_TCP_pose)
    moved = np.array(robot.tick(2500).actual_TCP_pose) - begun
    assert moved[2] > 0.03
    assert np.abs(moved[[0, 1, 3, 4, 5]]).max() < 1e-3
    assert robot.send(f.EndForceMode) == Done()
    robot.until_rest()
    assert robot.kinds().count("motion_stopped") == 1


@pytest.mark.parametrize("sensor", [True, False])
@pytest.mark.parametrize("stiffness", [1e3, 1e4, 1e5])
def test_a_surface_is_pressed_with_the_wanted_force_without_bouncing(stiffness, sensor):
    robot, plant = touching(stiffness, sensor=sensor)
    force_mode(robot, wrench=(0.0, 0.0, -20.0, 0.0, 0.0, 0.0))
    forces = pressed(robot, plant, 700 if stiffness > 1e3 else 1500)
    met = int(np.argmax(forces > 0.0))
    assert forces[met:].min() > 0.0
    if stiffness == 1e3:
        assert np.diff(forces[met + 200 :]).min() > -1e-3
        assert forces[-1] == pytest.approx(20.0, abs=8.0)
        return
    if stiffness == 1e4:
        assert np.abs(forces[met + 250 :] - 20.0).max() <= 2.0
    late = forces[met + 500 :]
    assert late.max() <= 22.0
    assert late.min() >= 18.0


def test_the_loop_of_force_control_is_stable_by_its_response_and_says_with_which_margin():
    """The force's response to a speed, through line, drives, structure and a surface of 1e5 N/m, in a Nyquist plot.

    The felt force answers a pulse of velocity by g[n], which ends in the constant k h; with the law
    C(z) = g h/M / (1 + h D/M - 1/z) the loop is L = C G. Its distance from -1, and the factor that leads there.
    """
    robot, _ = touching(1e5, gap=-4e-4)
    robot.tick(600)
    speed, felt = 1e-3, []
    before = robot.controller.forces.felt(robot.controller.cycle.sample)[2]
    assert robot.send(m.SpeedL, xd=(0.0, 0.0, -speed, 0.0, 0.0, 0.0), acceleration=50.0) == Accepted(id=1)
    for _ in range(500):
        robot.tick()
        felt.append((robot.controller.forces.felt(robot.controller.cycle.sample)[2] - before) / speed)
    pulse = np.diff(felt, prepend=0.0)
    tail = pulse[-150:].mean()
    assert 2e4 < tail / H < 1e5  # the surface, and the arm behind it
    z = np.exp(
        1j * np.concatenate((np.linspace(0.2, 20.0, 200), np.linspace(20.0, 0.98 * np.pi / H, 2000))) * H
    )
    response = (
        ((pulse - tail) * z[:, None] ** -np.arange(len(pulse))).sum(axis=1) + tail / (1.0 - 1.0 / z)
    ) / z
    task = ForceTask(np.ones(6), np.zeros(6), np.ones(6))
    law = (H / task.mass) / (1.0 + H * task.contact_damping / task.mass - 1.0 / z)
    loop = law * response
    crossings = np.flatnonzero((loop.imag[:-1] * loop.imag[1:] <= 0.0) & (loop.real[:-1] < 0.0))
    assert -1.0 / loop.real[crossings].min() > 4.0  # a gain margin above 4: 2 is the largest scaling
    assert np.abs(1.0 + loop).min() > 0.6


def test_a_motion_in_the_other_axes_goes_on_while_the_force_is_kept():
    robot, plant = touching(1e4)
    force_mode(robot, wrench=(0.0, 0.0, -20.0, 0.0, 0.0, 0.0))
    pressed(robot, plant, 500)
    here = places(robot)[-1]
    assert robot.send(m.SpeedL, xd=(0.03, 0.0, 0.05, 0.0, 0.0, 0.0), acceleration=0.3) == Accepted(id=1)
    forces = pressed(robot, plant, 500)
    assert np.abs(forces - 20.0).max() < 2.0
    way = places(robot)[-1] - here
    ramp = np.hypot(0.03, 0.05) / 0.3  # z does not follow the command, x does
    assert way[0] == pytest.approx(0.03 * (1.0 - 0.5 * ramp), abs=1e-4)
    assert abs(way[1]) < 1e-6


# ---------------------------------------------------------------- frames


@pytest.mark.parametrize("axis", range(3))
def test_an_axis_of_a_frame_gives_way_along_it(axis):
    robot, _ = feeling()
    frame = (0.1, 0.2, 0.3, 0.4, -0.8, 0.5)
    axes = turn_matrix(frame[3:])
    compliant = tuple(k == axis for k in range(6))
    force_mode(robot, compliant, tuple(30.0 * (k == axis) for k in range(6)), frame=frame)
    robot.tick(200)
    way = axes.T @ (places(robot)[-1] - places(robot)[0])
    assert way[axis] > 0.005
    assert np.abs(np.delete(way, axis)).max() < 1e-7


def turn_matrix(vector):
    import pinocchio as pin

    return np.asarray(pin.exp3(np.array(vector)))


def test_type_1_pushes_to_the_origin_of_its_frame_and_type_3_across_the_way():
    robot, _ = feeling()
    here = places(robot)[-1]
    origin = here + np.array([0.2, 0.1, 0.05])
    force_mode(
        robot, (False, True, False, False, False, False), (0.0, 30.0, 0.0, 0.0, 0.0, 0.0),
        frame=(*origin, 0.3, 0.2, 0.1), frame_type=1,
    )  # fmt: skip
    robot.tick(200)
    way = places(robot)[-1] - here
    assert way / np.linalg.norm(way) == pytest.approx(
        (origin - here) / np.linalg.norm(origin - here), abs=1e-4
    )
    robot, _ = feeling()
    robot.send(m.SpeedL, xd=(0.03, 0.04, 0.0, 0.0, 0.0, 0.0))
    robot.tick(100)
    here = places(robot)[-1]
    force_mode(
        robot, (False, True, False, False, False, False), (0.0, 20.0, 0.0, 0.0, 0.0, 0.0), frame_type=3
    )
    robot.tick(1)
    axes = robot.controller.cycle.trajectory.axes
    assert axes[:, 0] == pytest.approx([0.6, 0.8, 0.0], abs=1e-6)


# ---------------------------------------------------------------- limits and ends

FRAMES = st.sampled_from([None, (0.3, 0.2, 0.1, 0.5, 0.1, -0.7)])
COMMANDS = st.one_of(
    st.tuples(
        st.just("force_mode"), st.tuples(*[st.booleans()] * 6),
        st.tuples(*[st.floats(-60.0, 60.0)] * 3, *[st.floats(-8.0, 8.0)] * 3),
        st.floats(0.01, 0.2), FRAMES, st.sampled_from([1, 2, 3]), st.floats(0.0, 1.0), st.floats(0.0, 2.0),
    ),
    st.tuples(st.just("freedrive"), st.tuples(*[st.booleans()] * 6), st.sampled_from(["base", "tool"])),
    st.tuples(st.just("speed_l"), st.tuples(*[st.floats(-0.1, 0.1)] * 3)),
    st.tuples(st.just("speed_j"), st.tuples(*[st.floats(-0.5, 0.5)] * 6)),
    st.tuples(st.just("servo_j"), st.tuples(*[st.floats(-0.2, 0.2)] * 6)),
    st.tuples(st.just("push"), st.tuples(*[st.floats(-80.0, 80.0)] * 3)),
    st.tuples(st.just("end_force_mode")),
    st.tuples(st.just("stop_j")),
)  # fmt: skip


@given(st.lists(st.tuples(COMMANDS, st.integers(1, 60)), min_size=1, max_size=8))
def test_whatever_is_commanded_and_pushes_the_joints_keep_their_limits_and_come_to_rest(sequence):
    robot, plant = feeling()
    for (kind, *given_), ticks in sequence:
        if kind == "force_mode":
            compliant, wrench, limit, frame, frame_type, damping, gain = given_
            force_mode(
                robot, compliant, wrench, limits=tuple(limit if one else 1e3 for one in compliant), frame=frame,
                frame_type=frame_type, damping=damping, gain=gain,
            )  # fmt: skip
        elif kind == "freedrive":
            robot.send(f.Freedrive, free=given_[0], frame=given_[1])
        elif kind == "speed_l":
            robot.send(m.SpeedL, xd=(*given_[0], 0.0, 0.0, 0.0))
        elif kind == "speed_j":
            robot.send(m.SpeedJ, qd=given_[0])
        elif kind == "servo_j":
            robot.send(m.ServoJ, q=tuple(np.array(URSIM) + given_[0]))
        elif kind == "push":
            plant.pushed[:3] = given_[0]
        else:
            robot.send(f.EndForceMode if kind == "end_force_mode" else m.StopJ)
        robot.tick(ticks)
    robot.send(m.StopJ)
    robot.until_rest()
    q = robot.column("reference_q")
    limits = UR5E.limits
    assert np.abs(np.diff(q, axis=0) / H).max() <= min(limits.velocity) * (1.0 + 1e-6)
    assert np.abs(np.diff(q, 2, axis=0) / H**2).max() <= min(limits.acceleration) * (1.0 + 1e-6) + 1e-6
    ends = [event for event in robot.events if event.kind in {"motion_done", "motion_stopped"}]
    assert len(ends) == robot.kinds().count("motion_started")


def test_a_compliant_axis_keeps_its_speed_limit_and_the_others_their_place():
    robot, plant = feeling()
    limits = (0.1, 0.1, 0.02, 0.5, 0.5, 0.5)
    force_mode(robot, wrench=(0.0, 0.0, -100.0, 0.0, 0.0, 0.0), limits=limits, damping=0.0)
    plant.pushed[:2] = 60.0, -80.0
    robot.tick(500)
    way = np.diff(places(robot), axis=0) / H
    assert np.abs(way[:, 2]).max() == pytest.approx(0.02, abs=1e-6)
    assert np.abs(way[:, :2]).max() < 1e-6


@pytest.mark.parametrize("push", [(0.0, 0.0, 260.0), (200.0, 200.0, 0.0)])
def test_a_force_beyond_what_a_robot_bears_is_a_protective_stop(push):
    robot, plant = feeling()
    plant.pushed[:3] = push
    robot.tick(5)
    assert "protective_stop" not in robot.kinds()
    robot.tick(5)
    (event,) = [event for event in robot.events if event.kind == "protective_stop"]
    assert event.code == "limit_force"
    assert "above 250 N" in event.why


def test_a_tool_that_leaves_its_way_in_force_mode_is_a_protective_stop_that_names_the_axis():
    robot, plant = touching(0.0)
    force_mode(robot, limits=(0.1, 1e-4, 0.1, 0.5, 0.5, 0.5))
    plant.pushed = np.array([0.0, 60.0, 0.0])
    robot.tick(100)
    (event,) = [event for event in robot.events if event.kind == "protective_stop"]
    assert event.code == "limit_force"
    assert "axis 1 of force mode" in event.why
    assert "limits[1] is 0.0001" in event.why


def test_end_force_mode_needs_something_to_end_and_force_mode_an_arm_that_may_be_taken_over():
    robot, _ = feeling()
    refused = robot.send(f.EndForceMode)
    assert isinstance(refused, Refused)
    robot.send(m.SpeedJ, qd=(0.1, 0.0, 0.0, 0.0, 0.0, 0.0))
    robot.tick(10)
    assert isinstance(robot.send(f.EndForceMode), Refused)
    assert force_mode(robot) == Accepted(id=1)  # the speed goes on, but for z
    robot.tick(100)
    assert robot.states[-1].target_qd[0] == pytest.approx(0.1, abs=1e-3)
    robot.send(f.EndForceMode)
    robot.until_rest()
    assert robot.controller.motion.activity is Activity.REST


# ---------------------------------------------------------------- by hand


def test_the_arm_follows_a_hand_along_the_free_axes_and_stops_when_it_lets_go():
    robot, plant = feeling()
    assert robot.send(f.Freedrive, free=(True, False, True, False, False, False)) == Accepted(id=1)
    plant.pushed[:3] = 20.0, 20.0, 0.0
    robot.tick(500)
    way = places(robot)[-1] - places(robot)[0]
    assert way[0] > 0.08
    assert abs(way[1]) < 1e-6
    plant.pushed[:] = 0.0
    robot.tick(600)
    assert np.abs(np.diff(places(robot)[-2:], axis=0)).max() / H < 5e-3


def test_a_hand_cannot_push_the_arm_through_a_singular_posture():
    """It gets slower, says so, and keeps its limits."""
    robot, plant = feeling()
    start(robot, "freedrive_mode()", "while True:", "write_output_integer_register(0, get_freedrive_status())",
          "sync()", "end")  # fmt: skip
    plant.pushed[:3] = 0.0, -60.0, 20.0
    robot.tick(3000)
    assert robot.controller.io().output_int_register[0] > 0
    assert playing(robot)
    assert "protective_stop" not in robot.kinds()


# ---------------------------------------------------------------- programs

MODE = "force_mode(p[0,0,0,0,0,0], [0,0,1,0,0,0], [0,0,{},0,0,0], 2, [2,2,1.5,1,1,1])"


def finished(robot, plant, *lines, most=6000):
    """Run a program; return the force of the surface in each tick."""
    assert start(robot, *lines) == Done()
    forces = []
    while playing(robot):
        forces.append(pressed(robot, plant, 1)[0])
        assert len(forces) < most
    assert failure(robot) is None, failure(robot)
    return np.array(forces)


def test_the_example_of_ur_rtde_presses_into_the_air_and_back():
    """A thread calls force_mode in every step: -10 N, then +10 N, for 2 s each; within 5.8 cm of its start."""
    robot, plant = touching(0.0)
    loop = ("i = 0", "while i < {}:", MODE, "sync()", "i = i + 1", "end")
    down, up = ([line.format(value) for line in loop] for value in (-10, 10))
    down[1], up[1] = "while i < 1000:", "while i < 999:"
    finished(
        robot, plant, "force_mode_set_damping(0.025)", "force_mode_set_gain_scaling(0.5)", *down, *up,
        "end_force_mode()", "stopl(10)",
    )  # fmt: skip
    way = places(robot) - places(robot)[0]
    assert way[:, 2].min() < -0.005
    assert np.abs(way).max() < 0.058
    assert np.abs(way[-1]).max() < 0.003


def test_moves_of_a_program_in_force_mode_keep_the_force_and_arrive():
    robot, plant = touching(1e4)
    x, y, z = places(robot)[-1].tolist()
    turned = ", ".join(f"{one!r}" for one in robot.states[-1].actual_TCP_pose[3:])
    there, back = (f"p[{x + dx!r}, {y!r}, {z!r}, {turned}]" for dx in (0.03, 0.0))
    forces = finished(
        robot, plant, "zero_ftsensor()", MODE.format(-20), "sleep(1)", f"movel({there}, a=.5, v=.1)", "textmsg(1)",
        f"movej(get_inverse_kin({back}), a=.5, v=.2)", "stopl(1)", "textmsg(2)", "end_force_mode()",
    )  # fmt: skip
    assert said(robot) == ["1", "2"]
    assert np.abs(forces[500:-50] - 20.0).max() < 2.0
    way = places(robot) - np.array([x, y, z])
    assert way[:, 0].max() == pytest.approx(0.03, abs=1e-4)
    assert np.abs(way[-1, :2]).max() < 1e-4


def test_an_arc_in_force_mode_and_a_move_in_freedrive_are_refused_in_words():
    for mode, move, why in (
        (MODE.format(0), "movec(get_actual_tcp_pose(), get_actual_tcp_pose())", "no arcs"),
        ("teach_mode()", f"movej({list(URSIM)})", "call end_freedrive_mode"),
    ):
        robot, _ = feeling()
        start(robot, mode, move)
        robot.tick(50)
        assert why in failure(robot).why


@pytest.mark.parametrize(
    ("stiffness", "sensor"), [(1e4, True), (1e5, True), (1e4, False), (0.0, True), (0.0, False)]
)
def test_a_contact_is_found_with_when_it_began_and_none_in_the_air(stiffness, sensor):
    """As the scripts of UR's clients do: move until tool_contact says so, then back to where it began."""
    robot, plant = touching(stiffness, gap=0.02, sensor=sensor)
    finished(
        robot, plant, "s = 0", "i = 0", "while s == 0 and i < 800:", "s = tool_contact([0, 0, -1, 0, 0, 0])",
        "speedl([0, 0, -0.03, 0, 0, 0], 1.0, get_steptime())", "i = i + 1", "end", "textmsg(s)",
        "q = get_actual_joint_positions_history(s)", "stopl(3)", "movel(q)", "textmsg(get_actual_tcp_pose()[2])",
    )  # fmt: skip
    steps, z = (float(text) for text in said(robot))
    if stiffness == 0.0:
        assert steps == 0
        return
    assert 0 < steps < 60
    assert abs(z - plant.height) < 1.5e-3  # steps of .06 mm, and what the force took to count


def test_the_end_of_a_program_ends_force_mode_and_a_pause_does_too():
    robot, _ = feeling()
    start(robot, MODE.format(-20), "sleep(0.2)")
    robot.until_rest(400)
    assert robot.controller.motion.activity is Activity.REST
    assert not playing(robot)


def test_a_thread_that_ends_stops_its_own_motion_and_not_force_mode():
    robot, plant = touching(1e4)
    forces = finished(
        robot, plant, "thread aside():", "speedl([0.02, 0, 0, 0, 0, 0], 1, 10)", "end", MODE.format(-20), "sleep(1)",
        "t = run aside()", "sleep(.3)", "kill t", "sleep(.5)", "textmsg(get_tcp_force()[2])",
    )  # fmt: skip
    assert float(said(robot)[0]) == pytest.approx(20.0, abs=1.0)
    assert np.abs(forces[500:-5] - 20.0).max() < 2.0
    still = np.diff(places(robot)[-60:-5, 0])
    assert np.abs(still).max() < 1e-9
