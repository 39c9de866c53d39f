"""Streams are limited by the joints' torque, too."""

import numpy as np
import pytest

from tvist_controller.line.inverse_dynamics import InverseDynamics
from tvist_controller.line.limits import GENTLEST_STOP, TORQUE_SHARE, TorqueRoom
from tvist_controller.setup import body, paper_payload
from tvist_controller.trajectory import MotionLimits

from .robots import PAPER, Q1, Q3, UR5E, H, without_arm
from .streams import swinging

DYNAMICS = InverseDynamics(UR5E, body(paper_payload(UR5E)))
MOST = np.array(UR5E.limits.torque)
ROOM = TorqueRoom(UR5E, DYNAMICS)
STILL = np.zeros(6)


@pytest.mark.parametrize("seed", range(20))
def test_within_the_bound_no_acceleration_passes_the_share_and_at_it_one_reaches_it(seed):
    random = np.random.default_rng(seed)
    q, qd = random.uniform(-3, 3, 6), random.uniform(-1.5, 1.5, 6)
    bound = ROOM.acceleration(q, qd)
    signs = 1 - 2 * ((np.arange(64)[:, None] >> np.arange(6)) & 1)
    shares = [np.abs(DYNAMICS.torque(q, qd, bound * sign) / MOST).max() for sign in signs]
    if bound > GENTLEST_STOP:
        assert max(shares) == pytest.approx(TORQUE_SHARE, rel=1e-9)


def test_little_is_left_where_gravity_takes_most_and_much_where_it_does_not():
    assert 1.5 < ROOM.acceleration(Q1, STILL) < 5.0
    assert ROOM.acceleration(Q3, STILL) > 20.0
    shoulder = np.eye(6)[1]
    assert ROOM.allows(Q1, STILL, 3.0 * shoulder)
    assert not ROOM.allows(Q1, STILL, 40.0 * shoulder)
    assert ROOM.allows(Q1, STILL, np.full(6, GENTLEST_STOP))


@pytest.mark.parametrize("frequency", [1.5, 3.0])
@pytest.mark.parametrize("start", [Q1, Q3])
def test_the_shaped_torque_stays_within_its_share_whatever_the_stream_asks_for(start, frequency):
    """Two per thousand for what lies between a reference and its shaped one."""
    line = without_arm(q=start)
    stream = line.stream(H, MotionLimits(3.0, 40.0, 2000.0))
    motion = swinging([0.05, 0.1, 0.1, 0.1, 0.1, 0.1], frequency, 0.4)
    samples = []
    for k, q in enumerate(motion(np.arange(900) * H)):
        stream.offer(k, start + q)
        samples.append(line.step())
    shares = np.abs([sample.torque for sample in samples]) / MOST
    assert shares.max() <= TORQUE_SHARE * 1.002
    asked = np.array([start + q for q in motion(np.arange(900) * H)])
    needed = [
        np.abs(DYNAMICS.torque(b, (c - a) / (2 * H), (c - 2 * b + a) / H**2) / MOST).max()
        for a, b, c in zip(asked, asked[1:], asked[2:], strict=False)
    ]
    assert (stream.limited > 0) == (max(needed) > TORQUE_SHARE)


def test_a_gentle_stream_passes_to_the_bit_there():
    line = without_arm(q=Q1)
    stream = line.stream(H, PAPER)
    for k, q in enumerate(swinging([0.05, -0.05, 0.05, 0.05, 0.0, 0.05], 0.6)(np.arange(600) * H)):
        stream.offer(k, Q1 + q)
        assert (line.step().reference == Q1 + q).all()
    assert stream.limited == 0
