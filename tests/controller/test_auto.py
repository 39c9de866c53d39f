"""Filters of constant mean delay in the server: chosen, changed with the payload, inside the limits."""

import numpy as np
import pytest

from tvist_controller.setup import paper_payload
from tvist_controller.sources.calibrations import load
from tvist_protocol import commands as c
from tvist_protocol.replies import Done

from .robots import PAPER, Q3, UR5E, H, Robot

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
