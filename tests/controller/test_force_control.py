"""Force at the tool, force mode, freedrive and contacts: compliant and stiff axes, and how each ends."""

import numpy as np
import pinocchio as pin
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

from .forces import KINEMATICS, UR5E_IN_AIR, feeling, finished, force_mode, places, pressed, touching
from .robots import H
from .scripts import URSIM, failure, playing, said, start

one = st.floats(-200.0, 200.0)
six = st.tuples(one, one, one, one, one, one).map(np.array)


@given(st.lists(six, min_size=1, max_size=30), st.floats(0.0, 1.0), st.floats(0.0, 2.0), st.floats(0.0, 2.0))
def test_the_force_law_keeps_speed_limits_and_is_passive(forces, damping, gain, limit):
    task = ForceTask(np.ones(6), np.zeros(6), np.full(6, limit), damping, gain)
    inertia = task.mass * np.repeat([1.0, 0.22**2], 3)
    velocity = np.zeros(6)
    for force in forces:
        before, velocity = velocity, compliant_velocity(task, velocity, force)
        assert np.abs(velocity).max() <= limit
        gained = 0.5 * inertia * (velocity**2 - before**2)
        assert (gained <= gain * PERIOD * np.abs(force * velocity) + 1e-12).all()


def test_sensed_force_excludes_payload_weight_in_any_orientation():
    payload = Payload(mass=2.0, com=(0.01, -0.02, 0.05), inertia=(0.0,) * 6)
    robot, plant = feeling(payload=payload)
    plant.weight, plant.com, plant.pushed[:3] = 2.0, np.array(payload.com), [4.0, -3.0, 12.0]
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


def test_zeroing_subtracts_an_offset_in_the_sensor_frame():
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


def test_in_free_air_the_tool_moves_along_the_wanted_force_only():
    """With the values of ROS 2's test, 10 N moves the tool by over 6 mm/s, and no other axis."""
    robot, _ = touching(0.0)
    assert force_mode(robot, wrench=(0.0, 0.0, 10.0, 0.0, 0.0, 0.0), damping=0.1, gain=0.8) == Accepted(id=1)
    begun = np.array(robot.tick(1).actual_TCP_pose)
    moved = np.array(robot.tick(1000).actual_TCP_pose) - begun
    assert moved[2] > 0.012
    assert np.abs(moved[[0, 1, 3, 4, 5]]).max() < 4e-4
    assert robot.send(f.EndForceMode) == Done()
    robot.until_rest()
    assert robot.kinds().count("motion_stopped") == 1


@pytest.mark.parametrize(
    ("stiffness", "sensor", "gain", "settled"), [(1e4, False, 1.0, 250), (1e5, True, 2.0, 500)]
)
def test_a_surface_is_pressed_with_the_wanted_force_without_bouncing(stiffness, sensor, gain, settled):
    """The largest permitted gain is twice the usual one."""
    robot, plant = touching(stiffness, sensor=sensor)
    force_mode(robot, wrench=(0.0, 0.0, -20.0, 0.0, 0.0, 0.0), gain=gain)
    forces = pressed(robot, plant, 200 + settled)
    met = int(np.argmax(forces > 0.0))
    assert forces[met:].min() > 0.0
    assert np.abs(forces[met + settled :] - 20.0).max() <= 2.0


def test_a_compliant_axis_follows_its_task_frame():
    robot, _ = feeling()
    frame, chosen = (0.1, 0.2, 0.3, 0.4, -0.8, 0.5), [False, True, False, False, False, False]
    axes = pin.exp3(np.array(frame[3:]))
    force_mode(robot, tuple(chosen), tuple(30.0 * one for one in chosen), frame=frame)
    robot.tick(200)
    way = axes.T @ (places(robot)[-1] - places(robot)[0])
    assert way[1] > 0.005
    assert np.abs(np.delete(way, 1)).max() < 1e-7


