"""The workspace of an arm is within its limits."""

import numpy as np
import pytest

from tvist_lab.study.moves import MovesError, draw_moves
from tvist_lab.workspace import WORKSPACE, identified, ranges, workspace
from tvist_plant.description import load

ONE_JOINT = load("one-joint")


def test_the_ur5e_s_is_the_one_above_its_stand():
    limits = ranges(load("ur5e"))
    assert workspace(limits) == WORKSPACE
    assert identified(limits).low == (0.0, *WORKSPACE.low[1:])
    assert identified(limits).high == (0.0, *WORKSPACE.high[1:])


def test_an_arm_of_two_joints_has_all_that_its_limits_allow_half_a_turn_either_way():
    region = workspace(ranges(ONE_JOINT))
    assert region.low == pytest.approx((-np.pi, -2.8))
    assert region.high == pytest.approx((np.pi, 2.8))


def test_a_margin_keeps_a_jog_within_the_limits():
    q = identified(ranges(ONE_JOINT), 0.06).spread(500, 2, seed=0)
    assert np.all(q[:, 0] == 0.0)
    assert np.abs(q[:, 1]).max() <= 2.74
    assert np.abs(q[:, 1]).max() > 2.6


def test_limits_narrower_than_the_stand_s_count_for_a_six_joint_arm_too():
    assert workspace([(-1.0, 1.0)] * 6).low == (-1.0,) * 4
    assert workspace([(-1.0, 1.0)] * 6).high == (1.0, 0.0, 1.0, 0.0)


def test_random_moves_of_two_joints_keep_its_limits():
    moves = draw_moves(ONE_JOINT, 50, 0, (1.0, 1.0)).moves
    ends = np.array([end for move in moves for end in (move.start, move.target)])
    assert np.all(np.abs(ends) <= ONE_JOINT.limits.position)


def test_an_arm_without_a_wrist_cannot_turn_it():
    with pytest.raises(MovesError, match="wrists: a one-joint arm has 2 joints"):
        draw_moves(ONE_JOINT, 1, 0, (1.0, 1.0), wrists=True)
