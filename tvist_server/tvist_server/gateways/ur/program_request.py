"""Requests the program of an External Control node from a client, as UR's URCap of that name does."""

import asyncio
import contextlib
import logging
from typing import Final

from tvist_protocol.programs import MAX_SCRIPT

log = logging.getLogger(__name__)

PORT: Final = 50002  # port on which UR's client library answers
REQUEST: Final = b"request_program\n"
ENDS: Final = b"# NODE_CONTROL_LOOP_ENDS"  # line near the end of the library's program
WITHIN: Final = 2.0  # longest wait for a connection, and for more of a program [s]
SILENCE: Final = 0.1
"""Silence after which a program with the line `ENDS` is complete [s]; the library does not mark its end."""


async def program_of(host: str) -> str | None:
    """Request a machine's program; return None if it does not answer."""
    try:
        async with asyncio.timeout(3 * WITHIN):
            return await _requested(host)
    except (OSError, UnicodeDecodeError) as error:  # also a timeout
        why = str(error) or "no answer"
        log.warning("%s port %d did not send the program for External Control: %s", host, PORT, why)
        return None


async def _requested(host: str) -> str:
    async with asyncio.timeout(WITHIN):
        reader, writer = await asyncio.open_connection(host, PORT)
    try:
        writer.write(REQUEST)
        received, piece = bytearray(), REQUEST
        while piece and len(received) <= MAX_SCRIPT:
            piece = b""
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(SILENCE if ENDS in received else WITHIN):
                    piece = await reader.read(65_536)
            received += piece
        if len(received) > MAX_SCRIPT:
            raise OSError(f"it has more than {MAX_SCRIPT} bytes")
        if not received.strip():
            raise OSError("it sent nothing")
        return received.decode()
    finally:
        writer.close()
        with contextlib.suppress(OSError):
            await writer.wait_closed()
