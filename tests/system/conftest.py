"""Served robots, each in its own process, and sessions with them."""

import gc
import signal
import subprocess
import sys
from contextlib import ExitStack

import pytest
from tests.conformance.conftest import live, lockstep, realtime  # noqa: F401  fixtures
from tests.conformance.wire import Wire

from tvist_cli import main

from .bystander import Bystander
from .shell import Begun, Ended


@pytest.fixture(scope="module", autouse=True)
def collected():
    """Exclude objects of earlier tests from garbage collection, which would stop a client for 0.25 s."""
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.fixture
def bystander(realtime):  # noqa: F811  the fixture
    """Another client that must not be disturbed; the arm is at Q1."""
    with Wire(realtime.endpoint) as home, home.control("home"):
        pass
    with Bystander(realtime.endpoint) as bystander:
        yield bystander


@pytest.fixture
def start():
    """Return a function that starts a client process and waits until it reports that it is under way."""
    with ExitStack() as processes:

        def start(*arguments):
            command = [sys.executable, *map(str, arguments)]
            process = processes.enter_context(Begun(command, stdout=subprocess.PIPE))
            assert process.stdout.readline() == b"under way\n"
            return process

        yield start


@pytest.fixture
def called(monkeypatch, capfd, tmp_path):
    """Return a function that runs `tvist` in this process; it returns an `Ended`."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(signal, "signal", lambda *_: None)  # this process keeps its handlers
    monkeypatch.setattr("os.nice", lambda _: None)  # and its priority

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["tvist", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main.main()
        return Ended(ended.value.code, *capfd.readouterr())

    return run
