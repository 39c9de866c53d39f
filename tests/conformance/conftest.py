"""Served robots, and sessions with them that know nothing of our packages."""

import pytest

from .served import Served
from .wire import Wire


@pytest.fixture(scope="module")
def realtime():
    """A robot in real time, without the option truth."""
    with Served() as served:
        yield served


@pytest.fixture(scope="module")
def lockstep():
    """A robot in lockstep, with the option truth."""
    with Served("--clock", "lockstep", "--truth") as served:
        yield served


@pytest.fixture
def live(realtime):
    with Wire(realtime.endpoint) as wire:
        yield wire


@pytest.fixture
def stepped(lockstep):
    with Wire(lockstep.endpoint) as wire:
        yield wire
