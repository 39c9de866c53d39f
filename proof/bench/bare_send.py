"""A server that does nothing but send: the least that RTDE's packages can cost.

    python -m proof.bench.bare_send ADDRESS PORT

It answers the set-up of RTDE clients, and then sends each of them a package of the size of its recipe every 2 ms, by
one call of `send()`. All packages are made before. It ends with its stdin.
"""

import contextlib
import selectors
import socket
import sys
import time

from tvist_server.gateways.ur.rtde.outputs import OUTPUTS
from tvist_server.gateways.ur.rtde.recipes import split
from tvist_server.rtde.codec import PackageKind, PackageReader, package

PERIOD = 0.002
"""Control period [s]."""
RATE_BYTES = 8
"""Bytes of the rate before the names of a recipe."""


def package_of(payload: bytes) -> tuple[bytes, bytes]:
    """Return the answer to the set-up of a recipe, and a data package of its size.

    Args:
        payload: Payload of the set-up.
    """
    wires = [OUTPUTS[name] for name in split(payload[RATE_BYTES:])]
    answer = package(PackageKind.SETUP_OUTPUTS, b"\x01" + ",".join(wire.name for wire in wires).encode())
    return answer, package(PackageKind.DATA, bytes(1 + sum(wire.size for wire in wires)))


class Peer:
    """One client.

    Args:
        connection: Its connection.
    """

    def __init__(self, connection: socket.socket) -> None:
        self.connection, self._reader = connection, PackageReader()
        self.data = b""
        """Package to send."""
        self.started = False

    def hear(self) -> bool:
        """Answer what has arrived; False if the client has gone."""
        try:
            heard = self.connection.recv(4096)
        except ConnectionError:
            return False
        for kind, payload in self._reader.feed(heard):
            if kind == PackageKind.SETUP_OUTPUTS:
                answer, self.data = package_of(payload)
            else:
                answer = package(PackageKind(kind), b"\x01")
                self.started = kind == PackageKind.START
            self.connection.sendall(answer)
        return bool(heard)


def main(address: str, port: int) -> None:
    """Send until stdin ends."""
    selector = selectors.DefaultSelector()
    listening = socket.create_server((address, port))
    selector.register(listening, selectors.EVENT_READ)
    selector.register(sys.stdin, selectors.EVENT_READ)
    peers: list[Peer] = []
    due = time.monotonic()
    while True:
        for key, _ in selector.select(max(0.0, due - time.monotonic())):
            if key.fileobj is sys.stdin:
                return
            if key.fileobj is listening:
                connection, _ = listening.accept()
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                peers.append(Peer(connection))
                selector.register(connection, selectors.EVENT_READ, peers[-1])
            elif not key.data.hear():
                selector.unregister(key.data.connection)
                peers.remove(key.data)
        if time.monotonic() >= due:
            due += PERIOD
            for peer in peers:
                if peer.started:
                    with contextlib.suppress(OSError):  # it is just going
                        peer.connection.send(peer.data)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
