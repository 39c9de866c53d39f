"""The program on its way to a robot, in a thread of its own: the one that ticks never waits for the network."""

import contextlib
import socket
import threading

from tvist_server.moving.dashboard import asked
from tvist_server.moving.dialogue import PATIENCE
from tvist_server.moving.ports import Ports

REMOTE = "is in remote control"


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
        self._thread = threading.Thread(target=self._run, name="tvist-upload", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Let the connection go."""
        self._closed.set()

    def _run(self) -> None:
        if asked(self._ports.dashboard, [REMOTE]).get(REMOTE) == "false":
            self.trouble = (
                "it is in local control, or another client controls it: switch it to remote control"
            )
            return
        where = self._ports.primary
        try:
            with socket.create_connection((where.host, where.port), PATIENCE) as connection:
                connection.sendall(self._text.encode())
                connection.settimeout(0.5)
                while not self._closed.is_set():
                    with contextlib.suppress(TimeoutError):
                        if not connection.recv(1 << 16):
                            return
        except OSError as error:
            self.trouble = f"its port {where.port} takes no program: {error.strerror or error}"
