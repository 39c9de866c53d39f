"""A sweep with real processes, some of which are killed: the rows are always the same."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import polars as pl
import pytest
from distributed import Client
from polars.testing import assert_frame_equal
from tests.conformance.served import finished
from tests.places import free_port

SPEC = """
shapers = ["none"]
moves = 48
payloads = [1]
robots = ["one-joint"]
"""
PATIENCE = 200.0
"""After how long a process is taken to hang [s]."""


@pytest.fixture(scope="module")
def spec(tmp_path_factory):
    path = tmp_path_factory.mktemp("sweep") / "spec.toml"
    path.write_text(SPEC, encoding="utf-8")
    return path


def words(spec, folder, *options):
    return ["-m", "tvist_cli", "study", str(spec), "--output", str(folder), "--json", *options]


def begun(*arguments):
    """Start a sweep in a session of its own, whose processes can all be found and signalled."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([sys.executable, *words(*arguments)], start_new_session=True, **pipes)


def done(*arguments):
    """Run a sweep to its end; what it printed."""
    ended = finished(*words(*arguments))
    assert ended.returncode == 0, ended.stderr
    return json.loads(ended.stdout)


def wait_until(holds):
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.02)


def wait_for_part(folder):
    wait_until((folder / "parts" / "000001.parquet").exists)


def session(leader):
    """Processes of a session."""
    found = subprocess.run(
        ["ps", "-o", "pid=", "-s", str(leader)], capture_output=True, text=True, check=False
    )
    return found.stdout.split()


@pytest.fixture(scope="module")
def whole(spec):
    """The rows of a sweep that nothing interrupted."""
    result = done(spec, spec.with_name("whole"), "--processes", "2")
    assert (result["rows"], result["failed"], result["tasks"]) == (48, 0, 48)
    return rows_of(spec.with_name("whole"))


def rows_of(folder):
    assert not list((folder / "parts").iterdir())
    return pl.read_parquet(folder / "rows.parquet")


def test_a_killed_sweep_continues_and_leaves_no_process(spec, whole, tmp_path, monkeypatch):
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    process = begun(spec, tmp_path / "x", "--processes", "2")
    wait_for_part(tmp_path / "x")
    process.kill()
    process.communicate(timeout=PATIENCE)
    wait_until(lambda: not session(process.pid))
    # The next start removes these: tests/system/test_left_behind.py.
    assert all(left.name.startswith("tvist-own-") for left in temporary.iterdir())
    result = done(spec, tmp_path / "x", "--processes", "1")
    assert result["tasks_done_before"] == 32
    assert result["tasks"] == 16
    assert_frame_equal(rows_of(tmp_path / "x"), whole)


@pytest.mark.nightly
def test_control_c_is_a_sentence_keeps_what_is_done_and_leaves_no_process(spec, whole, tmp_path):
    process = begun(spec, tmp_path / "x", "--processes", "2")
    wait_for_part(tmp_path / "x")
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out) == (130, "")
    assert err.startswith("tvist: interrupted: ")
    assert err.endswith(f"they are kept in {tmp_path / 'x'}, and the same command continues\n")
    assert err.count("\n") == 1
    wait_until(lambda: not session(process.pid))
    result = done(spec, tmp_path / "x", "--processes", "2")
    assert result["tasks_done_before"] >= 32
    assert_frame_equal(rows_of(tmp_path / "x"), whole)


@contextmanager
def cluster():
    """Address of a Dask scheduler with two workers."""
    address = f"tcp://127.0.0.1:{free_port()}"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = ["scheduler", "--host", "127.0.0.1", "--port", address.rpartition(":")[2], "--no-dashboard"]
    worker = ["worker", address, "--nworkers", "2", "--nthreads", "1", "--no-dashboard"]
    started = [
        subprocess.Popen([sys.executable, "-m", "dask", *verb], **quiet) for verb in (scheduler, worker)
    ]
    try:
        yield address
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait(timeout=PATIENCE)


def test_a_worker_of_a_cluster_that_is_killed_changes_no_row(spec, whole, tmp_path):
    with cluster() as address:
        process = begun(spec, tmp_path / "x", "--scheduler", address)
        wait_for_part(tmp_path / "x")
        with Client(address, set_as_default=False) as client:
            victim, other = client.run(os.getpid).values()
        os.kill(victim, signal.SIGKILL)
        out, err = process.communicate(timeout=PATIENCE)
    assert victim != other
    assert process.returncode == 0, err
    assert json.loads(out)["failed"] == 0
    assert_frame_equal(rows_of(tmp_path / "x"), whole)


def test_an_address_without_a_scheduler_is_told(spec, tmp_path):
    ended = finished(*words(spec, tmp_path / "x", "--scheduler", "tcp://127.0.0.1:1"))
    assert (ended.returncode, ended.stdout) == (1, "")
    assert ended.stderr == "tvist: no Dask scheduler answers at tcp://127.0.0.1:1\n"
