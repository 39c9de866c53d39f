"""Clients of RTDE that read at 500 Hz, all in this process.

    python -m proof.bench.rtde_clients ADDRESS PORT COUNT RECIPES

A line on stdout says that all of them read. They read until stdin ends; then another line gives the number of
packages that each received.
"""

import json
import selectors
import socket
import struct
import sys

from tvist_server.rtde.codec import PackageKind, PackageReader, package

JOINT_VALUES = (
    "target_q", "target_qd", "target_qdd", "target_current", "target_moment", "actual_q", "actual_qd", "actual_current",
    "joint_control_output", "actual_TCP_pose", "actual_TCP_speed", "actual_TCP_force", "target_TCP_pose",
    "target_TCP_speed", "joint_temperatures", "joint_mode", "actual_joint_voltage",
)  # fmt: skip
SINGLE_VALUES = (
    "actual_tool_accelerometer", "robot_mode", "safety_mode", "runtime_state", "speed_scaling", "actual_momentum",
    "actual_main_voltage", "actual_robot_voltage", "actual_robot_current", "actual_digital_output_bits", "payload",
    "output_int_register_0", "output_double_register_0", "input_int_register_0", "input_double_register_0",
)  # fmt: skip
RECIPE = 22
"""Number of variables of each client, about as many as real clients request."""


def recipe(number: int) -> list[str]:
    """Return the variables of a client; all recipes differ, but share some variables."""
    pool = [*JOINT_VALUES, *SINGLE_VALUES]
    return ["timestamp", *(pool[(7 * number + 3 * k + k // 11) % len(pool)] for k in range(RECIPE - 1))]


class Client:
    """One connection that reads data packages.

    Args:
        address: IP address of the robot.
        port: Port of the robot's RTDE interface.
        names: Variables of its recipe.
    """

    def __init__(self, address: str, port: int, names: list[str]) -> None:
        self.received = 0
        self.socket = socket.create_connection((address, port), 10.0)
        self._reader = PackageReader()
        self._ask(PackageKind.REQUEST_PROTOCOL_VERSION, struct.pack(">H", 2))
        types = self._ask(PackageKind.SETUP_OUTPUTS, struct.pack(">d", 500.0) + ",".join(names).encode())
        assert b"NOT_FOUND" not in types, f"a variable is not known: {types!r}"
        self._ask(PackageKind.START, b"")

    def read(self) -> None:
        """Take what has arrived."""
        self.received += len(self._packages())

    def _ask(self, kind: PackageKind, payload: bytes) -> bytes:
        self.socket.sendall(package(kind, payload))
        while True:
            for answer, said in self._packages():
                if answer == kind:
                    return said

    def _packages(self) -> list[tuple[int, bytes]]:
        data = self.socket.recv(65536)
        assert data, "the robot closed the connection"
        return list(self._reader.feed(data))


def main(address: str, port: int, count: int, recipes: int) -> None:
    """Read until stdin ends."""
    clients = [Client(address, port, recipe(number % recipes)) for number in range(count)]
    selector = selectors.DefaultSelector()
    for client in clients:
        selector.register(client.socket, selectors.EVENT_READ, client)
    selector.register(sys.stdin, selectors.EVENT_READ, None)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    while True:
        for key, _ in selector.select():
            if key.data is None:
                sys.stdout.write(json.dumps([{"received": client.received} for client in clients]) + "\n")
                return
            key.data.read()


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
