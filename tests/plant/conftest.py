"""Robots for the tests of the plant, and a place for the figures they measure (shown by `pytest -v`)."""

import pytest

from tvist_plant.description import RobotDescription, load


@pytest.fixture(scope="session")
def ur5e() -> RobotDescription:
    return load("ur5e")


@pytest.fixture
def measured(request):
    """Note a figure, `measured(what, value)`, that stands in the report whether the test passes or fails."""

    def note(what, value):
        request.node.user_properties.append((what, value))

    return note


def pytest_terminal_summary(terminalreporter):
    if terminalreporter.verbosity < 1:
        return
    for report in (*terminalreporter.getreports("passed"), *terminalreporter.getreports("failed")):
        if report.when == "call":
            for what, value in report.user_properties:
                terminalreporter.write_line(f"{what}: {value}")
