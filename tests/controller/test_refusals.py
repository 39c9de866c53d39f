"""Refused commands: the content of each, once, as clients send them; code, field and limit."""

import math

import msgspec
import pytest
from tests.search.spaces import BENT, away

from tvist_controller.planning.filter_planner import (
    choose_filter,
    choose_source,
    make_estimator,
    wanted_modes,
)
from tvist_controller.refusal import RefusalError
from tvist_controller.setup import paper_payload
from tvist_protocol import commands as c
from tvist_protocol import motions as m
from tvist_protocol.io import Registers, SetRegisters
from tvist_protocol.replies import Accepted, Refused
from tvist_protocol.simulation import SimulationInject, SimulationReset, SimulationStep, StepSetpoint
from tvist_protocol.values import Payload
from tvist_shaping import BUILT_IN
from tvist_shaping.estimators.fixed import Fixed

from .robots import POLYNOMIAL, Q1, Q2, Q3, UR5E, NoArm, Robot, bits, calibration, setup

Q1_, Q2_, Q3_ = tuple(Q1), tuple(Q2), tuple(Q3)
REST, NAN = (0.0,) * 6, float("nan")
LOW = (0.0, 0.6, 0.0, -1.57, 0.0, 0.0)
"""The upper arm points below the horizon, into the floor."""
DISC = paper_payload(UR5E)
BODY = {"mass": 1.0, "com": DISC.com, "inertia": DISC.inertia}
IMPOSSIBLE = (1.0, 0.9, 0.0, 1.0, 0.0, 1.0)
HEAVY = Payload(mass=6.0, com=(0.0, 0.0, 0.04), inertia=IMPOSSIBLE)


def assert_unchanged(robot: Robot, twin: Robot, ticks: int = 50) -> None:
    """Check that the next states and events equal, bit for bit, those of a robot without the command."""
    for each in (robot, twin):
        each.states.clear()
        each.events.clear()
        each.tick(ticks)
    assert bits(robot.states) == bits(twin.states)
    assert robot.events == twin.events
    assert bits([robot.controller.io()]) == bits([twin.controller.io()])
    hidden = [(each.controller.declared, each.controller.assumed.source) for each in (robot, twin)]
    assert hidden[0] == hidden[1]


def alike(begin, **changes):
    """Return a robot and its twin, which do the same."""
    robots = [Robot(**changes) for _ in range(2)]
    for each in robots:
        begin(each)
    return robots


def content(**polynomial):
    return msgspec.to_builtins(calibration(**polynomial))


def polynomial(calibration):
    return {"name": "polynomial", "calibration": calibration}


def deep(change):
    """Return a calibration with a fault deep inside."""
    found = content()
    return polynomial(found | {"polynomial": found["polynomial"] | change})


def torque(**fields):
    return {"fault": "torque", "value": 1.0, "seconds": 0.1} | fields


def path(*segments):
    return {"segments": segments}


def through(*rows):
    """Return the command of a trajectory, and its points from rows of time, q and perhaps qd and qdd."""
    names = ("time", "q", "qd", "qdd")
    points = tuple(m.TrajectoryPoint(**dict(zip(names, row, strict=False))) for row in rows)
    return m.MoveTrajectory, {"points": points}


def bent(joint, turn):
    return tuple(angle + turn * (number == joint) for number, angle in enumerate(BENT.tolist()))


