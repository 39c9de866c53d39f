"""Metrics of recordings made by hand, of which every answer is known."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.lab.conftest import event, make_recording, one_motion, ring

from tvist_lab.metrics import (
    MotionResult,
    MotionRows,
    NotMeasurableError,
    Runs,
    amplitude,
    analyze,
    attained_position,
    best_tool_acceleration,
    envelope,
    in_motion_rms,
    motions,
    peak_acceleration,
    peak_after_stop,
    peak_velocity,
    residual,
    rigid_acceleration,
    settling,
    still_after,
    table_2,
    table_notes,
    tool_acceleration,
    vibration_after_stop,
)  # fmt: skip
from tvist_lab.recordings import RecordingError

TICKS = 1500


def steps(*spans):
    """A joint that moves by 1 rad in each span of ticks, at constant speed."""
    tick = np.arange(TICKS)
    return sum(np.clip((tick - start) / (stop - start), 0.0, 1.0) for start, stop in spans)


def test_motion_spans_the_last_tick_at_rest_to_the_last_moving_tick():
    assert motions(one_motion()) == [MotionRows(100, 500, 501, 1500)]


def test_delay_excludes_the_tick_of_publication():
    recording = one_motion(shaped_ticks=37)
    (motion,) = motions(recording)
    assert motion.duration(recording) == pytest.approx(0.8)
    assert motion.shaped_duration(recording) == pytest.approx(0.8 + 0.074)
    assert motion.delay(recording) == pytest.approx(0.074)
    unshaped = one_motion()
    assert motions(unshaped)[0].delay(unshaped) == 0.0


def test_events_separate_motions_without_rest():
    reference = steps((100, 500), (501, 900))
    told = ((101, "started", 1), (501, "done", 1), (502, "started", 2), (901, "done", 2))
    events = [event(tick, f"motion_{what}", number) for tick, what, number in told]
    recording = make_recording(reference, np.roll(reference, 1), events=events)
    first, second = motions(recording)
    assert (first.start, first.reference_stop, first.id) == (100, 500, 1)
    assert (second.start, second.reference_stop, second.id) == (501, 900, 2)
    assert first.end == second.start + 1


def test_stopped_motion_is_marked_and_an_empty_one_omitted():
    events = [event(50, "motion_started", 1), event(51, "motion_done", 1)]
    events += [event(101, "motion_started", 2), event(505, "motion_stopped", 2)]
    (motion,) = motions(one_motion(events=events))
    assert motion.id == 2
    assert motion.stopped


def test_a_rest_of_the_reference_starts_a_new_motion():
    reference = steps((100, 300), (400, 500))
    found = [
        (one.start, one.reference_stop, one.end) for one in motions(make_recording(reference, reference))
    ]
    assert found == [(100, 300, 401), (400, 500, 1500)]


def test_reset_of_the_simulation_ends_a_motion():
    reference = steps((100, 500))
    reference[1000:] -= 0.7
    (motion,) = motions(make_recording(reference, np.roll(reference, 1)))
    assert motion == MotionRows(100, 500, 501, 1000)


def test_times_are_right_with_missing_ticks():
    recording = one_motion(shaped_ticks=20)
    kept = np.delete(np.arange(TICKS), np.arange(200, 260))
    thinned = type(recording)({name: column[kept] for name, column in recording.columns.items()})
    (motion,) = motions(thinned)
    assert motion.duration(thinned) == pytest.approx(0.8)
    assert motion.delay(thinned) == pytest.approx(0.040)


def test_robot_at_rest_has_no_motions():
    assert motions(make_recording()) == []
    assert motions(make_recording(ticks=1)) == []


END = np.array([0.3, -0.2, 0.5])


def with_motion(recording):
    return recording, motions(recording)[0]


def along(E, direction=(0.0, 0.0, 1.0)):
    """Positions at signed distances E from the end."""
    return END + np.outer(E, np.array(direction) / np.linalg.norm(direction))


def drawn(points):
    """E over ticks, straight between points (tick, E)."""
    ticks, values = zip(*points, strict=True)
    return np.interp(np.arange(TICKS), ticks, values)


def taken(E, **columns):
    return with_motion(one_motion(position=along(E, (1.0, 2.0, -1.0)), **columns))


# Enters the band (0.03 mm) between ticks 550 and 551, leaves it, and stays in it from between 700 and 701 on.
ONE_SWING = [
    (100, 0.5), (550, 4e-5), (551, 2e-5), (600, 1e-5), (650, 2e-4), (700, 5e-5), (701, 1e-5), (800, 0.0),
]  # fmt: skip


def test_settling_is_interpolated_between_ticks():
    recording, motion = taken(drawn(ONE_SWING))
    settled = settling(recording, motion)
    assert settled.enter == pytest.approx((550.5 - 100) * 0.002, abs=1e-6)
    assert settled.cycle == pytest.approx((700.5 - 100) * 0.002, abs=1e-6)
    assert settled.stabilisation == pytest.approx(150 * 0.002, abs=2e-6)
    assert settled.overshoot == pytest.approx(2e-4)
    np.testing.assert_allclose(attained_position(recording, motion), END, atol=1e-9)


def test_tool_within_the_band_has_no_stabilisation_or_overshoot():
    E = drawn([(100, 0.5), (550, 4e-5), (551, 2e-5), (560, 2.5e-5), (700, 0.0)])
    settled = settling(*taken(E))
    assert settled.stabilisation == settled.overshoot == 0.0
    assert settled.cycle == settled.enter


def test_overshoot_counts_beyond_the_end():
    E = drawn([(100, -0.5), (540, -1e-4), (548, 3e-4), (600, 0.0)])
    settled = settling(*taken(E))
    assert settled.overshoot == pytest.approx(3e-4)
    assert settled.stabilisation > 0.05


@pytest.mark.parametrize(
    ("E", "ticks", "why"),
    [
        (1e-4 * np.sin(0.1 * np.arange(TICKS)), TICKS, r"not settled within 0\.03 mm"),
        (0.0, 560, "at rest for less than"),
        (-drawn([(100, 0.5), (600, 0.0)]), TICKS, "moved by less than"),
    ],
)
def test_settling_is_not_measurable_without_motion_and_rest(E, ticks, why):
    position = along(drawn([(100, 0.5), (600, 0.0)]) + E)[:ticks]
    with pytest.raises(NotMeasurableError, match=why):
        settling(*with_motion(one_motion(ticks=ticks, position=position)))


STOP = 501


@pytest.mark.parametrize(
    ("f_d", "zeta", "axis"), [(15.0, 0.14, (1.0, 0.0, 0.0)), (6.7, 0.1, (1.0, -2.0, 0.5))]
)
def test_rv_of_a_damped_sine_is_its_amplitude(f_d, zeta, axis):
    recording, motion = with_motion(one_motion(alpha=ring(TICKS, STOP, f_d, zeta, 1.2, axis=axis)))
    rv = residual(recording, motion)
    assert rv.fitted
    sigma = 2.0 * np.pi * f_d * zeta / np.sqrt(1.0 - zeta**2)
    # The peaks of |e^(-σt) cos ωt| come before ωt = kπ and lie √(1-ζ²) below the envelope.
    assert rv.value == pytest.approx(1.2 * np.sqrt(1.0 - zeta**2), rel=0.04)
    assert rv.decay == pytest.approx(sigma, rel=0.1)
    assert rv.stop == pytest.approx(0.002 * STOP)


def test_rv_with_fewer_than_two_peaks_is_the_largest_value():
    recording, motion = with_motion(one_motion(alpha=ring(TICKS, STOP, 6.7, 0.34, 0.3)))
    rv = residual(recording, motion)
    assert not rv.fitted
    assert np.isnan(rv.decay)
    first_after_the_stop = np.linalg.norm(ring(TICKS, STOP, 6.7, 0.34, 0.3)[STOP + 1])
    assert rv.value == pytest.approx(first_after_the_stop)
    np.testing.assert_allclose(rv.curve(np.array([1.1, 1.2])), rv.value)


def test_rv_counts_0_3_s_after_the_shaped_stop():
    alpha = np.zeros((TICKS, 3))
    alpha[: STOP + 40 + 1, 0] = alpha[STOP + 40 + 152 :, 0] = 5.0
    assert residual(*with_motion(one_motion(40, alpha=alpha))).value == pytest.approx(0.0, abs=1e-12)


def test_growing_peaks_are_fitted_by_a_constant():
    alpha = np.zeros((TICKS, 3))
    alpha[STOP + 20, 0], alpha[STOP + 60, 0] = 0.2, 0.3
    rv = residual(*with_motion(one_motion(alpha=alpha)))
    assert rv.decay == pytest.approx(0.0, abs=1e-6)
    assert rv.value == pytest.approx(0.25, rel=1e-3)


def loud_until(tick, level=0.2):
    truth = np.zeros((TICKS, 3))
    truth[101 : tick + 1, 1] = level
    return truth


@pytest.mark.parametrize("shaped_ticks", [0, 37])
def test_time_of_rest_counts_from_the_start_of_the_reference(shaped_ticks):
    noise = np.random.default_rng(0).standard_normal((TICKS, 3))
    recording = one_motion(shaped_ticks, truth=loud_until(650), alpha=noise)
    assert still_after(*with_motion(recording)) == pytest.approx(550 * 0.002)


def test_time_of_rest_is_zero_or_not_measurable_at_the_extremes():
    assert still_after(*with_motion(one_motion(truth=loud_until(650, 0.09)))) == 0.0
    with pytest.raises(NotMeasurableError, match="still exceeded"):
        still_after(*with_motion(one_motion(truth=loud_until(TICKS))))


def test_peak_after_the_stop_omits_the_last_ramp_and_needs_the_truth():
    truth = np.zeros((TICKS, 3))
    truth[541 + 5, 0] = 7.0
    truth[541 + 6, 0] = 0.4
    truth[800, 2] = 0.3
    assert peak_after_stop(*with_motion(one_motion(40, truth=truth))) == pytest.approx(0.4)
    with pytest.raises(RecordingError, match="was truth recorded"):
        peak_after_stop(*with_motion(one_motion()))


@pytest.mark.parametrize(("delay", "peak"), [(0.074, 0.5), (0.0, 2.0)])
def test_vibration_counts_from_the_declared_delay(delay, peak):
    truth = np.zeros((TICKS, 3))
    truth[: 501 + 37 + 1, 0] = 2.0
    truth[501 + 37 + 1, 0] = 0.5
    recording = one_motion(37, truth=truth, shaper_delay=np.full(TICKS, delay))
    assert vibration_after_stop(*with_motion(recording))[0] == pytest.approx(peak)


def test_envelope_is_the_amplitude_without_slow_drift():
    alpha = ring(700, 0, 10.0, 0.02, 1.0, axis=(1.0, 1.0, 1.0), phase=1.0)
    assert np.max(envelope(alpha, 0.002)) == pytest.approx(1.0, abs=0.08)
    drift = np.tile(np.linspace(1.0, 2.0, 700)[:, None], (1, 3))
    assert np.max(envelope(drift, 0.002)[100:600]) < 0.05


def test_rigid_acceleration_of_a_turning_tool_points_to_its_axis():
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


def test_peak_acceleration_is_the_largest_of_any_joint():
    qdd, qd = np.zeros((2, TICKS, 6))
    qdd[300, 2], qd[400, 4] = -2.3, -1.4
    qdd[900, 0], qd[900, 0] = 50.0, 50.0
    recording, motion = with_motion(one_motion(target_qdd=qdd, target_qd=qd))
    assert peak_acceleration(recording, motion) == 2.3
    assert peak_velocity(recording, motion) == 1.4


def test_tool_at_rest_in_any_orientation_has_no_acceleration():
    orientations = Rotation.random(200, rng=np.random.default_rng(1))
    force = orientations.inv().apply([0.0, 0.0, 9.81])
    recording = make_recording(ticks=200, rotation=orientations.as_rotvec(), actual_tool_accelerometer=force)
    np.testing.assert_allclose(tool_acceleration(recording), 0.0, atol=1e-12)


def test_acceleration_is_in_the_frame_of_the_flange():
    turned = Rotation.from_rotvec([np.pi / 2, 0.0, 0.0])
    world = np.array([0.0, 0.0, 2.0])
    force = turned.inv().apply(world + np.array([0.0, 0.0, 9.81]))
    rotation, felt = turned.as_rotvec(), np.tile(force, (5, 1))
    recording = make_recording(ticks=5, rotation=rotation, actual_tool_accelerometer=felt)
    alpha = tool_acceleration(recording)
    np.testing.assert_allclose(alpha, np.tile([0.0, 2.0, 0.0], (5, 1)), atol=1e-12)
    np.testing.assert_allclose(amplitude(alpha), 2.0)


def test_missing_truth_is_reported():
    with pytest.raises(RecordingError, match="was truth recorded"):
        tool_acceleration(make_recording(), truth=True)
    holes = np.full((1500, 3), np.nan)
    with pytest.raises(NotMeasurableError, match="missing at some ticks"):
        tool_acceleration(make_recording(truth=holes), truth=True)
    holes[1:] = 0.0  # a recorder on the network may miss the truth of the first tick
    assert tool_acceleration(make_recording(truth=holes), truth=True, rows=slice(1, None)).shape == (1499, 3)


def test_sensor_below_60_hz_replaces_missing_truth():
    noise = 0.03 * np.random.default_rng(0).standard_normal((1500, 3))
    loud = amplitude(tool_acceleration(make_recording(alpha=noise)))
    quiet = amplitude(best_tool_acceleration(make_recording(alpha=noise)))
    assert np.mean(loud > 0.1) > 0.005
    assert not np.any(quiet > 0.1)
    true = make_recording(alpha=noise, truth=np.zeros((1500, 3)))
    np.testing.assert_allclose(best_tool_acceleration(true), 0.0, atol=1e-12)


def result(**values):
    usual = {"start_s": 0.2, "stop_s": 2.0, "delay_ms": 0.0, "stabilisation_ms": 500.0, "cycle_ms": 2300.0}
    return MotionResult(**{**usual, "overshoot_m": 5e-4, "residual_vibration_m_s2": 1.0, **values})


def test_impact_is_the_signed_change_of_means_in_percent():
    unshaped = [result(residual_vibration_m_s2=one, overshoot_m=0.0) for one in (1.0, 1.22)]
    shaped = [result(residual_vibration_m_s2=one, overshoot_m=0.0) for one in (0.10, 0.16)]
    table = table_2({"Q1-Q2": Runs(unshaped, shaped)})
    json.dumps(table, allow_nan=False)
    row = table["Q1-Q2"]
    columns = {"delay_ms", "stabilisation_ms", "cycle_ms", "overshoot_m", "residual_vibration_m_s2"}
    assert set(row["unshaped"]) == set(row["shaped"]) == columns
    assert set(row["impact_percent"]) == {"stabilisation", "cycle", "overshoot", "residual_vibration"}
    assert row["unshaped"]["residual_vibration_m_s2"] == pytest.approx(1.11)
    assert row["shaped"]["residual_vibration_m_s2"] == pytest.approx(0.13)
    assert row["impact_percent"]["residual_vibration"] == pytest.approx(-88.3, abs=0.05)
    assert row["impact_percent"]["cycle"] == 0.0
    assert row["impact_percent"]["overshoot"] is None, "there is no impact on what was nothing before"


def test_unmeasurable_runs_are_omitted_from_the_mean_with_a_note():
    silent = result(overshoot_m=None, notes={"overshoot_m": "the tool had not settled"})
    runs = {"Q1-Q2": Runs([result(), silent, result(overshoot_m=1e-4)], [silent])}
    row = table_2(runs)["Q1-Q2"]
    assert row["unshaped"]["overshoot_m"] == pytest.approx(3e-4)
    assert row["shaped"]["overshoot_m"] is None
    assert row["impact_percent"]["overshoot"] is None
    assert table_notes(runs) == [
        "Q1-Q2 unshaped overshoot_m: the tool had not settled (1 of 3 runs)",
        "Q1-Q2 shaped overshoot_m: the tool had not settled (1 of 1 runs)",
    ]


def test_recording_is_measured_motion_by_motion():
    noise = 0.03 * np.random.default_rng(0).standard_normal((TICKS, 3))
    alpha = ring(TICKS, 538, 10.0, 0.1, 1.0, axis=(0.0, 1.0, 1.0))
    position = np.zeros((TICKS, 3))
    position[:, 0] = np.interp(np.arange(TICKS), [100, 560, 580, 620], [0.5, 0.0, 1e-4, 0.0])
    (measured,) = analyze(one_motion(37, alpha=alpha + noise, truth=alpha, position=position))
    assert measured.start_s == pytest.approx(0.2)
    assert measured.stop_s == pytest.approx(2 * 0.538)
    assert measured.delay_ms == pytest.approx(74.0)
    assert measured.overshoot_m == pytest.approx(1e-4)
    assert measured.residual_vibration_m_s2 == pytest.approx(1.0, rel=0.15)
    assert measured.f_d_hz == pytest.approx(10.0, rel=0.02)
    assert measured.zeta == pytest.approx(0.1, rel=0.1)
    assert measured.still_after_ms == pytest.approx(1e3 * (0.876 + np.log(10.0) / 6.31), abs=60.0)
    assert set(measured.notes) <= {"servo_lag_ms"}  # the made-up arm does not follow


def test_unmeasurable_values_are_null_with_a_reason():
    (measured,) = analyze(one_motion(ticks=560))
    plain = json.loads(json.dumps(measured.as_dict(), allow_nan=False))
    missing = {"stabilisation_ms", "cycle_ms", "overshoot_m", "residual_vibration_m_s2", "f_d_hz", "zeta"}
    missing |= {"f_d_interval_hz", "zeta_interval", "servo_lag_ms"}
    assert {name for name, value in plain.items() if value is None} == missing
    assert set(plain["notes"]) == missing
    assert "0.2 s" in plain["notes"]["f_d_hz"]


def test_unfitted_rv_and_stopped_motion_are_noted():
    events = [event(101, "motion_started", 1), event(501, "motion_stopped", 1)]
    (measured,) = analyze(one_motion(events=events))
    assert measured.residual_vibration_m_s2 is not None
    assert "fewer than two peaks" in measured.notes["residual_vibration_m_s2"]
    assert "stopped" in measured.notes["stop_s"]
