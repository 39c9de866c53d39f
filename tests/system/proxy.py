"""A link between a client and a robot that can be cut, held up, delayed and made slow."""

import contextlib
import socket
import threading
import time
from queue import SimpleQueue

from tests.places import free_port

CHUNK = 4096
"""Bytes passed on at once."""
BUFFER = 1 << 14
"""What the link holds of its own each way [bytes]; small, so that a link that stands still is soon felt."""


class Proxy:
    """Passes bytes on between whoever connects to `endpoint` and a robot, both ways.

    Args:
        target: The robot's endpoint, `tcp/<host>:<port>`.
        address: Where it listens: IP address and port; None for a free port of 127.0.0.1.
    """

    def __init__(self, target, address=None):
        host, port = target.partition("/")[2].split(":")
        self._target = (host, int(port))
        self._flowing = threading.Event()
        self._flowing.set()
        self._lock = threading.Lock()
        self._sockets = set()
        self._interface = None
        self._address = address or ("127.0.0.1", free_port())
        self.delay = 0.0
        """How long a byte takes each way [s]."""
        self.rate = None
        """Bytes a second each way; None: as many as come."""
        self.connections = 0
        """How often somebody has connected."""
        self.restore()

    @property
    def endpoint(self):
        return "tcp/{}:{}".format(*self._address)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.cut()

    # ---------------------------------------------------------------- what can happen to it

    def cut(self):
        """Break every connection, and refuse new ones."""
        with self._lock:
            interface, self._interface = self._interface, None
            sockets, self._sockets = self._sockets, set()
        for each in (*sockets, *([interface] if interface else [])):
            with contextlib.suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
            each.close()
        self._flowing.set()

    def restore(self):
        """Take connections again, at the same place."""
        interface = socket.socket()
        interface.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        interface.bind(self._address)
        interface.listen()
        self._interface = interface
        threading.Thread(target=self._accept, args=(interface,), daemon=True).start()

    def hold(self):
        """Let nothing pass, as when a cable is pulled: the connections stay."""
        self._flowing.clear()

    def flow(self):
        """Let pass again, first what has waited."""
        self._flowing.set()

    # ---------------------------------------------------------------- threads

    def _accept(self, interface):
        while True:
            try:
                near, _ = interface.accept()
            except OSError:
                return
            far = socket.socket()
            for each in (near, far):
                each.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
                each.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER)
                each.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with contextlib.suppress(OSError):
                far.connect(self._target)
            with self._lock:
                if self._interface is not interface:
                    near.close()
                    far.close()
                    return
                self._sockets |= {near, far}
            self.connections += 1
            for source, sink in ((near, far), (far, near)):
                under_way = SimpleQueue()
                for work, each in ((self._take, source), (self._give, sink)):
                    threading.Thread(target=work, args=(each, under_way), daemon=True).start()

    def _take(self, source, under_way):
        while True:
            self._flowing.wait()
            try:
                data = source.recv(CHUNK)
            except OSError:
                data = b""
            if self.rate is not None:
                time.sleep(len(data) / self.rate)
            under_way.put((time.monotonic(), data))
            if not data:
                return

    def _give(self, sink, under_way):
        while True:
            came, data = under_way.get()
            wait = came + self.delay - time.monotonic()
            if wait > 0.0:
                time.sleep(wait)
            self._flowing.wait()
            try:
                if not data:
                    sink.shutdown(socket.SHUT_WR)
                    return
                sink.sendall(data)
            except OSError:
                return
