"""What the arm carries, found as a client by its torques."""

import msgspec
import numpy as np
import pytest

from tvist_client import make_payload
from tvist_lab.identification.payload import identify_payload
from tvist_lab.identification.ring_downs import IdentificationError
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_plant.description import load

ROBOT = load("ur5e")
INERTIA = (0.002, 0.0, 0.0, 0.002, 0.0, 0.002)


@pytest.fixture(autouse=True)
def _few_poses(monkeypatch):
    monkeypatch.setattr("tvist_lab.identification.payload.POSES", 3)
    monkeypatch.setattr("tvist_lab.identification.payload.CANDIDATES", 15)


async def found(mass, com, description=ROBOT):
    async with robot_in_process(free_setup(seed=2, truth=False)) as robot, robot.control("test") as arm:
        await arm.reset(payload=make_payload(mass, com, INERTIA if mass else (0.0,) * 6))
        await arm.set_payload(2.0, (0.0, 0.0, 0.04), INERTIA)
        return await identify_payload(robot, arm, description, seed=2, progress=lambda _: None)


async def test_payload_is_identified_although_another_one_is_declared():
    mass, com = 0.6, (0.03, 0.0, 0.05)
    payload = await found(mass, com)
    assert payload.payload.mass == pytest.approx(mass, abs=0.02)
    np.testing.assert_allclose(payload.payload.com, com, atol=0.002)
    assert payload.mass_in_motion == pytest.approx(mass, abs=0.15)
    assert abs(payload.payload.mass - mass) < 5.0 * payload.mass_deviation
    assert payload.declared.mass == 2.0


async def test_an_empty_flange_is_identified_as_zero_payload():
    payload = await found(0.0, (0.0, 0.0, 0.0))
    assert payload.payload.mass < 0.02
    assert payload.payload.com == (0.0, 0.0, 0.0)


async def test_file_of_another_robot_is_refused():
    other = msgspec.structs.replace(ROBOT, robot=msgspec.structs.replace(ROBOT.robot, model="other"))
    with pytest.raises(IdentificationError, match="is a UR5e"):
        await found(1.0, (0.0, 0.0, 0.0), other)
