"""The tool's acceleration is what the sensor feels without gravity."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tvist_lab.metrics import NotMeasurableError, amplitude, best_tool_acceleration, tool_acceleration
from tvist_lab.metrics.vibration import band_pass, low_pass
from tvist_lab.recordings import RecordingError


def test_a_tool_at_rest_in_any_orientation_feels_no_acceleration(make_recording):
    orientations = Rotation.random(200, rng=np.random.default_rng(1))
    force = orientations.inv().apply([0.0, 0.0, 9.81])
    recording = make_recording(ticks=200, rotation=orientations.as_rotvec(), actual_tool_accelerometer=force)
    np.testing.assert_allclose(tool_acceleration(recording), 0.0, atol=1e-12)


def test_acceleration_is_in_the_frame_of_the_flange(make_recording):
    turned = Rotation.from_rotvec([np.pi / 2, 0.0, 0.0])
    world = np.array([0.0, 0.0, 2.0])
    force = turned.inv().apply(world + np.array([0.0, 0.0, 9.81]))
    recording = make_recording(
        ticks=5, rotation=turned.as_rotvec(), actual_tool_accelerometer=np.tile(force, (5, 1))
    )
    alpha = tool_acceleration(recording)
    np.testing.assert_allclose(alpha, np.tile([0.0, 2.0, 0.0], (5, 1)), atol=1e-12)
    np.testing.assert_allclose(amplitude(alpha), 2.0)


def test_truth_takes_the_true_orientation_where_it_was_recorded(make_recording):
    bent = Rotation.from_rotvec([0.0, 0.002, 0.0])
    force = np.tile(bent.inv().apply([0.0, 0.0, 9.81]), (5, 1))
    pose = np.tile([0.0, 0.0, 0.0, *bent.as_rotvec()], (5, 1))
    recording = make_recording(ticks=5, truth_tool_acceleration=force, truth_flange_pose=pose)
    np.testing.assert_allclose(tool_acceleration(recording, truth=True), 0.0, atol=1e-12)


def test_truth_that_was_not_recorded_or_has_holes_is_said(make_recording):
    with pytest.raises(RecordingError, match="was truth recorded"):
        tool_acceleration(make_recording(), truth=True)
    holes = np.full((1500, 3), np.nan)
    with pytest.raises(NotMeasurableError, match="missing at some ticks"):
        tool_acceleration(make_recording(truth=holes), truth=True)
    holes[1:] = 0.0  # a recorder on the network may miss the truth of the first tick
    assert tool_acceleration(make_recording(truth=holes), truth=True, rows=slice(1, None)).shape == (1499, 3)


def test_without_truth_the_sensor_is_taken_below_60_hz(make_recording):
    noise = 0.03 * np.random.default_rng(0).standard_normal((1500, 3))
    loud = amplitude(tool_acceleration(make_recording(alpha=noise)))
    quiet = amplitude(best_tool_acceleration(make_recording(alpha=noise)))
    assert np.mean(loud > 0.1) > 0.005
    assert not np.any(quiet > 0.1)
    true = make_recording(alpha=noise, truth=np.zeros((1500, 3)))
    np.testing.assert_allclose(best_tool_acceleration(true), 0.0, atol=1e-12)


def test_filters_keep_what_is_inside_their_band_in_phase_and_drop_the_rest():
    t = 0.002 * np.arange(2000)
    inside = np.sin(2.0 * np.pi * 15.0 * t)[:, None]
    outside = np.sin(2.0 * np.pi * 150.0 * t)[:, None] + 0.5
    middle = slice(500, 1500)
    np.testing.assert_allclose(low_pass(inside + outside, 0.002)[middle], inside[middle] + 0.5, atol=0.02)
    np.testing.assert_allclose(band_pass(inside + outside, 0.002)[middle], inside[middle], atol=0.02)
