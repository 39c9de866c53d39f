"""A session with all robots of a network, whatever their namespaces; what is seen of them is said by subclasses."""

import asyncio
from abc import ABC, abstractmethod
from types import TracebackType
from typing import Self

import zenoh

from tvist_client.robot import ENDPOINT
from tvist_client.transports.certificates import Folder
from tvist_client.transports.session import close_session, open_session
from tvist_protocol import keys


class Across(ABC):
    """A session without a namespace of its own. Use as an asynchronous context.

    Args:
        endpoint: Endpoint of a router, or of one server.
        security: Folder with this client's certificate, for `tls/<host>:<port>`.
        namespace: Namespace that the robots are in or below; empty: all namespaces.

    Raises:
        ProtocolError: The namespace is none.
    """

    def __init__(
        self, endpoint: str = ENDPOINT, *, security: Folder | None = None, namespace: str = ""
    ) -> None:
        self._endpoint, self._security = endpoint, security
        self._within = keys.check_namespace(namespace) if namespace else ""
        self._session: zenoh.Session
        self._loop: asyncio.AbstractEventLoop

    async def __aenter__(self) -> Self:
        """Connect and subscribe.

        Raises:
            NotConnectedError: Nobody listens there, or the certificate is rejected.
        """
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
        """Subscribe to what is to be seen; called once the session is open."""
