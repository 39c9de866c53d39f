"""A robot of another process that tvist moves: what starts, what is refused, and how fast it moves."""

import pytest
from tests.conformance.served import refused_to_start
from tests.system.moving.bridge import HOST, NOBODY, OTHER, beside, largest_step, sides, speed, states_of
from tests.system.ur_object import Client
from tests.system.waiting import eventually

from tvist_client.blocking import Robot

pytestmark = pytest.mark.realtime


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


def test_client_moves_the_robot_no_faster_than_the_speed_cap(arm, bridge):
    with sides(arm, bridge) as (there, robot, control):
        goal = beside(robot, 0.13)
        with states_of(there) as states:
            control.move_j(goal, velocity=0.5, acceleration=3.0)
            eventually(lambda: there.state().target_q == pytest.approx(goal, abs=1e-3))
        assert robot.info().limits.velocity == [0.5] * 6
        assert robot.state().actual_q == pytest.approx(there.state().actual_q, abs=2e-3)
        assert 0.4 < max(map(speed, states)) < 0.55
        assert largest_step(states) < 0.55 * 0.002


def test_speed_slider_of_the_robot_slows_motions(arm, bridge):
    warnings = []
    with sides(arm, bridge) as (_, robot, control), Client("rtde_io", "RTDEIOInterface", HOST) as io:
        robot.on_event(lambda event: warnings.append(event.why))
        assert io.setSpeedSlider(0.5)
        try:
            eventually(lambda: "the speed slider of the robot is at 50 %: so are motions" in warnings)
            with states_of(robot) as states:
                control.move_j(beside(robot, 0.04), velocity=0.4, acceleration=3.0)
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


def test_second_bridge_is_refused(bridge):
    code, said = refused_to_start("--plant", f"ur://{HOST}", "--enable-motion")
    assert (code, "another client holds its inputs" in said) == (2, True)
    bridge.assert_quiet()
