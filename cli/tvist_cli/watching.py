"""How long something is watched: for some seconds, or until Control+C."""

import asyncio
import contextlib
import time
from collections.abc import Coroutine
from typing import Any

from tvist_cli.failure import interrupted, told


def watch_for(seconds: float | None, watching: Coroutine[Any, Any, None], meanwhile: str) -> None:
    """Watch until the time is over or Control+C ends it, which is a failure with exit code 130.

    Args:
        seconds: Longest time [s]; None: until Control+C.
        watching: What watches, and shows what it sees.
        meanwhile: What goes on without it, such as "the robot keeps running".
    """
    began = time.monotonic()
    with told(), contextlib.suppress(TimeoutError):
        try:
            asyncio.run(asyncio.wait_for(watching, seconds))
        except KeyboardInterrupt:
            raise interrupted(f"watched for {time.monotonic() - began:.1f} s; {meanwhile}") from None
