"""The page's server: one page and a WebSocket per tab. By default only this machine can reach the server."""

import gzip
import ipaddress
import itertools
import json
import logging
import socket
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from functools import cache
from importlib.resources import files
from typing import Any
from urllib.parse import urlsplit

import msgspec
from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

LARGEST = 16 * 2**20  # largest message from a page [byte]; the largest ones are frames of a film
LARGEST_PORT = 65535
WAITS_S = 1.0  # how long a tab may take to close its connection when the server ends [s]


_QUIET = logging.getLogger("tvist.view.stage")
_QUIET.setLevel(logging.CRITICAL)  # it is no error if a browser opens a connection and leaves


class StageError(RuntimeError):
    """The page cannot be served."""


class Tab:
    """One open tab."""

    def __init__(self, number: int, connection: ServerConnection) -> None:
        self.number, self._connection = number, connection

    async def send(self, kind: str, content: Mapping[str, Any]) -> None:
        """Send a message, and wait while the tab is slow; do nothing if the tab is gone."""
        try:
            await self._connection.send(msgspec.json.encode({"type": kind, **content}).decode())
        except ConnectionClosed:
            return

    def __aiter__(self) -> AsyncIterator[str | bytes]:
        return aiter(self._connection)


Meet = Callable[[Tab], Awaitable[None]]  # serves one tab until it is closed


def page(boot: Mapping[str, Any]) -> str:
    """Return the page as one self-contained text; `boot` is what it needs to know at the start."""
    said = json.dumps(msgspec.to_builtins(boot)).replace("<", "\\u003c")
    return _page().replace('id="boot">{}', f'id="boot">{said}')


@cache
def _page() -> str:
    return gzip.decompress(files("tvist_view").joinpath("page.html.gz").read_bytes()).decode()


@asynccontextmanager
async def open_stage(
    page: str,
    meet: Meet,
    address: str,
    port: int,
    *,
    insecure: bool = False,
    parts: Callable[[str], bytes | None] = lambda _: None,
) -> AsyncIterator[str]:
    """Serve a page; the value of the block is its address. Raise StageError if that is impossible.

    `meet` is called for each tab. With `insecure`, other machines may use the page, and anyone who opens it
    can move the robot. `parts` returns the content of other paths, such as meshes, or None.
    """
    if not is_local(address) and not insecure:
        raise StageError(
            f"address is {address}: other machines could open the page and move the robot, since it knows no "
            "passwords. Add --insecure to accept that, or forward the port: ssh -L 8080:127.0.0.1:8080 HOST"
        )
    if not 0 <= port <= LARGEST_PORT:  # the socket would stay open
        raise StageError(f"port is {port}: must be 0 to {LARGEST_PORT}, such as --port 8081")
    numbers = itertools.count(1)

    async def serve_tab(connection: ServerConnection) -> None:
        await meet(Tab(next(numbers), connection))

    def answer(connection: ServerConnection, request: Request) -> Response | None:
        if not _may(request, anywhere=insecure):
            return connection.respond(403, "another site may not use this page\n")
        if request.headers.get("Upgrade", "").lower() == "websocket":
            return None
        path = urlsplit(request.path).path
        if path == "/":
            return _found("text/html; charset=utf-8", page.encode())
        if (content := parts(path)) is None:
            return connection.respond(404, "not found\n")
        return _found("application/octet-stream", content)

    try:
        with socket.create_server(
            (address, port), family=socket.AF_INET6 if ":" in address else socket.AF_INET
        ) as listening:
            async with serve(
                serve_tab,
                sock=listening,
                process_request=answer,
                max_size=LARGEST,
                compression=None,  # costs more than it saves within one machine
                close_timeout=WAITS_S,
                logger=_QUIET,
            ):
                yield f"http://{f'[{address}]' if ':' in address else address}:{listening.getsockname()[1]}"
    except OSError as error:
        raise StageError(
            f"cannot listen on {address} port {port}: {error.strerror or error}. "
            "Give another port, such as --port 8081"
        ) from error


def _found(kind: str, content: bytes) -> Response:
    headers = {
        "Content-Type": kind,
        "Content-Length": str(len(content)),
        "Cache-Control": "no-store",
        "Content-Security-Policy": "frame-ancestors 'none'",  # against clickjacking
    }
    return Response(200, "OK", Headers(headers), content)


def _may(request: Request, *, anywhere: bool) -> bool:
    """Whether a request comes from the page itself or from a program, rather than from another site.

    Browsers let any site open a WebSocket to this machine, with the site in the header Origin. The header
    Host reveals a site whose name resolves to this machine.
    """
    origin, host = request.headers.get("Origin"), request.headers.get("Host", "")
    ours = anywhere or is_local(urlsplit(f"//{host}").hostname or "")
    return ours and (origin is None or urlsplit(origin).netloc == host)


def is_local(address: str) -> bool:
    """Return whether an address belongs to this machine only."""
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return address == "localhost"
