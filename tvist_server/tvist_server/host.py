"""Bytes around one controller: what arrives is decoded, carried out and journaled, what comes out goes to a sink.

Still without clock, thread or socket: whoever calls `tick` lets time pass. In lockstep and free it is the client,
through `simulation.step`.
"""

import logging
from typing import Protocol

from tvist_protocol.codec import decode_command, decode_setpoint, encode, refusal
from tvist_protocol.commands import Setpoint, SimulationStep
from tvist_protocol.errors import ProtocolError
from tvist_protocol.io import Io
from tvist_protocol.journal import Entry, entry_of
from tvist_protocol.replies import Done, Refused
from tvist_protocol.stream import Event, State, Truth
from tvist_server.about import info_of
from tvist_server.controller import Controller

log = logging.getLogger(__name__)


class Sink(Protocol):
    """Where a controller's output goes. Nothing here may wait or raise."""

    def state(self, state: State) -> None:
        """A tick's state."""

    def event(self, event: Event) -> None:
        """An event; it comes before the state of its tick."""

    def truth(self, truth: Truth) -> None:
        """What no robot can know, where that is told."""

    def io(self, io: Io) -> None:
        """Inputs, outputs and registers, where they changed; it comes before the state of its tick."""

    def journal(self, entry: Entry) -> None:
        """What reached the controller before the tick of that number."""


class Host:
    """One controller, spoken to in bytes.

    Args:
        controller: The robot.
        sink: Takes what it puts out.
    """

    def __init__(self, controller: Controller, sink: Sink) -> None:
        self.controller = controller
        self.failure: str | None = None
        """Why the controller ticks no more, where it does not."""
        self._sink = sink

    def request(self, data: bytes) -> bytes:
        """Carry out a command; its encoded reply."""
        try:
            command = decode_command(data)
        except ProtocolError as error:
            self.controller.counters.commands += 1
            self.controller.counters.refused += 1
            return encode(refusal(error))
        self._note(entry_of(self._next, command))
        reply = self.controller.receive(command)
        if isinstance(command, SimulationStep) and isinstance(reply, Done):
            return encode(self._step(command, reply))
        return encode(reply)

    def setpoint(self, data: bytes) -> None:
        """Take a set-point."""
        try:
            setpoint = decode_setpoint(data)
        except ProtocolError:
            self.controller.counters.setpoints_received += 1
            self.controller.counters.setpoints_refused += 1
            return
        self._receive_setpoint(setpoint)

    def client_seen(self, client: str) -> None:
        """A client's liveliness token is there."""
        self._note(Entry(tick=self._next, kind="client_seen", client=client))
        self.controller.client_seen(client)

    def client_gone(self, client: str) -> None:
        """A client's liveliness token is gone."""
        self._note(Entry(tick=self._next, kind="client_gone", client=client))
        self.controller.client_gone(client)

    def missed(self, ticks: int) -> None:
        """Ticks have begun too late."""
        self._note(Entry(tick=self._next, kind="missed", count=ticks))
        self.controller.missed(ticks)

    def info(self) -> bytes:
        """What the controller says of itself."""
        return encode(info_of(self.controller))

    def tick(self) -> None:
        """One control period."""
        io = self.controller.changed_io()
        if io is not None:
            self._sink.io(io)
        state, events = self.controller.tick()
        for event in events:
            self._sink.event(event)
        self._sink.state(state)
        if self.controller.setup.truth:
            self._sink.truth(self.controller.truth())

    @property
    def _next(self) -> int:
        return self.controller.tick_number + 1

    def _note(self, entry: Entry) -> None:
        self._sink.journal(entry)

    def _receive_setpoint(self, setpoint: Setpoint) -> None:
        self._note(entry_of(self._next, setpoint))
        self.controller.receive_setpoint(setpoint)

    def _step(self, command: SimulationStep, reply: Done) -> Done | Refused:
        setpoints = iter(command.setpoints or ())
        for _ in range(command.ticks):
            setpoint = next(setpoints, None)
            if setpoint is not None:
                self._receive_setpoint(
                    Setpoint(token=command.token, sequence=setpoint.sequence, q=setpoint.q)
                )
            self.tick()
        return reply
