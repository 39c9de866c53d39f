"""Served robots, each a process of its own, and sessions with them."""

import gc

import pytest
from tests.conformance.served import Served
from tests.conformance.wire import Wire


@pytest.fixture(scope="module", autouse=True)
def collected():
    """Put aside what earlier tests left: to look through it would stop a client for a quarter of a second."""
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.fixture(scope="module")
def realtime():
    """A robot in real time."""
    with Served() as served:
        yield served


@pytest.fixture(scope="module")
def lockstep():
    """A robot whose time a client steps."""
    with Served("--clock", "lockstep", "--truth") as served:
        yield served


@pytest.fixture
def live(realtime):
    """A session with the robot in real time."""
    with Wire(realtime.endpoint) as wire:
        yield wire
