"""Programs ended by signals leave neither processes nor folders behind."""

import os
import select
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import psutil
import pytest
from tests import forked
from tests.conformance.served import NOISE, PATIENCE, Served
from tests.conformance.wire import Wire
from tests.places import free_endpoint
from tests.system.waiting import eventually

from tvist_cli.main import main
from tvist_lab.recordings.mcap_file import read
from tvist_server.own_folder import OwnFolder
from tvist_server.shutdown import ending_signals

SPEC = 'shapers = ["none"]\nmoves = 300\npayloads = [1]\nrobots = ["one-joint"]\n'
"""A study that takes much longer than the test."""
WORKERS = ("--robots", "ur5e*2", "--workers", "2", "--clock", "lockstep")
KILLED_AT_THE_START = """
import os, signal, sys
from tvist_cli.main import main
from tvist_server.workers import Workers
Workers._made = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
sys.argv[0] = "tvist"
main()
"""


def test_command_interrupted_before_its_work_reports_it(monkeypatch, capsys):
    monkeypatch.setattr("tvist_cli.commands.shapers.shapers", lambda: signal.raise_signal(signal.SIGTERM))
    monkeypatch.setattr(sys, "argv", ["tvist", "shapers"])
    handlers = {number: signal.getsignal(number) for number in ending_signals()}
    try:
        with pytest.raises(SystemExit) as ended:
            main()
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    assert ended.value.code == 130
    assert capsys.readouterr().err == "tvist: interrupted\n"


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """Folder for the temporary files of started programs."""
    folder = tmp_path / "t"  # sockets in it have paths of at most 107 bytes
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    return folder


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one core: a study uses one process")
@pytest.mark.parametrize(
    ("number", "to"),
    [
        (signal.SIGTERM, os.kill),
        pytest.param(signal.SIGKILL, os.kill, marks=pytest.mark.nightly),
        pytest.param(signal.SIGHUP, os.killpg, marks=pytest.mark.nightly),  # a closed terminal does this
    ],
)
def test_signal_ends_all_processes_of_a_study(number, to, temporary, tmp_path):
    """tests/lab/test_sweep.py tests that the next start continues the study."""
    (tmp_path / "spec.toml").write_text(SPEC)
    words = [sys.executable, "-m", "tvist_cli", "study", "spec.toml", "--output", "out"]
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
    process = forked.Popen(words, cwd=tmp_path, start_new_session=True, **pipes)
    everyone = psutil.Process(process.pid)

    def working():
        assert process.poll() is None, process.stderr.read()
        children = everyone.children(recursive=True)
        return len([one for one in children if "spawn_main" in " ".join(one.cmdline())]) > 1 and children

    children = eventually(working)
    to(process.pid, number)
    _, said = process.communicate(timeout=PATIENCE)
    assert psutil.wait_procs(children, PATIENCE)[1] == []
    if number is signal.SIGKILL:
        assert all(left.name.startswith("tvist-own-") for left in temporary.iterdir())
    else:
        assert (process.returncode, list(temporary.iterdir())) == (130, [])
        assert said.startswith("tvist: interrupted")
        assert not [word for word in NOISE if word in said]


def test_workers_end_in_order_when_the_main_process_is_killed(temporary, tmp_path):
    names = ("ur5e-1", "ur5e-2")
    with Served(*WORKERS, "--record", str(tmp_path / "run.mcap"), name=None) as served:
        for name in names:
            with Wire(served.endpoint, name) as wire, wire.control() as token:
                wire.step(token, 5)
        workers = psutil.Process(served.process.pid).children()
        served.process.kill()
        assert psutil.wait_procs(workers, PATIENCE)[1] == []
        served.wait()
        assert list(temporary.iterdir()) == []
        assert all(read(tmp_path / f"run-{name}.mcap").complete for name in names)


def test_starting_workers_end_when_the_main_process_is_killed(temporary):
    ours, theirs = os.pipe()
    words = [sys.executable, "-c", KILLED_AT_THE_START, "serve", "--listen", free_endpoint(), *WORKERS]
    process = subprocess.Popen(words, pass_fds=[theirs], stderr=subprocess.DEVNULL)
    os.close(theirs)
    assert process.wait(PATIENCE) == -signal.SIGKILL
    assert select.select([ours], [], [], PATIENCE)[0]  # all processes that inherited the other end have ended
    os.close(ours)
    assert list(temporary.iterdir()) == []


def test_next_start_removes_the_folders_of_killed_processes_only(temporary, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    held = OwnFolder()
    try:
        with Served(*WORKERS, name=None) as served:
            everyone = [psutil.Process(served.process.pid), *psutil.Process(served.process.pid).children()]
            for one in everyone:
                one.suspend()
            for one in everyone:
                one.kill()
            assert psutil.wait_procs(everyone, PATIENCE)[1] == []
            served.wait()
        (left,) = set(temporary.iterdir()) - {held.path}
        (temporary / "tvist-own-linked").symlink_to(Path.home())
        with Served(*WORKERS, name=None):
            assert held.path.exists()
            assert not left.exists()
    finally:
        held.close()
    assert [one.name for one in temporary.iterdir()] == ["tvist-own-linked"]
    assert Path.home().exists()
