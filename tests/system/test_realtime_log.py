"""Examples with UR's interfaces: a log like that of the paper's authors, and motions with a shaper."""

import csv
import re
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.conformance.served import NOT_REPEATED, PATIENCE, Served, finished
from tests.places import own_address
from tests.system.waiting import eventually

from tvist_client.blocking import Robot
from tvist_lab.recordings.mcap_file import read

EXAMPLES = Path(__file__).parents[2] / "clients" / "examples"
EXAMPLE = EXAMPLES / "02_realtime_log.py"
TICK, BOOTED = 0.002, 40.0
COLUMNS = {
    "q_target": "unshaped_q",
    "qd_target": "unshaped_qd",
    "qdd_target": "unshaped_qdd",
    "q_actual": "actual_q",
    "qd_actual": "actual_qd",
    "tool_vector_actual": "actual_TCP_pose",
    "TCP_speed_actual": "actual_TCP_speed",
    "tool_accelerometer": "actual_tool_accelerometer",
    "robot_mode": "robot_mode",
    "safety_mode": "safety_mode",
    "program_state": "runtime_state",
    "speed_scaling": "speed_scaling",
}
"""Columns of the log, and their names in the recording."""


def logged(path):
    with path.open(encoding="utf-8") as file:
        rows = csv.reader(file)
        names = next(rows)
        values = np.array([[float(value) for value in row] for row in rows])
    columns = {"time": values[:, names.index("time")]}
    for name, ours in COLUMNS.items():
        which = [k for k, found in enumerate(names) if found == name or found.rpartition("_")[0] == name]
        columns[ours] = values[:, which[0]] if len(which) == 1 else values[:, which]
    columns["tick"] = np.round((columns["time"] - BOOTED) / TICK)
    return columns


def last_time(log):
    """Return the time of the last line but one that is complete; later ones may be in the script's buffer."""
    *_, line, _, _ = ["0", "", "", *log.read_bytes()[-20_000:].decode().splitlines()]
    first, _, rest = line.partition(",")
    return float(first) if rest and first.replace(".", "").isdigit() else 0.0


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """The log, and the server's recording of the same time.

    In lockstep each sample waits for the script; in real time a busy machine would lose some.
    """
    folder, host = tmp_path_factory.mktemp("logged"), own_address(1)
    log, recorded = folder / "realtime.csv", folder / "run.mcap"
    options = ("--clock", "lockstep", "--profile", "real", "--ur-address", host, "--record", str(recorded))
    with (
        Served(*options, constants=NOT_REPEATED) as served,
        Robot.connect(served.endpoint) as robot,
        robot.control("mover") as arm,
    ):
        robot.advance(1)  # the state before the first tick is not recorded
        command = [sys.executable, EXAMPLE, host, log]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as logger:
            try:
                assert "logging" in logger.stdout.readline()
                first, *others = robot.state().target_q
                arm.move_j([first + 0.5, *others])
                end = BOOTED + TICK * robot.advance(500)
                eventually(lambda: robot.advance(50) and last_time(log) >= end)
                logger.send_signal(signal.SIGINT)
                said, _ = logger.communicate(timeout=PATIENCE)
            finally:
                logger.kill()
        assert logger.returncode == 0
    return SimpleNamespace(said=said, log=logged(log), recorded=read(recorded).recording)


def test_log_has_every_sample_and_equals_the_recording_to_the_last_bit(both):
    assert " 0 missing" in both.said
    tick = both.log["tick"]
    assert np.all(np.diff(tick) == 1)
    recorded = both.recorded.between(int(tick[0]), int(tick[-1]))
    np.testing.assert_array_equal(recorded["tick"], tick)
    np.testing.assert_array_equal(BOOTED + recorded.time, both.log["time"])
    for name in COLUMNS.values():
        np.testing.assert_array_equal(recorded[name], both.log[name], err_msg=name)


def test_example_uses_the_standard_library_only():
    imported = re.findall(r"^(?:import|from) (\w+)", EXAMPLE.read_text(), re.MULTILINE)
    assert set(imported) <= sys.stdlib_module_names


def test_unreachable_robot_is_reported_in_one_line():
    command = [sys.executable, EXAMPLE, "127.0.0.250"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert ended.stderr.count("\n") == 1
    assert "127.0.0.250:30003" in ended.stderr


@pytest.mark.realtime
@pytest.mark.nightly
def test_tool_vibrates_for_a_shorter_time_with_a_shaper(tmp_path):
    """The figure is in docs/how-to/connect-ur-clients.md."""
    pytest.importorskip("rtde_control")
    figure = tmp_path / "figure.png"
    ended = finished(EXAMPLES / "03_ur_rtde_shaping.py", figure)
    assert ended.returncode == 0, ended.stderr
    unshaped, shaped = (int(until) for until in re.findall(r"until (-?\d+) ms", ended.stdout))
    assert shaped < unshaped - 40
    assert figure.stat().st_size > 0
