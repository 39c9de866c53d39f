"""Sessions with all robots of a network in any namespace; one subscription to the newest states of many robots."""

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial
from types import TracebackType
from typing import NamedTuple, Self

import zenoh
from zenoh.handlers import Callback

from tvist_client.errors import MisuseError
from tvist_client.robot import ENDPOINT
from tvist_client.transports.certificates import Folder
from tvist_client.transports.inbox import wake
from tvist_client.transports.session import close_session, open_session
from tvist_protocol import keys
from tvist_protocol.codec import decode
from tvist_protocol.errors import ProtocolError
from tvist_protocol.stream import State


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
        await self._subscribe()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await asyncio.to_thread(close_session, self._session)

    @abstractmethod
    async def _subscribe(self) -> None:
        """Subscribe, once the session is open."""

    def _of_robots(self, handle: Callable[[RobotPlace, zenoh.Sample], None]) -> "Callback[zenoh.Sample]":
        """Return a callback that passes what is on robots' keys to a function on the loop."""

        def on_sample(sample: zenoh.Sample) -> None:
            place = keys.place(str(sample.key_expr))
            if place is not None:
                wake(self._loop, partial(handle, RobotPlace(*place), sample))

        return Callback(on_sample, indirect=False)


class Newest(NamedTuple):
    """The newest state of a robot."""

    state: State
    received: int  # number of its states since the last call of `look`
    at: float  # time of its arrival on the loop's clock [s]


class ManyStates(FleetSession):
    """Newest state of each robot that a key selects, decoded by `look`. Use it as an asynchronous context.

    `selector` is a key with wildcards that ends in `/state`, such as `tvist/*/state`, or `**/tvist/*/state` for all
    namespaces; MisuseError if it is not. `namespace` precedes it.
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

    def look(self) -> dict[RobotPlace, Newest]:
        """Return the newest state of each robot that has ever sent one."""
        found: dict[RobotPlace, Newest] = {}
        for place, (data, received, at) in sorted(self._newest.items()):
            try:
                found[place] = Newest(decode(State, data), received, at)
            except ProtocolError:  # from another version
                continue
            self._newest[place] = (data, 0, at)
        return found

    def _keep(self, place: RobotPlace, sample: zenoh.Sample) -> None:
        _, received, _ = self._newest.get(place, (b"", 0, 0.0))
        self._newest[place] = (sample.payload.to_bytes(), received + 1, self._loop.time())
