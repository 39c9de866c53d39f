"""Web pages served until Control+C."""

import asyncio
import logging
import os
import warnings
from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Any

from tvist_cli.failure import interrupted, told
from tvist_cli.output import err

if TYPE_CHECKING:
    from viser import ViserServer

NICE = 5
"""How much a page gives way to other programs, such as a robot's server on the same machine."""


def serve_page(
    run: "Callable[[ViserServer], Coroutine[Any, Any, None]]",
    place: tuple[str, int],
    title: str,
    *,
    insecure: bool,
) -> None:
    """Serve a page until Control+C."""
    from tvist_view.stage import StageError, close_stage, open_stage

    logging.basicConfig(format="tvist: %(message)s", level=logging.WARNING)
    warnings.filterwarnings("ignore", "Queued a .* on a closed connection")  # a browser left during a picture
    if hasattr(os, "nice"):
        os.nice(NICE)
    with told(StageError):
        server = open_stage(*place, title, insecure=insecure)
    err.print(f"the page is at http://{place[0]}:{server.get_port()} (Control+C ends it)")
    try:
        with told():
            asyncio.run(run(server))
    except KeyboardInterrupt:
        raise interrupted("the page has ended") from None
    finally:
        close_stage(server)
