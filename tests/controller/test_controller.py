"""The controller: commands in, replies, states and events out."""

import msgspec
import numpy as np
import pytest

from tvist_controller.about import info_of
from tvist_controller.controller import Controller
from tvist_controller.loopback import LoopbackHost
from tvist_controller.setup import paper_payload
from tvist_lab.in_process import free_setup
from tvist_protocol import commands as c
from tvist_protocol.codec import check, decode
from tvist_protocol.io import Io
from tvist_protocol.replies import Accepted, Done
from tvist_protocol.simulation import SimulationReset
from tvist_protocol.stream import State

from .robots import Q1, Q2, Q3, ROUNDING, UR5E, H, Robot, bits, calibration, cut, setup

Q1_, Q2_, Q3_ = tuple(Q1), tuple(Q2), tuple(Q3)
DISC = paper_payload(UR5E)


def test_a_motion_starts_at_the_next_tick_and_is_done_at_rest(robot):
    assert robot.send(c.MoveJ, q=Q2_) == Accepted(id=1)
    last = robot.until_rest()
    told = [(event.kind, event.id, event.tick) for event in robot.events]
    assert told == [("motion_started", 1, 1), ("motion_done", 1, last.tick)]
    assert last.reference_q == list(Q2_)


def test_a_stop_reports_a_limited_deceleration(robot):
    robot.move()
    robot.send(c.Stop, deceleration=1e5)
    robot.tick()
    assert "limited" in robot.events[-1].why
    robot.until_rest()
    robot.stream()
    robot.send(c.Stop, deceleration=1e5)
    robot.tick()
    told = [(event.kind, event.code) for event in robot.events[-2:]]
    assert told == [("stream_stopped", None), ("warning", "limit_acceleration")]


def test_a_stop_at_rest_changes_nothing():
    robot, twin = Robot(), Robot()
    assert robot.send(c.Stop) == Done()
    robot.tick(50)
    twin.tick(50)
    assert bits(robot.states) == bits(twin.states)
    assert robot.events == []


def test_choosing_an_estimator_emits_an_event(robot):
    assert robot.send(c.SetEstimator, name="fixed", f_d=(6.7,), zeta=(0.34,)) == Done()
    state = robot.tick()
    assert (state.estimated_f_d, state.estimated_zeta) == ([6.7], [0.34])
    content = msgspec.to_builtins(calibration())
    assert robot.send(c.SetEstimator, name="polynomial", calibration=content) == Done()
    assert robot.tick().estimated_f_d == pytest.approx([6.7], abs=0.05)
    assert robot.kinds() == ["shaper_changed", "shaper_changed"]
    assert robot.controller.assumed.source.name == "polynomial"


def test_declaring_a_payload_does_not_change_the_carried_one(robot):
    moments = robot.tick().target_moment
    assert robot.send(c.SetPayload, mass=1.0, com=DISC.com, inertia=DISC.inertia) == Done()
    assert abs(robot.tick().target_moment[1]) < abs(moments[1])
    assert robot.controller.cycle.plant.payload.mass == 5.0
    assert info_of(robot.controller).payload.mass == 1.0


def test_a_calibration_for_another_payload_causes_a_warning():
    robot = Robot(calibration=calibration(mass=2.0))
    robot.tick()
    assert [(e.kind, e.code) for e in robot.events] == [("warning", "payload_mismatch")]
    assert "Take a modal calibration" in robot.events[0].why
    assert not info_of(robot.controller).calibration.fits_payload
    robot.send(c.SetPayload, mass=2.0, com=DISC.com, inertia=DISC.inertia)
    robot.tick()
    assert len(robot.events) == 1
    assert info_of(robot.controller).calibration.fits_payload
    robot.send(c.SetPayload, mass=3.0, com=DISC.com, inertia=DISC.inertia)
    robot.tick()
    assert robot.events[-1].code == "payload_mismatch"


def test_a_reset_in_motion_stops_it_and_restores_the_initial_state():
    robot, fresh = Robot(), Robot(q=Q3_, seed=5)
    motion = robot.move()
    robot.send(SimulationReset, q=Q3_, seed=5)
    robot.states.clear()
    for each in (robot, fresh):
        each.send(c.MoveJ, q=Q2_)
        each.tick(400)
    assert [(e.kind, e.id) for e in robot.events[:3]] == [
        ("motion_started", motion),
        ("motion_stopped", motion),
        ("motion_started", motion + 1),
    ]
    for name in ("target_q", "target_moment", "actual_q", "actual_tool_accelerometer"):
        assert (robot.column(name) == fresh.column(name)).all()


