"""The controller: commands in, replies, states and events out."""

import msgspec
import numpy as np
import pytest

from tvist_controller.about import info_of
from tvist_controller.controller import Controller
from tvist_controller.line.line_mode import LineMode
from tvist_controller.motion.setpoints import TIMEOUT
from tvist_controller.setup import body, paper_payload
from tvist_protocol import commands as c
from tvist_protocol.codec import check, encode
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.simulation import SimulationInject, SimulationReset, SimulationStep, StepSetpoint
from tvist_protocol.stream import Telemetry
from tvist_protocol.values import Payload

from .robots import PAPER, Q1, Q2, Q3, ROUNDING, UR5E, H, Robot, calibration, cut, setup

Q1_, Q2_, Q3_ = tuple(Q1), tuple(Q2), tuple(Q3)
DISC = paper_payload(UR5E)
IMPOSSIBLE = (1.0, 0.9, 0.0, 1.0, 0.0, 1.0)
HEAVY = Payload(mass=6.0, com=(0.0, 0.0, 0.04), inertia=(0.01, 0.0, 0.0, 0.01, 0.0, 0.01))


def bits(states):
    return [encode(state) for state in states]


def moving(robot: Robot, ticks: int = 200) -> int:
    """Id of a motion that has been under way for some ticks."""
    accepted = robot.send(c.MoveJ, q=Q3_)
    robot.tick(ticks)
    return accepted.id


def streaming(robot: Robot, ticks: int = 100, **limits) -> None:
    """A stream of small set-points that is under way."""
    assert robot.send(c.ServoStart, **limits) == Done()
    for k in range(ticks):
        robot.setpoint(k, Q1 + 0.1 * (1 - np.cos(3.0 * k * H)))
        robot.tick()


# ---------------------------------------------------------------- happy paths


def test_a_move_is_accepted_announced_and_done():
    robot = Robot()
    assert robot.send(c.MoveJ, q=Q2_) == Accepted(id=1)
    robot.tick()
    assert [(e.kind, e.id, e.tick) for e in robot.events] == [("motion_started", 1, 1)]
    last = robot.until_rest()
    assert [(e.kind, e.id) for e in robot.events[1:]] == [("motion_done", 1)]
    assert robot.events[-1].tick == last.tick
    assert last.reference_q == list(Q2_)


def test_ids_count_up():
    robot = Robot()
    ids = []
    for angle in (0.01, 0.02, 0.03):
        ids.append(robot.send(c.MoveJ, q=tuple(Q1 + angle)).id)
        robot.until_rest()
    assert ids == [1, 2, 3]


def test_a_move_to_where_it_is_is_done_in_a_tick():
    robot = Robot()
    robot.send(c.MoveJ, q=Q1_)
    robot.tick()
    assert robot.kinds() == ["motion_started", "motion_done"]


def test_a_stream_is_followed_and_stopped():
    robot = Robot()
    streaming(robot, 300)
    assert robot.states[-1].setpoint_sequence == 299
    assert robot.column("reference_q")[-1] == pytest.approx(Q1 + 0.1 * (1 - np.cos(3.0 * 299 * H)), abs=0)
    assert robot.send(c.ServoStop) == Done()
    robot.until_rest()
    assert robot.kinds() == ["stream_stopped"]
    assert robot.states[-1].setpoint_sequence is None
    assert robot.send(c.MoveJ, q=Q1_) == Accepted(id=1)


def test_an_accepted_stop_ends_the_motion_past_the_filter():
    robot = Robot()
    motion = moving(robot)
    assert robot.send(c.Stop) == Done()
    robot.until_rest()
    assert [(e.kind, e.id) for e in robot.events[1:]] == [("motion_stopped", motion)]
    assert robot.events[-1].tick == 201
    assert robot.states[-1].tick < 201 + 150


def test_a_stop_whose_deceleration_is_limited_says_so():
    robot = Robot()
    moving(robot)
    robot.send(c.Stop, deceleration=1e5)
    robot.tick()
    assert "limited" in robot.events[-1].why
    robot.until_rest()
    streaming(robot)
    robot.send(c.Stop, deceleration=1e5)
    robot.tick()
    assert [(e.kind, e.code) for e in robot.events[-2:]] == [
        ("stream_stopped", None),
        ("warning", "limit_acceleration"),
    ]


