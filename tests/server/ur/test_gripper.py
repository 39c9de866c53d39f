"""The port of a cell's gripper: many requests are answered in order."""

import asyncio
from types import SimpleNamespace

from tests.controller.cells import a_cell
from tests.controller.robots import UR5E

from tvist_controller.cell.live_cell import LiveCell
from tvist_plant.flexible_arm import FlexibleArm

from .served_controller import connect, until

MANY = 300  # requests at once: more than may wait for their answers


async def test_many_requests_to_the_gripper_are_answered_in_order(make_served):
    plant, terminals = FlexibleArm(UR5E, UR5E.payload), SimpleNamespace(set_tcp=print)
    cell, waiting = LiveCell(a_cell(), UR5E, plant, terminals, print), []
    served = make_served({"gripper": 0}, gripper=lambda *asked: waiting.append(asked))
    await served.tick()
    await served.interfaces.open()
    reader, writer = await connect(served, "gripper")
    writer.write(b"".join(b"SET POS %d\nGET PRE\n" % (number % 256) for number in range(MANY)))
    expected = b"".join(b"ackPRE %d\n" % (number % 256) for number in range(MANY))
    reading, most = asyncio.create_task(reader.readexactly(len(expected))), 0
    while not reading.done():
        await until(lambda: waiting or reading.done())
        most = max(most, len(waiting))
        while waiting:
            request, answer = waiting.pop(0)
            answer(cell.answer(request))
    assert await reading == expected
    assert 0 < most < MANY
