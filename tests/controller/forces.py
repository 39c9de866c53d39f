"""Robots that feel forces at their tool, for the tests of force control."""

import numpy as np
from tests.touching_arm import TouchingArm

from tvist_controller.kinematics.arm import Arm
from tvist_plant.description import Payload as Body
from tvist_plant.plant import GRAVITY, Measurement
from tvist_protocol import forces as f
from tvist_protocol.replies import Done
from tvist_protocol.values import Payload

from .robots import UR5E, NoArm, Robot
from .scripts import URSIM, failure, playing, start

KINEMATICS = Arm(UR5E)
NOTHING = Payload(mass=0.0, com=(0.0, 0.0, 0.0), inertia=(0.0,) * 6)
Z = (False, False, True, False, False, False)
UR5E_IN_AIR = UR5E.quiet().without_floor()


class Feeling(NoArm):
    """Follows its commands, and has a force sensor that feels a push in the base frame, and a weight."""

    def __init__(self):
        self.pushed, self.weight, self.com = np.zeros(6), 0.0, np.zeros(3)

    def step(self, command):
        measured = super().step(command)
        rotation = KINEMATICS.pose(command.q)[0]
        weight = rotation.T @ np.array([0.0, 0.0, -GRAVITY * self.weight])
        push = np.concatenate((rotation.T @ self.pushed[:3], rotation.T @ self.pushed[3:]))
        wrench = push + np.concatenate((weight, np.cross(self.com, weight)))
        return Measurement(measured.q, measured.qd, measured.moment, measured.accelerometer, wrench=wrench)


def feeling(**changes):
    plant = Feeling()
    robot = Robot(**({"q": URSIM, "plant": plant, "description": UR5E_IN_AIR, "payload": NOTHING} | changes))
    robot.tick(2)
    return robot, plant


def touching(stiffness, *, gap=0.002, sensor=True, q=URSIM, arm=UR5E_IN_AIR, mass=0.0):
    damping, payload = 0.1 * np.sqrt(5.0 * stiffness), NOTHING
    if mass:
        payload = Payload(mass=mass, com=(0.0, 0.0, 0.05), inertia=(0.05, 0.0, 0.0, 0.05, 0.0, 0.05))
    carried = Body(mass=mass, com=payload.com, inertia=payload.inertia)
    plant = TouchingArm(arm, carried, stiffness=stiffness, damping=damping, sensor=sensor)
    robot = Robot(q=q, plant=plant, description=arm, payload=payload, shaper="none")
    robot.tick(2)
    plant.height = robot.states[-1].actual_TCP_pose[2] - gap if stiffness else -1e9
    return robot, plant


def pressed(robot, plant, ticks):
    """Return the force of the surface in each tick [N]."""
    forces = []
    for _ in range(ticks):
        robot.tick()
        forces.append(plant.force[2])
    return np.array(forces)


def finished(robot, plant, *lines, most=6000):
    """Run a program; return the force of the surface in each tick."""
    assert start(robot, *lines) == Done()
    forces = []
    while playing(robot):
        forces.append(pressed(robot, plant, 1)[0])
        assert len(forces) < most
    assert failure(robot) is None, failure(robot)
    return np.array(forces)


def places(robot):
    """Return the tool's positions before shaping, one per tick [m]."""
    return np.array([KINEMATICS.pose(np.array(state.reference_q))[1] for state in robot.states])


def protective(robot):
    return [event.why for event in robot.told("protective_stop")]


def force_mode(robot, compliant=Z, wrench=(0.0,) * 6, **fields):
    return robot.send(f.ForceMode, compliant=compliant, wrench=wrench, **fields)