def test_a_stop_at_rest_is_done_and_nothing_happens():
    robot, twin = Robot(), Robot()
    assert robot.send(c.Stop) == Done()
    robot.tick(50)
    twin.tick(50)
    assert bits(robot.states) == bits(twin.states)
    assert robot.events == []


def test_a_shaper_is_chosen_and_announced():
    robot = Robot()
    assert robot.send(c.SetShaper, name="ei") == Done()
    state = robot.tick()
    assert robot.kinds() == ["shaper_changed"]
    assert "ei with estimator fixed" in robot.events[0].why
    assert state.shaper_delay == pytest.approx(0.1)


def test_an_estimator_is_chosen_and_announced():
    robot = Robot()
    assert robot.send(c.SetEstimator, name="fixed", f_d=(6.7,), zeta=(0.34,)) == Done()
    state = robot.tick()
    assert (state.estimated_f_d, state.estimated_zeta) == ([6.7], [0.34])
    content = msgspec.to_builtins(calibration())
    assert robot.send(c.SetEstimator, name="polynomial", calibration=content) == Done()
    assert robot.tick().estimated_f_d == pytest.approx([6.7], abs=0.05)
    assert robot.kinds() == ["shaper_changed", "shaper_changed"]
    assert robot.controller.assumed.source.name == "polynomial"


def test_a_payload_is_declared_and_the_arm_keeps_what_it_carries():
    robot = Robot()
    moments = robot.tick().target_moment
    assert robot.send(c.SetPayload, mass=1.0, com=DISC.com, inertia=DISC.inertia) == Done()
    assert abs(robot.tick().target_moment[1]) < abs(moments[1])
    assert robot.controller.cycle.plant.payload.mass == 5.0
    assert info_of(robot.controller).payload.mass == 1.0


def test_a_calibration_for_another_payload_is_a_warning_and_stands_in_info():
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


def test_a_reset_puts_the_arm_elsewhere_and_keeps_lease_and_tick():
    robot = Robot()
    robot.tick(10)
    assert robot.send(SimulationReset, q=Q3_, shaper="none") == Done(tick=10)
    state = robot.tick()
    assert state.tick == 11
    assert state.target_q == list(Q3_)
    assert state.shaper_delay == 0.0
    assert robot.send(c.KeepAlive) == Done()


def test_a_reset_in_mid_motion_stops_it_and_everything_is_as_new():
    robot, fresh = Robot(), Robot(q=Q3_, seed=5)
    motion = moving(robot)
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


def test_a_reset_without_a_pose_stays_where_it_is():
    robot = Robot()
    moving(robot)
    robot.send(SimulationReset)
    assert robot.tick().target_q == pytest.approx(robot.states[-2].target_q, abs=1.5 * H * 2)
    assert robot.controller.cycle.mode.at_rest


def test_a_reset_keeps_the_seed_that_was_chosen_last():
    robot = Robot()
    noise = []
    for seed in (7, None):
        robot.send(SimulationReset, q=Q1_, seed=seed)
        noise.append(robot.tick().actual_tool_accelerometer)
    assert noise[0] == noise[1]


def test_a_reset_changes_what_is_carried_and_not_what_is_declared():
    robot = Robot()
    declared = robot.tick().target_moment
    robot.send(SimulationReset, payload=HEAVY)
    state = robot.tick()
    assert state.target_moment == declared
    assert robot.controller.cycle.plant.payload.mass == HEAVY.mass
    assert robot.controller.declared == DISC


def test_a_step_is_granted_with_its_last_tick():
    robot = Robot()
    robot.tick(3)
    assert robot.send(SimulationStep, ticks=10) == Done(tick=13)
    robot.send(c.ServoStart)
    setpoints = (StepSetpoint(sequence=0, q=Q1_),)
    assert robot.send(SimulationStep, ticks=1, setpoints=setpoints) == Done(tick=4)


