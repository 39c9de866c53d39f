"""Motions planned to leave no vibration: they keep their limits, and end where they should."""

import numpy as np
import pytest

from tvist_controller.api.line import ElasticArm, JointLine, load_calibration, paper_payload, quiet_motion

from .robots import PAPER, Q1, Q3, UR5E, H


@pytest.mark.parametrize("speed", [1.0, 0.5])
def test_a_quiet_motion_keeps_the_limits_and_never_turns_back(speed):
    arm = ElasticArm(UR5E, load_calibration("ur5e_modal"), paper_payload(UR5E, 3.0))
    motion = quiet_motion(JointLine(Q1, Q3), PAPER, arm, H, speed)
    q = [Q1]
    while not motion.finished:
        q.append(motion.next())
    steps = np.diff(q, axis=0)
    assert motion.quiet
    np.testing.assert_array_equal(q[-1], Q3)
    assert np.abs(steps).max() / H <= PAPER.velocity * speed * (1.0 + 1e-6)
    assert np.abs(np.diff(steps, axis=0)).max() / H**2 <= PAPER.acceleration * speed**2 * (1.0 + 1e-6)
    assert (steps * np.sign(Q3 - Q1) >= -1e-9).all()
