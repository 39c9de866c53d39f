"""A robot tells how it stands before the first tick, and telling it changes nothing."""

import pytest

from tvist_lab.in_process import free_setup, robot_in_process
from tvist_protocol.codec import decode
from tvist_protocol.io import Io
from tvist_protocol.simulation import SimulationReset
from tvist_protocol.stream import State

from .robots import UR5E, Robot

Q2 = UR5E.poses["Q2"]


def test_before_the_first_tick_the_state_is_that_of_the_arm_at_rest_where_it_starts():
    robot = Robot()
    first = robot.controller.latest
    assert (first.tick, first.timestamp) == (0, 0.0)
    assert first.reference_q == first.target_q == list(UR5E.poses["Q1"])
    assert set(first.target_qd + first.target_qdd) == {0.0}
    after = robot.tick()
    assert first.actual_q == pytest.approx(after.actual_q, abs=1e-9)
    assert first.actual_moment == pytest.approx(after.actual_moment, abs=1e-6)
    assert first.estimated_f_d == after.estimated_f_d
    assert (first.robot_mode, first.safety_mode, first.runtime_state) == (
        after.robot_mode,
        after.safety_mode,
        after.runtime_state,
    )


def test_an_arm_that_was_put_elsewhere_is_told_to_stand_there_at_the_same_tick():
    robot = Robot()
    robot.tick(5)
    assert robot.send(SimulationReset, q=Q2, mode="POWER_OFF").tick == 5
    told = robot.controller.latest
    assert (told.tick, told.target_q, told.robot_mode) == (5, list(Q2), robot.tick().robot_mode)


def test_who_subscribes_in_process_is_told_at_once_and_the_run_stays_the_same():
    from tvist_controller.loopback import LoopbackHost

    told = []
    asked, unasked = LoopbackHost(free_setup()), LoopbackHost(free_setup())
    for _ in range(3):  # to ask often changes as little as to ask once
        asked.subscribe("state", lambda data: told.append(decode(State, data)))
    asked.subscribe("io", lambda data: told.append(decode(Io, data)))
    assert [message.tick for message in told] == [0, 0, 0, 1]
    for host in (asked, unasked):
        host.controller.tick()
    assert asked.controller.latest == unasked.controller.latest


async def test_a_client_in_process_has_state_and_io_as_its_first_line_and_time_stands_still():
    async with robot_in_process(free_setup(start="Q2")) as robot:
        state, io = await robot.state(), await robot.io()
        assert state.target_q == list(Q2)
        assert io.actual_digital_output_bits == 0
        assert (await robot.info()).tick == 0
        seen = []
        robot.on_state(lambda state: seen.append(state.tick))
        async with robot.control("me"):
            await robot.advance(3)
        assert seen == [1, 2, 3]
        assert (await robot.state()).tick == 3
