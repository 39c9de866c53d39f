"""One RTDE connection: what it has set up, and what it is answered.

Before `REQUEST_PROTOCOL_VERSION` the protocol is version 1, which knows no frequency, no recipe's id in front of
outputs and their types, and no source in text messages.
"""

from collections.abc import Callable
from math import floor
from struct import Struct

from tvist_controller.instruments.snapshot import Snapshot
from tvist_server.gateways.ur import version
from tvist_server.gateways.ur.base import ControllerAccess, PortSession, Send
from tvist_server.gateways.ur.robot import UrRobot
from tvist_server.gateways.ur.rtde.codec import (
    PackageKind,
    PackageReader,
    TextLevel,
    package,
    text_message,
    words,
)
from tvist_server.gateways.ur.rtde.inputs import INPUTS, NEED_CONTROL
from tvist_server.gateways.ur.rtde.recipes import InputRecipe, OutputRecipe, split
from tvist_server.gateways.ur.rtde.writing import InputWriter

RATE = 500.0
"""Rate of control periods, and the highest frequency of packages [Hz]."""
RECIPES = 255
"""Input recipes that a connection can number."""
SENTENCES = 64
"""Different text messages to a client between two starts: it may send wrong packages for days."""
OUTPUT_ID = b"\x01"
"""A connection has one output recipe."""

_UINT16 = Struct(">H")
_DOUBLE = Struct(">d")
_VERSION = Struct(">4I")
_TRUE, _FALSE = b"\x01", b"\x00"


