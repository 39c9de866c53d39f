"""A robot of another process that tvist moves: it brakes, and restarts only when that is safe."""

import contextlib
import signal
import socket

import pytest
from tests.system.moving.bridge import (
    DASHBOARD,
    HOST,
    NEAR,
    PRIMARY,
    RTDE,
    SECONDARY,
    STEP,
    a_bridge,
    beside,
    hold,
    largest_step,
    refused,
    sides,
    speed,
    states_of,
    still,
    switch_on,
    tell,
)
from tests.system.relay import Relay
from tests.system.shell import tvist
from tests.system.waiting import eventually

from tvist_client import RefusedError
from tvist_client.blocking import Robot
from tvist_protocol.modes import RobotMode

pytestmark = pytest.mark.realtime


def test_robot_brakes_when_the_bridge_is_killed(arm):
    with a_bridge() as bridge:
        with sides(arm, bridge) as (there, robot, control), states_of(there) as states:
            control.move_j(beside(robot, 0.2), velocity=0.4, wait=False)
            robot.advance(30)
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


def protective_stop():
    """Trigger a protective stop by a secondary program."""
    with socket.create_connection((HOST, SECONDARY), 10.0) as connection:
        connection.sendall(b"sec stopping():\n  protective_stop()\nend\n")


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
