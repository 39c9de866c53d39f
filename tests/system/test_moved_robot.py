"""`tvist serve --plant ur://… --enable-motion` moves a robot in another process, and stops with it."""

import time

import pytest
from tests.conformance.served import PATIENCE, refused_to_start
from tests.places import own_address
from tests.system.moved_robot import (
    Link,
    a_bridge,
    a_robot,
    largest_step,
    protective_stop,
    states_of,
    tell,
)
from tests.system.test_command_line import tvist
from tests.system.ur_object import Client

from tvist_client import RefusedError
from tvist_client.blocking import Robot
from tvist_protocol.modes import RobotMode

pytestmark = pytest.mark.realtime

HOST, NEAR, OTHER, NOBODY = (own_address(last) for last in (51, 52, 53, 54))
STEP = 0.002
"""Largest step of the robot's target beside its motions [rad]."""


@pytest.fixture(scope="module")
def arm():
    with a_robot(HOST) as served:
        yield served


@pytest.fixture
def bridge(arm):
    with a_bridge(HOST) as served:
        wait_until_it_follows(served)
        yield served


def eventually(true):
    deadline = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < deadline, "it never was so"


def wait_until_it_follows(served):
    with Robot.connect(served.endpoint, "bridge") as robot, robot.control("me") as control:
        move_by_nothing(robot, control)


def move_by_nothing(robot, control):
    """Move by nothing as soon as the arm is held."""

    eventually(lambda: not refused(lambda: control.move_j(robot.state().target_q, velocity=0.3), "not ready"))


def refused(do, words):
    """Whether something is refused, which is then said in these words."""
    try:
        do()
    except RefusedError as refusal:
        why = str(refusal)
    else:
        return False
    assert words in why, why
    return True


def beside(robot, change):
    q = list(robot.state().target_q)
    q[0] += change
    return q


def test_a_client_moves_it_and_no_joint_is_faster_than_the_cap(arm, bridge):
    with (
        Robot.connect(arm.endpoint) as there,
        Robot.connect(bridge.endpoint, "bridge") as robot,
        robot.control("me") as control,
    ):
        goal = beside(robot, 0.4)
        with states_of(there) as states:
            control.move_j(goal, velocity=0.5)
            robot.advance(250)
        assert robot.info().limits.velocity == [0.5] * 6
        assert there.state().target_q == pytest.approx(goal, abs=1e-3)
        assert robot.state().actual_q == pytest.approx(there.state().actual_q, abs=2e-3)
        assert max(max(map(abs, state.target_qd)) for state in states) < 0.55
        assert largest_step(states) < 0.55 * 0.002
        control.move_j(beside(robot, -0.4), velocity=0.5)


def stopped(bridge, how, words, *, mode):
    """Stop the robot in a motion; what the bridge says has these words, and its state is this safety mode."""
    with Robot.connect(bridge.endpoint, "bridge") as robot, robot.control("me") as control:
        goal = beside(robot, 0.3)
        control.move_j(goal, velocity=0.4, wait=False)
        robot.advance(150)
        how()
        bridge.wait_until_said(words)
        eventually(lambda: robot.state().safety_mode == mode)
        with pytest.raises(RefusedError):
            control.move_j(goal)


def test_a_protective_stop_is_unlocked_at_the_robot_and_then_here(arm, bridge):
    stopped(bridge, lambda: protective_stop(HOST), "it has made a protective stop", mode=3)
    with (
        Robot.connect(arm.endpoint) as there,
        Robot.connect(bridge.endpoint, "bridge") as robot,
        robot.control("me") as control,
    ):
        with pytest.raises(RefusedError, match="clear that at the robot"):
            control.unlock_protective_stop()
        with states_of(there) as states:
            eventually(lambda: tell(HOST, "unlock protective stop") == ["Protective stop releasing"])
            eventually(lambda: not refused(control.unlock_protective_stop, "at the robot"))
            move_by_nothing(robot, control)
            there.advance(50)
        assert largest_step(states) < STEP
        assert robot.state().target_q == pytest.approx(there.state().target_q, abs=1e-3)
        control.move_j(beside(robot, -0.1), velocity=0.4)


