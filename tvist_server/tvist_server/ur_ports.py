"""TCP ports of UR's own interfaces."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta, Struct

from tvist_controller.cell.gripper import PORT

InterfaceName = Literal[
    "dashboard", "primary", "secondary", "realtime", "rtde", "interpreter",
    "primary_read_only", "secondary_read_only", "realtime_read_only", "gripper",
]  # fmt: skip
"""Name of an interface of UR, or of the interface of a cell's gripper."""
MOST_JOINTS = 6  # number of joints in packages of UR's interfaces; missing joints are 0
WITHOUT_JOINTS: frozenset[InterfaceName] = frozenset({"dashboard", "interpreter"})
"""Interfaces that send no joint values, so that they suit any number of joints."""
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
    gripper: Port = PORT  # port of the gripper, for a robot with a cell

    def open(self) -> dict[InterfaceName, int]:
        """Return the ports of UR's open interfaces."""
        named = msgspec.structs.asdict(self)
        return {interface: port for interface, port in named.items() if port and interface != "gripper"}  # type: ignore[misc]

    def check_joints(self, robot: str, joints: int) -> None:
        """Raise ValueError if an open interface cannot send all joints, because clients would miss the last ones."""
        limited = [interface for interface in self.open() if interface not in WITHOUT_JOINTS]
        if joints > MOST_JOINTS and limited:
            closing = " ".join(f"--ur-port {interface}=off" for interface in limited)
            raise ValueError(
                f"the robot {robot} has {joints} joints, but UR's interfaces have room for {MOST_JOINTS}: serve it "
                "without --ur, since clients over Zenoh get any number, or close the interfaces that send joints: "
                + closing
            )
