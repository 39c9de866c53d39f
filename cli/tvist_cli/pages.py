"""Web pages served until Control+C."""

import asyncio
import logging
import os
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tvist_cli.failure import failing_on, interrupted
from tvist_cli.output import err

if TYPE_CHECKING:
    from tvist_view.stage import Meet

MAGNIFY = 100.0  # default magnification of the bending [-]
NICE = 5  # Niceness of a page's process, so that it yields to a robot's server on the same machine


@dataclass(frozen=True)
class PageAddress:
    """Address and port of a page."""

    address: str
    port: int
    insecure: bool  # whether other machines can open the page


def serve_page(
    page: str,
    meet: "Meet",
    door: PageAddress,
    run: Callable[[], Awaitable[None]] | None = None,
    parts: Callable[[str], bytes | None] = lambda _: None,
) -> None:
    """Serve a page until Control+C while `run` runs; `parts` returns further files that the page requests by path."""
    from tvist_view.stage import StageError, open_stage

    logging.basicConfig(format="tvist: %(message)s", level=logging.WARNING)
    if hasattr(os, "nice"):
        os.nice(NICE)

    async def served() -> None:
        async with open_stage(
            page, meet, door.address, door.port, insecure=door.insecure, parts=parts
        ) as url:
            err.print(f"the page is at {url} (Control+C ends it)")
            await (asyncio.Event().wait() if run is None else run())

    try:
        with failing_on(StageError):
            asyncio.run(served())
    except KeyboardInterrupt:
        raise interrupted("the page has ended") from None
