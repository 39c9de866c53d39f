"""What a robot's own controller says, and what becomes of it here."""

from collections.abc import Callable

import msgspec

from tvist_controller.commands.events import Emit
from tvist_controller.instruments.peripherals import Peripherals
from tvist_plant.plant import Sight
from tvist_protocol.io import Io
from tvist_protocol.values import Payload


class Said:
    """Takes what a robot says, cycle by cycle.

    Args:
        peripherals: Told when inputs and outputs change.
        set_tcp: Told the tool centre point.
        emit: Emits events.
    """

    def __init__(
        self, peripherals: Peripherals, set_tcp: Callable[[tuple[float, ...]], None], emit: Emit
    ) -> None:
        self._peripherals, self._set_tcp, self._emit = peripherals, set_tcp, emit
        self._sight: Sight | None = None
        self._io: tuple[object, ...] = ()

    @property
    def missed(self) -> int:
        """Number of the robot's cycles that did not arrive."""
        return 0 if self._sight is None else self._sight.missed

    def tell(self, sight: Sight, before: Sight | None) -> None:
        """Emit what people should know, and take over the tool; `before` is what it said before."""
        for why in sight.told:
            self._emit("warning", why=why)
        if sight.tool is not None and (before is None or sight.tool != before.tool):
            self._set_tcp(sight.tool)
        io = sight.payload, sight.tool, sight.slider, sight.inputs, sight.outputs
        if io != self._io:
            self._io, self._peripherals.changed = io, True

    def declared(self, payload: Payload) -> Payload:
        """Return the payload that the robot was told; `payload` if it does not say."""
        if self._sight is None or self._sight.payload is None:
            return payload
        told = self._sight.payload
        return Payload(mass=told.mass, com=told.com, inertia=told.inertia)

    def io(self, io: Io, *, force: bool) -> Io:
        """Return `io` with what the robot says of itself; its force at the tool only if that is wanted."""
        sight = self._sight
        if sight is None:
            return io
        given = {
            "payload": self.declared(io.payload),
            "tcp_offset": io.tcp_offset if sight.tool is None else list(sight.tool),
            "target_speed_fraction": io.target_speed_fraction if sight.slider is None else sight.slider,
            "actual_digital_input_bits": sight.inputs,
            "actual_digital_output_bits": sight.outputs,
            "actual_TCP_force": list(sight.force) if force and sight.force is not None else None,
        }
        return msgspec.structs.replace(io, **given)
