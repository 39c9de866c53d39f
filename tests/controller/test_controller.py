"""The controller: commands in, replies, states and events out."""

import msgspec
import numpy as np
import pytest

from tvist_controller.about import info_of
from tvist_controller.controller import Controller
from tvist_controller.cycle import STILL
from tvist_controller.setup import body, paper_payload
from tvist_controller.streaming import TIMEOUT
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


def test_motion_done_is_the_tick_after_the_last_that_moved():
    robot = Robot()
    robot.send(c.MoveJ, q=Q2_)
    robot.until_rest()
    robot.tick(100)
    steps = np.abs(np.diff(robot.column("target_q"), axis=0)).max(axis=1)
    last_moved = robot.states[np.flatnonzero(steps > STILL)[-1] + 1].tick
    assert robot.events[-1].tick == last_moved + 1


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


def test_anyone_may_stop_but_not_with_a_stale_token():
    robot = Robot()
    moving(robot)
    assert robot.send(c.Stop, token="stale").code == "stale_token"
    assert not robot.controller.cycle.stopping
    assert robot.send(c.Stop, token=None) == Done()
    assert robot.controller.cycle.stopping


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


@pytest.mark.parametrize("deceleration", [5e-324, 1e-9, 0.3])
def test_a_stop_as_gentle_as_nothing_is_a_stop(deceleration):
    robot = Robot()
    moving(robot, 500)
    assert robot.send(c.Stop, token=None, deceleration=deceleration) == Done()
    robot.until_rest(1500)


def test_a_harder_stop_overtakes_a_gentle_one():
    robot = Robot()
    moving(robot, 500)
    robot.send(c.Stop, deceleration=1.0)
    robot.tick(10)
    robot.send(c.Stop)
    robot.until_rest(100)
    assert robot.kinds().count("motion_stopped") == 1


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
    assert robot.controller.filters.source.name == "polynomial"


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
    assert robot.controller.cycle.at_rest


def test_a_reset_keeps_the_seed_that_was_chosen_last():
    robot = Robot()
    noise = []
    for seed in (7, None):
        robot.send(SimulationReset, q=Q1_, seed=seed)
        noise.append(robot.tick().actual_tool_accelerometer)
    assert noise[0] == noise[1]


def test_a_reset_ends_a_stream():
    robot = Robot()
    streaming(robot)
    robot.send(SimulationReset)
    robot.tick()
    assert robot.kinds() == ["stream_stopped"]
    assert robot.send(c.MoveJ, q=Q2_) == Accepted(id=1)


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
    hidden = [(each.controller.declared, each.controller.filters.source) for each in (robot, twin)]
    assert hidden[0] == hidden[1]


@pytest.mark.parametrize("begin", [None, moving, streaming])
@pytest.mark.parametrize(("kind", "fields", "code", "where"), WRONG)
def test_wrong_content_is_refused_before_the_arm_s_motion_is_looked_at(kind, fields, code, where, begin):
    robot, twin = Robot(), Robot()
    for each in (robot, twin):
        if begin is not None:
            begin(each)
    reply = robot.send(kind, **fields)
    assert isinstance(reply, Refused)
    assert (reply.code, reply.where) == (code, where)
    assert reply.why
    assert_unchanged(robot, twin)


@pytest.mark.parametrize("token", ["", "b#1"])
@pytest.mark.parametrize(("kind", "fields"), WITH_TOKEN)
def test_a_stale_token_is_refused_first_of_all(kind, fields, token):
    robot, twin = Robot(), Robot()
    for each in (robot, twin):
        moving(each)
    reply = robot.send(kind, **(fields | {"token": token}))
    assert (reply.code, reply.where) == ("stale_token", "token")
    assert_unchanged(robot, twin)


@pytest.mark.parametrize("wrong", [entry for entry in WRONG if entry[0] is not c.TakeControl])
def test_wrong_content_with_a_stale_token_is_a_stale_token(wrong):
    robot = Robot()
    assert robot.send(wrong[0], **(wrong[1] | {"token": "old"})).code == "stale_token"


@pytest.mark.parametrize(("kind", "fields"), WITH_TOKEN)
def test_without_a_lease_there_is_no_control(kind, fields):
    robot = Robot()
    robot.send(c.ReleaseControl)
    assert robot.send(kind, **fields).code == "no_control"


@pytest.mark.parametrize("begin", [moving, streaming])
@pytest.mark.parametrize(("kind", "fields"), [entry for entry in WITH_TOKEN if entry[0] in AT_REST_ONLY])
def test_what_needs_an_arm_at_rest_is_busy_in_motion(kind, fields, begin):
    robot, twin = Robot(), Robot()
    for each in (robot, twin):
        begin(each)
    assert robot.send(kind, **fields).code == "busy"
    assert_unchanged(robot, twin)