COEFFICIENTS = POLYNOMIAL["f_d_coefficients"]
TOO_MANY = Registers(bank="input_double", first=47, values=(1.0, 2.0))
NO_BIT = Registers(bank="input_bit", values=(2,))
INT, MOST = {"bank": "input_int"}, UR5E.limits
FIXED = {"name": "fixed", "f_d": (8.0,), "zeta": (0.2,)}
WRONG = [  # command, content, code and field; the limit told, or words that help
    (c.TakeControl, {"client": "b"}, "no_control", "token"),
    (c.TakeControl, {"client": "a", "protocol": 2}, "unsupported_version", "protocol"),
    (c.MoveJ, {"q": Q2_[:5]}, "out_of_range", "q", 6),
    (c.MoveJ, {"q": (*Q2_, 0.0)}, "out_of_range", "q"),
    (c.MoveJ, {"q": (7.0, *Q2_[1:])}, "limit_position", "q[0]", MOST.position[0]),
    (c.MoveJ, {"q": (*Q2_[:5], -math.inf)}, "limit_position", "q[5]"),
    (c.MoveJ, {"q": (*Q2_[:5], NAN)}, "limit_position", "q[5]"),
    (c.MoveJ, {"q": Q2_, "velocity": 4.0}, "limit_velocity", "velocity", MOST.velocity[0]),
    (c.MoveJ, {"q": Q2_, "velocity": 1e-4}, "out_of_range", "velocity"),
    (c.MoveJ, {"q": (6.28, *Q2_[1:]), "velocity": 5e-324}, "out_of_range", "velocity"),
    (c.MoveJ, {"q": Q2_, "acceleration": 41.0}, "limit_acceleration", "acceleration", MOST.acceleration[0]),
    (c.MoveJ, {"q": Q2_, "acceleration": 5e-324}, "out_of_range", "acceleration"),
    (c.MoveJ, {"q": Q2_, "jerk": 3000.0}, "out_of_range", "jerk", MOST.jerk[0]),
    (c.MoveJ, {"q": Q2_, "jerk": 1e-300}, "out_of_range", "jerk"),
    (*through((1.0, Q2_), (1.0, Q2_)), "out_of_range", "points[1].time"),
    (*through((0.0, Q2_)), "out_of_range", "points[0].time"),
    (*through((1.0, Q2_), (2.0, Q2_[:5])), "out_of_range", "points[1].q", 6),
    (*through((1.0, Q2_), (2.0, Q2_, REST)), "out_of_range", "points[1].qd", "for all points or"),
    (*through((1.0, Q2_, None, REST)), "missing_field", "points[0].qd"),
    (*through((1.0, Q2_, (0.1, *REST[1:]))), "out_of_range", "points[0].qd", "begins and ends"),
    (c.ServoStart, {"velocity": 4.0}, "limit_velocity", "velocity"),
    (c.ServoStart, {"acceleration": 1e-9}, "out_of_range", "acceleration"),
    (m.ServoJ, {"q": (7.0, *REST[1:])}, "limit_position", "q[0]"),
    (m.ServoJ, {"q": (0.0,)}, "out_of_range", "q"),
    (m.SpeedJ, {"qd": (0.0, 3.2, *REST[2:])}, "limit_velocity", "qd[1]"),
    (m.SpeedJ, {"qd": REST[1:]}, "out_of_range", "qd"),
    (m.SpeedJ, {"qd": REST, "acceleration": 41.0}, "limit_acceleration", "acceleration"),
    (c.SetShaper, {"name": "zvdddd"}, "unknown_shaper", "name", "did you mean 'zvddd'?"),
    (c.SetShaper, {"name": "elastic-17"}, "out_of_range", "name"),
    (c.SetShaper, {"name": "zv", "modes": 2}, "out_of_range", "modes", 1),
    (c.SetShaper, {"name": "auto"}, "out_of_range", "name"),
    (c.SetEstimator, {"name": "neural"}, "unknown_estimator", "name"),
    (c.SetEstimator, {"name": "modal"}, "missing_field", "calibration"),
    (c.SetEstimator, {"name": "modal", "f_d": (8.0,)}, "out_of_range", "f_d"),
    (c.SetEstimator, {"name": "modal", "calibration": "ur5e_5kg"}, "out_of_range", "calibration"),
    (c.SetEstimator, {"name": "fixed"}, "missing_field", "f_d"),
    (c.SetEstimator, {"name": "fixed", "f_d": (10.0,)}, "missing_field", "zeta"),
    (c.SetEstimator, FIXED | {"f_d": (0.1,)}, "out_of_range", "f_d"),
    (c.SetEstimator, FIXED | {"zeta": (0.2, 0.2)}, "out_of_range", "zeta"),
    (c.SetEstimator, FIXED | {"calibration": "x"}, "out_of_range", "calibration"),
    (c.SetEstimator, {"name": "polynomial"}, "missing_field", "calibration"),
    (c.SetEstimator, {"name": "polynomial", "zeta": (0.1,)}, "out_of_range", "zeta"),
    (c.SetEstimator, polynomial("../../etc/passwd"), "unknown_calibration", "calibration"),
    (c.SetEstimator, polynomial({}), "missing_field", "calibration.name"),
    (c.SetEstimator, polynomial({"nmae": "x"}), "unknown_field", "calibration.nmae"),
    (c.SetEstimator, polynomial(content(robot="UR10e")), "out_of_range", "calibration.robot", "UR10e"),
    (c.SetEstimator, deep({"f_d_coefficients": COEFFICIENTS[:-1]}), "out_of_range", "calibration"),
    (c.SetEstimator, deep({"degree": 99}), "out_of_range", "calibration.polynomial.degree"),
    (c.SetEstimator, deep({"degree": "two"}), "malformed", "calibration.polynomial.degree"),
    (c.SetEstimator, deep({"f_d_range": (1.0, 1e9)}), "out_of_range", "calibration.polynomial.f_d_range[1]"),
    (c.SetEstimator, deep({"colour": 1}), "unknown_field", "calibration.polynomial.colour"),
    (c.SetPayload, BODY | {"mass": 5.1}, "out_of_range", "mass", 5.0),
    (c.SetPayload, BODY | {"inertia": (-0.01, 0.0, 0.0, 0.01, 0.0, 0.01)}, "out_of_range", "inertia"),
    (c.SetPayload, BODY | {"inertia": (0.01, 0.02, 0.0, 0.01, 0.0, 0.01)}, "out_of_range", "inertia"),
    (c.SetPayload, BODY | {"inertia": (0.01, 0.0, 0.0, 0.01, 0.0, 0.03)}, "out_of_range", "inertia"),
    (c.SetPayload, BODY | {"inertia": IMPOSSIBLE}, "out_of_range", "inertia"),
    (SetRegisters, INT | {"first": 47, "values": (1, 2)}, "out_of_range", "values"),
    (SetRegisters, {"bank": "input_bit", "first": 100, "values": (True,) * 29}, "out_of_range", "values"),
    (SetRegisters, INT | {"values": (1, 1.5)}, "out_of_range", "values[1]"),
    (SetRegisters, INT | {"values": (2**31,)}, "out_of_range", "values[0]"),
    (SetRegisters, INT | {"values": (True,)}, "out_of_range", "values[0]"),
    (SetRegisters, {"bank": "input_bit", "values": (True, 1)}, "out_of_range", "values[1]"),
    (SetRegisters, {"bank": "input_double", "values": (False,)}, "out_of_range", "values[0]"),
    (SetRegisters, INT | {"values": (8,), "also": (TOO_MANY,)}, "out_of_range", "also[0].values"),
    (SetRegisters, INT | {"values": (8,), "also": (NO_BIT,)}, "out_of_range", "also[0].values[0]"),
    (SetRegisters, {"bank": "output_double", "values": (1.5,), "token": None}, "missing_field", "token"),
    (SimulationReset, {"q": Q2_[:2]}, "out_of_range", "q"),
    (SimulationReset, {"q": Q2_, "shaper": "zvv"}, "unknown_shaper", "shaper"),
    (SimulationReset, {"q": Q2_, "payload": HEAVY}, "out_of_range", "payload.inertia"),
    (SimulationReset, {"q": LOW, "seed": 7, "mode": "IDLE", "shaper": "ei"}, "collision", "q"),
    (SimulationInject, {"fault": "gravity"}, "unknown_fault", "fault"),
    (SimulationInject, {"fault": "nan", "value": 1.0}, "out_of_range", "value"),
    (SimulationInject, torque(), "missing_field", "joint"),
    (SimulationInject, torque(joint=6), "out_of_range", "joint"),
]
FAST = through((2.0, bent(0, 0.1), REST, REST), (2.6, bent(0, 1.6), REST, REST))
TOO_GENTLE = m.ArcSegment(via=away((0.1, 0.0, 0.0)), pose=away((0.1, 0.1, 0.0)), acceleration=1e-3)
PLANNED = [
    (m.MoveL, {"pose": away((5.0, 0.0, 0.0))}, "no_solution", "pose"),
    (m.MoveL, {"pose": away((0.7, 0.2, 0.2))}, "singular", "pose", "% of the way"),
    (m.MoveL, {"pose": away((0.0, 0.0, -0.6))}, "collision", "pose", "% of the way"),
    (m.MoveL, {"pose": away((0.1, 0.0, 0.0)), "velocity": 1e-5}, "out_of_range", "velocity"),
    (m.MoveC, {"via": away((0.1, 0.0, 0.0)), "pose": away((0.2, 0.0, 0.0))}, "out_of_range", "via"),
    (m.MoveC, {"via": away((0.1, 0.0, 0.0)), "pose": away((0.0, 0.0, 0.0))}, "out_of_range", "via"),
    (m.MovePath, path(m.LineSegment(pose=away((9.0, 0.0, 0.0)))), "no_solution", "segments[0].pose"),
    (m.MovePath, path(m.JointSegment(q=Q1_), m.JointSegment(q=REST[1:])), "out_of_range", "segments[1].q"),
    (m.MovePath, path(m.JointSegment(q=(9.0,) * 6)), "limit_position", "segments[0].q[0]"),
    (*through((0.0, bent(2, 0.02)), (1.0, bent(2, 0.0))), "out_of_range", "points[0].q[2]"),
    (*through((1.0, bent(0, 0.1))), "limit_acceleration", "points[0]", "or velocities if they have"),
    (*through((5.0, bent(0, 0.1), REST), (15.0, bent(5, 6.0), REST)), "limit_position", "points[1]"),
    (*FAST, "limit_velocity", "points[1]", "joint base would have a velocity of"),
    (*through((3.0, bent(1, 1.0), REST)), "collision", "points[0]", "floor"),
    (m.MovePath, {"segments": (TOO_GENTLE,)}, "out_of_range", "segments[0].acceleration"),
]
WITH_TOKEN = [
    (c.KeepAlive, {}), (c.ReleaseControl, {}), (c.MoveJ, {"q": Q2_}), (c.ServoStart, {}), (c.ServoStop, {}),
    (c.Stop, {}), (c.SetShaper, {"name": "ei"}), (c.SetEstimator, FIXED), (c.SetPayload, BODY),
    (SimulationReset, {"q": Q2_}), (SimulationStep, {"ticks": 1}), (c.PowerOn, {}), (c.PowerOff, {}),
    (c.UnlockProtectiveStop, {}), (SimulationInject, {"fault": "protective_stop"}),
]  # fmt: skip


