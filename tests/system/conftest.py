"""Served robots, each a process of its own, and sessions with them."""

import gc
import subprocess
import sys

import pytest
from tests import forked
from tests.conformance.conftest import live, lockstep, realtime  # noqa: F401  fixtures
from tests.conformance.served import PATIENCE
from tests.conformance.wire import Wire

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
