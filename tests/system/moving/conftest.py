"""A robot in its own process, and a bridge that moves it."""

import pytest
from tests.conformance.served import Served
from tests.system.moving.bridge import HOST, OTHER, SPEED, a_bridge, hold, switch_on

from tvist_client.blocking import Robot
from tvist_protocol.modes import RobotMode


@pytest.fixture(scope="module")
def arm():
    """The robot in its own process; like UR's robots it shapes nothing."""
    real = ("--profile", "real", "--shaper", "none", "--hidden", "1001", "--speed", str(SPEED))
    with Served("--ur", "--ur-address", HOST, *real) as served:
        yield served


@pytest.fixture(scope="module")
def shared(arm):
    """The bridge of the tests at the end of a file, which keeps other bridges away."""
    with a_bridge(HOST, "--ur", "--ur-address", OTHER, "--shaper", "zv") as served:
        yield served


@pytest.fixture
def bridge(shared):
    """The shared bridge, which holds the arm; on a busy machine it may have lost it before."""
    with Robot.connect(shared.endpoint, "bridge") as robot, robot.control("me") as control:
        if robot.state().robot_mode == RobotMode.RUNNING:
            hold(robot, control)
        else:
            switch_on(robot, control)
    return shared
