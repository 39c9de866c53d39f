"""A robot at rest in the posture Q1, for tests that need no other."""

import pytest

from .robots import Robot


@pytest.fixture
def robot():
    return Robot()