def test_it_is_busy_until_the_stop_has_ended():
    robot = Robot()
    moving(robot)
    robot.send(c.Stop)
    robot.tick(2)
    assert robot.send(c.MoveJ, q=Q1_).code == "busy"
    robot.until_rest()
    assert robot.send(c.MoveJ, q=Q1_) == Accepted(id=2)


def test_a_stream_that_waits_for_its_first_set_point_is_busy():
    robot = Robot()
    robot.send(c.ServoStart)
    robot.tick(10)
    assert robot.send(c.MoveJ, q=Q1_).code == "busy"


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


def test_in_real_time_no_client_steps():
    reply = Robot(clock="realtime").send(SimulationStep, ticks=1)
    assert (reply.code, reply.where) == ("wrong_mode", "type")


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


def test_a_set_point_without_a_stream_is_counted_and_dropped():
    robot = Robot()
    robot.setpoint(0, Q2_)
    robot.tick(20)
    counters = robot.controller.counters
    assert (counters.setpoints_received, counters.setpoints_refused) == (1, 1)
    assert robot.states[-1].target_q == list(Q1_)


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


def test_any_command_with_the_token_renews_the_lease():
    robot = Robot(clock="realtime", lease_s=1.0)
    for _ in range(5):
        robot.tick(400)
        assert robot.send(c.KeepAlive) == Done()
    assert robot.events == []


def test_set_points_renew_the_lease():
    robot = Robot(clock="realtime", lease_s=0.5)
    streaming(robot, 600)
    assert robot.events == []


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


def test_releasing_control_ends_a_stream():
    robot = Robot()
    streaming(robot, 150)
    robot.send(c.ReleaseControl)
    robot.tick()
    assert robot.kinds() == ["stream_stopped"]
    stopped_within_limits(robot)


def test_a_client_that_goes_takes_its_lease_and_its_motion_with_it():
    controller = Controller(setup())
    robot = Robot()
    robot.controller = controller
    robot.token = controller.receive(c.TakeControl(client="a"), session="1f").token
    motion = moving(robot)
    for other in (("b", "1f"), ("a", "2f"), ("a", "")):
        controller.client_gone(*other)
        assert not controller.cycle.stopping
    controller.client_gone("a", "1f")
    robot.tick()
    assert [(e.kind, e.id) for e in robot.events[1:]] == [("lease_lost", None), ("motion_stopped", motion)]
    stopped_within_limits(robot)


def test_a_client_that_was_not_seen_goes_unnoticed():
    robot = Robot()
    moving(robot)
    robot.controller.client_gone("a", "")
    robot.tick()
    assert robot.kinds() == ["motion_started"]


def test_at_rest_a_lost_lease_is_one_event():
    robot = Robot(clock="realtime", lease_s=0.1)
    robot.tick(100)
    assert robot.kinds() == ["lease_lost"]


def test_a_new_lease_of_the_same_client_leaves_its_motion_alone():
    robot = Robot()
    motion = moving(robot)
    robot.token = robot.send(c.TakeControl, client="a").token
    robot.until_rest()
    assert [(e.kind, e.id) for e in robot.events[1:]] == [("motion_done", motion)]


def test_serving_ends_in_rest_before_a_stream_is_over_and_can_be_stopped_meanwhile():
    robot = Robot()
    streaming(robot, 150)
    robot.send(c.ServoStop)
    robot.tick(3)
    robot.send(c.Stop)
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


def test_runtime_state_says_whether_it_moves():
    robot = Robot()
    assert robot.tick().runtime_state == 1
    moving(robot, 5)
    assert robot.states[-1].runtime_state == 2
    assert robot.until_rest().runtime_state == 1


def test_missed_ticks_are_published():
    robot = Robot()
    robot.controller.missed(3)
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


# ---------------------------------------------------------------- anything, in any order


