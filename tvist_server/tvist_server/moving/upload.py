"""The program on its way to a robot, in a thread of its own: the one that ticks never waits for the network."""

import contextlib
import socket
import threading

from tvist_server.moving.dashboard import asked
from tvist_server.moving.dialogue import PATIENCE
from tvist_server.moving.ports import Ports
from tvist_server.moving.start_checks import REMOTE, remote_trouble

LOOK_EVERY = 0.2
"""Longest time after which the thread ends [s]."""


class Upload:
    """Sends a program, and keeps the connection: some robots end a program whose sender is gone.

    Args:
        ports: The robot's interfaces.
        text: The program.
    """

    def __init__(self, ports: Ports, text: str) -> None:
        self._ports, self._text = ports, text
        self.trouble: str | None = None
        """Why the program cannot run, in words."""
        self._closed = threading.Event()
        threading.Thread(target=self._run, name="tvist-upload", daemon=True).start()

    def close(self) -> None:
        """Let the connection go."""
        self._closed.set()

    def _run(self) -> None:
        self.trouble = remote_trouble(asked(self._ports.dashboard, [REMOTE]))
        if self.trouble is not None:
            return
        where = self._ports.primary
        try:
            with socket.create_connection((where.host, where.port), PATIENCE) as connection:
                connection.sendall(self._text.encode())
                connection.settimeout(LOOK_EVERY)
                while not self._closed.is_set():
                    with contextlib.suppress(TimeoutError):
                        if not connection.recv(1 << 16):
                            return
        except OSError as error:
            self.trouble = f"its port {where.port} takes no program: {error.strerror or error}"
