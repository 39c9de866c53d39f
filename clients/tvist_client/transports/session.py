"""Zenoh sessions of a client; all are closed before the process ends."""

import asyncio
import contextlib
import json
import re
import threading
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import zenoh
from zenoh.handlers import Callback

from tvist_client.errors import NotConnectedError
from tvist_client.transports.certificates import Folder, settings, why_refused
from tvist_client.transports.inbox import wake
from tvist_protocol.errors import quoted
from tvist_protocol.keys import check_namespace

_PORT = "[1-9]\\d{0,3}|[1-5]\\d{4}|6[0-4]\\d{3}|65[0-4]\\d{2}|655[0-2]\\d|6553[0-5]"
_ENDPOINT = re.compile(rf"(?!(tcp|tls|udp|quic|ws)/)[a-z]+[/-].*|[a-z]+/\S+:({_PORT})([?#].*)?")
"""Matches endpoints with a valid port, and those of protocols without ports (Zenoh checks them itself)."""
ENCODING = zenoh.Encoding("application/msgpack")
CONFIG: Mapping[str, Any] = {
    "mode": "client",
    # The endpoint is given, so there is nothing to search for.
    "scouting/multicast/enabled": False,
    "transport/shared_memory/enabled": False,
}
"""Zenoh settings of a session, by path."""


def open_session(endpoint: str, security: Folder | None = None, namespace: str = "") -> zenoh.Session:
    """Open a session, in which keys are written without the namespace. Blocks until it is connected."""
    invalid = (
        f"{quoted(endpoint)} is not an endpoint: it must have the form tcp/<host>:<port>, such as "
        "tcp/127.0.0.1:7447, with a port from 1 to 65535"
    )
    if not isinstance(endpoint, str) or not _ENDPOINT.fullmatch(endpoint):
        raise NotConnectedError(invalid)
    config, shown = zenoh.Config(), settings(endpoint, security)
    if namespace:
        shown["namespace"] = check_namespace(namespace)
    try:
        for path, value in {**CONFIG, **shown, "connect/endpoints": [endpoint]}.items():
            config.insert_json5(path, json.dumps(value))
    except zenoh.ZError as error:
        raise NotConnectedError(invalid) from error
    try:
        session = zenoh.open(config)
    except zenoh.ZError as error:
        refused = why_refused(endpoint, security)
        why = f"no server answers at {endpoint}: check that it is running and listens there (`tvist serve`)"
        raise NotConnectedError(f"no connection to {endpoint}: {refused}" if refused else why) from error
    _OPEN.add(session)
    return session


def ask(
    session: zenoh.Session, key: str, data: bytes | None, timeout_s: float
) -> asyncio.Future[zenoh.Reply | None]:
    """Query one key, from the loop. The result is the first answer, or None if nobody answers.

    If a query reaches no queryable, Zenoh ends it at once; if unanswered, with an error at its timeout.
    """
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[zenoh.Reply | None] = loop.create_future()

    def settle(reply: zenoh.Reply | None) -> None:
        if not answer.done():
            answer.set_result(reply)

    def on_reply(reply: zenoh.Reply | None = None) -> None:
        wake(loop, partial(settle, reply))

    # With the default quality of service, states have another queue and cannot delay answers.
    callback = Callback(on_reply, on_reply, indirect=False)
    encoding = None if data is None else ENCODING
    session.get(key, callback, payload=data, encoding=encoding, timeout=timeout_s)
    return answer


def close_session(session: zenoh.Session) -> None:
    """Close a session. Blocks for some milliseconds."""
    _OPEN.discard(session)
    with contextlib.suppress(zenoh.ZError):
        session.close()  # type: ignore[no-untyped-call]


_OPEN: set[zenoh.Session] = set()


def _close_all() -> None:
    for session in tuple(_OPEN):
        close_session(session)


# An open session can hang the process at its end. `atexit` runs too late: after threads were joined.
_register: Callable[[Callable[[], None]], None] = threading._register_atexit  # type: ignore[attr-defined]  # noqa: SLF001
_register(_close_all)
