"""A robot in lockstep that nobody has stepped tells how it stands; a client need not let time pass to see it."""

import asyncio

import pytest
from tests.conformance.served import Served

from tvist_client import Robot


@pytest.fixture(scope="module")
def unstepped():
    with Served("--clock", "lockstep", "--start", "q2") as served:
        yield served


def test_before_the_first_tick_state_and_io_are_told(unstepped):
    async def look():
        async with await Robot.connect(unstepped.endpoint) as robot:
            return await robot.state(), await robot.io(), await robot.info()

    state, io, info = asyncio.run(look())
    assert (state.tick, io.tick, info.tick) == (0, 1, 0)
    assert state.target_q[0] == pytest.approx(1.5707963)
