"""A robot of another process that tvist moves: it brakes when set-points cease, and plays no old ones."""

import contextlib

import pytest
from tests.system.moving.bridge import (
    DASHBOARD,
    HOST,
    NEAR,
    PRIMARY,
    RTDE,
    STEP,
    a_bridge,
    beside,
    largest_step,
    sides,
    speed,
    states_of,
    switch_on,
)
from tests.system.relay import Relay
from tests.system.waiting import eventually

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
