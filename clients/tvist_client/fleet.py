"""The robots of a network in any namespace, over one session without a namespace."""

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection
from contextlib import suppress
from functools import partial
from types import TracebackType
from typing import NamedTuple, Self, TypeVar

import msgspec
import zenoh
from zenoh.handlers import Callback

from tvist_client.connection import understood
from tvist_client.errors import MisuseError, NotConnectedError, UnexpectedReplyError
from tvist_client.readiness import RELIEVE, Readiness, readiness, unlock_command
from tvist_client.robot import ENDPOINT
from tvist_client.transports.certificates import Folder
from tvist_client.transports.inbox import wake
from tvist_client.transports.session import ask, close_session, open_session
from tvist_client.transports.zenoh import natural, query_tokens
from tvist_protocol import Info, ProtocolError, Refused, State, Stop, Telemetry, keys
from tvist_protocol.codec import decode, decode_reply, encode

T = TypeVar("T")
ANSWER_S = 3.0  # longest wait for a robot's answer [s]
LISTEN_S = 1.6  # time in which every robot in real time publishes its telemetry at least once [s]
_TIMING = ("ticks_per_second", "missed_ticks", "late_p99_us", "load", "due_ticks", "overloaded")
"""Fields of `FleetRobot` that come from telemetry."""
_OF_INFO = ("model", "clock", "control")  # fields of a fleet's robot that its `info` has


class RobotPlace(NamedTuple):
    """A robot's namespace (empty: none) and name."""

    namespace: str
    robot: str

    def __str__(self) -> str:
        """Namespace and name as one path, `hall-3/ur5e-1`."""
        return keys.within(self.namespace, self.robot)

    def key(self, leaf: keys.Leaf) -> str:
        """Return the robot's key that ends in `leaf`."""
        return keys.within(self.namespace, keys.key(self.robot, leaf))


def place_of(text: str) -> RobotPlace:
    """Parse `NAMESPACE/NAME` or `NAME`."""
    namespace, _, robot = text.rpartition("/")
    return RobotPlace(keys.check_namespace(namespace) if namespace else "", keys.check_robot_name(robot))


class FleetSession(ABC):
    """A session with the robots in or below a namespace (empty: all). Use it as an asynchronous context."""

    def __init__(
        self, endpoint: str = ENDPOINT, *, security: Folder | None = None, namespace: str = ""
    ) -> None:
        self._endpoint, self._security = endpoint, security
        self._within = keys.check_namespace(namespace) if namespace else ""
        self._session: zenoh.Session
        self._loop: asyncio.AbstractEventLoop

    async def __aenter__(self) -> Self:
        self._loop = asyncio.get_running_loop()
        self._session = await asyncio.to_thread(open_session, self._endpoint, self._security)
        try:
            await self._subscribe()
        except BaseException:
            await asyncio.to_thread(close_session, self._session)
            raise
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await asyncio.to_thread(close_session, self._session)

    @abstractmethod
    async def _subscribe(self) -> None:
        """Subscribe, once the session is open."""

    def _of_robots(self, handle: Callable[[RobotPlace, zenoh.Sample], None]) -> "Callback[zenoh.Sample]":
        """Return a callback that calls `handle` on the loop for each sample with a robot's key."""

        def on_sample(sample: zenoh.Sample) -> None:
            place = keys.place(str(sample.key_expr))
            if place is not None:
                wake(self._loop, partial(handle, RobotPlace(*place), sample))

        return Callback(on_sample, indirect=False)


class FleetRobot(msgspec.Struct, frozen=True, kw_only=True):
    """A robot of a fleet, as described by its `info` and telemetry at one time."""

    namespace: str
    name: str
    model: str | None  # model of the arm; null if the robot does not answer
    clock: str | None
    robot_mode: str | None
    safety_mode: str | None  # RTDE names of its modes; null if they are unknown
    control: str | None  # client that has control; null if there is none
    ready: bool  # whether the robot answers and may be moved
    ticks_per_second: float | None
    """Control periods in its last second [1/s]; null for a robot that has sent no telemetry, as in lockstep."""
    silent_s: float | None  # time since its last telemetry, which comes once a second [s]
    missed_ticks: int | None  # control periods missed since its start, of `due_ticks`
    late_p99_us: float | None  # 99th percentile of the lateness of its ticks in its last second [µs]
    load: float | None  # share of its last second in which the tick thread worked for this robot [-]
    said: str  # reason why it cannot be moved or is unknown, or that it is overloaded; empty if all is well
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


