"""The log of an accelerometer alone shows frequency and damping of what rings, or of what a sweep excites."""

import json

import numpy as np
import pytest
from scipy.signal import lsim
from tests.lab.made_logs import damped

from tvist_cli.commands.log.analyze import analyze
from tvist_lab.metrics import NotMeasurableError
from tvist_lab.metrics.sensor_alone import free_vibrations
from tvist_lab.recordings import RecordingError, read
from tvist_lab.recordings.table import ROBOT_OR_SENSOR


def klipper(path, rate, alpha, seed=1):
    """Write acceleration along an oblique axis as Klipper does, in mm/s², with gravity and noise."""
    force = np.outer(alpha, [0.6, 0.5, -0.3]) + np.array([0.0, 0.0, 9.81])
    force += 0.04 * np.random.default_rng(seed).standard_normal(force.shape)
    rows = np.column_stack([76.0 + np.arange(len(alpha)) / rate, 1e3 * force])
    np.savetxt(path, rows, "%.6f", ",", header="time,accel_x,accel_y,accel_z", comments="#")
    return path


def ringing(rate, f_d, zeta, begins=(1.0, 3.0), length=5.0):
    since = np.arange(0.0, length, 1.0 / rate)[:, None] - begins
    return 8.0 * np.sum(damped(since, f_d, zeta, 0.4), axis=1)


def swept(rate, f_d, zeta, length=40.0, highest=133.0):
    """A mode that is shaken at 5 Hz to the highest frequency, with an acceleration in proportion to it."""
    since = np.arange(0.0, length + 2.0, 1.0 / rate) - 1.0
    rise, omega = (highest - 5.0) / length, 2.0 * np.pi * f_d / np.sqrt(1.0 - zeta**2)
    shaken = (5.0 + rise * since) / 50.0 * np.sin(2.0 * np.pi * (5.0 + 0.5 * rise * since) * since)
    shaken[(since < 0.0) | (since > length)] = 0.0
    return 3.0 * lsim(([omega**2], [1.0, 2.0 * zeta * omega, omega**2]), shaken, since + 1.0)[1]


@pytest.mark.parametrize(("rate", "f_d", "zeta"), [(500, 9.0, 0.12), (3200, 110.0, 0.02)])
@pytest.mark.parametrize(
    ("kind", "excited", "starts"), [("ring-down", ringing, [77, 79]), ("sweep", swept, [None])]
)
def test_frequency_and_damping_of_ring_downs_and_sweeps_are_found(
    tmp_path, rate, f_d, zeta, kind, excited, starts
):
    recording = read(klipper(tmp_path / "raw.csv", rate, excited(rate, f_d, zeta)), needs=ROBOT_OR_SENSOR)
    found = free_vibrations(recording)
    assert [one.kind for one in found] == [kind] * len(starts)
    for one, start in zip(found, starts, strict=True):
        assert one.f_d_hz == pytest.approx(f_d, rel=0.01)
        assert one.zeta == pytest.approx(zeta, rel=0.05)
        if kind == "ring-down":
            assert start == pytest.approx(one.start_s, abs=0.5 / f_d)
            assert one.f_d_interval_hz[0] < one.f_d_hz < one.f_d_interval_hz[1]


def test_forced_vibration_is_not_measured(tmp_path):
    t = np.arange(0.0, 6.0, 0.002)
    driven = np.where((t > 1.0) & (t < 2.0), np.sin(2.0 * np.pi * (t - 1.0)), 0.0)
    hum = np.where(t > 1.0, 0.5 * np.sin(2.0 * np.pi * 50.0 * t), 0.0)
    for name, alpha in (("rest", 0.0 * t), ("moved", driven), ("hum", hum)):
        recording = read(klipper(tmp_path / f"{name}.csv", 500.0, alpha), needs=ROBOT_OR_SENSOR)
        with pytest.raises(NotMeasurableError, match="neither a ring-down nor a sweep"):
            free_vibrations(recording)


def test_commands_report_an_accelerometer_alone(tmp_path, capsys):
    file = klipper(tmp_path / "raw.csv", 1600, ringing(1600, 41.0, 0.04))
    analyze(file)
    assert "an accelerometer alone" in capsys.readouterr().out
    analyze(file, json=True)
    assert len(json.loads(capsys.readouterr().out)["free_vibrations"]) == 2
    with pytest.raises(RecordingError, match="accelerometer alone, no joint angles: tvist log analyze"):
        read(file)