def assert_refused(robot, twin, table):
    for kind, fields, code, where, *told in table:
        reply = robot.send(kind, **fields)
        assert isinstance(reply, Refused), (kind, fields)
        assert (reply.code, reply.where) == (code, where), (kind, fields, reply)
        assert reply.why
        for one in told:
            assert one in reply.why if isinstance(one, str) else one == reply.limit, reply
        assert_unchanged(robot, twin, 3)
    assert_unchanged(robot, twin)


@pytest.mark.parametrize("begin", [Robot.tick, Robot.move, Robot.stream])
def test_invalid_commands_are_refused_and_change_nothing(begin):
    """Content is checked before the present activity."""
    assert_refused(*alike(begin), WRONG)


def test_impossible_paths_are_refused_and_change_nothing():
    assert_refused(*alike(Robot.tick, q=tuple(BENT), plant=NoArm()), PLANNED)


def test_a_stale_token_is_refused_before_other_checks():
    robot, twin = alike(Robot.move)
    wrong = [
        (kind, fields) for kind, fields, *_ in WRONG if kind is not c.TakeControl and "token" not in fields
    ]
    for kind, fields in WITH_TOKEN + wrong:
        for token in ("", "b#1"):
            reply = robot.send(kind, **(fields | {"token": token}))
            assert (reply.code, reply.where) == ("stale_token", "token"), (kind, fields)
        assert_unchanged(robot, twin, 3)


