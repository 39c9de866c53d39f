"""The rhythm of a page: thirty pictures a second, and fewer where the machine is slower."""

import asyncio
from collections.abc import AsyncIterator

FRAME_S = 1.0 / 30.0
"""Time between two pictures [s]."""
NOTES_EVERY = 6
"""Pictures between two looks at what the last stop was like."""


async def pictures() -> AsyncIterator[int]:
    """Count pictures from 0, each when it is due; a picture that comes too late delays those after it."""
    loop = asyncio.get_running_loop()
    count, due = 0, loop.time()
    while True:
        yield count
        count += 1
        due = max(due + FRAME_S, loop.time())
        await asyncio.sleep(due - loop.time())
