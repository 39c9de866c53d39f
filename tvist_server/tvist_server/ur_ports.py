"""TCP ports of UR's own interfaces."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta, Struct

InterfaceName = Literal[
    "dashboard", "primary", "secondary", "realtime", "rtde", "interpreter",
    "primary_read_only", "secondary_read_only", "realtime_read_only",
]  # fmt: skip
"""Name of one of UR's interfaces."""
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

    def open(self) -> dict[InterfaceName, int]:
        """Return the port of each interface that is open."""
        return {interface: port for interface, port in msgspec.structs.asdict(self).items() if port}  # type: ignore[misc]