class RtdeSession(PortSession):
    """Answers a client and samples for it.

    Args:
        robot: What the interfaces of a robot share.
        control: The way to its controller.
        send: Sends an answer.
    """

    client_begins = True

    def __init__(self, robot: UrRobot, control: ControllerAccess, send: Send) -> None:
        self._robot = robot
        self._control = control
        self._send = send
        self._reader = PackageReader()
        self._writer = InputWriter(robot, control, self._complain)
        self._version = 1
        self._head = b""
        self._started = False
        self._outputs: OutputRecipe | None = None
        self._outputs_wrong = False
        self._inputs: list[InputRecipe] = []
        self._every = 1
        self._next: int | None = None
        self._said: set[str] = set()
        self._handlers: dict[int, Callable[[bytes], None]] = {
            PackageKind.REQUEST_PROTOCOL_VERSION: self._request_version,
            PackageKind.GET_URCONTROL_VERSION: self._tell_version,
            PackageKind.TEXT_MESSAGE: self._take_text,
            PackageKind.DATA: self._take_data,
            PackageKind.SETUP_OUTPUTS: self._set_up_outputs,
            PackageKind.SETUP_INPUTS: self._set_up_inputs,
            PackageKind.START: self._start,
            PackageKind.PAUSE: self._pause,
        }

    @property
    def served(self) -> bool:
        """Whether outputs were started, and not paused since."""
        return self._started

    def receive(self, data: bytes) -> None:
        """Take what arrived, cut anywhere."""
        for kind, payload in self._reader.feed(data):
            handler = self._handlers.get(kind)
            if handler is None:
                self._complain(f"there is no package of type {kind}")
            else:
                handler(payload)

    def sample(self, snapshot: Snapshot) -> bytes:
        """A data package where one is due: with the first tick after the start, then every so many ticks."""
        if not self._started or self._outputs is None:
            return b""
        tick, every = snapshot.state.tick, self._every
        if self._next is None:
            self._next = tick
        if tick < self._next:
            return b""
        self._next += every * ((tick - self._next) // every + 1)
        return self._outputs.package(snapshot, self._head)

    def closed(self) -> None:
        """The connection is gone: its inputs are free."""
        self._robot.inputs.release(self)

    # ------------------------------------------------------------------ answers

    def _request_version(self, payload: bytes) -> None:
        """Version 1 or 2; another one leaves what is."""
        wanted = _UINT16.unpack_from(payload)[0] if len(payload) >= _UINT16.size else 0
        accepted = wanted in {1, 2}
        if accepted:
            self._version = wanted
            self._head = b"" if wanted == 1 else OUTPUT_ID
        self._send(package(PackageKind.REQUEST_PROTOCOL_VERSION, _TRUE if accepted else _FALSE))

    def _tell_version(self, _payload: bytes) -> None:
        numbers = version.MAJOR, version.MINOR, version.BUGFIX, version.BUILD
        self._send(package(PackageKind.GET_URCONTROL_VERSION, _VERSION.pack(*numbers)))

    def _set_up_outputs(self, payload: bytes) -> None:
        """A new output recipe replaces the old one; one that is not valid leaves none."""
        frequency = RATE
        if self._version > 1:
            if len(payload) >= _DOUBLE.size:
                frequency = _DOUBLE.unpack_from(payload)[0]
            payload = payload[_DOUBLE.size :]
        recipe = OutputRecipe(split(payload))
        self._outputs_wrong = not recipe.valid
        self._outputs = recipe if recipe.valid else None
        self._every, self._next = ticks_between(frequency), None
        number = OUTPUT_ID if recipe.valid else _FALSE
        head = b"" if self._version == 1 else number
        self._send(words(PackageKind.SETUP_OUTPUTS, head, recipe.words))

    def _set_up_inputs(self, payload: bytes) -> None:
        """A further input recipe; one that is not valid has id 0 and takes nothing."""
        names = split(payload)
        types = [self._input_word(name) for name in names]
        valid = bool(names) and len(self._inputs) < RECIPES and not {"NOT_FOUND", "IN_USE"} & set(types)
        number = 0
        if valid:
            self._robot.inputs.take(names, self)
            self._inputs.append(InputRecipe(names))
            number = len(self._inputs)
        self._send(words(PackageKind.SETUP_INPUTS, bytes([number]), types))

    def _input_word(self, name: str) -> str:
        """Type of an input variable, or why it cannot be had."""
        if name not in INPUTS:
            return "NOT_FOUND"
        elsewhere = name in NEED_CONTROL and self._control.held_by_other
        if elsewhere or not self._robot.inputs.is_free(name, self):
            return "IN_USE"
        return INPUTS[name].name

    def _take_data(self, payload: bytes) -> None:
        """Inputs are taken whether or not outputs were started."""
        number = payload[0] if payload else 0
        if 0 < number <= len(self._inputs):
            self._writer.write(self._inputs[number - 1].values(payload[1:]))
        else:
            self._complain(f"there is no input recipe {number}")

    def _start(self, _payload: bytes) -> None:
        """Samples begin; not after output variables that were wrong."""
        self._started, self._next = not self._outputs_wrong, None
        self._said.clear()
        self._send(package(PackageKind.START, _TRUE if self._started else _FALSE))

    def _pause(self, _payload: bytes) -> None:
        self._started = False
        self._send(package(PackageKind.PAUSE, _TRUE))

    def _take_text(self, _payload: bytes) -> None:
        """What clients say is for a person's log; there is none to show it in."""

    def _complain(self, sentence: str) -> None:
        """Tell the client, once; never before the start, where it would be taken for the answer to a set-up."""
        if self._started and sentence not in self._said and len(self._said) < SENTENCES:
            self._said.add(sentence)
            self._send(text_message(self._version, TextLevel.WARNING, sentence, "RTDE"))


def ticks_between(frequency: float) -> int:
    """Ticks from one sample to the next: the rate over the frequency, rounded down.

    Args:
        frequency: Wanted [Hz]; what is above 500 counts as 500, what is below 1 as 1, and no number above zero as none
            wanted, hence 500.
    """
    if not frequency > 0.0:
        return 1
    return floor(RATE / min(max(frequency, 1.0), RATE) + 1e-9)
