r"""A gripper with moving fingers: a Robotiq 2F's registers and text protocol.

Positions are counts as in the registers: open at `OPEN`, closed at `CLOSED`, requests of 0 to 255 are clamped.

Protocol on port 63352: `SET POS 255 GTO 1\n` is answered by `ack`, `GET POS\n` by a line. The URCap's functions send
`GET POS` without a line feed and read a fixed number of bytes: the answer is the value alone with leading zeros. For
the same reason `ack` has no `\n`.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

OPEN, CLOSED = 3, 230  # positions of open and closed fingers [counts]; real ones differ by a few counts
ACTIVATION: Final = 500  # shortest duration of an activation [ticks]
SPEEDS = {0.085: (0.020, 0.150), 0.14: (0.030, 0.250)}
"""Finger speed at register values 0 and 255 for each opening [m/s]."""
FORCES = {0.085: (20.0, 235.0), 0.14: (10.0, 125.0)}
"""Finger force at register values 0 and 255 for each opening [N]."""
MOVING, STOPPED_CLOSING, ARRIVED = 0, 2, 3  # values of OBJ
WRITABLE: Mapping[str, int] = MappingProxyType(
    {"ACT": 1, "GTO": 1, "ATR": 1, "ARD": 1, "POS": 255, "SPE": 255, "FOR": 255, "MOD": 1, "MSC": 255}
)  # writable registers and their largest values

PORT: Final = 63352  # TCP port on which the URCap listens
SLAVES = ("9", "1")  # SID values by which clients select the only gripper
UNKNOWN: Final = b"?"  # answer to an unknown request
LONGEST: Final = 1024  # longest line [bytes]
_DIGITS = {"PRE": 3, "POS": 3, "SPE": 3, "FOR": 3, "MSC": 3, "FLT": 2}
"""Digits of a bare answer; 1 for other registers."""
_BARE_GET = re.compile(rb"GET [A-Z]{3}")
_LIST = b"[9]"  # numbers of the connected grippers
_LIST_BYTES = 17  # length of the list of up to four grippers

Meet = Callable[[float, float], float | None]
"""Function that returns the opening at which fingers closing between two openings meet a part, else None [m]."""


@dataclass(frozen=True)
class Moved:
    """Results of a tick of the fingers."""

    gripped: bool = False  # the fingers have gripped a part
    released: bool = False  # the fingers have released the part
    met_nothing: bool = False  # the fingers have closed without a part


_NOTHING = Moved()


class Gripper:
    """The fingers with their opening [m], and their registers."""

    def __init__(self, stroke: float, *, activated: bool) -> None:
        self.stroke = stroke  # largest opening [m]
        self._activated = activated
        self.begin()

    @property
    def grip_force(self) -> float:
        """Set force of the fingers [N]."""
        least, most = FORCES[self.stroke]
        return least + self._written["FOR"] / 255.0 * (most - least)

    def begin(self) -> None:
        """Reset to the start: open fingers."""
        self._position = float(OPEN)
        self._written = dict.fromkeys(WRITABLE, 0) | {"ACT": int(self._activated), "SPE": 255, "FOR": 255}
        self._activating = 0  # remaining ticks of the activation; 0 if complete
        self._active = self._activated
        self._released = False  # whether an automatic release has ended, which requires another activation
        self._object = ARRIVED
        self.holds = False  # whether a part is between the fingers; without one, they close further

    # ------------------------------------------------------------------ registers

    def write(self, values: Mapping[str, int]) -> None:
        """Write registers of `WRITABLE` together, with effect from the next tick."""
        written, before = self._written, self._written["ACT"]
        written.update(values)
        if not written["ACT"]:
            self._active, self._activating, self._released = False, 0, False
        elif not before:
            self._activating, self._active = ACTIVATION, False
        if self._target is None:
            self._object = self._object or ARRIVED  # fingers that were moving have stopped
        elif self._target != self._position and not self._stopped:
            self._object = MOVING

    def read(self, name: str) -> int | None:
        """Return a register; None for an unknown name."""
        match name:
            case "POS":
                return round(self._position)
            case "PRE":
                return self._written["POS"]
            case "OBJ":
                return self._object
            case "STA":
                return 3 if self._active else 1 if self._activating else 0
            case "FLT":
                return self._fault
        return self._written.get(name)

    @property
    def _fault(self) -> int:
        """Fault code: 11 during, 15 after automatic release; for requests, 7 before, 5 during activation."""
        if self._written["ATR"]:
            return 15 if self._released else 11
        if self._written["GTO"] and not self._active:
            return 5 if self._activating else 7
        return 0

    # ------------------------------------------------------------------ motion

    @property
    def opening(self) -> float:
        """Present distance between the fingers [m]."""
        return self._opening(self._position)

    @property
    def _target(self) -> float | None:
        written = self._written
        if written["ATR"]:
            return CLOSED if written["ARD"] else OPEN
        if self._activating:
            return OPEN
        if not (self._active and written["GTO"]):
            return None
        return min(max(written["POS"], OPEN), CLOSED)

    @property
    def _stopped(self) -> bool:
        """Whether a part between the fingers prevents the requested closing."""
        return self.holds and self._target is not None and self._target >= self._position

    @property
    def _step(self) -> float:
        """Travel of the fingers in a tick [counts]."""
        from tvist_plant.plant import PERIOD  # the port's number is read by the options, without the plant

        slow, fast = SPEEDS[self.stroke]
        share = 0.0 if self._written["ATR"] else 1.0 if self._activating else self._written["SPE"] / 255.0
        return (slow + share * (fast - slow)) * PERIOD / self.stroke * (CLOSED - OPEN)

    def tick(self, meet: Meet) -> Moved:
        """Move fingers for a tick; while they close and hold nothing, `meet` finds the part between them."""
        target, position = self._target, self._position
        if target is None:
            return _NOTHING
        if self._activating > 1 or (self._activating and position == target):
            self._activating -= 1
            self._active = not self._activating
        if self._stopped:
            self._object = STOPPED_CLOSING
            return _NOTHING
        if target == position:
            self._arrive()
            return _NOTHING
        step = min(self._step, abs(target - position))
        new = position + step if target > position else position - step
        released, gripped = self.holds and target < position, False
        if target > position:
            at = meet(self._opening(position), self._opening(new))
            gripped = at is not None
            new = new if at is None else CLOSED - at / self.stroke * (CLOSED - OPEN)
        self._position, self.holds = new, gripped
        self._object = STOPPED_CLOSING if gripped else MOVING
        arrived = not gripped and abs(target - new) < 1e-9
        if arrived:
            self._position = float(target)
            self._arrive()
        return Moved(gripped=gripped, released=released, met_nothing=arrived and target == CLOSED)

    def _arrive(self) -> None:
        self._object = ARRIVED
        if self._written["ATR"]:
            self._released, self._active = True, False

    def _opening(self, position: float) -> float:
        return (CLOSED - position) / (CLOSED - OPEN) * self.stroke


# ---------------------------------------------------------------------- the text protocol


class Requests:
    """Splits the bytes of one connection into requests."""

    def __init__(self) -> None:
        self._received = b""

    def cut(self, data: bytes) -> list[bytes]:
        """Return the requests that new data completes; a GET without line feed is complete if alone."""
        if not self._received and _BARE_GET.fullmatch(data):
            return [data]
        *lines, rest = (self._received + data).split(b"\n")
        requests = [line + b"\n" for line in lines if line.strip()]
        if len(rest) > LONGEST:
            requests.append(rest[:LONGEST])
            rest = b""
        self._received = rest
        return requests


def changes(request: bytes) -> bool:
    """Return whether a request may change something and so belongs in the journal."""
    return not request.startswith(b"GET ")


def answer(gripper: Gripper, request: bytes) -> bytes:
    """Carry out a request cut by `Requests` and return the answer."""
    alone = not request.endswith(b"\n")
    match request.decode("ascii", "replace").split():
        case ["GET", "SID"]:
            return _LIST.ljust(_LIST_BYTES) if alone else b"SID " + _LIST + b"\n"
        case ["GET", name] if (value := gripper.read(name)) is not None:
            digits = _DIGITS.get(name, 1)
            return (f"{value:0{digits}d}" if alone else f"{name} {value}\n").encode()
        case ["SET", "SCN_BLOCK", _]:  # stop scanning for grippers
            return b"ack"
        case ["SET", "SID", slave]:
            return b"ack" if slave in SLAVES else b""  # no answer for a gripper that does not exist
        case ["SET", *pairs] if pairs and len(pairs) % 2 == 0:
            return _set(gripper, pairs)
    return UNKNOWN


def _set(gripper: Gripper, pairs: list[str]) -> bytes:
    values: dict[str, int] = {}
    for name, text in zip(pairs[::2], pairs[1::2], strict=True):
        if not (text.isascii() and text.isdigit() and int(text) <= WRITABLE.get(name, -1)):
            return UNKNOWN
        values[name] = int(text)
    gripper.write(values)
    return b"ack"