# ---------------------------------------------------------------- refusals

WITH_TOKEN = [
    (c.KeepAlive, {}),
    (c.ReleaseControl, {}),
    (c.MoveJ, {"q": Q2_}),
    (c.ServoStart, {}),
    (c.ServoStop, {}),
    (c.Stop, {}),
    (c.SetShaper, {"name": "ei"}),
    (c.SetEstimator, {"name": "fixed", "f_d": (8.0,), "zeta": (0.1,)}),
    (c.SetPayload, {"mass": 1.0, "com": DISC.com, "inertia": DISC.inertia}),
    (SimulationReset, {"q": Q2_}),
    (SimulationStep, {"ticks": 1}),
    (c.PowerOn, {}),
    (c.PowerOff, {}),
    (c.UnlockProtectiveStop, {}),
    (SimulationInject, {"fault": "protective_stop"}),
]
WRONG = [
    (c.TakeControl, {"client": "b"}, "no_control", "token"),
    (c.TakeControl, {"client": "a", "protocol": 2}, "unsupported_version", "protocol"),
    (c.MoveJ, {"q": Q2_[:5]}, "out_of_range", "q"),
    (c.MoveJ, {"q": (7.0, *Q2_[1:])}, "limit_position", "q[0]"),
    (c.MoveJ, {"q": Q2_, "velocity": 4.0}, "limit_velocity", "velocity"),
    (c.MoveJ, {"q": Q2_, "acceleration": 41.0}, "limit_acceleration", "acceleration"),
    (c.MoveJ, {"q": Q2_, "jerk": 3000.0}, "out_of_range", "jerk"),
    (c.MoveJ, {"q": Q2_, "jerk": 1e-300}, "out_of_range", "jerk"),
    (c.MoveJ, {"q": (6.28, *Q2_[1:]), "velocity": 5e-324}, "out_of_range", "velocity"),
    (c.ServoStart, {"velocity": 4.0}, "limit_velocity", "velocity"),
    (c.ServoStart, {"acceleration": 1e-9}, "out_of_range", "acceleration"),
    (c.SetShaper, {"name": "zvdddd"}, "unknown_shaper", "name"),
    (c.SetShaper, {"name": "elastic-17"}, "out_of_range", "name"),
    (c.SetShaper, {"name": "zv", "modes": 2}, "out_of_range", "modes"),
    (c.SetEstimator, {"name": "modal"}, "missing_field", "calibration"),
    (c.SetEstimator, {"name": "neural"}, "unknown_estimator", "name"),
    (c.SetShaper, {"name": "auto"}, "out_of_range", "name"),
    (c.SetEstimator, {"name": "fixed"}, "missing_field", "f_d"),
    (c.SetEstimator, {"name": "fixed", "f_d": (0.1,), "zeta": (0.1,)}, "out_of_range", "f_d"),
    (c.SetEstimator, {"name": "polynomial"}, "missing_field", "calibration"),
    (c.SetEstimator, {"name": "polynomial", "calibration": "x"}, "unknown_calibration", "calibration"),
    (c.SetPayload, {"mass": 5.1, "com": DISC.com, "inertia": DISC.inertia}, "out_of_range", "mass"),
    (c.SetPayload, {"mass": 1.0, "com": DISC.com, "inertia": IMPOSSIBLE}, "out_of_range", "inertia"),
    (SimulationReset, {"q": Q2_[:2]}, "out_of_range", "q"),
    (SimulationReset, {"q": Q2_, "shaper": "zvv"}, "unknown_shaper", "shaper"),
    (
        SimulationReset,
        {"q": Q2_, "payload": msgspec.structs.replace(HEAVY, inertia=IMPOSSIBLE)},
        "out_of_range",
        "payload.inertia",
    ),
    (SimulationInject, {"fault": "gravity"}, "unknown_fault", "fault"),
    (SimulationInject, {"fault": "nan", "value": 1.0}, "out_of_range", "value"),
    (SimulationInject, {"fault": "torque", "value": 1.0, "seconds": 0.1}, "missing_field", "joint"),
    (
        SimulationInject,
        {"fault": "torque", "joint": 6, "value": 1.0, "seconds": 0.1},
        "out_of_range",
        "joint",
    ),
]
AT_REST_ONLY = [c.MoveJ, c.ServoStart]


