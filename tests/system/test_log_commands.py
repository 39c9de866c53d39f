"""`tvist log`: recordings of a served robot, and logs of other devices."""

import math
import signal

import pytest
from tests.conformance.served import PATIENCE
from tests.conformance.wire import Wire
from tests.lab.made_logs import TwoDevices
from tests.system.shell import Ended, begun, tvist
from tests.system.waiting import eventually, recorded_ticks

NEAR = "0.1,-3.1,0.1,-1.5,0.1,0.1"


@pytest.fixture(scope="module")
def recorded(lockstep, tmp_path_factory):
    """A recording that `tvist log record` made of a motion, and what it said; in lockstep no state is lost."""
    path = tmp_path_factory.mktemp("recorded") / "seen.mcap"
    with begun("log", "record", path, "--endpoint", lockstep.endpoint, "--json") as process:
        assert "recording ur5e into" in process.stderr.readline()
        assert tvist("move", NEAR, "--endpoint", lockstep.endpoint).code == 0
        with Wire(lockstep.endpoint) as wire, wire.control() as token:
            tick = wire.step(token, 400)["tick"]  # what rings after the motion
        eventually(lambda: recorded_ticks(path)[-1:] >= [tick - 100])  # all but the last chunk
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE)
    return path, Ended(process.returncode, out, err)


def test_control_c_ends_an_open_ended_recording_with_exit_code_0(recorded):
    path, ended = recorded
    said = ended.assert_done().json
    assert (said["file"], said["lost"]) == (str(path), 0)
    assert said["states"] > 400


@pytest.mark.realtime
def test_control_c_before_the_time_is_over_keeps_the_recording_and_exits_with_130(realtime, called, tmp_path):
    path = tmp_path / "short.mcap"
    process = begun("log", "record", path, "--endpoint", realtime.endpoint, "--seconds", 600)
    assert "recording" in process.stderr.readline()
    with Wire(realtime.endpoint) as wire:
        wire.until(wire.state()["tick"] + 50)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert f"s recorded into {path}" in err.splitlines()[-1]
    called("log", "analyze", path, "--json").assert_done()


def test_analyze_prints_a_table_of_the_motion_and_draws_it(recorded, called, tmp_path):
    said = called("log", "analyze", recorded[0], "--figures", tmp_path / "drawn").assert_done().out
    assert all(words in said for words in ("1 motion", "RV m/s²", "overshoot", "e_os mm"))
    assert {path.name for path in (tmp_path / "drawn").iterdir()} == {"motion_1.png", "ring_down_1.png"}


def test_a_recording_of_a_client_is_neither_replayed_nor_overwritten(lockstep, recorded, called, tmp_path):
    called("log", "replay", recorded[0]).assert_failed(1, "serve --record")
    called("log", "record", recorded[0], "--endpoint", lockstep.endpoint).assert_failed(1, "exists")
    (tmp_path / "text.mcap").write_text("hello", encoding="utf-8")
    ended = called("log", "analyze", tmp_path / "text.mcap", "--json").assert_failed(1, "no MCAP file")
    assert ended.out == ""


def test_analyze_joins_the_logs_of_a_robot_and_a_sensor(called, tmp_path):
    devices = TwoDevices(4, 2.5, 0.003, motions=3)
    log = devices.robot(tmp_path / "robot.csv", ("zeit", "achse {}"), first=1, units=(1e-3, math.pi / 180.0))
    imu = devices.sensor(tmp_path / "imu.csv", header=False)
    of_robot = ("--columns", "time=zeit:ms,q=achse {}:deg")
    of_imu = ("--imu", imu, "--imu-columns", "time=1,accelerometer=2-4,gyroscope=5-7", "--robot", "ur5e")
    given = (*of_robot, *of_imu)
    analysed = called("log", "analyze", log, *given, "--json").assert_done().json
    assert len(analysed["motions"]) == devices.motions
    assert any("joined by its gyroscope" in note for note in analysed["notes"])
    called("log", "analyze", log, *of_robot, "--imu", log).assert_failed(1, "its columns with --imu-columns")