def anything(random: np.random.Generator, robot: Robot):
    """Some command, valid or not; most carry the token."""
    q = tuple(Q1 + random.uniform(-0.3, 0.3, 6)) if random.random() < 0.8 else tuple(random.uniform(-9, 9, 6))
    limits = {}
    if random.random() < 0.5:
        limits = {
            "velocity": float(10 ** random.uniform(-6, 1)),
            "acceleration": float(10 ** random.uniform(-6, 2)),
            "jerk": float(10 ** random.uniform(-6, 4)),
        }
    body_ = {"com": (0.0, 0.1, 0.0), "inertia": tuple(random.uniform(0, 0.02, 6).tolist())}
    f_d = tuple(random.uniform(0.1, 200, random.integers(1, 3)).tolist())
    choices = [
        (c.TakeControl, {"client": str(random.choice(["a", "b"])), "lease_s": 0.5}),
        (c.KeepAlive, {}),
        (c.ReleaseControl, {}),
        (c.MoveJ, {"q": q} | limits),
        *[(c.MoveJ, {"q": q})] * 5,
        *[(c.ServoStop, {}), (c.Stop, {})] * 2,
        (c.MoveJ, {"q": q[: random.integers(1, 6)]}),
        (c.ServoStart, {"period": float(random.uniform(0.002, 0.1))} | limits),
        (c.ServoStart, {}),
        (c.Stop, {"deceleration": float(10 ** random.uniform(-300, 5))}),
        (c.Stop, {"token": None}),
        (
            c.SetShaper,
            {"name": str(random.choice(["zv", "ei3", "none", "no"])), "modes": random.integers(1, 3)},
        ),
        (c.SetEstimator, {"name": "fixed", "f_d": f_d, "zeta": (float(random.random()),)}),
        (c.SetEstimator, {"name": "polynomial", "calibration": msgspec.to_builtins(calibration())}),
        (c.SetPayload, {"mass": float(random.uniform(0, 6))} | body_),
        (SimulationReset, {"q": q, "seed": int(random.integers(0, 2**63))}),
        (SimulationReset, {"payload": Payload(mass=float(random.uniform(0, 20)), **body_)}),
        (SimulationReset, {"shaper": "mzv"}),
        (SimulationStep, {"ticks": 5, "setpoints": (StepSetpoint(sequence=1, q=q),)}),
        (c.HandOver, {"client": "b"}),
        (c.Pause, {}),
        *[(c.Resume, {})] * 2,
        (c.SetSpeed, {"fraction": float(random.choice([0.0, 0.3, 1.0, 1.0, 1.0]))}),
        *[(c.PowerOn, {})] * 2,
        *[(c.UnlockProtectiveStop, {})] * 3,
    ]
    rare = [
        (c.PowerOff, {}),
        (SimulationInject, {"fault": str(random.choice(["protective_stop", "reduced", "normal", "nan"]))}),
        (
            SimulationInject,
            {
                "fault": "torque",
                "joint": int(random.integers(0, 6)),
                "value": float(random.uniform(-400, 400)),
                "seconds": 0.05,
            },
        ),
    ]
    some = rare if random.random() < 0.02 else choices
    kind, fields = some[random.integers(len(some))]
    fields = {key: int(value) if isinstance(value, np.integer) else value for key, value in fields.items()}
    if random.random() < 0.1 and "token" in kind.__struct_fields__:
        fields["token"] = str(random.choice(["", "a#1", "x"]))
    return robot.send(kind, **fields)


@pytest.mark.parametrize("seed", [0, 1])
def test_whatever_comes_nothing_breaks_and_every_motion_ends_once(seed):
    """A thousand commands a seed, with set-points and ticks in between."""
    random = np.random.default_rng(seed)
    robot = Robot(clock="realtime" if seed else "free", lease_s=0.5)
    sent = refused = 0
    sequence = received = 0
    accepted = set()
    for _ in range(1000):
        lease = robot.controller.session.lease
        if (lease is None or lease.token != robot.token) and random.random() < 0.5:
            reply = robot.send(c.TakeControl, client=lease.client if lease else "a", lease_s=0.5)
        else:
            reply = anything(random, robot)
        sent += 1
        refused += isinstance(reply, Refused)
        if isinstance(reply, Accepted):
            robot.token = reply.token or robot.token
            accepted |= {reply.id} - {None}
        for _ in range(random.integers(0, 25)):
            if random.random() < 0.7:
                sequence += int(random.choice([0, 1, 1, 1, 2, -3, 2**40]))
                robot.setpoint(max(sequence, 0), Q1 + random.uniform(-0.2, 0.2) * (random.random() < 0.1))
                received += 1
            robot.tick()
        if random.random() < 0.1:
            sequence = 0
            robot.tick(300)
    robot.send(c.Stop, token=None)
    robot.until_rest()

    counters = robot.controller.counters
    assert counters.commands == sent + 2  # control was taken before, and stopped after
    assert counters.refused == refused
    assert 100 < refused < sent
    assert counters.setpoints_received == received
    started = [event.id for event in robot.events if event.kind == "motion_started"]
    ended = [event.id for event in robot.events if event.kind in {"motion_done", "motion_stopped"}]
    assert sorted(started) == sorted(ended) == sorted(accepted)
    assert len(started) > 20
    assert [event.tick for event in robot.events] == sorted(event.tick for event in robot.events)
    for name in ("reference_q", "target_q", "target_qdd", "target_moment", "actual_q"):
        assert np.isfinite(robot.column(name)).all()


def test_the_body_of_the_wire_is_that_of_the_plant():
    assert body(HEAVY).mass == HEAVY.mass
    assert PAPER.jerk == c.MoveJ(token="", q=Q1_).jerk