def assert_unchanged(robot: Robot, twin: Robot, ticks: int = 50) -> None:
    """The next states and events are, bit for bit, those of one that did not get the command."""
    for each in (robot, twin):
        each.states.clear()
        each.events.clear()
        each.tick(ticks)
    assert bits(robot.states) == bits(twin.states)
    assert robot.events == twin.events
    hidden = [(each.controller.declared, each.controller.assumed.source) for each in (robot, twin)]
    assert hidden[0] == hidden[1]


def alike(begin):
    """A robot and its twin, both of which do the same."""
    robot, twin = Robot(), Robot()
    begin(robot)
    begin(twin)
    return robot, twin


@pytest.mark.parametrize("begin", [Robot.tick, moving, streaming])
def test_wrong_content_is_refused_before_the_arm_s_motion_is_looked_at(begin):
    robot, twin = alike(begin)
    for kind, fields, code, where in WRONG:
        reply = robot.send(kind, **fields)
        assert isinstance(reply, Refused), (kind, fields)
        assert (reply.code, reply.where) == (code, where)
        assert reply.why
        assert_unchanged(robot, twin, 3)
    assert_unchanged(robot, twin)


def test_a_stale_token_is_refused_first_of_all():
    robot, twin = alike(moving)
    wrong = [(kind, fields) for kind, fields, _, _ in WRONG if kind is not c.TakeControl]
    for kind, fields in WITH_TOKEN + wrong:
        for token in ("", "b#1"):
            reply = robot.send(kind, **(fields | {"token": token}))
            assert (reply.code, reply.where) == ("stale_token", "token"), (kind, fields)
        assert_unchanged(robot, twin, 3)
    assert_unchanged(robot, twin)


def test_without_a_lease_there_is_no_control():
    robot = Robot()
    robot.send(c.ReleaseControl)
    for kind, fields in WITH_TOKEN:
        assert robot.send(kind, **fields).code == "no_control", kind


@pytest.mark.parametrize("begin", [moving, streaming])
@pytest.mark.parametrize(("kind", "fields"), [entry for entry in WITH_TOKEN if entry[0] in AT_REST_ONLY])
def test_what_needs_an_arm_at_rest_is_busy_in_motion(kind, fields, begin):
    robot, twin = alike(begin)
    assert robot.send(kind, **fields).code == "busy"
    assert_unchanged(robot, twin)


def test_without_a_stream_there_is_none_to_stop_or_to_step():
    robot = Robot()
    assert robot.send(c.ServoStop).code == "wrong_mode"
    setpoints = (StepSetpoint(sequence=0, q=Q1_),)
    reply = robot.send(SimulationStep, ticks=1, setpoints=setpoints)
    assert (reply.code, reply.where) == ("wrong_mode", "setpoints")


def test_a_step_s_set_points_are_checked():
    robot = Robot()
    robot.send(c.ServoStart)
    good, bad = StepSetpoint(sequence=0, q=Q1_), StepSetpoint(sequence=1, q=(9.0, *Q1_[1:]))
    reply = robot.send(SimulationStep, ticks=2, setpoints=(good, bad))
    assert (reply.code, reply.where) == ("limit_position", "setpoints[1].q[0]")
    reply = robot.send(SimulationStep, ticks=1, setpoints=(good, good))
    assert (reply.code, reply.where, reply.limit) == ("out_of_range", "setpoints", 1)


def test_a_move_that_would_last_for_hours_is_refused():
    wide = msgspec.structs.replace(UR5E.limits, position=(1e3,) * 6)
    robot = Robot(msgspec.structs.replace(UR5E, limits=wide))
    reply = robot.send(c.MoveJ, q=(900.0, *Q1_[1:]), velocity=0.01)
    assert (reply.code, reply.where) == ("out_of_range", "velocity")
    assert robot.send(c.MoveJ, q=Q2_) == Accepted(id=1)


