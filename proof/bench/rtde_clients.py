"""Clients of RTDE that read at 500 Hz, each with a recipe of its own, all in this process.

    python -m proof.bench.rtde_clients ADDRESS PORT COUNT

A line on stdout says that all of them read. They read until stdin ends; then another line gives the numbers of
packages that each received and missed.
"""

import json
import os
import selectors
import socket
import struct
import sys

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
PERIOD = 0.002
"""Control period [s]."""


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
        self.lost = 0
        """Number of ticks missing between two that arrived."""
        self._last: int | None = None
        self._data = b""
        self.socket = socket.create_connection((address, port), 10.0)
        self._ask("V", struct.pack(">H", 2))
        types = self._ask("O", struct.pack(">d", 500.0) + ",".join(names).encode())
        if b"NOT_FOUND" in types:
            raise SystemExit(f"a variable is not known: {types!r}")
        self._ask("S", b"")

    def read(self) -> bool:
        """Take the received data; return whether the connection is still open."""
        data = self.socket.recv(65536)
        self._data += data
        while len(self._data) >= 3 and len(self._data) >= (size := int.from_bytes(self._data[:2], "big")):
            package, self._data = self._data[:size], self._data[size:]
            if package[2] == ord("U"):
                self.sample(package[4:])
        return bool(data)

    def sample(self, values: bytes) -> None:
        """Count a sample.

        Args:
            values: The values of its recipe, `timestamp` first.
        """
        (stamp,) = struct.unpack_from(">d", values)
        tick = round(stamp / PERIOD)
        if self._last is not None:
            self.lost += tick - self._last - 1
        self._last = tick
        self.received += 1

    def _ask(self, kind: str, payload: bytes) -> bytes:
        self.socket.sendall(struct.pack(">HB", 3 + len(payload), ord(kind)) + payload)
        while True:
            size, answer = struct.unpack(">HB", self._exactly(3))
            said = self._exactly(size - 3)
            if answer == ord(kind):
                return said

    def _exactly(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            more = self.socket.recv(count - len(data))
            if not more:
                raise SystemExit("the robot closed the connection")
            data += more
        return data


def main(address: str, port: int, count: int) -> None:
    """Read until stdin ends."""
    clients = [Client(address, port, recipe(number)) for number in range(count)]
    selector = selectors.DefaultSelector()
    for client in clients:
        selector.register(client.socket, selectors.EVENT_READ, client)
    selector.register(sys.stdin, selectors.EVENT_READ, None)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    while True:
        for key, _ in selector.select():
            if key.data is None:
                os.read(sys.stdin.fileno(), 1)
                said = [{"received": client.received, "lost": client.lost} for client in clients]
                sys.stdout.write(json.dumps(said) + "\n")
                return
            if not key.data.read():
                raise SystemExit("the robot closed the connection")


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