def test_set_points_of_a_step_are_checked(robot):
    robot.send(c.ServoStart)
    good, bad = StepSetpoint(sequence=0, q=Q1_), StepSetpoint(sequence=1, q=(9.0, *Q1_[1:]))
    reply = robot.send(SimulationStep, ticks=2, setpoints=(good, bad))
    assert (reply.code, reply.where) == ("limit_position", "setpoints[1].q[0]")
    reply = robot.send(SimulationStep, ticks=1, setpoints=(good, good))
    assert (reply.code, reply.where, reply.limit) == ("out_of_range", "setpoints", 1)


WRONG_Q = Q1_[:5], (*Q1_, 0.0), (7.0, *Q1_[1:]), (NAN, *Q1_[1:])


@pytest.mark.parametrize("setpoint", [{"token": ""}, {"token": "old"}, *({"q": q} for q in WRONG_Q)])
def test_an_invalid_set_point_is_counted_and_dropped(setpoint):
    robot, twin = alike(Robot.stream)
    robot.setpoint(**({"sequence": 100, "q": Q1_} | setpoint))
    assert robot.controller.counters.setpoints_refused == 1
    assert_unchanged(robot, twin)


def test_a_move_lasting_hours_is_refused():
    wide = msgspec.structs.replace(UR5E.limits, position=(1e3,) * 6)
    robot = Robot(msgspec.structs.replace(UR5E, limits=wide))
    reply = robot.send(c.MoveJ, q=(900.0, *Q1_[1:]), velocity=0.01)
    assert (reply.code, reply.where) == ("out_of_range", "velocity")
    assert robot.send(c.MoveJ, q=Q2_) == Accepted(id=1)


