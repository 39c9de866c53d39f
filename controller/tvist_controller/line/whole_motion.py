"""Whole motions, block by block. No block depends on the arm, so results equal `ControlCycle`'s bitwise."""

from dataclasses import dataclass

import numpy as np

from tvist_controller.kinematics.arm import InverseDynamics
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.drive_feed_forward import DriveFeedForward
from tvist_controller.line.elastic_feed_forward import ElasticFeedForward
from tvist_controller.line.line_tick import SIGNALS, TORQUE, Q, all_to_drives, to_drives
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import PERIOD, Response, SimulatedArm


@dataclass(frozen=True)
class DriveCommandSeries:
    """Drive commands of T ticks."""

    rest: DriveCommand
    """Command for the arm at rest before them."""
    targets: Floats
    """q*, q̇* and q̈* of each tick, shape (T, 3, n) [rad, rad/s, rad/s^2]."""
    commands: Floats
    """Positions, velocities and torques of each command, shape (T, 3, n)."""
    delay: float
    """Delay of commands behind their targets [s]."""


class DrivenLine:
    """The control line from shaped reference to drives, without an arm; for `law` see `ControlCycle`."""

    def __init__(self, description: RobotDescription, declared: Payload, law: Floats | None = None) -> None:
        self._dynamics, self._law = InverseDynamics(description, declared), law
        self._drives = DriveFeedForward(description)
        self._parts = self._dynamics.chain, self._dynamics.scratch, self._drives.rows

    def drive(
        self,
        start: Floats,  # joint angles at rest, shape (n,) [rad]
        shaped: Floats,  # shaped reference, shape (k, n) [rad]
        ticks: int,  # T
        resting: int = 0,  # ticks before the first sample
        elastic: ElasticFeedForward | None = None,  # None for the paper's feed-forward
        law: Floats | None = None,  # friction to feed forward in this motion; None for that of the line
    ) -> DriveCommandSeries:
        """Compute the drive commands for a shaped reference, from rest."""
        drives = self._drives
        drives.wanted = elastic
        drives.law = self._law if law is None else law
        drives.reset(self._dynamics.gravity(start))
        _, rest = self._tick(start, start, start)
        whole = np.empty((ticks, len(start)))
        whole[:resting], whole[resting:] = start, shaped[-1]
        moving = min(len(shaped), ticks - resting)
        whole[resting : resting + moving] = shaped[:moving]
        targets, commands = np.empty((2, ticks, 3, len(start)))
        if elastic is None:
            all_to_drives(start, whole, PERIOD, *self._parts, targets, commands)
            return DriveCommandSeries(rest, targets, commands, drives.delay)
        before, middle = start, start
        for tick, last in enumerate(whole):
            targets[tick], command = self._tick(before, middle, last)
            commands[tick] = command.q, command.qd, command.torque
            before, middle = middle, last
        return DriveCommandSeries(rest, targets, commands, drives.delay)

    def _tick(self, before: Floats, middle: Floats, last: Floats) -> tuple[Floats, DriveCommand]:
        """Return the target in the middle of three shaped references, shape (3, n), and its drive command."""
        signals = np.empty((SIGNALS, len(last)))
        to_drives(before, middle, last, last, PERIOD, *self._parts, signals)
        return signals[Q:TORQUE], self._drives.command(signals, self._dynamics.payload_parameters)


def respond(plant: SimulatedArm, driven: DriveCommandSeries, seed: int) -> Response:
    """Move a plant with drive commands, from rest.

    Raises:
        PlantError: The state is no longer finite.
        ValueError: The plant does not provide the truth.
    """
    plant.reset(driven.rest, seed=seed)
    return plant.play(driven.commands)
