"""The robots of a network, found by their liveliness tokens over one session without a namespace."""

import asyncio
from collections.abc import Collection
from functools import partial

import msgspec
import zenoh
from zenoh.handlers import Callback

from tvist_client.across import Across, RobotPlace
from tvist_client.connection import understood
from tvist_client.errors import ClientError, NotConnectedError
from tvist_client.readiness import RELIEVE, readiness
from tvist_client.robot import ENDPOINT
from tvist_client.transports.certificates import Folder
from tvist_client.transports.inbox import wake
from tvist_client.transports.zenoh import natural
from tvist_protocol import keys
from tvist_protocol.codec import decode, decode_reply, encode
from tvist_protocol.commands import Stop
from tvist_protocol.errors import ProtocolError
from tvist_protocol.info import Info
from tvist_protocol.replies import Refused
from tvist_protocol.stream import Telemetry

ANSWER_S = 3.0
"""Longest wait for a robot's answer [s]."""
SETTLE_S = 0.3
"""Time for tokens to arrive after the session has opened [s]; on a slow network, `look` also sees late ones."""
LISTEN_S = 1.3
"""Time in which every robot in real time publishes its telemetry at least once [s]."""


class FleetRobot(msgspec.Struct, frozen=True):
    """A robot of a fleet, as one query of `info` has found it."""

    namespace: str
    name: str
    model: str | None
    """Model of the arm; null if the robot does not answer."""
    clock: str | None
    robot_mode: str | None
    safety_mode: str | None
    """RTDE names of its modes; null if they are unknown."""
    control: str | None
    """Client that has control; null if there is none."""
    ready: bool
    """Whether the robot answers and may be moved."""
    ticks_per_second: float | None
    """Control periods in its last second [1/s]; null for a robot that has sent no telemetry, as in lockstep."""
    silent_s: float | None
    """Time since its last telemetry, which comes once a second [s]."""
    missed_ticks: int | None
    """Control periods missed since its start, of `due_ticks`."""
    late_p99_us: float | None
    """99th percentile of the lateness of its ticks in its last second [µs]."""
    load: float | None
    """Share of its last second in which the tick thread worked for this robot [-]."""
    said: str
    """Reason why it cannot be moved or is unknown, or that it is overloaded; empty if all is well."""
    due_ticks: int | None = None
    """Control periods due since its start; null in lockstep, or from an older server."""
    overloaded: bool | None = None
    """Whether it is overloaded, as telemetry defines it; null if it has sent none."""


class StopReport(msgspec.Struct, frozen=True):
    """A robot's answer to `stop`."""

    namespace: str
    name: str
    ok: bool
    said: str


