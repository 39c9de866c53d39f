"""Motions whose shaped reference keeps the limits, at any limits."""

import numpy as np
import pytest
from tests.controller.robots import UR5E, H, setup

from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.planning.fitting import keeping_motion, shaped_ahead
from tvist_controller.sources.calibrations import load
from tvist_controller.trajectory import JointLine, MotionLimits, quickest_motion
from tvist_lab.study.moves import draw_moves

INDUSTRIAL = MotionLimits(3.0, 8.0, 2000.0)


def peak(motion, tvist):
    return np.abs(np.diff(shaped_ahead(motion, tvist), 2, axis=0)).max() / H**2


@pytest.mark.parametrize("shaper", ["auto", "short"])
def test_fast_moves_keep_the_limit_of_acceleration(shaper):
    moves = draw_moves(UR5E, 12, 2024, (5.0, 5.0)).moves
    tvist = FilterPlanner(setup(shaper=shaper, calibration=load("ur5e_modal"))).first().tvist
    for move in moves:
        path = JointLine(np.array(move.start), np.array(move.target))
        motion = keeping_motion(path, INDUSTRIAL, tvist)
        assert peak(motion, tvist) <= INDUSTRIAL.acceleration
        assert motion.duration <= 1.02 * quickest_motion(path, INDUSTRIAL, H).duration


def test_a_filter_that_exceeds_more_is_spared_more():
    tvist = FilterPlanner(setup(shaper="auto", calibration=load("ur5e_modal"))).first().tvist
    tvist.excess = 1e-12  # as if nothing were known of its excess
    slower = 0
    for move in draw_moves(UR5E, 8, 7, (5.0, 5.0)).moves:
        path = JointLine(np.array(move.start), np.array(move.target))
        motion = keeping_motion(path, INDUSTRIAL, tvist)
        assert peak(motion, tvist) <= INDUSTRIAL.acceleration
        slower += motion.duration > quickest_motion(path, INDUSTRIAL, H).duration
    assert slower > 0


def test_easy_moves_are_planned_as_ever():
    tvist = FilterPlanner(setup(shaper="auto", calibration=load("ur5e_modal"))).first().tvist
    path, limits = JointLine(np.zeros(6), np.full(6, 0.5)), MotionLimits(1.5, 2.0, 100.0)
    spared = MotionLimits(1.5, 2.0 * (1.0 - tvist.excess), 100.0)
    assert keeping_motion(path, limits, tvist).duration == quickest_motion(path, spared, H).duration
