"""A link between whoever connects and a server, which can be cut, held up, delayed and made slow."""

import contextlib
import socket
import threading
import time
from queue import SimpleQueue

CHUNK = 4096
"""Bytes that are passed on at once."""
ROOM = 1 << 14
"""Bytes that the link itself holds each way; small, so that a link that stands still is soon felt."""
Address = tuple[str, int]
"""IP address and port."""


class Relay:
    """Passes bytes on between its own address and a server's, both ways and in their order."""

    def __init__(self, target, near):
        self._target, self._near = target, near
        self._flowing, self._lock = threading.Event(), threading.Lock()
        self._listening: socket.socket | None = None
        self._open = set[socket.socket]()
        self.delay = 0.0
        """Time that bytes take each way [s]."""
        self.rate: float | None = None
        """Bytes a second each way; None: as many as come."""
        self.connections = 0
        """Number of times that somebody has connected."""
        self.flow()
        self.restore()

    @property
    def endpoint(self):
        """Its address in Zenoh's notation."""
        return "tcp/{}:{}".format(*self._near)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.cut()

    # ---------------------------------------------------------------- what can happen to it

    def hold(self):
        """Let nothing pass, as with a cable that is pulled: connections stay, and what comes waits."""
        self._flowing.clear()

    def flow(self):
        """Let pass what has waited and what comes."""
        self._flowing.set()

    def cut(self):
        """Break all connections, and refuse new ones."""
        with self._lock:
            listening, self._listening = self._listening, None
            ended, self._open = self._open, set()
        for one in (*ended, *([listening] if listening else [])):
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()
        self.flow()

    def restore(self):
        """Take connections again, at the same place."""
        self._listening = listening = socket.create_server(self._near)
        threading.Thread(target=self._accept, args=(listening,), daemon=True).start()

    def takes(self):
        """Return the time that the next bytes take [s]."""
        return self.delay

    # ---------------------------------------------------------------- threads

    def _accept(self, listening):
        while True:
            try:
                near, _ = listening.accept()
            except OSError:
                return
            far = socket.socket()
            for one in (near, far):
                one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, ROOM)
                one.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, ROOM)
                one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with contextlib.suppress(OSError):  # its side then ends at once, as a refused one does
                far.connect(self._target)
            with self._lock:
                if self._listening is not listening:
                    near.close()
                    far.close()
                    return
                self._open |= {near, far}
            self.connections += 1
            for source, sink in ((near, far), (far, near)):
                under_way = SimpleQueue[tuple[float, bytes]]()
                for work, one in ((self._take, source), (self._give, sink)):
                    threading.Thread(target=work, args=(one, under_way), daemon=True).start()

    def _take(self, source, under_way):
        data = b"x"
        while data:
            self._flowing.wait()
            try:
                data = source.recv(CHUNK)
            except OSError:
                data = b""
            if self.rate is not None:
                time.sleep(len(data) / self.rate)
            under_way.put((time.monotonic(), data))

    def _give(self, sink, under_way):
        while True:
            came, data = under_way.get()
            time.sleep(max(0.0, came + self.takes() - time.monotonic()))
            self._flowing.wait()
            try:
                if not data:
                    sink.shutdown(socket.SHUT_WR)
                    return
                sink.sendall(data)
            except OSError:
                return
