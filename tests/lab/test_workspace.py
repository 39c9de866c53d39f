"""The workspace of an arm is within its limits; maps tell what calibration and plant tell, each at its place."""

import numpy as np
import pytest
from msgspec.structs import replace

from tvist_controller.api.line import body, estimator_of, load_calibration, paper_payload
from tvist_lab.identification.workspace_map import workspace_map
from tvist_lab.study.moves import draw_moves
from tvist_lab.workspace import WORKSPACE, identified, workspace
from tvist_plant.description import load
from tvist_plant.flexible_arm import FlexibleArm

ONE_JOINT = load("one-joint")


def test_workspace_of_the_ur5e_is_above_its_stand():
    ur5e = load("ur5e")
    assert workspace(ur5e) == WORKSPACE
    assert identified(ur5e).low == (0.0, *WORKSPACE.low[1:])
    assert identified(ur5e).high == (0.0, *WORKSPACE.high[1:])


def test_narrower_joint_limits_reduce_the_workspace():
    region = workspace(ONE_JOINT)
    assert region.low == pytest.approx((-np.pi, -2.8))
    assert region.high == pytest.approx((np.pi, 2.8))
    ur5e = load("ur5e")
    narrow = workspace(replace(ur5e, limits=replace(ur5e.limits, position=(1.0,) * 6)))
    assert (narrow.low, narrow.high) == ((-1.0,) * 4, (1.0, 0.0, 1.0, 0.0))


def test_margin_keeps_a_jog_within_the_limits():
    q = identified(ONE_JOINT, 0.06).spread(500, 2, seed=0)
    assert np.all(q[:, 0] == 0.0)
    assert np.abs(q[:, 1]).max() <= 2.74
    assert np.abs(q[:, 1]).max() > 2.6


def test_random_moves_of_two_joints_keep_the_limits():
    moves = draw_moves(ONE_JOINT, 50, 0, (1.0, 1.0)).moves
    ends = np.array([end for move in moves for end in (move.start, move.target)])
    assert np.all(np.abs(ends) <= ONE_JOINT.limits.position)


@pytest.fixture(scope="module")
def found(ur5e):
    return workspace_map(ur5e, load_calibration("ur5e_5kg"), 5.0, 5)


def test_each_value_of_the_map_belongs_to_its_configuration(ur5e, found):
    free = np.argwhere(np.isfinite(found.true["f_d_hz"]))
    assert found.names == ("shoulder", "elbow")
    assert 0 < len(free) < 25, "some of the corners of the workspace collide"
    arm = FlexibleArm(ur5e, body(paper_payload(ur5e, 5.0)))
    estimator = estimator_of(load_calibration("ur5e_5kg"))
    for row, column in free[::3]:
        q = np.array(found.rest)
        q[found.joints[0]], q[found.joints[1]] = found.angles[0][row], found.angles[1][column]
        true, (f_d, zeta) = arm.modes(q), estimator.estimate(q)
        assert found.true["f_d_hz"][row, column] == pytest.approx(true.f_d[0])
        assert found.identified["f_d_hz"][row, column] == pytest.approx(f_d[0])
        assert found.identified["zeta"][row, column] == pytest.approx(zeta[0])
        assert found.true["zeta"][row, column] == pytest.approx(true.zeta[0])


def test_shipped_calibration_is_accurate_on_the_whole_map(found):
    assert np.nanmax(np.abs(found.error("f_d_hz"))) < 10.0


def test_modal_calibration_is_accurate_with_another_payload(ur5e):
    heavy, light = (workspace_map(ur5e, load_calibration("ur5e_modal"), mass, 3) for mass in (5.0, 1.0))
    assert np.nanmin(light.identified["f_d_hz"]) > np.nanmin(heavy.identified["f_d_hz"]) + 1.0
    assert np.nanmax(np.abs(light.error("f_d_hz"))) < 5.0


def test_arm_of_two_joints_is_mapped_over_both():
    found = workspace_map(load("one-joint"), load_calibration("one-joint_1kg"), 1.0, 5)
    assert found.joints == (0, 1)
    spread = np.nanmax(found.true["f_d_hz"], axis=0) - np.nanmin(found.true["f_d_hz"], axis=0)
    assert np.nanmax(spread) < 1e-6, "turning the base changes no mode"
