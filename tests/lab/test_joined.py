"""A robot's log and that of a sensor with a clock of its own are put on one clock, or refused with what to record."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples
from tests.lab.made_logs import G, TwoDevices, write_csv

from tvist_lab.recordings import RecordingError, read
from tvist_lab.recordings.joined import joined
from tvist_lab.recordings.table import SENSOR
from tvist_lab.recordings.two_clocks import at_flange, by_sensor, fits
from tvist_plant.description import load

RECORDED = Path(__file__).parent / "data" / "ur5_stops.csv.gz"
DEGREE = np.pi / 180.0
FORCE = ("timestamp", "actual_tool_accelerometer")


def wrong_by(found, devices):
    """Largest error of a row's time [s], and error of the drift."""
    stamps, values = devices.rows
    first = np.argmin(np.abs(values[:, :3] - found["actual_tool_accelerometer"][0]).sum(axis=1))
    true = ((stamps - devices.offset) / (1.0 + devices.drift))[first : first + len(found)]
    error = found.time - true
    return np.abs(error).max(), abs((error[-1] - error[0]) / (true[-1] - true[0]))


def join(folder, devices, robot=None, sensor=None, columns=None, imu_columns=None, other=None):
    """Write the logs of the robot and of its sensor, or that of other devices, and join them."""
    log = devices.robot(folder / "robot.csv", **(robot or {}))
    imu = (other or devices).sensor(folder / "imu.csv", **(sensor or {}))
    return joined(read(log, columns), imu, imu_columns)


FAULTS = {
    "none": {},
    "rows dropped and repeated": {"dropped": 0.05, "repeated": 0.1},
    "few motions": {"motions": 3},
    "one joint": {"moving": (0,)},
    "slow": {"speed": 0.3},
    "loud": {"noise": (0.1, 0.3), "ringing": 3.0},
    "slow rates": {"robot_rate": 50.0, "sensor_rate": 100.0},
    "fast sensor": {"sensor_rate": 1000.0},
    "a log of seconds since 1970": {"robot_start": 1.7e9},
    "angles that are held": {"held": 4},
    "a long lever": {"lever": 0.3},
    "little rest around": {"spare": -1.0},
}
SURE = set(FAULTS) - {"few motions", "slow", "loud"}


@examples(30)
@given(
    seed=st.integers(0, 10**6),
    offset=st.floats(-5.0, 5.0),
    drift=st.floats(-0.01, 0.01),
    fault=st.sampled_from(sorted(FAULTS)),
    gyroscope=st.booleans(),
)
def test_joined_rows_are_within_3_ms_or_refused(tmp_path_factory, seed, offset, drift, fault, gyroscope):
    devices = TwoDevices(seed, offset, drift, **{"motions": 5} | FAULTS[fault])
    sensor, why = {} if gyroscope else {"names": FORCE}, ""
    try:
        found = join(tmp_path_factory.mktemp("log"), devices, sensor=sensor)
    except RecordingError as error:
        why = str(error)
    if why:
        assert "record both at once" in why
        assert fault not in SURE, why
        return
    late, slope = wrong_by(found, devices)
    # Limits hold for 95 % intervals: where a join is nearly refused, one in twenty is a little beyond.
    slack = 1.0 if fault in SURE else 1.5
    assert late < slack * 3e-3
    assert slope < slack * 2e-4