@pytest.mark.parametrize(
    ("command", "words"),
    [("stop", "its program was stopped at the robot"), ("pause", "its program was paused")],
)
def test_a_program_that_is_ended_at_the_robot_is_begun_again_where_the_arm_stands(
    arm, bridge, command, words
):
    stopped(bridge, lambda: tell(HOST, command), words, mode=1)
    with (
        Robot.connect(arm.endpoint) as there,
        Robot.connect(bridge.endpoint, "bridge") as robot,
        robot.control("me") as control,
    ):
        if command == "pause":
            with pytest.raises(RefusedError, match="is paused"):
                control.power_on()
            tell(HOST, "stop")
        with states_of(there) as states:
            eventually(lambda: not refused(control.power_on, "is not moved"))
            move_by_nothing(robot, control)
        assert largest_step(states) < STEP
        control.move_j(beside(robot, -0.1), velocity=0.4)


def test_an_arm_without_power_is_switched_on_at_the_robot_and_then_here(arm, bridge):
    stopped(bridge, lambda: tell(HOST, "power off"), "its program was stopped at the robot", mode=1)
    with (
        Robot.connect(arm.endpoint) as there,
        Robot.connect(bridge.endpoint, "bridge") as robot,
        robot.control("me") as control,
    ):
        eventually(lambda: there.state().robot_mode == RobotMode.POWER_OFF)
        there.advance(100)
        with pytest.raises(RefusedError, match="switch it on and release its brakes at the robot"):
            control.power_on()
        tell(HOST, "power on", "brake release")
        eventually(lambda: not refused(control.power_on, "is not moved"))
        move_by_nothing(robot, control)
        control.power_off()
    tvist("unlock", bridge.endpoint, "--name", "bridge", "--power-on").assert_done()
    wait_until_it_follows(bridge)


@pytest.mark.parametrize("how", ["hold", "cut"])
def test_a_link_that_fails_lets_the_robot_brake_and_nothing_old_is_played(arm, how):
    with Link(HOST, NEAR) as link, a_bridge(NEAR) as bridge:
        wait_until_it_follows(bridge)
        with (
            Robot.connect(arm.endpoint) as there,
            Robot.connect(bridge.endpoint, "bridge") as robot,
            robot.control("me") as control,
        ):
            control.move_j(beside(robot, 0.3), velocity=0.4, wait=False)
            robot.advance(150)
            with states_of(there) as states:
                getattr(link, how)()
                bridge.wait_until_said("it says nothing any more")
                eventually(lambda: max(map(abs, there.state().target_qd)) < 1e-3)
                stands = there.state().target_q
                link.flow() if how == "hold" else link.restore()
                eventually(lambda: not refused(control.power_on, "is not moved"))
                move_by_nothing(robot, control)
            assert largest_step(states) < STEP
            assert there.state().target_q == pytest.approx(stands, abs=1e-3)
            control.move_j(beside(robot, -0.1), velocity=0.4)


def test_a_bridge_that_is_killed_lets_the_robot_brake(arm):
    bridge = a_bridge(HOST)
    try:
        bridge.wait_until_ready()
        wait_until_it_follows(bridge)
        with Robot.connect(arm.endpoint) as there, states_of(there) as states:
            with Robot.connect(bridge.endpoint, "bridge") as robot, robot.control("me") as control:
                control.move_j(beside(robot, 0.3), velocity=0.4, wait=False)
                robot.advance(200)
                bridge.process.kill()
            eventually(lambda: states and max(map(abs, states[-1].target_qd)) < 1e-4)
        assert largest_step(states) < STEP
    finally:
        bridge.kill()


def test_the_robot_s_own_slider_slows_motions(arm, bridge):
    with (
        Robot.connect(bridge.endpoint, "bridge") as robot,
        robot.control("me") as control,
    ):
        warnings = []  # stderr may leave some out
        robot.on_event(lambda event: warnings.append(event.why))
        set_slider(0.5)
        try:
            eventually(lambda: "the speed slider of the robot is at 50 %: so are motions" in warnings)
            with states_of(robot) as states:
                control.move_j(beside(robot, 0.2), velocity=0.4)
            assert max(max(map(abs, state.target_qd)) for state in states) < 0.22
            set_slider(0.0)
            eventually(lambda: "the speed slider of the robot is at 0 %: so are motions" in warnings)
            stands = robot.state().target_q
            moving = control.move_j(beside(robot, 0.2), velocity=0.4, wait=False)
            robot.advance(100)
            assert robot.state().target_q == stands
            set_slider(1.0)
            moving.wait()
            assert robot.state().target_q != stands
        finally:
            set_slider(1.0)
        eventually(lambda: "the speed slider of the robot is at 100 %: so are motions" in warnings)


