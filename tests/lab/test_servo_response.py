"""The lag with which a robot follows set-points, from what was sent and what it measured."""

from dataclasses import replace

import numpy as np
import pytest

from tvist_lab.identification.ring_downs import fresh
from tvist_lab.identification.servo_response import servo_response
from tvist_lab.recordings import Recording
from tvist_lab.study.line import point_to_point
from tvist_plant.plant import PERIOD

LAG, GAIN, DELAY = 0.045, 1800.0, 4


def moves(lag=LAG, gain=GAIN, delay=DELAY, every=1):
    """A turn of the last joint, followed by a servo that is integrated in twenty steps a tick, with noise."""
    random, found = np.random.default_rng(3), []
    for way in (0.1, -0.1):
        target = np.zeros((500, 6))
        reference = point_to_point(np.zeros(6), way * np.eye(6)[5])
        target[50:, 5] = way
        target[50 : 50 + len(reference)] = reference
        q, qd, angles = 0.0, 0.0, []
        for setpoint in target[:, 5]:
            for _ in range(20):
                qd += PERIOD / 20 * gain * (setpoint - q - lag * qd)
                q += PERIOD / 20 * qd
            angles.append(q)
        actual = np.zeros_like(target)
        actual[delay:, 5] = angles[: 500 - delay]
        actual += random.normal(0.0, 1e-6, actual.shape)
        force, ticks = random.normal(0.0, 0.03, (500, 3)), np.arange(500)
        held = ticks // every * every
        columns = {"tick": ticks, "timestamp": PERIOD * ticks, "target_q": target, "actual_q": actual[held]}
        columns["actual_tool_accelerometer"] = force[held]
        found.append(Recording(columns))
    return found


@pytest.mark.parametrize(("lag", "gain", "every"), [(LAG, GAIN, 1), (0.1, 320.0, 4)])
def test_lag_gain_and_delay_are_found_from_every_fourth_row(lag, gain, every):
    found = servo_response(moves(lag, gain, every=every))
    assert found.lag == pytest.approx(lag, rel=0.02)
    assert found.gain == pytest.approx(gain, rel=0.05)
    assert found.delay == pytest.approx(DELAY * PERIOD, abs=0.001)
    for pole in found.poles:
        assert pole**2 + gain * lag * pole + gain == pytest.approx(0.0, abs=0.05 * gain)


def test_arm_that_does_not_follow_like_a_servo_has_no_lag():
    wrong = [
        replace(move, columns={**move.columns, "actual_q": np.round(move["actual_q"], 1)}) for move in moves()
    ]
    assert servo_response(wrong) is None
    assert list(fresh(moves(every=4)[0])[:3]) == [0, 4, 8]
