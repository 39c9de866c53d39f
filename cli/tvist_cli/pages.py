"""Web pages served until Control+C."""

import asyncio
import logging
import os
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING

from tvist_cli.failure import failing_on, interruptible
from tvist_cli.output import err

if TYPE_CHECKING:
    from tvist_view.stage import Meet

MAGNIFY = 100.0  # default magnification of the bending [-]
NICE = 5  # Niceness of a page's process, so that it yields to a robot's server on the same machine


def serve_page(
    page: str,
    meet: "Meet",
    address: str = "127.0.0.1",
    port: int = 8080,
    *,
    insecure: bool = False,
    run: Callable[[], Awaitable[None]] | None = None,
    parts: Callable[[str], bytes | None] = lambda _: None,
) -> None:
    """Serve a page until Control+C while `run` runs; `parts` returns further files that the page requests by path.

    Other machines can open it only if it is `insecure`.
    """
    from tvist_view.stage import StageError, open_stage

    logging.basicConfig(format="tvist: %(message)s", level=logging.WARNING)
    if hasattr(os, "nice"):
        os.nice(NICE)

    async def served() -> None:
        async with open_stage(page, meet, address, port, insecure=insecure, parts=parts) as url:
            err.print(f"the page is at {url} (Control+C ends it)")
            await (asyncio.Event().wait() if run is None else run())

    with failing_on(StageError), interruptible("the page has ended"):
        asyncio.run(served())
