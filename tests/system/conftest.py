"""Served robots, each a process of its own, and sessions with them."""

import gc
import signal
import subprocess
import sys

import pytest
from tests import forked
from tests.conformance.conftest import live, lockstep, realtime  # noqa: F401  fixtures
from tests.conformance.served import PATIENCE
from tests.conformance.wire import Wire

from tvist_cli import main

from .bystander import Bystander


@pytest.fixture(scope="module", autouse=True)
def collected():
    """Put aside what earlier tests left: to look through it would stop a client for a quarter of a second."""
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.fixture
def bystander(realtime):  # noqa: F811  the fixture
    """Somebody else, and the arm at Q1."""
    with Wire(realtime.endpoint) as home, home.control("home"):
        pass
    with Bystander(realtime.endpoint) as bystander:
        yield bystander


@pytest.fixture
def start():
    """Start a client process; it says when it does what it was asked to."""
    processes = []

    def start(*arguments):
        process = forked.Popen([sys.executable, *map(str, arguments)], stdout=subprocess.PIPE)
        processes.append(process)
        assert process.stdout.readline() == b"under way\n"
        return process

    yield start
    for process in processes:
        process.kill()
        process.wait(PATIENCE)
        process.stdout.close()


@pytest.fixture
def called(monkeypatch, capfd, tmp_path):
    """Run the program in this process, as the console script does; its exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(signal, "signal", lambda *_: None)  # this process keeps its own

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["tvist", *arguments])
        with pytest.raises(SystemExit) as ended:
            main.main()
        out, err = capfd.readouterr()
        return ended.value.code, out, err

    return run