@pytest.mark.parametrize("name", BUILT_IN.names())
def test_every_built_in_shaper_can_be_chosen(name):
    modes = wanted_modes(name, 1, "name")
    f_d, zeta = [10.0, 20.0, 40.0, 80.0], [0.1, 0.1, 0.08, 0.08]
    assert choose_filter(name, Fixed(f_d[:modes], zeta[:modes]), 6).name == name


def refused(action, *arguments, **named):
    with pytest.raises(RefusalError) as caught:
        action(*arguments, **named)
    return caught.value.reply


def estimator(own=None, **fields):
    return choose_source(c.SetEstimator(token="", **fields), setup(calibration=own))


def test_a_calibration_is_given_as_a_map_by_name_or_by_the_setup():
    source = estimator(name="polynomial", calibration=content(name="mine"))
    assert source.calibration.name == "mine"
    assert source.estimator(1, DISC).f_d_min == 5.0
    own = calibration(name="own")
    for named in (None, "own"):
        assert estimator(own, name="polynomial", calibration=named).calibration is own


def test_the_number_of_modes_is_limited_by_estimator_and_filter():
    source = estimator(name="fixed", f_d=(8.0, 15.0), zeta=(0.2, 0.1))
    assert source.estimator(2, DISC).modes == 2
    reply = refused(make_estimator, source, 3, DISC, "modes")
    assert (reply.code, reply.where, reply.limit) == ("out_of_range", "modes", 2)
    assert wanted_modes("zv", 3, "name") == 3
    assert wanted_modes("auto", 1, "name") == wanted_modes("auto", 4, "name") == 4
    assert refused(wanted_modes, "auto", 2, "name").where == "modes"
    assert refused(choose_filter, "ei3", Fixed([0.5], [0.2]), 6, where="f_d").code == "out_of_range"
