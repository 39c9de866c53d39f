"""`tvist serve --plant ur://… --enable-motion` moves a robot in another process, and stops with it."""

import contextlib
import signal
import socket

import numpy as np
import pytest
from tests.conformance.served import Served, refused_to_start
from tests.places import own_address
from tests.system.proxy import Proxy
from tests.system.shell import tvist
from tests.system.ur_object import Client
from tests.system.waiting import eventually

from tvist_client import RefusedError
from tvist_client.blocking import Robot
from tvist_protocol.modes import RobotMode

pytestmark = pytest.mark.realtime

HOST, NEAR, OTHER, NOBODY = (own_address(last) for last in (51, 52, 53, 54))
SPEED = "0.2"
"""Speed of the robot's time, so that a busy machine is on time, too."""
DASHBOARD, PRIMARY, SECONDARY, RTDE = 29999, 30001, 30002, 30004
STEP = 0.002
"""Largest step of the robot's target beside its motions [rad]."""


@pytest.fixture(scope="module")
def arm():
    """The robot in its own process: it shapes nothing, as UR's do."""
    real = ("--profile", "real", "--shaper", "none", "--hidden", "1001", "--speed", SPEED)
    with Served("--ur", "--ur-address", HOST, *real) as served:
        yield served


@contextlib.contextmanager
def a_bridge(host=HOST, *options):
    with Served("--plant", f"ur://{host}", "--enable-motion", *options, name="bridge") as served:
        with Robot.connect(served.endpoint, "bridge") as robot, robot.control("me") as control:
            move_by_nothing(robot, control)
        yield served


@pytest.fixture
def bridge(arm):
    with a_bridge() as served:
        yield served


@contextlib.contextmanager
def sides(arm, bridge):
    """The robot seen there, the bridge's robot, and control of this."""
    with (
        Robot.connect(arm.endpoint) as there,
        Robot.connect(bridge.endpoint, "bridge") as robot,
        robot.control("me") as control,
    ):
        yield there, robot, control


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
    first, *others = robot.state().target_q
    return [first + change, *others]


@contextlib.contextmanager
def states_of(robot):
    """All states of a robot while this lasts."""
    states = []
    stop = robot.on_state(states.append)
    try:
        yield states
    finally:
        stop()


def largest_step(states):
    """The largest way of a joint's target in a control period [rad]."""
    ticks = np.array([state.tick for state in states])
    targets = np.array([state.target_q for state in states])
    return float((np.abs(np.diff(targets, axis=0)).max(axis=1) / np.diff(ticks)).max())


def tell(*lines):
    """Say something to the robot's dashboard; what it answers."""
    connection = socket.create_connection((HOST, DASHBOARD), 10.0)
    with connection, connection.makefile("rw") as spoken:
        spoken.readline()
        answers = []
        for line in lines:
            print(line, file=spoken, flush=True)
            answers.append(spoken.readline().strip())
        return answers


def protective_stop():
    """Let the robot make a protective stop, beside the program that runs."""
    with socket.create_connection((HOST, SECONDARY), 10.0) as connection:
        connection.sendall(b"sec stopping():\n  protective_stop()\nend\n")


def test_a_client_moves_it_and_no_joint_is_faster_than_the_cap(arm, bridge):
    with sides(arm, bridge) as (there, robot, control):
        goal = beside(robot, 0.2)
        with states_of(there) as states:
            control.move_j(goal, velocity=0.5)
            robot.advance(250)
        assert robot.info().limits.velocity == [0.5] * 6
        assert there.state().target_q == pytest.approx(goal, abs=1e-3)
        assert robot.state().actual_q == pytest.approx(there.state().actual_q, abs=2e-3)
        assert max(max(map(abs, state.target_qd)) for state in states) < 0.55
        assert largest_step(states) < 0.55 * 0.002
        control.move_j(beside(robot, -0.2), velocity=0.5)