class Fleet(Across):
    """Robots on a network, over one session. Use it as an asynchronous context.

    `endpoint` is that of a router or server. The robots are in or below `namespace`; ProtocolError if it is invalid.
    """

    def __init__(
        self, endpoint: str = ENDPOINT, *, security: Folder | None = None, namespace: str = ""
    ) -> None:
        super().__init__(endpoint, security=security, namespace=namespace)
        self._told: dict[RobotPlace, tuple[float, Telemetry]] = {}
        self.places: set[RobotPlace] = set()
        """Robots whose liveliness tokens are present."""

    async def _subscribe(self) -> None:
        self._session.liveliness().declare_subscriber(
            keys.within(self._within, keys.ANYWHERE_ALIVE),
            Callback(self._on_token, indirect=False),
            history=True,
        )
        self._session.declare_subscriber(
            keys.within(self._within, f"{keys.ANYWHERE}/telemetry"),
            Callback(self._on_telemetry, indirect=False),
        )
        await asyncio.sleep(SETTLE_S)

    async def listen(self) -> None:
        """Wait until every robot in real time has published its telemetry."""
        await asyncio.sleep(LISTEN_S)

    async def look(self) -> list[FleetRobot]:
        """Query every robot's description and condition, in natural order of their names."""
        places = sorted(self.places, key=_by_number)
        answers = await asyncio.gather(*(self._ask(place, "info", None) for place in places))
        return [self._row(place, answer) for place, answer in zip(places, answers, strict=True)]

    async def stop(self, places: Collection[RobotPlace]) -> list[StopReport]:
        """Stop the motions of the robots `places`, all at once and whichever client has control."""
        wanted, data = sorted(places, key=_by_number), encode(Stop())
        answers = await asyncio.gather(*(self._ask(place, "command", data) for place in wanted))
        return [_stopped(place, answer) for place, answer in zip(wanted, answers, strict=True)]

    # The following methods run in Zenoh's threads.

    def _on_token(self, sample: zenoh.Sample) -> None:
        place = keys.place(str(sample.key_expr))
        if place is not None:
            there = sample.kind == zenoh.SampleKind.PUT
            wake(self._loop, partial(self.places.add if there else self.places.discard, RobotPlace(*place)))

    def _on_telemetry(self, sample: zenoh.Sample) -> None:
        place = keys.place(str(sample.key_expr))
        if place is not None:
            wake(self._loop, partial(self._hear, RobotPlace(*place), sample.payload.to_bytes()))

    def _hear(self, place: RobotPlace, data: bytes) -> None:
        try:
            self._told[place] = (self._loop.time(), decode(Telemetry, data))
        except ProtocolError:  # from another version; its silence is reported
            return

    async def _ask(self, place: RobotPlace, leaf: keys.Leaf, data: bytes | None) -> bytes | NotConnectedError:
        """Return a robot's answer, or why there is none: an error would delay the other robots."""
        answer: asyncio.Future[bytes | NotConnectedError] = self._loop.create_future()

        def settle(outcome: bytes | NotConnectedError) -> None:
            if not answer.done():
                answer.set_result(outcome)

        def on_reply(reply: zenoh.Reply) -> None:
            late = NotConnectedError(
                f"it does not answer within {ANSWER_S:g} s: it hangs, or needs more time"
            )
            wake(self._loop, partial(settle, late if reply.ok is None else reply.ok.payload.to_bytes()))

        def on_end() -> None:
            denied = place in self.places and self._security is not None
            why = "it takes no commands from this client: use an operator's certificate (`tvist keys --operator`)"
            wake(self._loop, partial(settle, NotConnectedError(why if denied else "it does not answer")))

        self._session.get(
            place.key(leaf), Callback(on_reply, on_end, indirect=False), payload=data, timeout=ANSWER_S
        )
        return await answer

    def _row(self, place: RobotPlace, answer: bytes | NotConnectedError) -> FleetRobot:
        heard, telemetry = self._told.get(place, (None, None))
        info, said = _info(answer)
        stands = None if info is None else readiness(info, None, _unlock(place))
        return FleetRobot(
            namespace=place.namespace,
            name=place.robot,
            model=None if info is None else info.model,
            clock=None if info is None else info.clock,
            robot_mode=None if stands is None else stands.robot_mode,
            safety_mode=None if stands is None else stands.safety_mode,
            control=None if info is None else info.control,
            ready=stands is not None and stands.ready,
            ticks_per_second=None if telemetry is None else telemetry.ticks_per_second,
            silent_s=None if heard is None else self._loop.time() - heard,
            missed_ticks=None if telemetry is None else telemetry.missed_ticks,
            late_p99_us=None if telemetry is None else telemetry.late_p99_us,
            load=None if telemetry is None else telemetry.load,
            said=said if stands is None else stands.sentence if not stands.ready else _load(telemetry),
            due_ticks=None if telemetry is None else telemetry.due_ticks,
            overloaded=None if telemetry is None else telemetry.overloaded,
        )


def _load(telemetry: Telemetry | None) -> str:
    if telemetry is None or not telemetry.overloaded:
        return ""
    due = telemetry.due_per_second or 0.0
    return f"overloaded: {telemetry.ticks_per_second:.0f} of {due:g} ticks/s. Next: {RELIEVE}"


def _info(answer: bytes | NotConnectedError) -> tuple[Info | None, str]:
    if isinstance(answer, NotConnectedError):
        return None, str(answer)
    try:
        return understood(partial(decode, Info), answer), ""
    except ClientError as error:
        return None, str(error)


def _stopped(place: RobotPlace, answer: bytes | NotConnectedError) -> StopReport:
    if isinstance(answer, NotConnectedError):
        return StopReport(*place, ok=False, said=str(answer))
    try:
        reply = understood(decode_reply, answer)
    except ClientError as error:
        return StopReport(*place, ok=False, said=str(error))
    if isinstance(reply, Refused):
        return StopReport(*place, ok=False, said=f"refused: {reply.why}")
    return StopReport(*place, ok=True, said="stopped")


def _unlock(place: RobotPlace) -> str:
    words = ["tvist unlock", "--name", place.robot]
    return " ".join([*words, "--namespace", place.namespace] if place.namespace else words)


def _by_number(place: RobotPlace) -> list[list[int | str]]:
    return [natural(text) for text in place]
