"""A program that a signal ends leaves neither processes nor folders behind, whatever the signal."""

import os
import select
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest
from tests.conformance.served import NOISE, PATIENCE, Served
from tests.places import free_endpoint
from tests.system.test_sweep import wait_until

from tvist_cli.main import main
from tvist_server.ending import ending_signals

STUDIES = {
    "moves": ["study", "moves", "--moves", "400"],
    "sweep": ["study", "spec.toml", "--output", "out"],
}
"""Each takes much longer than it is waited for; all end by the same runner."""
SPEC = 'shapers = ["none"]\nmoves = 4000\npayloads = [1]\nrobots = ["one-joint"]\n'
WORKERS = ("--robots", "ur5e*3", "--workers", "2", "--clock", "lockstep")
TOLD_AT_THE_START = """
import os, signal, sys
from tvist_cli.main import main
from tvist_server.workers import Workers
Workers._made = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
sys.argv[0] = "tvist"
main()
"""


def test_a_command_that_is_interrupted_before_its_work_begins_says_so(monkeypatch, capsys):
    monkeypatch.setattr("tvist_cli.commands.shapers.shapers", interrupted)
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


def interrupted() -> None:
    """A command at its beginning, when it is interrupted."""
    signal.raise_signal(signal.SIGTERM)


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """Where the programs that the test starts have their temporary files."""
    folder = tmp_path / "t"  # sockets in it have paths of at most 107 bytes
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    return folder


def begun(study, folder):
    """A study that has begun, with all its processes."""
    (folder / "spec.toml").write_text(SPEC)
    words = [sys.executable, "-m", "tvist_cli", *STUDIES[study]]
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
    process = subprocess.Popen(words, cwd=folder, start_new_session=True, **pipes)
    everyone = psutil.Process(process.pid)

    def working():
        assert process.poll() is None, process.stderr.read()
        return (
            sum("spawn_main" in " ".join(child.cmdline()) for child in everyone.children(recursive=True)) > 1
        )

    wait_until(working)
    return process, everyone.children(recursive=True)


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one core: everything is done in one process")
@pytest.mark.parametrize(
    ("study", "number", "to"),
    [
        ("moves", signal.SIGTERM, os.kill),
        ("moves", signal.SIGHUP, os.killpg),  # as a terminal does that is closed
        ("sweep", signal.SIGHUP, os.killpg),
        ("sweep", signal.SIGTERM, os.killpg),  # as a supervisor does
    ],
)
def test_a_signal_ends_a_study_with_its_processes_in_order(study, number, to, temporary, tmp_path):
    process, children = begun(study, tmp_path)
    to(process.pid, number)
    _, said = process.communicate(timeout=PATIENCE)
    assert psutil.wait_procs(children, PATIENCE)[1] == []
    assert process.returncode == 130
    assert said.startswith("tvist: interrupted")
    assert not [word for word in NOISE if word in said]
    assert list(temporary.iterdir()) == []


def test_workers_end_and_remove_their_folder_when_the_first_process_is_killed(temporary):
    served = Served(*WORKERS, name=None)
    try:
        served.wait_until_ready()
        workers = psutil.Process(served.process.pid).children()
        served.process.kill()
        assert psutil.wait_procs(workers, PATIENCE)[1] == []
        assert list(temporary.iterdir()) == []
    finally:
        served.kill()


def test_workers_that_just_begin_do_so_too(temporary):
    ours, theirs = os.pipe()
    words = [sys.executable, "-c", TOLD_AT_THE_START, "serve", "--listen", free_endpoint(), *WORKERS]
    process = subprocess.Popen(words, pass_fds=[theirs], stderr=subprocess.DEVNULL)
    os.close(theirs)
    assert process.wait(PATIENCE) == -signal.SIGKILL
    assert select.select([ours], [], [], PATIENCE)[0]  # all that inherited the other end have ended
    os.close(ours)
    assert list(temporary.iterdir()) == []


def test_the_next_start_removes_what_killed_processes_left_and_nothing_else(temporary):
    def killed():
        served = Served(*WORKERS, name=None)
        try:
            served.wait_until_ready()
            everyone = [psutil.Process(served.process.pid), *psutil.Process(served.process.pid).children()]
            for one in everyone:
                one.suspend()
            for one in everyone:
                one.kill()
            assert psutil.wait_procs(everyone, PATIENCE)[1] == []
        finally:
            served.kill()

    killed()
    (left,) = temporary.iterdir()
    with Served(*WORKERS, name=None):
        (held,) = temporary.iterdir()
        assert held != left
        killed()
        assert held in temporary.iterdir()
    (temporary / "tvist-own-linked").symlink_to(Path.home())
    with Served(*WORKERS, name=None):
        assert len(list(temporary.iterdir())) == 2
    assert [one.name for one in temporary.iterdir()] == ["tvist-own-linked"]
    assert Path.home().exists()
