"""TCP ports of UR's own interfaces."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta, Struct

from tvist_controller.cell.gripper import PORT

InterfaceName = Literal[
    "dashboard", "primary", "secondary", "realtime", "rtde", "interpreter",
    "primary_read_only", "secondary_read_only", "realtime_read_only", "gripper",
]  # fmt: skip
"""Name of one of UR's interfaces, or of that of a cell's gripper."""
MOST_JOINTS = 6
"""Joints that a package of UR's interfaces has room for; those that an arm does not have are 0 in it."""
WITHOUT_JOINTS: frozenset[InterfaceName] = frozenset({"dashboard", "interpreter"})
"""Interfaces that send no values of joints, so that an arm may have any number of them."""
Port = Annotated[int, Meta(ge=0, le=65535)]


class UrPorts(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """TCP port of each interface; 0 closes it."""

    dashboard: Port = 29999
    primary: Port = 30001
    secondary: Port = 30002
    realtime: Port = 30003
    rtde: Port = 30004
    interpreter: Port = 30020
    primary_read_only: Port = 30011
    secondary_read_only: Port = 30012
    realtime_read_only: Port = 30013
    gripper: Port = PORT
    """Port of the gripper, which only a robot with a cell has."""

    def open(self) -> dict[InterfaceName, int]:
        """Return the port of each of UR's interfaces that is open."""
        named = msgspec.structs.asdict(self)
        return {interface: port for interface, port in named.items() if port and interface != "gripper"}  # type: ignore[misc]

    def check_joints(self, robot: str, joints: int) -> None:
        """Check that the open interfaces can send the values of all joints of a robot.

        Args:
            robot: Name of the robot.
            joints: Number of its joints.

        Raises:
            ValueError: They cannot; without this check, clients would see an arm that lacks its last joints.
        """
        limited = [interface for interface in self.open() if interface not in WITHOUT_JOINTS]
        if joints > MOST_JOINTS and limited:
            closing = " ".join(f"--ur-port {interface}=off" for interface in limited)
            raise ValueError(
                f"the robot {robot} has {joints} joints, but UR's interfaces have room for {MOST_JOINTS}: serve it "
                "without --ur, since clients over Zenoh get any number, or close the interfaces that send joints: "
                + closing
            )
