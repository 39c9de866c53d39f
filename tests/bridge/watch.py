"""What a robot says of itself while something goes wrong, row by row, from its own RTDE interface."""

import selectors
import socket
import threading
import time

import numpy as np

from tvist_lab.recordings import Floats
from tvist_plant.plant import PERIOD
from tvist_protocol.modes import RuntimeState
from tvist_server.moving.program import NUMBER, STATE, State
from tvist_server.rtde.client import Row, RtdeClient
from tvist_server.rtde.wire import Field, Wire

_STATE = f"output_int_register_{STATE}"
_READ: dict[str, Field] = {
    "timestamp": Field(Wire.DOUBLE),
    "target_q": Field(Wire.VECTOR6D),
    "target_qd": Field(Wire.VECTOR6D),
    "runtime_state": Field(Wire.UINT32),
    f"input_int_register_{NUMBER}": Field(Wire.INT32),
    _STATE: Field(Wire.INT32),
}
STILL = 1e-6
"""Speed below which the target is at rest [rad/s]."""


class Watch:
    """Reads a robot's rows, without a link in between, from a thread of its own."""

    def __init__(self, robot):
        self._client, self._socket = RtdeClient(_READ, {}), socket.create_connection((robot, 30004))
        self._rows: list[Row] = []
        self._ended = False
        self._thread = threading.Thread(target=self._read, daemon=True)

    def __enter__(self):
        self._socket.sendall(self._client.begin())
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ended = True
        self._thread.join()
        self._socket.close()

    def _read(self):
        with selectors.DefaultSelector() as ready:
            ready.register(self._socket, selectors.EVENT_READ)
            while not self._ended:
                if ready.select(0.1):
                    received = self._client.receive(self._socket.recv(1 << 16))
                    self._rows += received.rows
                    if received.send:
                        self._socket.sendall(received.send)

    @property
    def count(self):
        """Number of rows so far."""
        return len(self._rows)

    @property
    def state(self):
        """What the program does."""
        return State(int(self._rows[-1][_STATE][0]))

    @property
    def plays(self):
        """Whether the robot plays a program."""
        return int(self._rows[-1]["runtime_state"][0]) == RuntimeState.PLAYING

    @property
    def speed(self):
        """Present speed of the fastest joint's target [rad/s]."""
        return max(map(abs, self._rows[-1]["target_qd"]))

    def since(self, first):
        """Return the rows from one on."""
        return Course(self._rows[first:])


class Course:
    """A piece of the robot's time, by its rows."""

    def __init__(self, rows):
        def column(name):
            return np.array([row[name] for row in rows]).squeeze()

        self.time: Floats = column("timestamp")
        self.q, self.qd = column("target_q"), column("target_qd")
        self.number = column(f"input_int_register_{NUMBER}")
        self.state = column(_STATE)

    @property
    def largest_step(self):
        """Largest way of a joint's target in a period [rad]."""
        ways = np.abs(np.diff(self.q, axis=0)).max(axis=1) / np.round(np.diff(self.time) / PERIOD)
        return float(ways.max())

    @property
    def silence(self):
        """Time from the last new number before braking to the begin of braking [s].

        Braking has begun at the last row before rest at which the fastest joint was not slower than a row before, or
        where the program says so, whichever is later.
        """
        speed = np.abs(self.qd).max(axis=1)
        said = int(np.argmax(self.state >= State.BRAKING)) if (self.state >= State.BRAKING).any() else 0
        rest = int(np.argmax(speed[said:] < STILL)) + said
        faster = np.flatnonzero(np.diff(speed[: rest + 1]) >= 0.0)
        begun = max(said, int(faster[-1]) + 1 if len(faster) else 0)
        came = np.flatnonzero(np.diff(self.number[: begun + 1]))
        return float(self.time[begun] - self.time[came[-1] + 1 if len(came) else 0])


def wait_for(true, seconds, what):
    """Wait until something is so."""
    deadline = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < deadline, f"{what}: not within {seconds:g} s"
        time.sleep(0.005)
