"""Robots for the tests of the plant."""

import pytest

from tvist_plant.description import RobotDescription, load


@pytest.fixture(scope="session")
def ur5e() -> RobotDescription:
    return load("ur5e")
