"""State that all interfaces of one robot share."""

from collections.abc import Callable
from zlib import crc32

from tvist_controller.instruments.snapshot import Snapshot
from tvist_plant.description import RobotDescription
from tvist_server.gateways.ur.external_control import ExternalControl
from tvist_server.gateways.ur.input_owners import InputOwners
from tvist_server.gateways.ur.programs import Programs

NO_MODE = "NONE"
"""Operational mode until a client sets one."""


class UrRobot:
    """State of one robot that clients of its interfaces share.

    Args:
        description: Description of the robot.
        name: Name of the robot on the network.
        tell: Sends a robot message to all clients that get them.
        external: Completes programs with a node External Control.
        report: Takes a sentence for the server's console.
        report_refusal: Takes one that says why something was refused.
    """

    def __init__(
        self,
        description: RobotDescription,
        name: str,
        tell: Callable[[bytes], None],
        external: ExternalControl,
        report: Callable[[str], None],
        report_refusal: Callable[[str], None],
    ) -> None:
        self.description = description
        self.name = name
        self.serial = f"2024550{crc32(name.encode()) % 10_000:04d}"
        """Serial number: UR's begin with the year; the last digits are derived from the name."""
        self.latest: Snapshot | None = None
        """Snapshot of the last tick; None before the first."""
        self.operational_mode = NO_MODE
        """Operational mode set by the dashboard."""
        self.inputs = InputOwners()
        self.programs = Programs(self, external)
        self._tell = tell
        self.report = report
        """Writes a sentence to the server's console."""
        self.report_refusal = report_refusal
        """Writes a sentence about a refusal to it, which no other sentence displaces."""

    def tell(self, message: bytes) -> None:
        """Send a robot message to all clients that get them."""
        self._tell(message)