HEADS = {
    "units found in the numbers": ({"units": (1e-3, DEGREE)}, {"units": (1e-6, G, DEGREE)}, None, None),
    "names of its own": (
        {"names": ("zeit", "achse {}"), "first": 1, "units": (1e-3, DEGREE)},
        {"names": ("t", "a{}", "w{}"), "first": "x", "units": (1e-9, 1e-3 * G, DEGREE)},
        "time=zeit:ms,q=achse {}:deg",
        "time=t:ns,accelerometer=a{}:mg,gyroscope=w{}:deg/s",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", HEADS)
def test_both_logs_may_have_any_units_and_names(tmp_path, kind):
    robot, sensor, columns, imu_columns = HEADS[kind]
    devices = TwoDevices(3, -3.7, 0.004)
    found = join(tmp_path, devices, robot, sensor, columns, imu_columns)
    late, slope = wrong_by(found, devices)
    assert late < 1e-3
    assert slope < 1e-4
    _, values = devices.rows
    place = np.argmin(np.abs(values[:, :3] - found["actual_tool_accelerometer"][0]).sum(axis=1))
    assert found["actual_tool_accelerometer"] == pytest.approx(values[place:, :3][: len(found)], abs=1e-5)
    assert found["actual_tool_gyroscope"] == pytest.approx(values[place:, 3:][: len(found)], abs=1e-5)
    assert found["actual_q"] == pytest.approx(devices.q(found.time), abs=3e-3)


def test_notes_give_offset_and_drift_with_uncertainty(tmp_path):
    notes = " / ".join(join(tmp_path, TwoDevices(5, 2.5, -0.002)).notes)
    assert "joined by its gyroscope" in notes
    assert re.search(r"its clock is 2\.(499|500)\d s ahead \(± 0\.\d ms\)", notes)
    assert re.search(r"runs 0\.(19|20)\d % \(± 0\.0\d\d %\) slow", notes)
    assert "a UR5e's kinematics count" in notes
    notes = join(tmp_path, TwoDevices(5), sensor={"names": FORCE}).notes
    assert any("joined by its accelerometer" in note for note in notes)


def seven_joints(folder):
    t = np.arange(0.0, 3.0, 0.01)
    log = write_csv(folder / "robot.csv", {"timestamp": t, "actual_q": np.sin(t)[:, None] * np.ones(7)})
    return joined(read(log), TwoDevices(1).sensor(folder / "imu.csv"))


def of(sensor=None, other=None, **how):
    return lambda folder: join(folder, TwoDevices(1, **how), sensor=sensor, other=other)


REFUSED = {
    "another motion": (of(other=TwoDevices(2)), "is not that of the joint angles.*record both"),
    "too little motion": (of(stroke=0.02), "too little: record both"),
    "motions that repeat": (of(same=True, motions=6, spare=-0.4), "motions repeat.*record both"),
    "one motion": (of(motions=1), "drift to .*record both"),
    "no accelerometer": (
        of({"names": ("timestamp", "actual_q")}),
        "no actual_tool_accelerometer_0.*--imu-columns",
    ),
    "a rate of raw numbers": (of({"units": (1.0, 1.0, 0.001)}), "are the units"),
    "seven joints": (seven_joints, "7 joints, a UR5e has 6: give the robot with --robot"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_unreliable_join_is_refused(tmp_path, kind):
    attempt, words = REFUSED[kind]
    with pytest.raises(RecordingError, match=words):
        attempt(tmp_path)


SENSELESS = {
    "nothing": lambda t, values: (t, np.full_like(values, np.nan)),
    "zeros": lambda t, values: (t, np.zeros_like(values)),
    "noise": lambda t, values: (t, np.random.default_rng(1).standard_normal(values.shape)),
    "three rows": lambda t, values: (t[:3], values[:3]),
    "a jump in time": lambda t, values: (t + np.where(np.arange(len(t)) > 40, 1e7, 0.0), values),
    "one axis": lambda t, values: (t, values * [0.0, 0.0, 1.0, 0.0, 0.0, 1.0]),
    "huge": lambda t, values: (t, 1e4 * values),
}


@pytest.mark.parametrize("kind", SENSELESS)
def test_wrong_sensor_log_is_refused(tmp_path, kind):
    devices = TwoDevices(6, motions=3)
    t, values = SENSELESS[kind](*devices.sensor_rows())
    log = read(devices.robot(tmp_path / "robot.csv"))
    force = {"timestamp": t, "actual_tool_accelerometer": values[:, :3]}
    for columns in (force | {"actual_tool_gyroscope": values[:, 3:]}, force):
        imu = write_csv(tmp_path / "imu.csv", columns)
        with pytest.raises(RecordingError, match=r"join|imu\.csv"):
            joined(log, imu)


def test_repeated_motions_are_joined_if_the_sensor_rested_around_them(tmp_path):
    devices = TwoDevices(1, 1.25, 0.003, same=True, motions=6, spare=5.0)
    late, slope = wrong_by(join(tmp_path, devices), devices)
    assert late < 1e-3
    assert slope < 1e-4


def test_sensor_of_a_real_arm_is_joined_on_its_clock(tmp_path):
    """Twenty seconds that others have joined, good to 5 ms, so that their drift is good to 5e-4."""
    recorded, offset, drift = read(RECORDED), -70.0, -0.005
    robot = write_csv(tmp_path / "robot.csv", {"timestamp": recorded.time, "actual_q": recorded["actual_q"]})
    force = recorded["actual_tool_accelerometer"]
    late = offset + (1.0 + drift) * recorded.time
    imu = write_csv(tmp_path / "imu.csv", dict(zip(FORCE, (late, force), strict=True)))
    found = joined(read(robot), imu, robot="ur5-light")
    assert len(found) > 0.99 * len(recorded)
    assert "joined by its accelerometer" in found.notes[0]
    angles, sensor = read(robot), read(imu, needs=SENSOR)
    felt = at_flange(load("ur5-light"), angles.time, angles["actual_q"], force=True)
    clocks = fits(felt, by_sensor(sensor.time, force, force=True))[0]
    assert clocks.first(sensor.time) == pytest.approx(recorded.time, abs=0.008)
    assert clocks.drift == pytest.approx(drift, abs=5e-4)
    assert clocks.correlation > 0.99


def test_whole_numbers_are_not_interpolated(tmp_path):
    devices = TwoDevices(2, 0.5)
    t, q = devices.robot_rows()
    columns = {"timestamp": t, "actual_q": q, "mode": np.where(t > 4.0, 7.0, 3.0)}
    log = write_csv(tmp_path / "robot.csv", columns)
    found = joined(read(log), devices.sensor(tmp_path / "imu.csv"))
    assert set(found["mode"]) == {3.0, 7.0}