def test_frame_types_1_and_3_align_with_the_origin_and_the_motion():
    robot, _ = feeling()
    across, here = (False, True, False, False, False, False), places(robot)[-1]
    origin = here + np.array([0.2, 0.1, 0.05])
    force_mode(robot, across, (0.0, 30.0, *[0.0] * 4), frame=(*origin, 0.3, 0.2, 0.1), frame_type=1)
    robot.tick(200)
    way, wanted = places(robot)[-1] - here, origin - here
    assert way / np.linalg.norm(way) == pytest.approx(wanted / np.linalg.norm(wanted), abs=1e-4)
    robot, _ = feeling()
    robot.send(m.SpeedL, xd=(0.03, 0.04, 0.0, 0.0, 0.0, 0.0))
    robot.tick(100)
    before = places(robot)[-1]
    force_mode(robot, across, (0.0, 20.0, *[0.0] * 4), frame_type=3)
    robot.tick(20)
    way = places(robot)[-1] - before
    assert way @ np.array([-0.8, 0.6, 0.0]) > 1e-4  # pushed across,
    assert way @ np.array([0.6, 0.8, 0.0]) > 1e-3  # while the motion goes on


def test_a_compliant_axis_keeps_its_speed_limit_and_stiff_axes_do_not_move():
    robot, plant = feeling()
    limits = (0.1, 0.1, 0.02, 0.5, 0.5, 0.5)
    force_mode(robot, wrench=(0.0, 0.0, -100.0, 0.0, 0.0, 0.0), limits=limits, damping=0.0)
    plant.pushed[:2] = 60.0, -80.0
    robot.tick(500)
    way = np.diff(places(robot), axis=0) / H
    assert np.abs(way[:, 2]).max() == pytest.approx(0.02, abs=1e-6)
    assert np.abs(way[:, :2]).max() < 1e-6


def test_a_path_deviation_in_force_mode_causes_a_stop_that_names_the_axis():
    robot, plant = touching(0.0)
    force_mode(robot, limits=(0.1, 1e-4, 0.1, 0.5, 0.5, 0.5))
    plant.pushed = np.array([0.0, 60.0, 0.0])
    robot.tick(100)
    (event,) = robot.told("protective_stop")
    assert event.code == "limit_force"
    assert "axis 1 of force mode" in event.why
    assert "limits[1] is 0.0001" in event.why


def test_end_force_mode_is_refused_without_force_mode():
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


def test_freedrive_follows_a_hand_along_free_axes_only():
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


def test_freedrive_does_not_pass_a_singular_posture():
    """It slows down, reports this, and keeps its limits."""
    robot, plant = feeling()
    start(robot, "freedrive_mode()", "while True:", "write_output_integer_register(0, get_freedrive_status())",
          "sync()", "end")  # fmt: skip
    plant.pushed[:3] = 0.0, -60.0, 20.0
    while robot.controller.io().output_int_register[0] == 0:
        robot.tick(100)
        assert len(robot.states) < 3000
    robot.tick(300)
    assert playing(robot)
    assert "protective_stop" not in robot.kinds()


MODE = "force_mode(p[0,0,0,0,0,0], [0,0,1,0,0,0], [0,0,{},0,0,0], 2, [2,2,1.5,1,1,1])"


def test_program_moves_in_force_mode_keep_the_force_and_arrive():
    robot, plant = touching(1e4)
    here = places(robot)[-1]
    pose = ", ".join(f"{one!r}" for one in robot.states[-1].actual_TCP_pose)
    there = f"pose_add(p[{pose}], p[0.03, 0, 0, 0, 0, 0])"
    forces = finished(
        robot, plant, "zero_ftsensor()", MODE.format(-20), "sleep(1)", f"movel({there}, a=.5, v=.1)", "textmsg(1)",
        f"movej(get_inverse_kin(p[{pose}]), a=.5, v=.2)", "stopl(1)", "textmsg(2)", "end_force_mode()",
    )  # fmt: skip
    assert said(robot) == ["1", "2"]
    assert np.abs(forces[500:-50] - 20.0).max() < 2.0
    way = places(robot) - here
    assert way[:, 0].max() == pytest.approx(0.03, abs=1e-3)
    assert np.abs(way[-1, :2]).max() < 1e-3


def test_arcs_in_force_mode_and_moves_in_freedrive_are_refused():
    for mode, move, why in (
        (MODE.format(0), "movec(get_actual_tcp_pose(), get_actual_tcp_pose())", "no arcs"),
        ("teach_mode()", f"movej({list(URSIM)})", "call end_freedrive_mode"),
    ):
        robot, _ = feeling()
        start(robot, mode, move)
        robot.tick(50)
        assert why in failure(robot).why


@pytest.mark.parametrize(("stiffness", "sensor"), [(1e5, True), (1e4, False), (0.0, False)])
def test_tool_contact_finds_the_start_of_a_contact(stiffness, sensor):
    """The program moves until it feels a contact, then back to where that began, as programs of UR robots do."""
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