def stopped(bridge, how, words, *, mode):
    """Stop the robot in a motion; what the bridge says has these words, and its state is this safety mode."""
    with Robot.connect(bridge.endpoint, "bridge") as robot, robot.control("me") as control:
        goal = beside(robot, 0.2)
        control.move_j(goal, velocity=0.4, wait=False)
        robot.advance(150)
        how()
        bridge.wait_until_said(words)
        eventually(lambda: robot.state().safety_mode == mode)
        with pytest.raises(RefusedError):
            control.move_j(goal)


def test_a_protective_stop_is_unlocked_at_the_robot_and_then_here(arm, bridge):
    stopped(bridge, protective_stop, "it has made a protective stop", mode=3)
    with sides(arm, bridge) as (there, robot, control):
        with pytest.raises(RefusedError, match="clear that at the robot"):
            control.unlock_protective_stop()
        with states_of(there) as states:
            eventually(lambda: tell("unlock protective stop") == ["Protective stop releasing"])
            eventually(lambda: not refused(control.unlock_protective_stop, "at the robot"))
            move_by_nothing(robot, control)
            there.advance(50)
        assert largest_step(states) < STEP
        assert robot.state().target_q == pytest.approx(there.state().target_q, abs=1e-3)


def test_a_program_that_is_ended_at_the_robot_is_begun_again_where_the_arm_stands(arm, bridge):
    stopped(bridge, lambda: tell("pause"), "its program was paused", mode=1)
    with sides(arm, bridge) as (there, robot, control):
        with pytest.raises(RefusedError, match="is paused"):
            control.power_on()
        tell("stop")
        with states_of(there) as states:
            eventually(lambda: not refused(control.power_on, "is not moved"))
            move_by_nothing(robot, control)
        assert largest_step(states) < STEP


def test_a_bridge_that_was_suspended_says_that_the_robot_got_no_set_point_meanwhile(arm, bridge):
    stood = []

    def suspended():
        with Robot.connect(arm.endpoint) as there:
            bridge.process.send_signal(signal.SIGSTOP)
            eventually(lambda: max(map(abs, there.state().target_qd)) < 1e-3)
            stood.extend(there.state().target_q)
            bridge.process.send_signal(signal.SIGCONT)

    stopped(bridge, suspended, "no set-point reached it", mode=1)
    with Robot.connect(arm.endpoint) as there:
        assert there.state().target_q == pytest.approx(stood, abs=1e-3)  # nothing that waited was played


def test_an_arm_without_power_is_switched_on_at_the_robot_and_then_here(arm, bridge):
    stopped(bridge, lambda: tell("power off"), "its program was stopped at the robot", mode=1)
    with sides(arm, bridge) as (there, robot, control):
        eventually(lambda: there.state().robot_mode == RobotMode.POWER_OFF)
        there.advance(100)
        with pytest.raises(RefusedError, match="switch it on and release its brakes at the robot"):
            control.power_on()
        tell("power on", "brake release")
        eventually(lambda: not refused(control.power_on, "is not moved"))
        move_by_nothing(robot, control)
        control.power_off()
    tvist("unlock", bridge.endpoint, "--name", "bridge", "--power-on").assert_done()


def test_a_link_that_fails_lets_the_robot_brake_and_nothing_old_is_played(arm):
    with contextlib.ExitStack() as links:
        ports = [
            links.enter_context(Proxy(f"tcp/{HOST}:{port}", (NEAR, port)))
            for port in (DASHBOARD, PRIMARY, RTDE)
        ]
        bridge = links.enter_context(a_bridge(NEAR))
        there, robot, control = links.enter_context(sides(arm, bridge))
        control.move_j(beside(robot, 0.2), velocity=0.4, wait=False)
        robot.advance(150)
        with states_of(there) as states:
            for port in ports:
                port.hold()
            bridge.wait_until_said("it says nothing any more")
            eventually(lambda: max(map(abs, there.state().target_qd)) < 1e-3)
            stands = there.state().target_q
            for port in ports:
                port.flow()
            eventually(lambda: not refused(control.power_on, "is not moved"))
            move_by_nothing(robot, control)
        assert largest_step(states) < STEP
        assert there.state().target_q == pytest.approx(stands, abs=1e-3)


