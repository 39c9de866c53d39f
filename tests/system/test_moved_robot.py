"""`tvist serve --plant ur://… --enable-motion`, here called the bridge, moves a robot of another process."""

import contextlib
import signal
import socket

import numpy as np
import pytest
from tests.conformance.served import Served, refused_to_start
from tests.places import own_address
from tests.system.relay import Relay
from tests.system.shell import tvist
from tests.system.ur_object import Client
from tests.system.waiting import eventually

from tvist_client import RefusedError
from tvist_client.blocking import Robot
from tvist_protocol.modes import RobotMode

pytestmark = pytest.mark.realtime

HOST, NEAR, OTHER, NOBODY = (own_address(last) for last in (51, 52, 53, 54))
SPEED = "0.2"  # speed of the robot's time, so that a busy machine keeps up
DASHBOARD, PRIMARY, SECONDARY, RTDE = 29999, 30001, 30002, 30004
STEP = 0.002  # largest step of the robot's target that is not part of a motion [rad]


@pytest.fixture(scope="module")
def arm():
    """The robot in its own process; like UR's robots it shapes nothing."""
    real = ("--profile", "real", "--shaper", "none", "--hidden", "1001", "--speed", SPEED)
    with Served("--ur", "--ur-address", HOST, *real) as served:
        yield served


@contextlib.contextmanager
def a_bridge(host=HOST, *options):
    with Served("--plant", f"ur://{host}", "--enable-motion", *options, name="bridge") as served:
        with Robot.connect(served.endpoint, "bridge") as robot, robot.control("me") as control:
            hold(robot, control)
        yield served


@pytest.fixture(scope="module")
def shared(arm):
    """The bridge of the tests at the end, which keeps other bridges away."""
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
    """Collect the states of a robot."""
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
    connection = socket.create_connection((HOST, DASHBOARD), 10.0)
    with connection, connection.makefile("rw") as spoken:
        spoken.readline()
        answers = []
        for line in lines:
            print(line, file=spoken, flush=True)
            answers.append(spoken.readline().strip())
        return answers


def protective_stop():
    """Trigger a protective stop by a secondary program."""
    with socket.create_connection((HOST, SECONDARY), 10.0) as connection:
        connection.sendall(b"sec stopping():\n  protective_stop()\nend\n")


