"""Safety of force control: silent or changed sensors, stops, other tools, heavy payloads, threads."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_plant.description import load
from tvist_protocol import commands as c
from tvist_protocol import forces as f
from tvist_protocol import motions as m
from tvist_protocol.io import SetTcp
from tvist_protocol.programs import ProgramPause, ProgramPlay, ProgramRun, ProgramStop
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.simulation import SimulationReset
from tvist_protocol.transitions import Activity

from .forces import (
    KINEMATICS,
    NOTHING,
    UR5E_IN_AIR,
    feeling,
    finished,
    force_mode,
    places,
    pressed,
    protective,
    touching,
)
from .robots import H
from .scripts import URSIM, failure, playing, said, script, start

DOWN = "force_mode(p[0,0,0,0,0,0], [0,0,1,0,0,0], [0,0,-20,0,0,0], 2, [2,2,1.5,1,1,1])"
ENABLE = "ft_rtde_input_enable(True, 0.3, [0.1, 0, 0], [0, 0, 0])"
SEVEN = (0.0, 0.0, 7.0, 0.0, 0.0, 0.0)


def sensed(robot, ticks, wrench=SEVEN):
    """Tick while a force sensor repeats its value."""
    for _ in range(ticks):
        robot.send(f.SetExternalWrench, wrench=wrench)
        robot.tick()
    return robot.states[-1]


def test_force_mode_waits_for_the_first_value_of_an_external_sensor():
    robot, _ = feeling()
    start(robot, ENABLE, "sleep(9)")
    state = robot.tick(20)
    assert state.flange_wrench == pytest.approx([0.0] * 6)  # the arm's own, until the other says something
    for refused in (force_mode(robot), robot.send(f.Freedrive), robot.send(f.ZeroFtsensor)):
        assert isinstance(refused, Refused)
        assert "external force sensor" in refused.why
    assert sensed(robot, 2).flange_wrench == pytest.approx([0.0, 0.0, 7.0, 0.0, -0.7, 0.0])
    assert force_mode(robot) == Accepted(id=1)


def test_force_mode_ends_when_an_external_sensor_is_silent():
    robot, _ = feeling(clock="realtime")
    start(robot, ENABLE, "sync()", DOWN, "sleep(9)")
    sensed(robot, 200)
    assert robot.controller.motion.activity is Activity.GUIDED
    assert "motion_stopped" not in robot.kinds()
    robot.tick(45)
    assert robot.controller.motion.activity is Activity.GUIDED
    robot.tick(10)
    (stopped,) = robot.told("motion_stopped")
    assert "external force sensor" in stopped.why
    assert "100 ms" in stopped.why
    (ended,) = robot.told("program_stopped")
    assert ended.why == stopped.why
    robot.until_rest()
    assert robot.tick(2).flange_wrench == pytest.approx([0.0] * 6)


def test_an_external_sensor_is_dropped_after_the_program_or_a_reset():
    robot, _ = feeling()
    for end in (lambda: robot.tick(100), lambda: robot.send(SimulationReset)):
        start(robot, ENABLE, "sleep(.1)")
        assert sensed(robot, 20).flange_wrench[2] == pytest.approx(7.0)
        end()
        assert robot.tick(2).flange_wrench == pytest.approx([0.0] * 6)
        start(robot, ENABLE, "sleep(.1)")  # and an old value is no value
        robot.tick(20)
        assert isinstance(force_mode(robot), Refused)
        robot.tick(60)


def test_both_sensors_are_monitored_for_excessive_force():
    robot, plant = feeling()
    start(robot, ENABLE, "sleep(9)")
    sensed(robot, 20)
    plant.pushed[:2] = 200.0, 200.0
    sensed(robot, 5)
    assert protective(robot) == []
    sensed(robot, 5)
    assert "force at the tool is 283 N, above 250 N" in protective(robot)[0]
    assert robot.told("protective_stop")[0].code == "limit_force"
    robot, plant = feeling()
    start(robot, ENABLE, "sleep(9)")
    sensed(robot, 20, (0.0, 260.0, 0.0, 0.0, 0.0, 0.0))
    assert "force at the tool is 260 N, above 250 N" in protective(robot)[0]


def test_the_force_zero_is_dropped_when_the_sensor_changes():
    robot, plant = feeling()
    plant.pushed[2] = 5.0
    robot.tick()
    assert robot.send(f.ZeroFtsensor) == Done()
    start(robot, ENABLE, "sync()", "sync()", "textmsg(get_tcp_force()[2])", "zero_ftsensor()", "sync()",
          "textmsg(get_tcp_force()[2])", "sleep(.1)")  # fmt: skip
    sensed(robot, 40)
    rotation = KINEMATICS.pose(np.array(URSIM))[0]
    assert [float(text) for text in said(robot)] == pytest.approx([7.0 * rotation[2, 2], 0.0], abs=1e-6)
    robot.tick(60)  # the program has ended: the arm's own sensor counts, and nothing as its zero
    assert robot.controller.io().tcp_force_zero is None
    assert robot.controller.forces.wrench()[2] == pytest.approx(5.0)
    robot.send(f.ZeroFtsensor)
    robot.send(SimulationReset)
    robot.tick()
    assert robot.controller.io().tcp_force_zero is None


@pytest.mark.parametrize("compliant", [(False, False, True, False, False, False), (True,) * 6])
def test_a_non_finite_force_stops_the_arm(compliant):
    robot, plant = feeling()
    force_mode(robot, compliant)
    robot.tick(20)
    plant.pushed[2] = np.nan
    robot.tick(5)
    plant.pushed[2] = 0.0
    robot.until_rest()
    assert "motion_stopped" in robot.kinds()
    assert np.isfinite(robot.column("reference_q")).all()


@pytest.mark.parametrize("move", ["movel({}, a=.5, v=.02)", "servoc({}, a=.5, v=.02)"])
@pytest.mark.parametrize("how", ["pause", "protective stop", "end_force_mode"])
def test_a_move_in_force_mode_does_not_continue_without_it(how, move):
    robot, _ = feeling()
    there = "pose_trans(p[0.05,0,0,0,0,0], get_target_tcp_pose())"
    start(robot, DOWN, move.format(there))
    robot.tick(100)
    if how == "pause":
        assert robot.send(ProgramPause) == Done()
    elif how == "protective stop":
        robot.controller.motion.protect("a test")
    else:
        robot.send(f.EndForceMode)
    robot.until_rest()
    here = places(robot)[-1]
    if how == "protective stop":
        robot.send(c.UnlockProtectiveStop)
    if how != "end_force_mode":  # which ends the program, as any stop of a client
        robot.send(ProgramPlay)
        robot.tick(50)
        assert "force mode has ended" in failure(robot).why
    assert not playing(robot)
    assert np.abs(places(robot)[-1] - here).max() < 1e-4


def test_a_move_continues_after_a_pause_if_a_thread_restarts_force_mode():
    robot, plant = touching(1e4)
    start(robot, *KEEP, "sleep(.3)",
          "movel(pose_trans(p[0.01,0,0,0,0,0], get_target_tcp_pose()), a=.5, v=.02)", "textmsg(1)",
          "kill t")  # fmt: skip
    pressed(robot, plant, 220)
    here = places(robot)[-1]
    robot.send(ProgramPause)
    robot.until_rest()
    robot.send(ProgramPlay)
    forces = pressed(robot, plant, 550)
    assert said(robot) == ["1"]
    assert failure(robot) is None
    assert places(robot)[-1][0] - here[0] > 0.005
    assert np.abs(forces[400:] - 20.0).max() < 2.0


KEEP = ("thread keep():", "while True:", DOWN, "sync()", "end", "end", "t = run keep()")


def test_force_mode_of_one_thread_applies_to_moves_of_another():
    """As PolyScope exports it: one thread calls force_mode in every step, while moves run in another."""
    robot, plant = touching(1e4)
    forces = finished(
        robot, plant, "here = get_target_tcp_pose()", *KEEP,
        "movel(pose_trans(p[0.01,0,0,0,0,0], here), a=.5, v=.05, r=.002)", "sleep(.1)",
        "movel(pose_trans(p[0.02,0,0,0,0,0], here), a=.5, v=.05)", "sleep(.5)", "textmsg(1)", "kill t",
        "end_force_mode()", "stopl(5)",
    )  # fmt: skip
    assert said(robot) == ["1"]
    assert max(forces) == pytest.approx(20.0, abs=1.5)


def test_payload_inertia_is_not_taken_for_a_force():
    arm = load("ur30").quiet().without_floor()
    robot, plant = touching(0.0, arm=arm, mass=30.0, q=(0.0, -1.3, 1.3, -1.57, -1.57, 0.0))
    felt = []
    for sign in (1.0, -1.0):
        robot.send(m.SpeedJ, qd=tuple(sign * np.array([2.0, 2.0, -2.0, 0.0, 0.0, 0.0])), acceleration=25.0)
        for _ in range(150):
            robot.tick()
            felt.append(np.linalg.norm(robot.controller.forces.felt(robot.controller.cycle.sample)[:3]))
    assert min(sorted(felt)[-10:]) > 250.0  # as UR's get_tcp_force would have it, with the inertia
    assert protective(robot) == []
    plant.pushed = np.array([0.0, 300.0, 0.0])
    robot.tick(10)
    assert "above 250 N" in protective(robot)[0]


def test_late_set_points_are_not_taken_for_a_contact():
    """Set-points pause for twelve ticks four times a second, as on a network, and the next tick catches up."""
    robot, _ = touching(0.0, mass=3.0)
    start(robot, "thread watch():", "s = 0", "while True:", "s = s + tool_contact(get_actual_tcp_speed())",
          "write_output_integer_register(0, s)", "sync()", "end", "end", "t = run watch()",
          "q = get_target_joint_positions()", "i = 0", "while i < 600:", "k = 1",
          "if i % 125 > 112:", "k = 0", "elif i % 125 == 0:",
          "k = 13", "end", "d = k * 0.001",
          "q = [q[0]+d, q[1], q[2]+0.7*d, q[3]-0.2*d, q[4]-d, q[5]-0.5*d]",
          "servoj(q, t=0.002, lookahead_time=0.03, gain=2000)", "i = i + 1", "end", "stopj(5)")  # fmt: skip
    robot.tick(750)
    assert failure(robot) is None
    assert np.ptp([state.actual_q[0] for state in robot.states]) > 0.45
    assert robot.controller.io().output_int_register[0] == 0


def test_zeroing_the_force_restarts_contact_detection():
    robot, plant = feeling(payload=NOTHING)
    plant.pushed[2] = 30.0
    contact = "tool_contact([0, 0, -1, 0, 0, 0])"
    start(robot, f"while True:\n write_output_integer_register(0, {contact})\n sync()\n end")
    robot.tick(100)
    robot.send(f.ZeroFtsensor)
    robot.tick(100)
    assert robot.controller.io().output_int_register[0] == 0
    plant.pushed[2] = 45.0
    robot.tick(50)
    assert robot.controller.io().output_int_register[0] > 0


OFFSETS = st.tuples(*[st.floats(-0.2, 0.2)] * 3, *[st.floats(-1.0, 1.0)] * 3)
PROGRAMS = (
    (DOWN, "movel(pose_trans(p[0.02,0,0.01,0,0,0], get_target_tcp_pose()), a=1, v=.1)", "end_force_mode()"),
    (*KEEP, "movel(pose_trans(p[0.02,0,0,0,0,0], get_target_tcp_pose()), a=1, v=.1, r=.005)", "sleep(.02)",
     "movej(get_inverse_kin(pose_trans(p[0,0,0.02,0,0,0], get_target_tcp_pose())), a=1, v=.1)", "kill t", "stopl(5)"),
    (ENABLE, "sync()", "zero_ftsensor()", DOWN, "set_tcp(p[0,0,.1,0,0,0])", "sleep(.1)"),
    ("freedrive_mode([1,1,0,0,0,1])", "sleep(.1)", "end_freedrive_mode()", "speedl([0,0,.05,0,0,0], 1, .05)"),
    (ENABLE, "sleep(1)"),
)  # fmt: skip
COMMANDS = st.one_of(
    st.builds(
        lambda compliant, wrench, kind, damping: (f.ForceMode, {
            "compliant": compliant, "wrench": wrench, "limits": (0.2,) * 3 + (1e3,) * 3, "frame_type": kind,
            "damping": damping}),
        st.tuples(*[st.booleans()] * 6), st.tuples(*[st.floats(-60.0, 60.0)] * 3, *[st.floats(-8.0, 8.0)] * 3),
        st.sampled_from([1, 2, 3]), st.floats(0.0, 1.0)),
    st.builds(lambda free, frame: (f.Freedrive, {"free": free, "frame": frame}), st.tuples(*[st.booleans()] * 6),
              st.sampled_from(["base", "tool"])),
    st.builds(lambda xd: (m.SpeedL, {"xd": xd}), st.tuples(*[st.floats(-0.2, 0.2)] * 6)),
    st.builds(lambda qd: (m.SpeedJ, {"qd": qd}), st.tuples(*[st.floats(-0.5, 0.5)] * 6)),
    st.builds(lambda q: (m.ServoJ, {"q": tuple(np.add(URSIM, q).tolist())}), st.tuples(*[st.floats(-0.2, 0.2)] * 6)),
    st.builds(lambda offset: (SetTcp, {"offset": offset}), OFFSETS),
    st.builds(lambda mass: (c.SetPayload, {"mass": mass, "com": (0.0, 0.0, 0.05), "inertia": (0.0,) * 6}),
              st.floats(0.0, 5.0)),
    st.builds(lambda wrench: (f.SetExternalWrench, {"wrench": wrench}), st.tuples(*[st.floats(-90.0, 90.0)] * 6)),
    st.builds(lambda lines: (ProgramRun, {"text": script(*lines)}), st.sampled_from(PROGRAMS)),
    st.builds(lambda push: ("push", push), st.tuples(*[st.floats(-160.0, 160.0)] * 3)),
    st.just(("push", (np.nan, 0.0, 0.0))),
    st.sampled_from([(one, {}) for one in (
        f.EndForceMode, f.ZeroFtsensor, m.StopJ, ProgramPause, ProgramPlay, ProgramStop, c.Pause, c.PowerOff, c.PowerOn,
        c.UnlockProtectiveStop, SimulationReset)]),
    st.sampled_from([("protective stop", ()), ("safeguard", (True,)), ("safeguard", (False,))]),
    st.builds(lambda fraction: (c.SetSpeed, {"fraction": fraction}), st.floats(0.05, 1.0)),
)  # fmt: skip


@examples(25)
@given(st.lists(st.tuples(COMMANDS, st.integers(1, 40)), min_size=1, max_size=8), st.booleans())
def test_force_control_keeps_limits_and_reports_its_end_for_random_commands(sequence, lockstep):
    robot, plant = feeling(clock="free" if lockstep else "realtime", lease_s=3600.0)
    guidance, motion = robot.controller.guidance, robot.controller.motion
    limits, given_way, reference = UR5E_IN_AIR.limits, False, [robot.states[-1].reference_q] * 2
    for (kind, given_), ticks in [*sequence, ((m.StopJ, {}), 600)]:
        placements = robot.controller.cycle.placements
        if kind == "push":
            plant.pushed[:3] = given_
        elif kind == "protective stop":
            motion.protect("a test")
        elif kind == "safeguard":
            robot.controller.safety.safeguard(stopped=given_[0])
        else:
            robot.send(kind, **given_)
        for _ in range(ticks):
            told = len(robot.events)
            state = robot.tick()
            if robot.controller.cycle.placements != placements:
                placements, reference = robot.controller.cycle.placements, [state.reference_q] * 2
            reference = [*reference[-2:], state.reference_q]
            steps = np.diff(reference, axis=0) / H
            assert np.abs(steps).max() <= min(limits.velocity) * (1.0 + 1e-6)
            assert np.abs(np.diff(steps, axis=0)).max() / H <= min(limits.acceleration) * (1.0 + 1e-6) + 1e-6
            gives = guidance.compliant is not None
            if gives:
                assert motion.activity is Activity.GUIDED
                assert (state.robot_mode, state.safety_mode) == (7, 1)
            gave, given_way = given_way, gives
            if gave and not gives:
                ends = [event for event in robot.events[told:] if event.kind == "motion_stopped"]
                assert ends
                assert all(event.why for event in ends)
    ends = [event for event in robot.events if event.kind in {"motion_done", "motion_stopped"}]
    assert len(ends) == robot.kinds().count("motion_started")
    assert guidance.compliant is None