# ---------------------------------------------------------------- set-points


@pytest.mark.parametrize(
    "setpoint",
    [
        {"token": ""},
        {"token": "old"},
        {"q": Q1_[:5]},
        {"q": (*Q1_, 0.0)},
        {"q": (7.0, *Q1_[1:])},
        {"q": (float("nan"), *Q1_[1:])},
    ],
)
def test_a_set_point_that_is_none_of_ours_is_counted_and_dropped(setpoint):
    robot, twin = Robot(), Robot()
    for each in (robot, twin):
        streaming(each)
    robot.setpoint(**({"sequence": 100, "q": Q1_} | setpoint))
    assert robot.controller.counters.setpoints_refused == 1
    assert_unchanged(robot, twin)


def test_counters_go_on_from_stream_to_stream_and_fit_the_wire():
    robot = Robot()
    for _ in range(2):
        streaming(robot, 20)
        robot.setpoint(3, Q1)
        robot.setpoint(2**64 - 1, Q1)
        robot.tick(5)
        robot.send(c.ServoStop)
        robot.until_rest()
    late, lost, _ = robot.controller.motion.streams.counters()
    assert late == 2
    assert 0 < lost <= 4000
    counts = dict.fromkeys(Telemetry.__struct_fields__, 0) | {"overloaded": False}
    check(Telemetry(**(counts | {"setpoints_lost": lost, "setpoints_late": late})))


# ---------------------------------------------------------------- the end of leases and streams


def stopped_within_limits(robot: Robot) -> None:
    robot.until_rest()
    hardest = min(UR5E.limits.acceleration)
    qdd, q = robot.column("target_qdd"), robot.column("target_q")
    assert np.abs(qdd).max() <= hardest + ROUNDING
    assert np.abs(np.diff(q, 2, axis=0)).max() / H**2 <= hardest + ROUNDING
    robot.tick(300)
    assert robot.states[-1].target_q == robot.states[-301].target_q


def test_a_lease_that_runs_out_in_mid_motion_stops_the_arm():
    robot = Robot(clock="realtime", lease_s=1.0)
    motion = moving(robot, 501)
    assert [(e.kind, e.id, e.tick) for e in robot.events[1:]] == [
        ("lease_lost", None, 501),
        ("motion_stopped", motion, 501),
    ]
    assert "expired" in robot.events[-1].why
    stopped_within_limits(robot)
    assert robot.send(c.KeepAlive).code == "no_control"
    assert robot.send(c.TakeControl, client="b").token


@pytest.mark.parametrize("clock", ["free", "lockstep"])
def test_where_time_is_the_client_s_nothing_times_out(clock):
    robot = Robot(clock=clock, lease_s=0.1)
    robot.send(c.ServoStart)
    robot.tick(1000)
    assert robot.events == []
    assert robot.send(c.KeepAlive) == Done()


@pytest.mark.parametrize("begun", [0, 7, 333])
def test_a_stream_without_set_points_is_stopped_after_a_quarter_of_a_second(begun):
    robot = Robot(clock="realtime")
    robot.tick(begun)
    robot.send(c.ServoStart)
    robot.tick(200)
    (event,) = robot.events
    assert event.kind == "stream_stopped"
    assert event.tick == begun + 1 + round(TIMEOUT / H)


def test_a_stream_that_falls_silent_in_mid_motion_stops_within_its_limits():
    robot = Robot(clock="realtime")
    streaming(robot, 150)
    robot.tick(130)
    assert robot.kinds() == ["stream_stopped"]
    stopped_within_limits(robot)
    assert robot.send(c.MoveJ, q=Q1_) == Accepted(id=1)


def test_releasing_control_in_motion_stops_the_arm():
    robot = Robot()
    motion = moving(robot)
    assert robot.send(c.ReleaseControl) == Done()
    robot.tick()
    assert [(e.kind, e.id) for e in robot.events[1:]] == [("motion_stopped", motion)]
    stopped_within_limits(robot)


