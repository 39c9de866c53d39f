"""What `tvist unlock` does to a robot that has stopped, on a real controller in process."""

import pytest

from tvist_client.readiness import look
from tvist_client.unlock import make_ready
from tvist_lab.in_process import free_setup, robot_in_process


async def stopped(robot, arm, *faults, ticks=500):
    await arm.move_j([1.0, -3.0, 0.0, -1.57, 0.0, 0.0], wait=False)
    await robot.advance(300)
    for fault in faults:
        await arm.inject(fault)
    await robot.advance(ticks)
    assert not (await look(robot)).ready


@pytest.mark.parametrize("ticks", [500, 2])
async def test_protective_stop_is_unlocked_while_the_arm_stops(ticks):
    async with robot_in_process(free_setup()) as robot, robot.control("me") as arm:
        await stopped(robot, arm, "protective_stop", ticks=ticks)
        assert await make_ready(robot, arm) == ["unlocked the protective stop"]
        assert (await look(robot)).ready


@pytest.mark.parametrize(("fault", "found"), [("violation", "found a violation"), ("fault", "had failed")])
async def test_safety_system_is_restarted_before_power_on(fault, found):
    async with robot_in_process(free_setup()) as robot, robot.control("me") as arm:
        await stopped(robot, arm, fault)
        (done,) = await make_ready(robot, arm)
        assert found in done
        left = await look(robot)
        assert left.robot_mode == "POWER_OFF"
        assert "tvist unlock --power-on" in left.next
        assert len(await make_ready(robot, arm, power_on=True)) == 1
        assert (await look(robot)).ready


@pytest.mark.parametrize(
    ("faults", "mode", "done"),
    [
        (["safeguard_stop"], "SAFEGUARD_STOP", []),
        (["emergency_stop"], "ROBOT_EMERGENCY_STOP", []),
        (["protective_stop", "safeguard_stop"], "SAFEGUARD_STOP", ["unlocked the protective stop"]),
    ],
)
async def test_stop_that_no_client_can_release_remains_without_a_wait(faults, mode, done):
    async with robot_in_process(free_setup()) as robot, robot.control("me") as arm:
        await stopped(robot, arm, *faults)
        assert await make_ready(robot, arm, power_on=len(faults) == 1) == done
        found = await look(robot)
        assert (found.ready, found.safety_mode) == (False, mode)
        assert "release it" in found.next
