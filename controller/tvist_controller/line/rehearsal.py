"""Rehearsal of the control line: its first ticks load compiled code, which takes many ticks' time."""

import numpy as np

from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.limits import StreamTorqueRoom, arm_limits
from tvist_controller.trajectory import SetpointStream
from tvist_plant.description import Payload
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD, Measurement, PlantTruth


class Still:
    """A plant that does nothing but keep its last command."""

    payload = Payload()

    def __init__(self, joints: int) -> None:
        still: Floats = np.zeros(joints)
        self.last = DriveCommand(still, still, still)
        """The last command."""
        self._nothing = Measurement(still, still, still, np.zeros(3))

    def reset(self, command: DriveCommand, *, payload: Payload | None = None, seed: int = 0) -> Measurement:  # noqa: ARG002
        """Keep a command; see `Plant.reset`."""
        return self.step(command)

    def step(self, command: DriveCommand) -> Measurement:
        """Keep a command; see `Plant.step`."""
        self.last = command
        return self._nothing

    def truth(self) -> PlantTruth | None:
        """Return None."""
        return None


def rehearse(cycle: ControlCycle) -> None:
    """Make some ticks with a line like this one, whose arm is not touched."""
    description, line, q = cycle.description, cycle.line, cycle.sample.reference
    carried = line.plant.payload
    flexible = isinstance(line.plant, FlexibleArm)
    other = ControlCycle(
        description, line.filter.tvist.fork(), q=q, declared=line.dynamics.payload, carried=carried, seed=0,
        plant=FlexibleArm(description, carried) if flexible else Still(description.joints),
    )  # fmt: skip
    other.line.filter.rehearse(q)  # a transition between filters has kernels of its own
    for _ in range(3):
        other.step()
    _ = other.line.shaped.joints.published  # as a state of a shaped motion needs it
    limits, room = arm_limits(description), StreamTorqueRoom(description, other.line.dynamics)
    # Curves through set-points at the line's own rate and at a lower one.
    for period in (PERIOD, 4.0 * PERIOD):
        stream = SetpointStream(q, period, limits, PERIOD, torque=room)
        for number in range(4):
            stream.offer(number, q)
            stream.next()
