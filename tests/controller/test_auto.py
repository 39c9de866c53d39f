"""Filters of constant mean delay in the server: chosen, changed with the payload, inside the limits."""

import numpy as np
import pytest

from tvist_controller.setup import paper_payload
from tvist_controller.sources.calibrations import load
from tvist_protocol import commands as c
from tvist_protocol.replies import Done
from tvist_protocol.simulation import SimulationReset
from tvist_protocol.values import Payload

from .robots import PAPER, Q1, Q2, Q3, UR5E, H, Robot

POLYNOMIAL = load("ur5e_5kg")
NAMES = ("auto", "short", "auto-target", "elastic-auto")
LIGHT = paper_payload(UR5E, 1.0)
FIELDS = {"mass": LIGHT.mass, "com": LIGHT.com, "inertia": LIGHT.inertia}


def ringing(robot: Robot) -> float:
    """Largest true acceleration of the tool later than 10 ms after the reference has stopped [m/s²]."""
    arm = robot.controller.cycle.plant
    robot.tick(5)
    felt = []
    for _ in range(300):
        robot.tick()
        felt.append(arm.truth().specific_force)
    return np.linalg.norm(np.array(felt) - felt[-1], axis=1)[:200].max()


def test_they_bring_their_own_estimator_and_leave_less_than_the_papers_shaper():
    left = {}
    for shaper in ("none", "zv", *NAMES):
        robot = Robot(calibration=POLYNOMIAL)
        assert robot.send(c.SetShaper, name=shaper) == Done()
        robot.send(c.MoveJ, q=tuple(Q3))
        robot.until_rest()
        left[shaper] = ringing(robot)
        if shaper in NAMES:
            assert robot.controller.assumed.source.name == "modal"
            assert "with estimator modal" in next(e.why for e in robot.events if e.kind == "shaper_changed")
            assert left[shaper] < min(0.1 * left["none"], left["zv"]), shaper


@pytest.mark.parametrize(("name", "target"), [*zip(NAMES, (Q2, Q3, Q2, Q2), strict=True), ("elastic", Q3)])
def test_a_motion_of_our_own_keeps_its_limits_to_the_last_digit(name, target):
    robot = Robot(calibration=POLYNOMIAL, shaper=name)
    robot.send(c.MoveJ, q=tuple(target))
    robot.until_rest()
    q = robot.column("target_q")
    assert np.abs(np.diff(q, 2, axis=0)).max() / H**2 <= PAPER.acceleration * (1.0 + 1e-8)
    assert np.abs(np.diff(q, axis=0)).max() / H <= PAPER.velocity * (1.0 + 1e-9)
    assert robot.states[-1].target_q == pytest.approx(target, abs=2e-7)


def test_to_know_the_end_is_to_be_there_sooner_and_a_stream_is_followed_all_the_same():
    ticks = {}
    for name in ("auto", "auto-target"):
        robot = Robot(calibration=POLYNOMIAL, shaper=name)
        robot.send(c.MoveJ, q=tuple(Q3))
        ticks[name] = robot.until_rest().tick
        assert robot.states[-1].estimated_f_d[0] == pytest.approx(14.8, abs=1.0)
    assert ticks["auto-target"] < ticks["auto"]
    at_rest = robot.controller.cycle.tvist.f_d.copy()
    robot.send(c.ServoStart)
    for k in range(400):
        robot.setpoint(k, Q3 - 0.2 * (1.0 - np.cos(2.0 * k * H)) * np.array([0, 1, 1, 0, 0, 0]))
        robot.tick()
    assert abs(robot.states[-1].estimated_f_d[0] - at_rest[0]) > 0.02  # it follows the arm


