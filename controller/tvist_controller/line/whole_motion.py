"""Whole motions at once, block by block, equal to `ControlCycle` to the last bit, since no block depends on the arm."""

from dataclasses import dataclass

import numpy as np

from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.elastic_feed_forward import ElasticFeedForward
from tvist_controller.line.line_tick import all_to_drives
from tvist_controller.trajectory import SampledPositions
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import PERIOD, Measurement, Response, SimulatedArm
from tvist_shaping.base import Filter


@dataclass(frozen=True)
class Driven:
    """Drive commands of T ticks."""

    rest: DriveCommand
    """Command for the arm at rest before them."""
    targets: Floats
    """q*, q̇* and q̈* of each tick, shape (T, 3, n) [rad, rad/s, rad/s^2]."""
    commands: Floats
    """Positions, velocities and torques of each command, shape (T, 3, n)."""
    delay: float
    """Delay of commands behind their targets [s]."""


class Still(SimulatedArm):
    """A plant that does nothing."""

    payload = Payload()

    def __init__(self, joints: int) -> None:
        still: Floats = np.zeros(joints)
        self._nothing = Measurement(still, still, still, np.zeros(3))

    def reset(self, command: DriveCommand, *, payload: Payload | None = None, seed: int = 0) -> Measurement:  # noqa: ARG002
        """See `SimulatedArm.reset`."""
        return self._nothing

    def step(self, command: DriveCommand) -> Measurement:  # noqa: ARG002
        """See `Plant.step`."""
        return self._nothing


class DrivenLine:
    """The control line from the shaped reference to the drives, without an arm.

    Args:
        description: The controller's model of the arm.
        passes: Filter that returns its input.
        start: Joint angles, shape (n,) [rad].
        declared: Declared payload.
        law: Known friction to feed forward, see `ControlCycle`.
    """

    def __init__(
        self,
        description: RobotDescription,
        passes: Filter,
        start: Floats,
        declared: Payload,
        law: Floats | None = None,
    ) -> None:
        self._law = law
        self._cycle = ControlCycle(
            description, passes, q=start, declared=declared, carried=declared, seed=0, law=law,
            plant=Still(description.joints),
        )  # fmt: skip

    def drive(
        self,
        start: Floats,
        shaped: Floats,
        ticks: int,
        resting: int = 0,
        elastic: ElasticFeedForward | None = None,
        law: Floats | None = None,
    ) -> Driven:
        """Compute the drive commands for a shaped reference, from rest.

        Args:
            start: Joint angles at rest, shape (n,) [rad].
            shaped: Shaped reference, shape (k, n) [rad].
            ticks: Number of ticks T.
            resting: Number of ticks before the first sample.
            elastic: Elastic feed-forward; None for the paper's.
            law: Friction to feed forward in this motion; None for that of the line.
        """
        cycle = self._cycle
        cycle.drives.compensate(self._law if law is None else law)
        cycle.use(cycle.tvist, elastic)
        rest, delay = cycle.reset(start).command, cycle.drives.delay
        if elastic is not None:
            return Driven(rest, *self._tick_by_tick(shaped, ticks, resting), delay)
        whole = np.empty((ticks, len(start)))
        whole[:resting], whole[resting:] = start, shaped[-1]
        moving = min(len(shaped), ticks - resting)
        whole[resting : resting + moving] = shaped[:moving]
        targets, commands = np.empty((2, ticks, 3, len(start)))
        all_to_drives(start, whole, PERIOD, *cycle.kernel_parts, targets, commands)
        return Driven(rest, targets, commands, delay)

    def _tick_by_tick(self, shaped: Floats, ticks: int, resting: int) -> tuple[Floats, Floats]:
        targets, commands = np.empty((2, ticks, 3, shaped.shape[1]))
        for tick in range(ticks):
            if tick == resting:
                self._cycle.begin(SampledPositions(list(shaped), PERIOD))
            sample = self._cycle.step()
            target, command = sample.target, sample.command
            targets[tick] = target.q, target.qd, target.qdd
            commands[tick] = command.q, command.qd, command.torque
        return targets, commands


def respond(plant: SimulatedArm, driven: Driven, seed: int) -> Response:
    """Move a plant with drive commands, from rest.

    Raises:
        PlantError: The state is no longer finite.
        ValueError: The plant does not provide the truth.
    """
    plant.reset(driven.rest, seed=seed)
    return plant.play(driven.commands)
