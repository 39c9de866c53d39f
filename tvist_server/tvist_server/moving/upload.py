"""The program on its way to a robot, in a thread of its own: the one that ticks never waits for the network."""

import contextlib
import socket
import threading
from collections.abc import Callable

from tvist_server.moving.configuration import PRIMARY
from tvist_server.moving.dashboard import asked
from tvist_server.moving.dialogue import PATIENCE
from tvist_server.moving.start_checks import REMOTE, remote_trouble
from tvist_server.watching.place import Place

LOOK_EVERY = 0.2
"""Longest time after which the thread ends [s]."""


class Upload:
    """Sends a program, and keeps the connection: some robots end a program whose sender is gone.

    Args:
        place: The robot.
        text: The program.
        check: Returns why the robot takes no program now, in words; None if it does.
    """

    def __init__(self, place: Place, text: str, check: Callable[[], str | None]) -> None:
        self._place, self._text, self._check = place, text, check
        self.trouble: str | None = None
        """Why the program cannot run, in words."""
        self._closed = threading.Event()
        self.thread = threading.Thread(target=self._run, name="tvist-upload", daemon=True)
        self.thread.start()

    def close(self) -> None:
        """Let the connection go."""
        self._closed.set()

    def _run(self) -> None:
        self.trouble = remote_trouble(asked(self._place, [REMOTE]))
        if self.trouble is not None or self._closed.is_set():
            return
        where = self._place.beside(PRIMARY)
        try:
            with socket.create_connection((where.host, where.port), PATIENCE) as connection:
                self.trouble = self._check()  # a program that comes late would end another one's motion
                if self.trouble is not None or self._closed.is_set():
                    return
                connection.sendall(self._text.encode())
                connection.settimeout(LOOK_EVERY)
                while not self._closed.is_set():
                    with contextlib.suppress(TimeoutError):
                        if not connection.recv(1 << 16):
                            return
        except OSError as error:
            self.trouble = f"its port {where.port} takes no program: {error.strerror or error}"
