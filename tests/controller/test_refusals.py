"""What is refused, and in which words."""

import math

import msgspec
import pytest

from tvist_controller.planning.filter_planner import (
    choose_filter,
    choose_source,
    make_estimator,
    wanted_modes,
)
from tvist_controller.refusal import RefusalError, check_body, check_joints, check_motion
from tvist_controller.setup import paper_payload
from tvist_protocol.commands import SetEstimator
from tvist_protocol.values import Payload
from tvist_shaping import BUILT_IN
from tvist_shaping.estimators.fixed import Fixed

from .robots import POLYNOMIAL, UR5E, calibration, setup

LIMITS = UR5E.limits
DISC = paper_payload(UR5E)
SIX = (0.0,) * 6


def refused(action, *arguments, **named):
    with pytest.raises(RefusalError) as caught:
        action(*arguments, **named)
    reply = caught.value.reply
    assert reply.why
    assert "\n" not in reply.why
    assert not reply.where or reply.where.split("[")[0] in reply.why or reply.code.startswith("unknown")
    return reply


@pytest.mark.parametrize("count", [0, 1, 5, 7])
def test_another_number_of_joints(count):
    reply = refused(check_joints, (0.0,) * count, UR5E)
    assert (reply.code, reply.where, reply.limit) == ("out_of_range", "q", 6)


@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize("angle", [6.2832, -7.0, math.inf, math.nan])
def test_beyond_a_joint_s_range(joint, angle):
    q = (*SIX[:joint], angle, *SIX[joint + 1 :])
    reply = refused(check_joints, q, UR5E, "setpoints[3].q")
    assert (reply.code, reply.where) == ("limit_position", f"setpoints[3].q[{joint}]")
    assert reply.limit == LIMITS.position[joint]


def test_the_ends_of_the_range_are_in_it():
    check_joints(LIMITS.position, UR5E)
    check_joints([-limit for limit in LIMITS.position], UR5E)


@pytest.mark.parametrize(
    ("values", "code", "where"),
    [
        ((3.2, 2.0, 100.0), "limit_velocity", "velocity"),
        ((1.5, 40.1, 100.0), "limit_acceleration", "acceleration"),
        ((1.5, 2.0, 2001.0), "out_of_range", "jerk"),
        ((9.0, 99.0, 1e6), "limit_velocity", "velocity"),
        ((1e-4, 2.0, 100.0), "out_of_range", "velocity"),
        ((1.5, 5e-324, 100.0), "out_of_range", "acceleration"),
        ((1.5, 2.0, 0.01), "out_of_range", "jerk"),
    ],
)
def test_limits_of_a_motion_beyond_those_of_the_arm_or_so_low_that_it_would_hardly_move(values, code, where):
    reply = refused(check_motion, *values, UR5E)
    assert (reply.code, reply.where) == (code, where)
    assert reply.limit is not None


def test_the_arm_s_own_limits_are_allowed():
    check_motion(LIMITS.velocity[0], LIMITS.acceleration[0], LIMITS.jerk[0], UR5E)


def payload(mass=1.0, inertia=(0.01, 0.0, 0.0, 0.01, 0.0, 0.01)):
    return Payload(mass=mass, com=(0.0, 0.0, 0.0), inertia=inertia)


@pytest.mark.parametrize(
    "inertia",
    [
        (-0.01, 0.0, 0.0, 0.01, 0.0, 0.01),
        (0.01, 0.02, 0.0, 0.01, 0.0, 0.01),  # not positive
        (0.01, 0.0, 0.0, 0.01, 0.0, 0.03),  # larger than the other two together
        (1.0, 0.9, 0.0, 1.0, 0.0, 1.0),  # likewise, but only along its principal axes
    ],
)
def test_an_inertia_that_no_body_has(inertia):
    reply = refused(check_body, payload(inertia=inertia), "payload")
    assert (reply.code, reply.where) == ("out_of_range", "payload.inertia")


@pytest.mark.parametrize("inertia", [(0.0,) * 6, (0.01, 0, 0, 0.01, 0, 0.02), (0, 0, 0, 0.01, 0, 0.01)])
def test_points_discs_and_rods_are_bodies(inertia):
    check_body(payload(inertia=inertia))


def test_more_than_the_rated_mass():
    reply = refused(check_body, payload(mass=5.1), rated=5.0)
    assert (reply.code, reply.where, reply.limit) == ("out_of_range", "mass", 5.0)
    check_body(payload(mass=5.1))


# ---------------------------------------------------------------- shapers and estimators


def test_an_unknown_shaper_is_answered_with_the_nearest():
    reply = refused(choose_filter, "zvdddd", Fixed([10.0], [0.2]), 6, where="name")
    assert (reply.code, reply.where) == ("unknown_shaper", "name")
    assert "did you mean 'zvddd'?" in reply.why


@pytest.mark.parametrize("name", BUILT_IN.names())
def test_every_shaper_that_is_named_can_be_chosen(name):
    modes = wanted_modes(name, 1, "name")
    f_d, zeta = [10.0, 20.0, 40.0, 80.0], [0.1, 0.1, 0.08, 0.08]
    assert choose_filter(name, Fixed(f_d[:modes], zeta[:modes]), 6).name == name