def test_another_payload_makes_other_modes_at_once_at_rest_and_without_a_step_in_motion():
    robot = Robot(calibration=POLYNOMIAL, shaper="auto")
    before = robot.tick().estimated_f_d[0]
    robot.send(c.SetPayload, **FIELDS)
    assert robot.tick().estimated_f_d[0] > 1.3 * before
    robot.send(c.MoveJ, q=tuple(Q3))
    robot.tick(300)
    since = len(robot.states)
    five = paper_payload(UR5E)
    robot.send(c.SetPayload, mass=five.mass, com=five.com, inertia=five.inertia)
    robot.until_rest()
    assert robot.events[-1].kind == "motion_done"
    q = robot.column("target_q")[since - 3 :]
    assert np.abs(np.diff(q, 2, axis=0)).max() / H**2 <= PAPER.acceleration * 1.01


def test_it_knows_what_it_carries():
    """Unlike polynomials, which are of one payload, the modal estimator needs no warning."""
    left = {}
    for shaper in ("none", "auto"):
        robot = Robot(calibration=POLYNOMIAL, shaper=shaper, payload=LIGHT)
        robot.send(c.MoveJ, q=tuple(Q3))
        robot.until_rest()
        left[shaper] = ringing(robot)
    assert left["auto"] < 0.12 * left["none"]
    assert not [event for event in robot.events if event.code == "payload_mismatch"]


def test_where_the_arm_has_no_modal_calibration_it_says_what_to_do():
    robot = Robot()
    reply = robot.send(c.SetShaper, name="auto")
    assert (reply.code, reply.where) == ("out_of_range", "name")
    with pytest.raises(ValueError, match="modes"):
        Robot(shaper="auto")


@pytest.mark.parametrize("modes", [2, 3])
def test_a_shaper_may_have_as_many_modes_as_the_estimator_gives(modes):
    robot = Robot(calibration=POLYNOMIAL)
    assert robot.send(c.SetShaper, name="zv", modes=modes) == Done()
    assert len(robot.tick().estimated_f_d) == modes
    assert robot.controller.assumed.source.name == "modal"
    assert robot.send(c.SetEstimator, name="polynomial").code == "out_of_range"
    assert robot.send(c.SetShaper, name="zv") == Done()
    assert robot.send(c.SetEstimator, name="polynomial") == Done()


def test_a_payload_that_no_calibration_saw():
    robot = Robot(calibration=POLYNOMIAL, shaper="auto")
    odd = Payload(mass=3.3, com=(0.02, -0.03, 0.09), inertia=(0.01, 0.0, 0.0, 0.012, 0.0, 0.008))
    assert robot.send(c.SetPayload, mass=odd.mass, com=odd.com, inertia=odd.inertia) == Done()
    assert robot.send(SimulationReset, payload=odd, q=tuple(Q1)).tick is not None
    robot.send(c.MoveJ, q=tuple(Q3))
    robot.until_rest()
    assert ringing(robot) < 0.1


def test_a_filter_that_cannot_do_what_it_should_says_so_once():
    """Hardly damped modes would need a longer filter than this one gets."""
    robot = Robot()
    slow = {"f_d": (2.0, 3.0, 4.0, 5.0), "zeta": (0.01, 0.01, 0.01, 0.01)}
    assert robot.send(c.SetEstimator, name="fixed", **slow) == Done()
    assert robot.send(c.SetShaper, name="auto") == Done()
    robot.tick(50)
    said = [event for event in robot.events if event.code == "out_of_range"]
    assert len(said) == 1
    assert "auto" in said[0].why
    assert robot.send(c.SetShaper, name="none") == Done()
    robot.tick(5)
    assert robot.send(c.SetShaper, name="auto") == Done()
    robot.tick(5)
    assert len([event for event in robot.events if event.code == "out_of_range"]) == 2


def test_a_clipped_filter_is_a_bit_in_every_state_and_one_event():
    robot = Robot()
    estimator = robot.controller.cycle.tvist.estimator
    for now in (False, True, False, True):
        estimator.clipped = now
        robot.tick(3)
    bits = [state.shaper_clipped for state in robot.states]
    assert bits == [False] * 3 + [True] * 3 + [False] * 3 + [True] * 3
    said = [event.tick for event in robot.events if event.code == "out_of_range"]
    assert said == [4, 10]
