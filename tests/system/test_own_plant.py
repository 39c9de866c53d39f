"""An arm of one's own, given to `tvist serve` by one option: every kind of client moves it, and its faults are told."""

import json
import sys
import time

import pytest
from tests.conformance.served import PATIENCE, Served, refused_to_start
from tests.own_arm import STANDS
from tests.places import own_address
from tests.system.test_command_line import tvist
from tests.system.ur_object import Client

from tvist_client import RefusedError
from tvist_client.blocking import Robot

pytestmark = pytest.mark.realtime

PLACE = f"{sys.modules['tests.own_arm'].__file__}:OwnArm"
HOST = own_address(41)
CLOSE = 5e-3
"""The drives lead by the twist of the gears that the robot file says, and this arm has none [rad]."""


@pytest.fixture(scope="module")
def broken(tmp_path_factory):
    return tmp_path_factory.mktemp("arm") / "fault"


@pytest.fixture(scope="module")
def served(broken):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("OWN_ARM_BROKEN", str(broken))
        with Served("--plant", PLACE, "--ur", "--ur-address", HOST, "--no-floor", cold=True) as served:
            yield served


def beside(change):
    return [float(STANDS[0]) + change, *map(float, STANDS[1:])]


def eventually(true):
    deadline = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < deadline, "it never was so"


def test_it_begins_where_the_arm_stands_and_a_client_moves_it(served):
    with Robot.connect(served.endpoint) as robot:
        assert robot.state().actual_q == pytest.approx(STANDS, abs=CLOSE)
        with robot.control("me") as arm:
            arm.move_j(beside(0.2))
        assert robot.state().target_q == pytest.approx(beside(0.2), abs=CLOSE)
        first = robot.state().tick
        eventually(lambda: robot.state().tick > first)  # the arm gives the ticks


def test_the_command_line_moves_it(served):
    where = ",".join(f"{angle:g}" for angle in beside(0.1))
    tvist("move", where, "--endpoint", served.endpoint).assert_done()


def test_it_cannot_be_put_anywhere(served):
    with (
        Robot.connect(served.endpoint) as robot,
        robot.control("me") as arm,
        pytest.raises(RefusedError, match="OwnArm"),
    ):
        arm.reset(q=beside(0.0))


def test_ur_s_own_client_moves_it(served):
    pytest.importorskip("rtde_control")
    with (
        Client("rtde_control", "RTDEControlInterface", HOST) as arm,
        Client("rtde_receive", "RTDEReceiveInterface", HOST) as seen,
    ):
        assert arm.moveJ(beside(-0.1), 1.0, 1.5)
        eventually(lambda: seen.getActualQ() == pytest.approx(beside(-0.1), abs=CLOSE))
        for _ in range(100):
            assert arm.servoJ(beside(-0.08), 0.0, 0.0, 0.002, 0.03, 1000.0)
        eventually(lambda: abs(seen.getActualQ()[0] - beside(-0.08)[0]) < 1e-3)
        arm.stopScript()


def test_its_fault_stops_the_robot_and_is_told(served, broken):
    with Robot.connect(served.endpoint) as robot:
        written = broken.with_suffix(".new")
        written.write_text("joint 3 is too warm")
        written.replace(broken)  # the arm never reads half of it
        try:
            eventually(lambda: robot.state().safety_mode == 9)
            assert robot.state().robot_mode == 3
            assert "too warm" in json.dumps(str(robot.info()))
        finally:
            broken.unlink()
        with robot.control("me") as arm:
            arm.restart_safety()
            arm.power_on()
            eventually(lambda: _moves(arm))


def _moves(arm):
    try:
        arm.move_j(beside(0.0))
    except RefusedError as refused:
        return "not ready" not in str(refused)
    return True


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--plant", "nobody"), "plant is 'nobody': must be FILE.py:NAME, or one of calibrated, coulomb"),
        (("--plant", PLACE, "--clock", "lockstep"), "clock is lockstep, but the plant"),
        (("--plant", PLACE, "--speed", "2"), "speed is 2, but the plant"),
        (("--plant", PLACE, "--robots", "ur5e*2"), "gives the tick, and there are 2 robots"),
        (("--plant", PLACE, "--truth"), "the plant OwnArm cannot report it"),
        (("--plant", PLACE.replace("OwnArm", "STANDS")), "it must be a class or a function"),
        (("--plant", PLACE.replace("OwnArm", "Measurement")), "making it raises TypeError"),
    ],
)
def test_what_cannot_be_served_is_refused_in_a_sentence(options, said):
    code, words = refused_to_start(*options)
    assert (code, said in words) == (2, True), words


@pytest.mark.parametrize("robot", ["ur5e", "one-joint"])
def test_mujoco_s_arm_is_served_by_its_name(robot):
    options = ("--robot", robot, "--plant", "mujoco", "--clock", "lockstep")
    if robot == "one-joint":
        options += ("--calibration", "none", "--shaper", "none")
    with Served(*options) as served, Robot.connect(served.endpoint) as arm, arm.control("me") as mine:
        before = arm.state().actual_q
        arm.advance(5)
        target = [before[0] + 0.1, *before[1:]]
        mine.move_j(target)
        assert arm.state().actual_q == pytest.approx(target, abs=5e-3)