def test_a_shaper_that_lasts_longer_than_the_delay_line_is_refused():
    assert refused(choose_filter, "ei3", Fixed([0.5], [0.2]), 6, where="f_d").code == "out_of_range"


def estimator(own=None, **fields):
    return choose_source(SetEstimator(token="", **fields), setup(calibration=own))


@pytest.mark.parametrize(
    ("fields", "code", "where"),
    [
        ({"name": "modal"}, "missing_field", "calibration"),
        ({"name": "modal", "f_d": (8.0,)}, "out_of_range", "f_d"),
        ({"name": "modal", "calibration": "ur5e_5kg"}, "out_of_range", "calibration"),
        ({"name": "polinomial"}, "unknown_estimator", "name"),
        ({"name": "fixed"}, "missing_field", "f_d"),
        ({"name": "fixed", "f_d": (10.0,)}, "missing_field", "zeta"),
        ({"name": "fixed", "f_d": (8.0,), "zeta": (0.2, 0.2)}, "out_of_range", "zeta"),
        ({"name": "fixed", "f_d": (8.0,), "zeta": (0.2,), "calibration": "x"}, "out_of_range", "calibration"),
        ({"name": "polynomial"}, "missing_field", "calibration"),
        ({"name": "polynomial", "f_d": (8.0,)}, "out_of_range", "f_d"),
        ({"name": "polynomial", "zeta": (0.1,)}, "out_of_range", "zeta"),
        ({"name": "polynomial", "calibration": "nowhere"}, "unknown_calibration", "calibration"),
        ({"name": "polynomial", "calibration": "../../etc/passwd"}, "unknown_calibration", "calibration"),
        ({"name": "polynomial", "calibration": {}}, "missing_field", "calibration.name"),
        ({"name": "polynomial", "calibration": {"nmae": "x"}}, "unknown_field", "calibration.nmae"),
    ],
)
def test_estimators_that_cannot_be(fields, code, where):
    reply = refused(estimator, **fields)
    assert (reply.code, reply.where) == (code, where)


def content(**changes):
    return msgspec.to_builtins(calibration(**changes))


def test_a_calibration_may_come_as_a_map():
    source = estimator(name="polynomial", calibration=content(name="mine"))
    assert source.calibration.name == "mine"
    assert source.estimator(1, DISC).f_d_min == 5.0


def test_a_calibration_of_another_robot_is_refused():
    reply = refused(estimator, name="polynomial", calibration=content(robot="UR10e"))
    assert (reply.code, reply.where) == ("out_of_range", "calibration.robot")
    assert "UR10e" in reply.why
    assert "UR5e" in reply.why


def test_a_calibration_whose_parts_do_not_go_together_is_refused():
    short = POLYNOMIAL["f_d_coefficients"][:-1]
    reply = refused(estimator, name="polynomial", calibration=content(f_d_coefficients=short))
    assert (reply.code, reply.where) == ("out_of_range", "calibration")
    assert "f_d_coefficients" in reply.why


def test_the_server_s_own_calibration_goes_by_its_name_or_without():
    own = calibration(name="own")
    for named in (None, "own"):
        assert estimator(own, name="polynomial", calibration=named).calibration is own


def test_modal_takes_the_calibration_that_comes_with_the_package():
    source = estimator(calibration(name="own"), name="modal")
    assert (source.name, source.calibration.name) == ("modal", "ur5e_modal")
    assert source.estimator(3, DISC).modes == 3
    assert estimator(name="modal", calibration="ur5e_modal") == source


def test_no_estimator_gives_more_modes_than_it_has():
    source = estimator(name="fixed", f_d=(8.0, 15.0), zeta=(0.2, 0.1))
    assert source.estimator(2, DISC).modes == 2
    reply = refused(make_estimator, source, 3, DISC, "modes")
    assert (reply.code, reply.where, reply.limit) == ("out_of_range", "modes", 2)


def test_a_filter_with_modes_of_its_own_takes_no_other_number():
    assert wanted_modes("zv", 3, "name") == 3
    assert wanted_modes("auto", 1, "name") == wanted_modes("auto", 4, "name") == 4
    assert refused(wanted_modes, "auto", 2, "name").where == "modes"


@pytest.mark.parametrize(
    ("change", "code", "where"),
    [
        ({"degree": 99}, "out_of_range", "calibration.polynomial.degree"),
        ({"degree": "two"}, "malformed", "calibration.polynomial.degree"),
        ({"f_d_range": (1.0, 1e9)}, "out_of_range", "calibration.polynomial.f_d_range[1]"),
        ({"colour": 1}, "unknown_field", "calibration.polynomial.colour"),
    ],
)
def test_a_fault_deep_in_a_calibration_is_named_where_it_is(change, code, where):
    wrong = content()
    wrong["polynomial"] |= change
    reply = refused(estimator, name="polynomial", calibration=wrong)
    assert (reply.code, reply.where) == (code, where)
