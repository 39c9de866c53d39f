"""A link between a robot's RTDE interface and its reader: it delays, drops, repeats and records rows."""

import random
from struct import Struct

from tests.system.relay import Relay

from tvist_server.rtde.codec import PackageKind, PackageReader, package

_DOUBLE = Struct(">d")


class RtdeLink(Relay):
    """Passes packages on; what it drops and repeats depends on a seed."""

    def __init__(self, target, seed=0):
        self._random = random.Random(seed)
        self.sent, self.passed = [], []
        """Kinds of the reader's packages, and for each connection the timestamps of the rows that passed."""
        self.slow, self.lost, self.repeated = False, 0.0, 0.0
        """Options of the link: rows at 125 Hz instead of 500 Hz, and shares of rows to drop and to repeat."""
        self.earlier = 0.0
        """Time by which timestamps are set back, as if the robot had been restarted [s]."""
        super().__init__(target)

    def takes(self):
        """Return 1 ms ± 0.5 ms; bytes keep their order."""
        return self._random.uniform(5e-4, 1.5e-3)

    def _give(self, sink, under_way):
        to_robot = sink.getpeername() == self._target
        super()._give(sink, _Edited(under_way, self._asked if to_robot else self._answers()))

    def _asked(self, data):
        self.sent += [PackageKind(kind) for kind, _ in PackageReader().feed(data)]
        return data.replace(_DOUBLE.pack(500.0), _DOUBLE.pack(125.0)) if self.slow else data

    def _answers(self):
        reader, rows = PackageReader(), []
        self.passed.append(rows)

        def answer(data):
            out = b""
            for kind, payload in reader.feed(data):
                whole = package(PackageKind(kind), payload)
                if kind == PackageKind.DATA:
                    if self._random.random() < self.lost:
                        continue
                    rows.append(_DOUBLE.unpack_from(payload, 1)[0] - self.earlier)
                    whole = package(kind, payload[:1] + _DOUBLE.pack(rows[-1]) + payload[1 + _DOUBLE.size :])
                    whole *= 2 if self._random.random() < self.repeated else 1
                out += whole
            return out

        return answer


class _Edited:
    def __init__(self, under_way, edit):
        self._under_way, self._edit = under_way, edit

    def get(self):
        came, data = self._under_way.get()
        while data and not (edited := self._edit(data)):  # nothing would end the connection
            came, data = self._under_way.get()
        return came, edited if data else data
