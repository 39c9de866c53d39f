"""A robot as every client sees it: its description, its messages, its time."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import TypeVar

from tvist_client.command import Answer, Leased
from tvist_client.commands import Questions
from tvist_client.errors import MisuseError, NotConnectedError, UnexpectedReplyError
from tvist_client.feed import Feed, Stream
from tvist_client.motion import Motion, MotionsByNumber
from tvist_client.transports.base import Transport
from tvist_client.values import whole
from tvist_protocol.codec import decode, decode_reply, encode
from tvist_protocol.commands import Command, Stop
from tvist_protocol.errors import ProtocolError, RefusedError
from tvist_protocol.info import Clock, Info
from tvist_protocol.io import Io
from tvist_protocol.modes import RuntimeState
from tvist_protocol.replies import Done, Refused
from tvist_protocol.simulation import SimulationStep, StepSetpoint
from tvist_protocol.stream import Event, State, Telemetry, Truth

BUFFER = 5000  # number of messages that an iterator buffers: 10 s of states
ANSWER_S = 10.0  # longest wait for the answer to a command [s]
STATE_S = 5.0  # longest pause between two states [s]; in lockstep the last state is repeated every second
CHUNK = 50  # ticks to step between two checks whether a motion has ended: 0.1 s
MAX_STEP = 1000
"""Largest number of set-points in one `simulation.step`, and of ticks that every server accepts at once."""
LONGEST_STEP = 100_000  # largest number of ticks in one `simulation.step`
TICK_S = 0.06  # longest duration of a tick on a slow machine [s]; a server may be slower than real time
T = TypeVar("T")


class Connection(Questions):
    """A robot over an open transport."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._clock: Clock | None = None
        self._states = Feed(transport, "state", State, once_a_tick=True)
        self._events = Feed(transport, "event", Event, once_a_tick=False)
        self._truths = Feed(transport, "truth", Truth, once_a_tick=True)
        self._telemetries = Feed(transport, "telemetry", Telemetry, once_a_tick=False)
        self._ios = Feed(transport, "io", Io, once_a_tick=False)
        self._feeds = (self._states, self._events, self._truths, self._telemetries, self._ios)
        self.arm: Leased | None = None
        """The arm, while this client has control."""
        self.stepper: Leased | None = None
        """The clock, while this client holds it."""
        self.motions = MotionsByNumber(self._until_ended)
        """Motions of all clients by number."""
        # Listen before sending any command, because an event may precede the answer.
        self._events.listen(self.motions.on_event)
        transport.on_lost(self._on_lost)

    def states(self, buffer: int = BUFFER) -> Stream[State]:
        """Iterate over every state from now on, one per tick; if the reader is slow, the oldest are dropped.

        Args:
            buffer: Number of messages that may wait; `Stream.dropped` counts those dropped.
        """
        return self._states.stream(buffer)

    def events(self, buffer: int = BUFFER) -> Stream[Event]:
        """Iterate over every event from now on."""
        return self._events.stream(buffer)

    def on_state(self, callback: Callable[[State], object]) -> Callable[[], None]:
        """Call a function with every state; it must not block. The returned function ends this."""
        return self._states.listen(callback)

    def on_event(self, callback: Callable[[Event], object]) -> Callable[[], None]:
        """Call a function with every event; see `on_state`."""
        return self._events.listen(callback)

    def on_truth(self, callback: Callable[[Truth], object]) -> Callable[[], None]:
        """Call a function with every truth message, if the server publishes them; see `on_state`."""
        return self._truths.listen(callback)

    def on_telemetry(self, callback: Callable[[Telemetry], object]) -> Callable[[], None]:
        """Call a function with every telemetry message, once a second; see `on_state`."""
        return self._telemetries.listen(callback)

    def on_io(self, callback: Callable[[Io], object]) -> Callable[[], None]:
        """Call a function with every message about inputs, outputs, registers and tool; see `on_state`."""
        return self._ios.listen(callback)

    async def io(self) -> Io:
        """Return inputs, outputs, registers and tool: latest values, or if none came yet the next ones (1 s).

        Raises:
            AnswerTimeoutError: No message arrived within `STATE_S`.
        """
        self._ios.subscribe()
        return self._ios.latest or await self._ios.next(lambda _: True, STATE_S)

    async def info(self) -> Info:
        """Request the robot's description and settings.

        Raises:
            RefusedError: The robot is still starting; the message has the progress.
        """
        data = await self._transport.info()
        try:
            info = understood(partial(decode, Info), data)
        except UnexpectedReplyError:
            if isinstance(reply := understood(decode_reply, data), Refused):
                raise RefusedError(reply) from None
            raise
        self._clock = info.clock
        return info

    async def clock(self) -> Clock:
        """Return what advances simulation time; it is requested only once."""
        return self._clock or (await self.info()).clock

    async def state(self) -> State:
        """Return the present state: in real time the next one to arrive, otherwise the last one.

        Before the first tick, the state describes the arm at rest. In lockstep the first call may take a second.

        Raises:
            AnswerTimeoutError: No state arrived within `STATE_S`.
            MisuseError: An in-process host other than tvist's publishes no state before its first tick.
            NotConnectedError: The connection is closed, or the robot has disconnected.
        """
        self._states.subscribe()
        if await self.clock() != "realtime" and self._states.latest is not None:
            return self._states.latest
        if self._clock == "free":
            raise MisuseError(
                "this robot sends its state from the first tick on: take control and call advance(1)"
            )
        return await self._next_state()

    async def request(self, command: Command, timeout_s: float = ANSWER_S) -> Answer:
        """Send any command.

        Args:
            command: The command, with its token if it has one.
            timeout_s: Longest wait for the answer [s].

        Raises:
            RefusedError: The robot refused it, which changed nothing.
            NotConnectedError: The robot does not answer.
            DeniedError: This client's certificate is not an operator's.
            AnswerTimeoutError: No answer came in time.
            ProtocolError: The command contains a value that cannot be sent.
        """
        reply = understood(decode_reply, await self._transport.request(encode(command), timeout_s))
        if isinstance(reply, Refused):
            raise RefusedError(reply)
        return reply

    def watch(self) -> None:
        """Subscribe to the states, before a command causes one."""
        self._states.subscribe()

    def put_setpoint(self, data: bytes) -> None:
        """Send an encoded set-point, as `Arm.servo` does."""
        self._transport.put_setpoint(data)

    async def stop(self) -> None:
        """Bring the arm to rest now; no control is needed."""
        await self.request(Stop())

    async def advance(self, ticks: int) -> int:
        """Advance time: by steps in lockstep and free, by waiting in real time.

        Args:
            ticks: Number of control periods, at least 1.

        Returns:
            The last tick that passed; its state has arrived.

        Raises:
            ArgumentError: `ticks` is less than 1, or not an integer.
            MisuseError: Not in real time, and this client has neither the clock nor control.
            RefusedError: Another client holds the clock; the message contains its name.
        """
        ticks = whole(ticks, "ticks", 1)
        if await self.clock() == "realtime":
            return await self._see_pass(ticks)
        by = self.stepper or self.arm
        if by is None:
            raise MisuseError(
                "only a client with `robot.clock_control(…)`, or else `robot.control(…)`, can step this robot's time"
            )
        tick = 0
        for first in range(0, ticks, MAX_STEP):
            tick = await step(self, by.token, min(MAX_STEP, ticks - first))
        return tick

    async def pass_time(self, ticks: int) -> None:
        """Let ticks pass as `advance` does, or wait for them if another client steps."""
        if await self._let_pass(ticks) is None:
            await self._see_pass(ticks)

    async def until(self, tick: int) -> State:
        """Wait until the state of a tick has arrived, without stepping time."""
        self._states.subscribe()
        if (latest := self._states.latest) is not None and latest.tick >= tick:
            return latest
        return await self._states.next(lambda state: state.tick >= tick, STATE_S)

    async def rest(self) -> State:
        """Step time, or wait if this client cannot, until the shaped reference is at rest.

        Returns the first state then. The arm may still vibrate.
        """
        while True:
            tick = await self._let_pass(CHUNK)
            state = await (self._next_state() if tick is None else self.until(tick))
            if state.runtime_state == RuntimeState.STOPPED:
                return state

    async def _next_state(self) -> State:
        return await self._states.next(lambda _: True, STATE_S)

    async def _until_ended(self, motion: Motion) -> None:
        while not motion.ended:
            if await self._let_pass(CHUNK) is None:
                await motion.wait_event()

    async def _see_pass(self, ticks: int) -> int:
        """Wait until this many ticks have passed after the next state; return the last tick."""
        last = (await self._next_state()).tick + ticks
        while (tick := (await self._next_state()).tick) < last:
            pass
        return tick

    async def _let_pass(self, ticks: int) -> int | None:
        """Step time; None if this client cannot: in real time, or if another client holds the clock."""
        if await self.clock() == "realtime":
            return None
        try:
            return await self.advance(ticks)
        except RefusedError:
            if self.stepper is not None or (await self.info()).stepper is None:
                raise
            return None

    def _on_lost(self, error: NotConnectedError) -> None:
        for feed in self._feeds:
            feed.end(error)
        self.motions.fail(error)


async def step(
    robot: Connection, token: str, ticks: int, setpoints: Sequence[StepSetpoint] | None = None
) -> int:
    """Send one `simulation.step`, with the clock's token if this client holds the clock; return its last tick."""
    robot.watch()
    ticks = whole(ticks, "ticks", 1, LONGEST_STEP)
    clock = token if robot.stepper is None else robot.stepper.token
    command = SimulationStep(
        token=clock,
        ticks=ticks,
        setpoints=None if setpoints is None else tuple(setpoints),
        motion_token=None if setpoints is None or clock == token else token,
    )
    reply = await robot.request(command, TICK_S * max(ticks, MAX_STEP))
    if not isinstance(reply, Done) or reply.tick is None:
        raise UnexpectedReplyError(f"simulation.step was answered by {reply}, without a tick")
    await robot.until(reply.tick)
    return reply.tick


def understood(decode: Callable[[bytes], T], data: bytes) -> T:
    """Decode an answer."""
    try:
        return decode(data)
    except ProtocolError as error:
        raise UnexpectedReplyError(
            f"the robot's answer is invalid, perhaps because it uses a newer protocol: update the client ({error})"
        ) from error
