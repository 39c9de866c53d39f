"""MuJoCo's arm at the end of a controller's line, hosted like any other."""

from dataclasses import replace

import numpy as np
import pytest

from tvist_client.blocking import Robot
from tvist_client.transports.loopback import LoopbackTransport
from tvist_controller.loopback import LoopbackHost
from tvist_controller.setup import body
from tvist_lab.in_process import free_setup
from tvist_plant.description import Payload
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import Measurement, PlantError
from tvist_protocol.codec import decode
from tvist_protocol.errors import RefusedError
from tvist_protocol.stream import State

TARGET = [0.4, -2.9, 0.3, -1.4, 0.0, 0.1]


@pytest.fixture(scope="module")
def mujoco_arm():
    """The class, imported where it is used: other tests do not need to wait for MuJoCo."""
    pytest.importorskip("mujoco")
    from tvist_plant.world.mujoco_arm import MujocoArm

    return MujocoArm


@pytest.fixture
def still(ur5e):
    return DriveCommand(np.array(ur5e.poses["Q1"]), np.zeros(6), np.zeros(6))


def quiet_setup():
    """Without gear errors and noise, which MuJoCo's arm does not have."""
    setup = free_setup(truth=True)
    description = setup.description.disturbed_by(["friction"])
    return replace(setup, description=description)


def moved(plant):
    """States of a hosted robot's motion and its ring-down."""
    host, states = LoopbackHost(quiet_setup(), plant), []
    host.subscribe("state", lambda data: states.append(decode(State, data)))
    with Robot.over(LoopbackTransport(host)) as robot, robot.control("test") as arm:
        arm.move_j(TARGET)
        robot.advance(200)
        truth = host.controller.truth()
    return states, truth


def test_a_hosted_controller_moves_it_as_it_moves_the_flexible_arm(mujoco_arm):
    setup = quiet_setup()
    found = [moved(make(setup.description, body(setup.payload))) for make in (mujoco_arm, FlexibleArm)]
    (theirs, their_truth), (ours, our_truth) = found
    assert len(theirs) == len(ours) > 500
    columns = (
        ("actual_q", 3e-4),  # measured 1.1e-4: MuJoCo's rule is of first order, half a step off
        ("actual_qd", 1e-3),  # measured 2.8e-4
        ("actual_moment", 5.0),  # measured 2.6: gains times what the motors are off
        ("actual_tool_accelerometer", 0.02),  # measured 0.006
    )
    for name, near in columns:
        a, b = (np.array([getattr(state, name) for state in states]) for states in (theirs, ours))
        assert np.ptp(b, axis=0).max() > 8.0 * near
        np.testing.assert_allclose(a, b, rtol=0.0, atol=near, err_msg=name)
    np.testing.assert_allclose(theirs[-1].actual_q, TARGET, rtol=0.0, atol=4e-3)  # gears twist by the weight
    for name in ("motor_q", "gear_deflection", "link_deflection", "flange_pose", "tool_acceleration"):
        a, b = getattr(their_truth, name), getattr(our_truth, name)
        np.testing.assert_allclose(a, b, rtol=0.0, atol=2e-4, err_msg=name)


def test_it_can_be_pushed(mujoco_arm):
    setup = free_setup()
    plant = mujoco_arm(setup.description, body(setup.payload))
    with Robot.over(LoopbackTransport(LoopbackHost(setup, plant))) as robot, robot.control("test") as arm:
        before = robot.state().actual_q[0]
        arm.inject("torque", joint=0, value=20.0, seconds=0.5)
        robot.advance(50)
        assert robot.state().actual_q[0] > before + 1e-4


class Silent:
    """An arm that derives from no class, and only follows commands."""

    payload = Payload()

    def reset(self, command, **_):
        return self.step(command)

    def step(self, command):
        return Measurement(command.q.copy(), command.qd.copy(), command.torque.copy(), np.zeros(3))


def test_an_arm_without_the_methods_can_be_neither_pushed_nor_broken():
    setup = free_setup(truth=False)
    with Robot.over(LoopbackTransport(LoopbackHost(setup, Silent()))) as robot, robot.control("test") as arm:
        for fault in ({"fault": "torque", "joint": 0, "value": 5.0, "seconds": 0.1}, {"fault": "nan"}):
            with pytest.raises(RefusedError, match="Silent"):
                arm.inject(fault.pop("fault"), **fault)


def test_it_carries_what_a_reset_says(mujoco_arm, ur5e, still):
    arm = mujoco_arm(ur5e, ur5e.payload)
    arm.reset(still)
    loaded = arm.truth().gear_deflection[1]
    arm.reset(still, payload=Payload())
    assert arm.payload == Payload()
    assert abs(arm.truth().gear_deflection[1]) < 0.6 * abs(loaded)
    arm.reset(still)
    assert arm.payload == Payload()


def test_at_rest_its_motors_and_its_accelerometer_say_what_the_flexible_arms_do(mujoco_arm, ur5e, still):
    quiet = ur5e.disturbed_by(["friction"])
    theirs, ours = (
        mujoco_arm(quiet, quiet.payload).reset(still),
        FlexibleArm(quiet, quiet.payload).reset(still),
    )
    for name in ("q", "qd", "moment", "accelerometer"):
        np.testing.assert_allclose(getattr(theirs, name), getattr(ours, name), rtol=0.0, atol=1e-9)


def test_measurements_are_the_receivers_own(mujoco_arm, ur5e, still):
    arm = mujoco_arm(ur5e, ur5e.payload)
    first = arm.reset(still)
    kept = [getattr(first, name).copy() for name in ("q", "qd", "moment", "accelerometer")]
    truth = arm.truth()
    force, rotation = truth.specific_force.copy(), truth.flange_rotation.copy()
    for _ in range(20):
        arm.step(DriveCommand(still.q + 0.05, still.qd, still.torque))
    for name, value in zip(("q", "qd", "moment", "accelerometer"), kept, strict=True):
        np.testing.assert_array_equal(getattr(first, name), value)
    np.testing.assert_array_equal(truth.specific_force, force)
    np.testing.assert_array_equal(truth.flange_rotation, rotation)


@pytest.mark.filterwarnings("ignore:.*:RuntimeWarning")
def test_a_command_without_sense_raises_and_a_reset_heals(mujoco_arm, ur5e, still, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes a log of its warnings where it is
    arm = mujoco_arm(ur5e, ur5e.payload)
    first = arm.reset(still)
    with pytest.raises(PlantError, match="finite"):  # noqa: PT012 - some ticks pass
        for _ in range(10):
            arm.step(DriveCommand(still.q, still.qd, np.full(6, np.nan)))
    again = arm.reset(still)
    np.testing.assert_array_equal(again.q, first.q)
    np.testing.assert_array_equal(again.moment, first.moment)