def set_slider(share):
    with Client("rtde_io", "RTDEIOInterface", HOST) as io:
        assert io.setSpeedSlider(share)


def test_what_the_robot_cannot_carry_is_refused(bridge):
    with Robot.connect(bridge.endpoint, "bridge") as robot, robot.control("me") as control:
        for command, words in (
            (lambda: control.set_shaper("elastic"), "takes positions only"),
            (lambda: control.set_digital_output(0, True), "only set-points are sent"),
            (lambda: control.set_payload(1.0, (0.0, 0.0, 0.0), (0.0,) * 6), "tell it first"),
        ):
            with pytest.raises(RefusedError, match=words):
                command()
        control.set_shaper("auto")
        control.set_shaper("zv")


def test_a_program_for_the_robot_moves_it_through_the_bridge_s_own_interfaces(arm):
    with a_bridge(HOST, "--ur", "--ur-address", OTHER, "--shaper", "zv") as bridge:
        wait_until_it_follows(bridge)
        with (
            Client("rtde_control", "RTDEControlInterface", OTHER) as control,
            Client("rtde_receive", "RTDEReceiveInterface", HOST) as seen,
        ):
            goal = list(seen.getTargetQ())
            goal[0] += 0.2
            assert control.moveJ(goal, 1.0, 1.5)
            eventually(lambda: seen.getTargetQ() == pytest.approx(goal, abs=1e-3))


def test_set_points_that_make_up_for_the_servo_s_lag_bring_it_closer(arm):
    """How far the robot's target is from ours in a motion, without and with it."""
    far = []
    for option in ((), ("--servo-lag", "simulated")):
        with a_bridge(HOST, *option) as bridge:
            wait_until_it_follows(bridge)
            with Robot.connect(bridge.endpoint, "bridge") as robot, robot.control("me") as control:
                with states_of(robot) as states:
                    control.move_j(beside(robot, 0.2 if option else -0.2), velocity=0.4)
                far.append(max(abs(state.target_q[0] - state.actual_q[0]) for state in states))
    assert far[1] < 0.5 * far[0]


def test_bad_starts_are_one_sentence_and_nothing_moves(arm):
    with Robot.connect(arm.endpoint) as there:
        before = there.state().target_q
        motion = ("--plant", f"ur://{HOST}", "--enable-motion")
        for options, words in (
            (("--enable-motion",), ["--plant ur://"]),
            (("--plant", f"ur://{NOBODY}", "--enable-motion"), ["no robot answers", "Next:"]),
            ((*motion, "--robot", "ur10e"), ["is no UR10e"]),
            ((*motion, "--payload", "2"), ["payload of 5 kg", "--payload"]),
            ((*motion, "--tcp", "0,0,0.1,0,0,0"), ["tool centre point", "--tcp"]),
            ((*motion, "--start", "Q2"), ["--start says"]),
            ((*motion, "--shaper", "elastic"), ["takes positions only"]),
            ((*motion, "--clock", "lockstep"), ["gives the tick"]),
            ((*motion, "--speed-cap", "9"), ["speed_cap is 9"]),
        ):
            code, said = refused_to_start(*options)
            assert code == 2, said
            assert all(word in said for word in words), said
        with there.control("somebody"):
            code, said = refused_to_start(*motion)
            assert code == 2
            assert "local control, or another client" in said
        with a_bridge(HOST) as bridge:
            wait_until_it_follows(bridge)
            code, said = refused_to_start(*motion)
            assert code == 2
            assert "another client holds its inputs" in said
            bridge.assert_quiet()
        assert there.state().target_q == pytest.approx(before, abs=1e-4)
