"""A TCP link between clients and a server that can be cut, stopped and slowed down."""

import contextlib
import socket
import threading
import time
from queue import SimpleQueue

from tests.places import free_port

CHUNK = 4096  # bytes passed on at once
ROOM = 1 << 14  # bytes that the link holds each way; few, so that a stopped link has an effect soon


class Relay:
    """Passes bytes on between its own address, `near`, and a server's endpoint, both ways and in order."""

    def __init__(self, target, near=None):
        host, port = target.partition("/")[2].split(":")
        self._target, self._near = (host, int(port)), near or ("127.0.0.1", free_port())
        self._flowing, self._lock = threading.Event(), threading.Lock()
        self._listening: socket.socket | None = None
        self._open = set[socket.socket]()
        self.rate: float | None = None  # bytes per second each way; None: unlimited
        self.connections = 0  # number of connections so far
        self.flow()
        self.restore()

    @property
    def endpoint(self):
        return "tcp/{}:{}".format(*self._near)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.cut()

    def hold(self):
        """Let nothing pass, as if a cable were pulled: connections stay, and bytes wait."""
        self._flowing.clear()

    def flow(self):
        """Pass on waiting and new bytes."""
        self._flowing.set()

    def cut(self):
        with self._lock:
            listening, self._listening = self._listening, None
            ended, self._open = self._open, set()
        for one in (*ended, *([listening] if listening else [])):
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()
        self.flow()

    def restore(self):
        self._listening = listening = socket.create_server(self._near)
        threading.Thread(target=self._accept, args=(listening,), daemon=True).start()

    def takes(self):
        """Return the time that the next bytes take [s]."""
        return 0.0

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
            try:
                far.connect(self._target)
            except OSError:  # no server listens
                near.close()
                far.close()
                continue
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
