"""The pytest plugin: fixtures with robots, markers, and the files of failed tests.

It is loaded wherever this package is installed, so it imports only pytest and the standard library; the first
robot imports the rest.
"""

import sys
import traceback
from collections.abc import Callable, Generator
from typing import TYPE_CHECKING

import pytest

from tvist_testing.markers import ROBOTS, described

if TYPE_CHECKING:
    from tvist_testing.fixture_robot import FixtureRobot
    from tvist_testing.serving import RobotOfTest, Serving

_SERVING = pytest.StashKey["Serving"]()
_TOLD = pytest.StashKey[bool]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the command line's options."""
    group = parser.getgroup("tvist", "robots of tvist")
    group.addoption(
        "--tvist-seed",
        type=int,
        default=0,
        metavar="N",
        help="Set the seed of sensor noise and gear errors for robots without the marker tvist_seed [0].",
    )
    group.addoption(
        "--tvist-recordings",
        default="tvist-recordings",
        metavar="DIR",
        help="Keep the recordings and logs of failed tests in this folder [tvist-recordings in the root folder].",
    )
    group.addoption(
        "--tvist-keep-all", action="store_true", help="Keep the recordings and logs of passed tests, too."
    )


def pytest_configure(config: pytest.Config) -> None:
    """Register the markers."""
    for line in described():
        config.addinivalue_line("markers", line)


def pytest_unconfigure(config: pytest.Config) -> None:
    """End the process that makes robots; a session fixture would end before the last test's report."""
    if _SERVING in config.stash:
        config.stash[_SERVING].close()


@pytest.fixture(scope="session")
def _tvist_serving(request: pytest.FixtureRequest) -> "Serving":
    """The maker of robots for this session."""
    from tvist_testing.robots import unavailable

    if (why := unavailable()) is not None:
        pytest.fail(why, pytrace=False)
    from tvist_testing.serving import Serving

    config = request.config
    kept = config.rootpath / config.getoption("tvist_recordings")
    serving = config.stash[_SERVING] = Serving(kept, config.getoption("tvist_seed"))
    return serving


@pytest.fixture
def tvist_robots(
    request: pytest.FixtureRequest, _tvist_serving: "Serving"
) -> Callable[[int], "list[FixtureRobot]"]:
    """Make robots: `tvist_robots(3)` returns three like `tvist_robot` with different names, endpoints and seeds."""
    made: list[FixtureRobot] = []

    def make(count: int) -> "list[FixtureRobot]":
        robots = _tvist_serving.robots(request, count, len(made))
        made.extend(robots)
        return robots

    return make


@pytest.fixture
def tvist_robot(request: pytest.FixtureRequest, _tvist_serving: "Serving") -> "FixtureRobot":
    """The test's own robot in lockstep, ready to be read and moved."""
    return _tvist_serving.robot(request)


@pytest.fixture
def tvist_ur(request: pytest.FixtureRequest, _tvist_serving: "Serving") -> "FixtureRobot":
    """The test's own robot in real time, with UR's interfaces on its own address."""
    return _tvist_serving.robot(request, ur=True)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Report where a failed test's recordings are; at the end of the test, keep or remove them."""
    report = yield
    robots: list[RobotOfTest] = item.stash.get(ROBOTS, [])
    if not robots:
        return report
    told = item.stash.get(_TOLD, False)
    if report.failed and not told:
        item.stash[_TOLD] = told = True
        _tell(item, report, robots)
    if report.when == "teardown":
        keep_all = item.config.getoption("tvist_keep_all")
        if keep_all and not told:
            _note(item, report, robots)
        if call.excinfo is None:
            _release_locals()
        for robot in robots:
            if told or keep_all:
                robot.keep()
            else:
                robot.discard()
        del item.stash[ROBOTS]
        item.stash[_TOLD] = False  # a test may run again
    return report


def _release_locals() -> None:
    """Release the last failure's local variables after its report, so that clients among them end now.

    A robot continues while a client of UR's interfaces is connected; see `forked_robot`.
    """
    error, seen = getattr(sys, "last_value", None), set[int]()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        traceback.clear_frames(error.__traceback__)
        error = error.__cause__ or error.__context__


def _tell(item: pytest.Item, report: pytest.TestReport, robots: "list[RobotOfTest]") -> None:
    _note(item, report, robots)
    add = getattr(report.longrepr, "addsection", lambda *section: report.sections.append(section))
    for robot in robots:
        add(f"tvist: robot {robot.recording.stem}", robot.described())


def _note(item: pytest.Item, report: pytest.TestReport, robots: "list[RobotOfTest]") -> None:
    """Add paths and seeds to JUnit and other reports."""
    properties = [one for robot in robots for one in robot.properties()]
    item.user_properties += properties  # for later reports
    report.user_properties += properties