def test_bad_start_options_are_refused_and_nothing_moves(arm):
    motion = ("--plant", f"ur://{HOST}", "--enable-motion")
    with Robot.connect(arm.endpoint) as there:
        before = there.state().target_q
        for options, words in (
            (("--plant", f"ur://{NOBODY}", "--enable-motion"), ["no robot answers", "Next:"]),
            ((*motion, "--robot", "ur10e"), ["is no UR10e"]),
            ((*motion, "--payload", "2"), ["payload is set to 5 kg", "--payload"]),
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


def test_robot_brakes_when_the_bridge_is_killed(arm):
    with a_bridge() as bridge:
        with sides(arm, bridge) as (there, robot, control), states_of(there) as states:
            control.move_j(beside(robot, 0.2), velocity=0.4, wait=False)
            robot.advance(60)
            bridge.process.kill()
            eventually(lambda: states and speed(states[-1]) < 1e-4)
        bridge.wait()
    assert largest_step(states) < STEP


def test_robot_brakes_when_the_link_fails_and_no_old_set_point_is_played(arm):
    with contextlib.ExitStack() as links:
        ports = [Relay(f"tcp/{HOST}:{port}", (NEAR, port)) for port in (DASHBOARD, PRIMARY, RTDE)]
        for port in ports:
            links.enter_context(port)
        bridge = links.enter_context(a_bridge(NEAR))
        there, robot, control = links.enter_context(sides(arm, bridge))
        control.move_j(beside(robot, 0.2), velocity=0.4, wait=False)
        robot.advance(30)
        with states_of(there) as states:
            for port in ports:
                port.hold()
            bridge.wait_until_said("it says nothing any more")
            eventually(lambda: speed(there.state()) < 1e-3)
            stands = there.state().target_q
            for port in ports:
                port.flow()
            switch_on(robot, control)
        assert largest_step(states) < STEP
        assert there.state().target_q == pytest.approx(stands, abs=1e-3)


def test_client_moves_the_robot_no_faster_than_the_speed_cap(arm, bridge):
    with sides(arm, bridge) as (there, robot, control):
        goal = beside(robot, 0.13)
        with states_of(there) as states:
            control.move_j(goal, velocity=0.5, acceleration=3.0)
            robot.advance(60)
        assert robot.info().limits.velocity == [0.5] * 6
        assert there.state().target_q == pytest.approx(goal, abs=1e-3)
        assert robot.state().actual_q == pytest.approx(there.state().actual_q, abs=2e-3)
        assert 0.4 < max(map(speed, states)) < 0.55
        assert largest_step(states) < 0.55 * 0.002


def stopped(bridge, stop, words, *, mode):
    """Stop the robot in a motion; the bridge reports the reason with these words and changes to a safety mode."""
    told = []  # stderr may omit some
    with Robot.connect(bridge.endpoint, "bridge") as robot, robot.control("me") as control:
        robot.on_event(lambda event: told.append(event.why or ""))
        control.move_j(beside(robot, 0.2), velocity=0.4, wait=False)
        robot.advance(60)
        stop()
        eventually(lambda: any(words in why for why in told))
        eventually(lambda: robot.state().safety_mode == mode)
        assert refused(still(robot, control), "send unlock_protective_stop" if mode == 3 else "send power_on")


def test_protective_stop_is_cleared_at_the_robot_first(arm, bridge):
    stopped(bridge, protective_stop, "it has made a protective stop", mode=3)
    with sides(arm, bridge) as (there, robot, control):
        with pytest.raises(RefusedError, match="clear that at the robot"):
            control.unlock_protective_stop()
        with states_of(there) as states:
            eventually(lambda: tell("unlock protective stop") == ["Protective stop releasing"])
            eventually(lambda: not refused(control.unlock_protective_stop, "at the robot"))
            hold(robot, control)
            there.advance(20)
        assert largest_step(states) < STEP
        assert robot.state().target_q == pytest.approx(there.state().target_q, abs=1e-3)


def test_program_ended_at_the_robot_is_restarted_from_the_present_posture(arm, bridge):
    stopped(bridge, lambda: tell("pause"), "its program was paused", mode=1)
    with sides(arm, bridge) as (there, robot, control):
        with pytest.raises(RefusedError, match="is paused"):
            control.power_on()
        tell("stop")
        with states_of(there) as states:
            switch_on(robot, control)
        assert largest_step(states) < STEP


def test_suspended_bridge_reports_missing_set_points_and_plays_no_old_ones(arm, bridge):
    stood = []

    def suspended():
        with Robot.connect(arm.endpoint) as there:
            bridge.process.send_signal(signal.SIGSTOP)
            eventually(lambda: speed(there.state()) < 1e-3)
            stood.extend(there.state().target_q)
            bridge.process.send_signal(signal.SIGCONT)

    stopped(bridge, suspended, "no set-point reached it", mode=1)
    with sides(arm, bridge) as (there, robot, control):
        assert there.state().target_q == pytest.approx(stood, abs=1e-3)
        switch_on(robot, control)


def test_arm_without_power_is_switched_on_at_the_robot_first(arm, bridge):
    stopped(bridge, lambda: tell("power off"), "its program was stopped at the robot", mode=1)
    with sides(arm, bridge) as (there, robot, control):
        eventually(lambda: there.state().robot_mode == RobotMode.POWER_OFF)
        there.advance(40)
        with pytest.raises(RefusedError, match="switch it on and release its brakes at the robot"):
            control.power_on()
        tell("power on", "brake release")
        switch_on(robot, control)
        control.power_off()
    tvist("unlock", bridge.endpoint, "--name", "bridge", "--power-on").assert_done()


def test_speed_slider_of_the_robot_slows_motions(arm, bridge):
    warnings = []
    with sides(arm, bridge) as (_, robot, control), Client("rtde_io", "RTDEIOInterface", HOST) as io:
        robot.on_event(lambda event: warnings.append(event.why))
        assert io.setSpeedSlider(0.5)
        try:
            eventually(lambda: "the speed slider of the robot is at 50 %: so are motions" in warnings)
            with states_of(robot) as states:
                control.move_j(beside(robot, 0.05), velocity=0.4)
            assert max(map(speed, states)) < 0.22
        finally:
            assert io.setSpeedSlider(1.0)
        eventually(lambda: "the speed slider of the robot is at 100 %: so are motions" in warnings)


def test_ur_client_moves_the_robot_through_the_interfaces_of_the_bridge(bridge):
    with (
        Client("rtde_control", "RTDEControlInterface", OTHER) as control,
        Client("rtde_receive", "RTDEReceiveInterface", HOST) as seen,
    ):
        first, *others = seen.getTargetQ()
        goal = [first - 0.05, *others]
        assert control.moveJ(goal, 1.0, 1.5)
        eventually(lambda: seen.getTargetQ() == pytest.approx(goal, abs=1e-3))
        control.stopScript()
    with Robot.connect(bridge.endpoint, "bridge") as robot:
        eventually(lambda: robot.info().control is None)


def test_commands_the_robot_cannot_follow_and_a_second_bridge_are_refused(arm, bridge):
    with sides(arm, bridge) as (_, _, control):
        for command, words in (
            (lambda: control.set_shaper("elastic"), "takes positions only"),
            (lambda: control.set_digital_output(0, True), "only set-points are sent"),
            (lambda: control.set_payload(1.0, (0.0, 0.0, 0.0), (0.0,) * 6), "set it there first"),
        ):
            with pytest.raises(RefusedError, match=words):
                command()
    code, said = refused_to_start("--plant", f"ur://{HOST}", "--enable-motion")
    assert (code, "another client holds its inputs" in said) == (2, True)
    bridge.assert_quiet()
