"""`tvist serve --plant ur://… --enable-motion`, here called the bridge, and what moves and watches its robot."""

import contextlib

import numpy as np
from tests.conformance.served import Served
from tests.places import own_address
from tests.system.test_ur_lockstep import dashboard
from tests.system.waiting import eventually

from tvist_client import RefusedError
from tvist_client.blocking import Robot
from tvist_server.moving.moved_robot import SILENT

HOST, NEAR, OTHER, NOBODY = (own_address(last) for last in (51, 52, 53, 54))
DASHBOARD, PRIMARY, SECONDARY, RTDE = 29999, 30001, 30002, 30004
SPEED = 0.2  # of the robot's time, so that a busy machine keeps up
SLOWED_DOWN = {"tvist_server.moving.moved_robot.SILENT": SILENT / SPEED}
"""Constants of a bridge whose robot is slowed down."""
STEP = 0.002  # largest step of the robot's target that is not part of a motion [rad]


@contextlib.contextmanager
def a_bridge(host=HOST, *options):
    motion = ("--plant", f"ur://{host}", "--enable-motion")
    with Served(*motion, *options, name="bridge", constants=SLOWED_DOWN) as served:
        with Robot.connect(served.endpoint, "bridge") as robot, robot.control("me") as control:
            hold(robot, control)
        yield served


@contextlib.contextmanager
def sides(arm, bridge):
    """Yield a client of the robot, a client of the bridge, and control of the bridge."""
    with (
        Robot.connect(arm.endpoint) as there,
        Robot.connect(bridge.endpoint, "bridge") as robot,
        robot.control("me") as control,
    ):
        yield there, robot, control


def refused(do, words):
    """Return whether something is refused, with these words."""
    why = ""
    try:
        do()
    except RefusedError as error:
        why = str(error)
    assert not why or words in why, why
    return bool(why)


def still(robot, control):
    """Return a function that moves the arm to its present posture."""
    return lambda: control.move_j(robot.state().target_q, velocity=0.3)


def hold(robot, control):
    """Wait until the bridge holds the arm."""
    eventually(lambda: not refused(still(robot, control), "not ready"))


def switch_on(robot, control):
    """Power on as soon as the robot permits it; until then motions are refused."""

    def switched():
        assert refused(still(robot, control), "send power_on")
        return not refused(control.power_on, "is not moved")

    eventually(switched)
    hold(robot, control)


def beside(robot, change):
    first, *others = robot.state().target_q
    return [first + change, *others]


@contextlib.contextmanager
def states_of(robot):
    states = []
    stop = robot.on_state(states.append)
    try:
        yield states
    finally:
        stop()


def speed(state):
    return max(map(abs, state.target_qd))


def largest_step(states):
    """Return the largest change of a joint's target in a control period [rad]."""
    ticks = np.array([state.tick for state in states])
    targets = np.array([state.target_q for state in states])
    return float((np.abs(np.diff(targets, axis=0)).max(axis=1) / np.diff(ticks)).max())


def tell(*lines):
    """Send lines to the robot's dashboard; return its answers."""
    with dashboard(HOST) as spoken:
        return [spoken.ask(line) for line in lines]