def test_a_bridge_that_is_killed_lets_the_robot_brake(arm):
    with a_bridge() as bridge:
        with sides(arm, bridge) as (there, robot, control), states_of(there) as states:
            control.move_j(beside(robot, 0.2), velocity=0.4, wait=False)
            robot.advance(200)
            bridge.process.kill()
            eventually(lambda: states and max(map(abs, states[-1].target_qd)) < 1e-4)
        bridge.wait()
    assert largest_step(states) < STEP


def test_the_robot_s_own_slider_slows_motions(arm, bridge):
    warnings = []  # stderr may leave some out
    with sides(arm, bridge) as (_, robot, control), Client("rtde_io", "RTDEIOInterface", HOST) as io:
        robot.on_event(lambda event: warnings.append(event.why))
        assert io.setSpeedSlider(0.5)
        try:
            eventually(lambda: "the speed slider of the robot is at 50 %: so are motions" in warnings)
            with states_of(robot) as states:
                control.move_j(beside(robot, 0.1), velocity=0.4)
            assert max(max(map(abs, state.target_qd)) for state in states) < 0.22
        finally:
            assert io.setSpeedSlider(1.0)
        eventually(lambda: "the speed slider of the robot is at 100 %: so are motions" in warnings)


def test_a_program_for_the_robot_moves_it_through_the_bridge_s_own_interfaces(arm):
    with (
        a_bridge(HOST, "--ur", "--ur-address", OTHER, "--shaper", "zv"),
        Client("rtde_control", "RTDEControlInterface", OTHER) as control,
        Client("rtde_receive", "RTDEReceiveInterface", HOST) as seen,
    ):
        first, *others = seen.getTargetQ()
        goal = [first - 0.2, *others]
        assert control.moveJ(goal, 1.0, 1.5)
        eventually(lambda: seen.getTargetQ() == pytest.approx(goal, abs=1e-3))


def test_what_the_robot_cannot_carry_and_a_second_bridge_are_refused(arm, bridge):
    with sides(arm, bridge) as (_, _, control):
        for command, words in (
            (lambda: control.set_shaper("elastic"), "takes positions only"),
            (lambda: control.set_digital_output(0, True), "only set-points are sent"),
            (lambda: control.set_payload(1.0, (0.0, 0.0, 0.0), (0.0,) * 6), "change it there first"),
        ):
            with pytest.raises(RefusedError, match=words):
                command()
    code, said = refused_to_start("--plant", f"ur://{HOST}", "--enable-motion")
    assert (code, "another client holds its inputs" in said) == (2, True)
    bridge.assert_quiet()


def test_bad_starts_are_one_sentence_and_nothing_moves(arm):
    motion = ("--plant", f"ur://{HOST}", "--enable-motion")
    with Robot.connect(arm.endpoint) as there:
        before = there.state().target_q
        for options, words in (
            (("--plant", f"ur://{NOBODY}", "--enable-motion"), ["no robot answers", "Next:"]),
            ((*motion, "--robot", "ur10e"), ["is no UR10e"]),
            ((*motion, "--payload", "2"), ["payload of 5 kg", "--payload"]),
            ((*motion, "--tcp", "0,0,0.1,0,0,0"), ["tool centre point", "--tcp"]),
            ((*motion, "--start", "Q2"), ["--start says"]),
        ):
            code, said = refused_to_start(*options)
            assert code == 2, said
            assert all(word in said for word in words), said
        with there.control("somebody"):
            code, said = refused_to_start(*motion)
            assert (code, "local control, or another client" in said) == (2, True)
        assert there.state().target_q == pytest.approx(before, abs=1e-4)