def test_a_client_that_goes_takes_its_lease_and_its_motion_with_it():
    controller = Controller(setup())
    robot = Robot()
    robot.controller = controller
    robot.token = controller.receive(c.TakeControl(client="a"), session="1f").token
    motion = moving(robot)
    for other in (("b", "1f"), ("a", "2f"), ("a", "")):
        controller.client_gone(*other)
        assert controller.cycle.mode is not LineMode.STOPPING
    controller.client_gone("a", "1f")
    robot.tick()
    assert [(e.kind, e.id) for e in robot.events[1:]] == [("lease_lost", None), ("motion_stopped", motion)]
    stopped_within_limits(robot)


# ---------------------------------------------------------------- states, truth, determinism


def story(robot: Robot):
    robot.send(c.MoveJ, q=tuple(Q1 + 0.2))
    robot.until_rest()
    streaming(robot, 100)
    robot.send(c.Stop)
    robot.until_rest()
    robot.send(c.SetShaper, name="ei2")
    robot.send(c.MoveJ, q=Q3_)
    robot.tick(300)
    return bits(robot.states), robot.events


def test_equal_commands_and_seed_give_equal_bits():
    assert story(Robot(seed=4)) == story(Robot(seed=4))


def test_another_seed_gives_another_noise_and_the_same_reference():
    a, b = Robot(seed=1), Robot(seed=2)
    story(a)
    story(b)
    assert (a.column("target_q") == b.column("target_q")).all()
    assert (a.column("actual_tool_accelerometer") != b.column("actual_tool_accelerometer")).any(axis=1).all()


def test_ticks_and_timestamps_count_up():
    robot = Robot()
    robot.tick(500)
    assert [state.tick for state in robot.states] == list(range(1, 501))
    assert [state.timestamp for state in robot.states] == [tick * H for tick in range(1, 501)]


def test_a_state_is_what_the_wire_takes():
    robot = Robot()
    moving(robot, 10)
    for state in robot.states:
        check(state)
    check(robot.controller.truth())
    check(info_of(robot.controller))


def test_missed_ticks_are_published():
    robot = Robot()
    robot.controller.counters.missed_ticks += 3
    assert robot.tick().missed_ticks == 3


def test_the_truth_does_not_disturb():
    told, untold = Robot(), Robot()
    for _ in range(120):
        told.tick()
        told.controller.truth()
        untold.tick()
    assert bits(told.states) == bits(untold.states)


@pytest.mark.parametrize("joints", [1, 2, 5])
def test_a_robot_of_any_number_of_joints_works_throughout(joints):
    robot = Robot(cut(joints))
    target = tuple(np.array(robot.controller.setup.q) + 0.2)
    assert robot.send(c.MoveJ, q=target) == Accepted(id=1)
    robot.until_rest()
    assert robot.send(c.ServoStart, period=0.008) == Done()
    for k in range(50):
        robot.setpoint(k, target)
        robot.tick(4)
    assert robot.send(c.ServoStop) == Done()
    robot.until_rest()
    robot.send(c.MoveJ, q=tuple(-angle for angle in target))
    robot.tick(100)
    assert robot.send(c.Stop) == Done()
    robot.until_rest()
    assert robot.send(SimulationReset, q=target) == Done(tick=robot.states[-1].tick)
    state = robot.tick()
    assert len(state.actual_q) == len(state.target_moment) == joints
    assert len(state.actual_TCP_pose) == 6
    assert len(check(robot.controller.truth()).motor_q) == joints
    assert robot.send(c.MoveJ, q=Q1_).code == ("busy" if joints == 6 else "out_of_range")


def test_a_setup_that_cannot_be_is_a_value_error():
    for wrong in (
        {"shaper": "zvdddd"},
        {"q": Q1_[:3]},
        {"calibration": calibration(f_d_range=(0.5, 16.0)), "shaper": "ei3"},
        {"calibration": calibration(joints=(1, 6))},
    ):
        with pytest.raises(ValueError, match=r"\w+"):
            Controller(setup(**wrong))


def test_the_body_of_the_wire_is_that_of_the_plant():
    assert body(HEAVY).mass == HEAVY.mass
    assert PAPER.jerk == c.MoveJ(token="", q=Q1_).jerk
