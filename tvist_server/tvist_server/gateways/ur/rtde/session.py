"""One RTDE connection: its protocol version, its recipes, and the answers to its packages.

Version 1, in use until the client requests version 2, has no frequency, no recipe id in packages of outputs,
and no source in text messages.
"""

from collections.abc import Callable, Mapping
from math import floor
from struct import Struct, pack

from tvist_controller.instruments.snapshot import Snapshot
from tvist_server.gateways.ur.base import PortSession, Send
from tvist_server.gateways.ur.lease import ConnectionControl
from tvist_server.gateways.ur.robot import UrRobot
from tvist_server.gateways.ur.rtde.package_encoder import PackageEncoder
from tvist_server.gateways.ur.rtde.recipes import InputRecipe, OutputRecipe, split
from tvist_server.gateways.ur.rtde.variables import INPUTS, NEED_CONTROL
from tvist_server.gateways.ur.rtde.writing import InputWriter
from tvist_server.gateways.ur.version import VERSION
from tvist_server.rtde.codec import PackageKind, PackageReader, package, warning, words

RATE = 500.0  # frequency of the control loop and highest frequency of data packages [Hz]
RECIPES = 255  # largest number of input recipes of a connection: their ids are 1 to 255
MAX_WARNINGS = 64
"""Largest number of text messages between two starts, because a client may send wrong packages for days."""
OUTPUT_ID = b"\x01"  # id of the output recipe: a connection has only one

_UINT16 = Struct(">H")
_DOUBLE = Struct(">d")
_TRUE, _FALSE = b"\x01", b"\x00"


class RtdeSession(PortSession):
    """Answers the packages of one client and sends it the outputs that it has subscribed to.

    `encoders` has an encoder for each interval between packages [ticks], so that variables of slow clients
    are not computed at the ticks of fast clients.
    """

    only_answers = True

    def __init__(
        self, robot: UrRobot, control: ConnectionControl, send: Send, encoders: Mapping[int, PackageEncoder]
    ) -> None:
        super().__init__(robot, control, send)
        self._encoders, self._encoder = encoders, encoders[1]
        self._reader = PackageReader()
        self._writer = InputWriter(robot, control, self._warn)
        self._version = 1
        self._head = b""
        self._outputs: OutputRecipe | None = None
        self._inputs: list[InputRecipe] = []
        self._every = 1
        self._next: int | None = None
        self._warned: set[str] = set()
        self._handlers: dict[int, Callable[[bytes], None]] = {
            PackageKind.REQUEST_PROTOCOL_VERSION: self._request_version,
            PackageKind.GET_URCONTROL_VERSION: self._tell_version,
            PackageKind.TEXT_MESSAGE: lambda _: None,  # a UR robot would show it on the teach pendant
            PackageKind.DATA: self._take_data,
            PackageKind.SETUP_OUTPUTS: self._set_up_outputs,
            PackageKind.SETUP_INPUTS: self._set_up_inputs,
            PackageKind.START: self._start,
            PackageKind.PAUSE: self._pause,
        }

    def receive(self, data: bytes) -> None:
        """Handle all complete packages; the rest is kept for the next call."""
        for kind, payload in self._reader.feed(data):
            handler = self._handlers.get(kind)
            if handler is None:
                self._warn(f"there is no package of type {kind}")
            else:
                handler(payload)

    def sample(self, snapshot: Snapshot) -> bytes:
        """Return a data package if one is due, otherwise no bytes; the first is due right after the start."""
        if not self.served or self._outputs is None:
            return b""
        tick, every = snapshot.state.tick, self._every
        if self._next is None:
            self._next = tick
        if tick < self._next:
            return b""
        self._next += every * ((tick - self._next) // every + 1)
        return self._encoder.package(self._outputs, snapshot, self._head)

    def closed(self) -> None:
        self._robot.inputs.release(self)
        self._encoder.end(self)
        super().closed()

    def _request_version(self, payload: bytes) -> None:
        wanted = _UINT16.unpack_from(payload)[0] if len(payload) >= _UINT16.size else 0
        accepted = wanted in {1, 2}
        if accepted:
            self._version = wanted
            self._head = b"" if wanted == 1 else OUTPUT_ID
        self._send(package(PackageKind.REQUEST_PROTOCOL_VERSION, _TRUE if accepted else _FALSE))

    def _tell_version(self, _payload: bytes) -> None:
        self._send(package(PackageKind.GET_URCONTROL_VERSION, pack(">4I", *VERSION)))

    def _set_up_outputs(self, payload: bytes) -> None:
        """Replace the output recipe; answer with types and, in version 2, an id: 0 if the recipe is invalid."""
        frequency = RATE
        if self._version > 1:
            if len(payload) >= _DOUBLE.size:
                frequency = _DOUBLE.unpack_from(payload)[0]
            payload = payload[_DOUBLE.size :]
        recipe = OutputRecipe(split(payload))
        self._outputs = recipe if recipe.valid else None
        self._every, self._next = ticks_between(frequency), None
        self._register()
        number = OUTPUT_ID if recipe.valid else _FALSE
        head = b"" if self._version == 1 else number
        self._send(words(PackageKind.SETUP_OUTPUTS, head, recipe.words))

    def _set_up_inputs(self, payload: bytes) -> None:
        """Add an input recipe; answer with an id and types. The id is 0 if a variable or the recipe is refused."""
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
        """Return an input variable's type, or `NOT_FOUND` or `IN_USE` if this connection cannot set it."""
        if name not in INPUTS:
            return "NOT_FOUND"
        elsewhere = name in NEED_CONTROL and self._control.held_by_other
        if elsewhere or not self._robot.inputs.is_free(name, self):
            return "IN_USE"
        return INPUTS[name].name

    def _take_data(self, payload: bytes) -> None:
        """Set the input variables of a data package, whether or not outputs are started."""
        number = payload[0] if payload else 0
        if 0 < number <= len(self._inputs):
            self._writer.write(self._inputs[number - 1].values(payload[1:]))
        else:
            self._warn(f"there is no input recipe {number}")

    def _start(self, _payload: bytes) -> None:
        self.served, self._next = self._outputs is not None, None
        self._register()
        self._warned.clear()
        self._send(package(PackageKind.START, _TRUE if self.served else _FALSE))

    def _pause(self, _payload: bytes) -> None:
        self.served = False
        self._register()
        self._send(package(PackageKind.PAUSE, _TRUE))

    def _register(self) -> None:
        """Register the recipe with the encoder of its interval if the client reads it now, else with none."""
        self._encoder.end(self)
        if self.served and self._outputs is not None:
            self._encoder = self._encoders[self._every]
            self._encoder.begin(self, self._outputs)

    def _warn(self, why: str) -> None:
        """Send each warning once per start; before the start, clients would take it for a recipe's answer."""
        if self.served and why not in self._warned and len(self._warned) < MAX_WARNINGS:
            self._warned.add(why)
            self._send(warning(self._version, why))


def ticks_between(frequency: float) -> int:
    """Return the ticks between two packages at a frequency [Hz], clipped to 1 to 500; 500 if it is not positive."""
    if not frequency > 0.0:
        return 1
    # 500 / (500 / 15) is 14.999999999999998, but a client that wants every 15th tick must get it.
    return floor(RATE / min(max(frequency, 1.0), RATE) + 1e-9)