class Fleet(FleetSession):
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
        alive, telemetry = (
            keys.within(self._within, key) for key in (keys.ANYWHERE_ALIVE, f"{keys.ANYWHERE}/telemetry")
        )
        self._session.liveliness().declare_subscriber(alive, self._of_robots(self._on_token), history=True)
        self._session.declare_subscriber(telemetry, self._of_robots(self._on_telemetry))
        # The subscriber gets the tokens of all present robots before this query ends.
        _, complete = await query_tokens(self._session, alive, ANSWER_S)
        if not complete:
            late = f"{self._endpoint} has not named all robots within {ANSWER_S:g} s"
            raise NotConnectedError(f"{late}: try again, or restart the router there")

    async def listen(self) -> None:
        """Wait until every robot in real time has published its telemetry."""
        await asyncio.sleep(LISTEN_S)

    async def look(self) -> list[FleetRobot]:
        """Query every robot's description and condition, in natural order of their names."""
        places = sorted(self.places, key=_by_number)
        infos = await asyncio.gather(
            *(self._ask(place, "info", None, partial(decode, Info)) for place in places)
        )
        return [self._row(place, info) for place, info in zip(places, infos, strict=True)]

    async def stop(self, places: Collection[RobotPlace]) -> list[StopReport]:
        """Stop the motions of the robots `places`, all at once and whichever client has control."""
        wanted, data = sorted(places, key=_by_number), encode(Stop())
        replies = await asyncio.gather(*(self._ask(place, "command", data, decode_reply) for place in wanted))
        why = [f"refused: {one.why}" if isinstance(one, Refused) else one for one in replies]
        return [
            StopReport(
                *place, ok=not isinstance(said, str), said=said if isinstance(said, str) else "stopped"
            )
            for place, said in zip(wanted, why, strict=True)
        ]

    def _on_token(self, place: RobotPlace, sample: zenoh.Sample) -> None:
        there = sample.kind == zenoh.SampleKind.PUT
        (self.places.add if there else self.places.discard)(place)

    def _on_telemetry(self, place: RobotPlace, sample: zenoh.Sample) -> None:
        with suppress(ProtocolError):  # answer of another version: reported as silence
            self._told[place] = (self._loop.time(), decode(Telemetry, sample.payload.to_bytes()))

    async def _ask(
        self, place: RobotPlace, leaf: keys.Leaf, data: bytes | None, read: Callable[[bytes], T]
    ) -> T | str:
        """Return a robot's answer, or why there is none: an error would end the queries of other robots."""
        reply = await ask(self._session, place.key(leaf), data, ANSWER_S)
        if reply is None and place in self.places and self._security is not None:
            return "it takes no commands from this client: use an operator's certificate (`tvist keys --operator`)"
        if reply is None:
            return "it does not answer"
        if reply.ok is None:
            return f"it does not answer within {ANSWER_S:g} s: try again, or restart its server"
        try:
            return understood(read, reply.ok.payload.to_bytes())
        except UnexpectedReplyError as error:
            return str(error)

    def _row(self, place: RobotPlace, answer: Info | str) -> FleetRobot:
        heard, telemetry = self._told.get(place, (None, None))
        stands = Readiness(False, None, None, None, str(answer), "")
        if isinstance(answer, Info):
            unlock = unlock_command(ENDPOINT, place.robot, None, place.namespace)
            stands = readiness(answer, None, unlock)
        return FleetRobot(
            namespace=place.namespace,
            name=place.robot,
            robot_mode=stands.robot_mode,
            safety_mode=stands.safety_mode,
            ready=stands.ready,
            silent_s=None if heard is None else self._loop.time() - heard,
            said=_load(telemetry) if stands.ready else stands.sentence,
            **{name: getattr(answer, name, None) for name in _OF_INFO},
            **{name: getattr(telemetry, name, None) for name in _TIMING},
        )


def _load(telemetry: Telemetry | None) -> str:
    if telemetry is None or not telemetry.overloaded:
        return ""
    due = telemetry.due_per_second or 0.0
    return f"overloaded: {telemetry.ticks_per_second:.0f} of {due:g} ticks/s. Next: {RELIEVE}"


def _by_number(place: RobotPlace) -> list[list[int | str]]:
    return [natural(text) for text in place]


class NewestState(NamedTuple):
    """The newest state of a robot."""

    state: State
    received: int  # number of its states since the last call of `look`
    at: float  # time of its arrival on the loop's clock [s]


class ManyStates(FleetSession):
    """Newest state of each robot that a key selects, decoded by `look`. Use it as an asynchronous context.

    `selector` is a key with wildcards that ends in `/state`, such as `tvist/*/state`, or `**/tvist/*/state` for all
    namespaces; MisuseError for other keys. The selector applies within `namespace`.
    """

    def __init__(
        self, selector: str, endpoint: str = ENDPOINT, *, security: Folder | None = None, namespace: str = ""
    ) -> None:
        if not selector.endswith("/state"):
            raise MisuseError(
                f"{selector} is not a key of states: it must end in /state, such as tvist/*/state"
            )
        try:
            zenoh.KeyExpr(selector)
        except zenoh.ZError as error:
            raise MisuseError(f"{selector} is not a key: write tvist/*/state, or tvist/NAME/state") from error
        super().__init__(endpoint, security=security, namespace=namespace)
        self._key = keys.within(self._within, selector)
        self._newest: dict[RobotPlace, tuple[bytes, int, float]] = {}

    async def _subscribe(self) -> None:
        self._session.declare_subscriber(self._key, self._of_robots(self._keep))

    def look(self) -> dict[RobotPlace, NewestState]:
        """Return the newest state of each robot that has ever sent one."""
        found = dict[RobotPlace, NewestState]()
        for place, (data, received, at) in sorted(self._newest.items()):
            with suppress(ProtocolError):  # from another version
                found[place] = NewestState(decode(State, data), received, at)
                self._newest[place] = (data, 0, at)
        return found

    def _keep(self, place: RobotPlace, sample: zenoh.Sample) -> None:
        _, received, _ = self._newest.get(place, (b"", 0, 0.0))
        self._newest[place] = (sample.payload.to_bytes(), received + 1, self._loop.time())
