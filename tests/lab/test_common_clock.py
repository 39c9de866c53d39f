"""On the common clock every shaper's delay counts."""

import numpy as np
import pytest

from tvist_lab.metrics import (
    NotMeasurableError,
    envelope,
    in_motion_rms,
    motions,
    peak_acceleration,
    peak_after_stop,
    peak_velocity,
    rigid_acceleration,
    still_after,
    vibration_after_stop,
)
from tvist_lab.recordings import RecordingError

TICKS = 1500


def with_motion(recording):
    return recording, motions(recording)[0]


def loud_until(tick, level=0.2):
    truth = np.zeros((TICKS, 3))
    truth[101 : tick + 1, 1] = level
    return truth


@pytest.mark.parametrize("shaped_ticks", [0, 37])
def test_still_counts_from_the_start_of_the_unshaped_reference_on_the_truth_channel(one_motion, shaped_ticks):
    noise = np.random.default_rng(0).standard_normal((TICKS, 3))
    recording = one_motion(shaped_ticks, truth=loud_until(650), alpha=noise)
    assert still_after(*with_motion(recording)) == pytest.approx(550 * 0.002)


def test_without_truth_the_sensor_tells_within_its_filter(one_motion):
    noise = 0.03 * np.random.default_rng(0).standard_normal((TICKS, 3))
    recording = one_motion(alpha=loud_until(650, 1.0) + noise)
    assert still_after(*with_motion(recording)) == pytest.approx(550 * 0.002, abs=0.012)


def test_an_arm_below_the_threshold_is_still_from_the_start(one_motion):
    assert still_after(*with_motion(one_motion(truth=loud_until(650, 0.09)))) == 0.0


def test_an_arm_that_never_gets_still_is_not_measurable(one_motion):
    with pytest.raises(NotMeasurableError, match="still exceeded"):
        still_after(*with_motion(one_motion(truth=loud_until(TICKS))))


def test_the_peak_after_the_stop_leaves_out_the_last_ramp_and_needs_the_truth(one_motion):
    truth = np.zeros((TICKS, 3))
    truth[541 + 5, 0] = 7.0
    truth[541 + 6, 0] = 0.4
    truth[800, 2] = 0.3
    assert peak_after_stop(*with_motion(one_motion(40, truth=truth))) == pytest.approx(0.4)
    with pytest.raises(RecordingError, match="was truth recorded"):
        peak_after_stop(*with_motion(one_motion()))


def test_the_declared_delay_is_granted_to_a_shaper_and_no_more(one_motion):
    truth = np.zeros((TICKS, 3))
    truth[: 501 + 37 + 1, 0] = 2.0
    truth[501 + 37 + 1, 0] = 0.5
    recording = one_motion(37, truth=truth, shaper_delay=np.full(TICKS, 0.074))
    assert vibration_after_stop(*with_motion(recording))[0] == pytest.approx(0.5)


def test_a_waiting_shaper_that_declares_no_delay_is_judged_while_it_still_moves(one_motion):
    truth = np.zeros((TICKS, 3))
    truth[: 501 + 38, 0] = 2.0
    assert vibration_after_stop(*with_motion(one_motion(37, truth=truth)))[0] == pytest.approx(2.0)


def test_the_envelope_of_a_lightly_damped_ring_down_is_its_amplitude_and_slow_drift_is_none(ring):
    alpha = ring(700, 0, 10.0, 0.02, 1.0, axis=(1.0, 1.0, 1.0), phase=1.0)
    assert np.max(envelope(alpha, 0.002)) == pytest.approx(1.0, abs=0.08)
    drift = np.tile(np.linspace(1.0, 2.0, 700)[:, None], (1, 3))
    assert np.max(envelope(drift, 0.002)[100:600]) < 0.05


def test_the_rigid_acceleration_of_a_turning_tool_points_to_its_axis(make_recording):
    t = 0.002 * np.arange(TICKS)
    q = np.clip(t - 0.2, 0.0, 2.0)
    recording = make_recording(q, np.roll(q, 1))

    def kinematics(joints):
        c, s = np.cos(joints[0]), np.sin(joints[0])
        return np.array([0.9 * c, 0.9 * s, 0.1]), np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    motion = motions(recording)[0]
    rigid = rigid_acceleration(recording, motion, kinematics)
    np.testing.assert_allclose(rigid[5:-5], np.tile([-0.9, 0.0, 0.0], (len(rigid) - 10, 1)), atol=1e-5)

    vibration = np.zeros((TICKS, 3))
    vibration[motion.start : motion.start + len(rigid)] = rigid + np.array([0.0, 0.3, 0.4])
    shaken = make_recording(q, np.roll(q, 1), truth=vibration)
    assert in_motion_rms(shaken, motion, rigid) == pytest.approx(0.5)


def test_the_rigid_motion_cannot_be_told_where_ticks_are_missing(one_motion):
    recording = one_motion()
    kept = np.delete(np.arange(TICKS), 300)
    thinned = type(recording)({name: column[kept] for name, column in recording.columns.items()})
    with pytest.raises(NotMeasurableError, match="ticks are missing"):
        rigid_acceleration(*with_motion(thinned), lambda q: (q[:3], np.eye(3)))


def test_peaks_of_the_shaped_reference_are_those_of_any_joint_within_the_motion(one_motion):
    qdd, qd = np.zeros((2, TICKS, 6))
    qdd[300, 2], qd[400, 4] = -2.3, -1.4
    qdd[900, 0], qd[900, 0] = 50.0, 50.0
    recording, motion = with_motion(one_motion(target_qdd=qdd, target_qd=qd))
    assert peak_acceleration(recording, motion) == 2.3
    assert peak_velocity(recording, motion) == 1.4
