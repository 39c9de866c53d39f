"""The paper's experiment, logged as its authors did: through UR's real-time interface, with its published layout.

The log's target is the reference before shaping, a tick later. The shaped one is that of the recording.
"""

import asyncio
import csv
import re
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.conformance.served import PATIENCE
from tests.places import own_address

from tvist_lab.metrics import Runs, measure, motions, table_2
from tvist_lab.metrics.motion import JUMP
from tvist_lab.recordings import Recording
from tvist_lab.recordings.mcap_file import read
from tvist_lab.served import served
from tvist_lab.studies.paper.experiment import SHAPED, UNSHAPED, run
from tvist_lab.studies.paper.published import MOTIONS

EXAMPLE = Path(__file__).parents[2] / "clients/examples/02_realtime_log.py"
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
"""Of the log and of the recording."""

ELSEWHERE = (0.0, -2.0, 0.5, -1.0, 0.0, 0.0)
"""Where the arm is put between runs, so that the log shows where each begins."""
MADE = [*MOTIONS][:1]

pytestmark = pytest.mark.timeout(900)


def logged(path):
    """The log as columns."""
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


async def experiment(options, host, log):
    """A motion, unshaped and shaped; what the script says at its end."""
    async with served(options) as server, server.robot.control("experiment") as arm:
        logger = await asyncio.create_subprocess_exec(
            sys.executable, EXAMPLE, host, log, stdout=asyncio.subprocess.PIPE
        )
        try:
            assert b"logging" in await logger.stdout.readline()
            for motion in MADE:
                for method in (UNSHAPED, SHAPED):
                    await run(server.robot, arm, motion, method, seed=7)
                    await arm.reset(q=ELSEWHERE)
                    await server.robot.advance(5)
            await until_logged(server.robot, Path(log))
            logger.send_signal(signal.SIGINT)
            said, _ = await asyncio.wait_for(logger.communicate(), PATIENCE)
        finally:
            if logger.returncode is None:
                logger.kill()
                await logger.wait()
    assert logger.returncode == 0
    return said.decode()


async def until_logged(robot, log):
    """Let time pass until everything that has been stands in the log."""
    end = BOOTED + TICK * await robot.advance(500)
    async with asyncio.timeout(PATIENCE):
        while last_time(log) < end:
            await robot.advance(50)


def last_time(log):
    """Of the last whole line but one; what comes behind may still be in the script's buffer."""
    *_, line, _, _ = ["0", "", "", *log.read_bytes()[-20_000:].decode().splitlines()]
    first, _, rest = line.partition(",")
    return float(first) if rest and first.replace(".", "").isdigit() else 0.0


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """The log, and the recording that the server made at the same time.

    In lockstep, where every sample waits for the script: in real time a busy machine makes holes in it.
    """
    folder = tmp_path_factory.mktemp("logged")
    log, recorded = folder / "realtime.csv", folder / "run.mcap"
    host = own_address(1)
    options = ["--clock", "lockstep", "--profile", "real", "--ur-address", host, "--record", str(recorded)]
    said = asyncio.run(experiment(options, host, str(log)))
    return SimpleNamespace(said=said, log=logged(log), recorded=read(recorded).recording)


def test_no_sample_is_missing(both, measured):
    measured("log", both.said.strip())
    assert " 0 missing" in both.said
    assert np.all(np.diff(both.log["tick"]) == 1)


def test_the_log_says_what_the_recording_does_to_the_last_bit(both):
    tick = both.log["tick"]
    recorded = both.recorded.between(int(tick[0]), int(tick[-1]))
    np.testing.assert_array_equal(recorded["tick"], tick)
    np.testing.assert_array_equal(BOOTED + recorded.time, both.log["time"])
    for name in COLUMNS.values():
        np.testing.assert_array_equal(recorded[name], both.log[name], err_msg=name)


def runs_of(log):
    """First and last row of each run: they move, and lie between resets."""
    jumps = 1 + np.flatnonzero(np.abs(np.diff(log["unshaped_q"], axis=0)).max(axis=1) > JUMP)
    ends = [*jumps, len(log["tick"])]
    spans = list(zip([0, *jumps], ends, strict=True))
    return [(a, b) for a, b in spans if np.ptp(log["unshaped_q"][a:b], axis=0).max() > JUMP]


def recordings(log, recorded):
    """Each run with its reference, which is the log's target a tick earlier, and the shaped one of the recording."""
    found = []
    for first, past in runs_of(log):
        target = log["unshaped_q"][first:past]
        columns = {name: column[first:past] for name, column in log.items() if name != "time"}
        columns |= {
            "timestamp": log["time"][first:past],
            "reference_q": np.concatenate([target[1:], target[-1:]]),
        }
        rows = recorded.between(int(columns["tick"][0]), int(columns["tick"][-1]))
        columns |= {name: rows[name] for name in ("target_q", "target_qd", "target_qdd")}
        found.append(Recording(columns))
    return found


def table(results):
    return table_2(
        {motion: Runs([results[2 * number]], [results[2 * number + 1]]) for number, motion in enumerate(MADE)}
    )


def test_table_2_from_the_log_equals_table_2_from_the_recording(both, measured):
    runs = recordings(both.log, both.recorded)
    assert len(runs) == 2 * len(MADE)
    ours, theirs = [], []
    for one in runs:
        whole = both.recorded.between(int(one["tick"][0]), int(one["tick"][-1]))
        ours.append(measure(one, motions(one)[0]))
        theirs.append(measure(whole, motions(whole)[0]))
    from_log, from_recording = table(ours), table(theirs)
    for motion, rows in from_recording.items():
        for kind, row in rows.items():
            measured(f"{motion} {kind}", row)
            assert from_log[motion][kind] == pytest.approx(row, rel=1e-9, abs=1e-9), (motion, kind)
            assert None not in row.values()


def test_the_script_uses_nothing_but_python():
    imported = re.findall(r"^(?:import|from) (\w+)", EXAMPLE.read_text(), re.MULTILINE)
    assert set(imported) <= sys.stdlib_module_names


def test_it_says_in_a_sentence_that_nobody_listens():
    ended = subprocess.run(
        [sys.executable, EXAMPLE, "127.0.0.250"], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1
    assert ended.stderr.count("\n") == 1
    assert "127.0.0.250:30003" in ended.stderr