def test_an_expired_lease_stops_a_moving_arm():
    robot = Robot(clock="realtime", lease_s=1.0)
    motion = robot.move(501)
    told = [(event.kind, event.id, event.tick) for event in robot.events[1:]]
    assert told == [("lease_lost", None, 501), ("motion_stopped", motion, 501)]
    robot.until_rest()
    hardest, q = min(UR5E.limits.acceleration), robot.column("target_q")
    assert np.abs(robot.column("target_qdd")).max() <= hardest + ROUNDING
    assert np.abs(np.diff(q, 2, axis=0)).max() / H**2 <= hardest + ROUNDING
    assert robot.tick(300).target_q == q[-1].tolist()
    assert robot.send(c.KeepAlive).code == "no_control"
    assert robot.send(c.TakeControl, client="b").token


def test_missed_ticks_are_published(robot):
    robot.controller.counters.missed_ticks += 3
    assert robot.tick().missed_ticks == 3


def test_reading_the_truth_does_not_change_the_run():
    told, untold = Robot(), Robot()
    for _ in range(120):
        told.tick()
        told.controller.truth()
        untold.tick()
    assert bits(told.states) == bits(untold.states)


@pytest.mark.parametrize("joints", [1, 2, 5])
def test_robots_with_fewer_joints_support_all_basic_commands(joints):
    robot = Robot(cut(joints))
    target = tuple(np.array(robot.controller.setup.q) + 0.2)
    assert robot.send(c.MoveJ, q=target) == Accepted(id=1)
    robot.until_rest()
    robot.stream(50, period=0.008)
    assert robot.send(c.ServoStop) == Done()
    assert robot.until_rest().setpoint_sequence is None
    assert robot.kinds().count("stream_stopped") == 1
    robot.send(c.MoveJ, q=tuple(-angle for angle in target))
    robot.tick(100)
    assert robot.send(c.Stop) == Done()
    robot.until_rest()
    assert robot.send(SimulationReset, q=target) == Done(tick=robot.states[-1].tick)
    state = robot.tick()
    truth = check(robot.controller.truth())
    assert {len(state.actual_q), len(state.target_moment), len(truth.motor_q)} == {joints}
    assert len(state.actual_TCP_pose) == 6
    assert robot.send(c.MoveJ, q=Q1_).code == "out_of_range"


def test_an_invalid_setup_raises_value_error():
    for wrong in (
        {"shaper": "zvdddd"},
        {"q": Q1_[:3]},
        {"calibration": calibration(f_d_range=(0.5, 16.0)), "shaper": "ei3"},
        {"calibration": calibration(joints=(1, 6))},
    ):
        with pytest.raises(ValueError, match=r"\w+"):
            Controller(setup(**wrong))


def test_the_state_before_the_first_tick_is_the_arm_at_rest_at_its_start(robot):
    first = robot.controller.latest
    assert (first.tick, first.timestamp) == (0, 0.0)
    assert first.reference_q == first.target_q == list(UR5E.poses["Q1"])
    assert set(first.target_qd + first.target_qdd) == {0.0}
    after = robot.tick()
    assert first.actual_q == pytest.approx(after.actual_q, abs=1e-9)
    assert first.actual_moment == pytest.approx(after.actual_moment, abs=1e-6)
    assert first.estimated_f_d == after.estimated_f_d
    for mode in ("robot_mode", "safety_mode", "runtime_state"):
        assert getattr(first, mode) == getattr(after, mode)


def test_an_in_process_subscriber_gets_the_present_message_without_side_effects():
    told = []
    asked, unasked = LoopbackHost(free_setup()), LoopbackHost(free_setup())
    for _ in range(3):  # to ask often changes as little as to ask once
        asked.subscribe("state", lambda data: told.append(decode(State, data)))
    asked.subscribe("io", lambda data: told.append(decode(Io, data)))
    assert [message.tick for message in told] == [0, 0, 0, 1]
    for host in (asked, unasked):
        host.controller.tick()
    assert asked.controller.latest == unasked.controller.latest
