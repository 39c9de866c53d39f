"""Messages into an MCAP file, in the caller's thread. Equal messages make equal files."""

import json
from collections.abc import Mapping
from typing import IO, Any

import msgspec
from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import LIBRARY_IDENTIFIER, CompressionType, Writer

from tvist_protocol.channels import tag
from tvist_protocol.info import Info
from tvist_protocol.recorded import (
    END_METADATA,
    FORMAT,
    METADATA,
    TICK_NS,
    Recorded,
    to_json,
    viewer_schema,
)

CHUNK_SIZE = 64 * 1024
"""Bytes compressed at once. Some 70 states: what a killed process loses, and half a millisecond of work; a
megabyte, the library's default, would stall for several ticks."""


def heading(info: Info, start: Mapping[str, Any]) -> dict[str, str]:
    """What stands at the beginning of a recording.

    Args:
        info: The robot.
        start: How the server was started, as JSON knows it.

    Raises:
        TypeError: `start` holds what JSON cannot.
        ValueError: `start` holds a number that is not finite.
    """
    return {
        "format": FORMAT,
        "info": msgspec.json.encode(info).decode(),
        "start": json.dumps(start, allow_nan=False, sort_keys=True),
    }


class RecordingWriter:
    """Writes one recording.

    Args:
        stream: Stream to write to; the caller closes it.
        topic_of: Topic of each kind of message.
        heading: What stands at its beginning.

    Raises:
        OSError: The stream does not take it.
    """

    def __init__(
        self, stream: IO[bytes], topic_of: Mapping[type[msgspec.Struct], str], heading: dict[str, str]
    ) -> None:
        self._stream = stream
        self._writer = Writer(
            stream, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD, enable_data_crcs=True
        )
        self._writer.start(library=f"tvist {LIBRARY_IDENTIFIER}")
        self._writer.add_metadata(METADATA, heading)
        self._channels = {kind: self._channel(kind, topic) for kind, topic in topic_of.items()}
        self.flush()

    def write(self, message: Recorded) -> None:
        """Add a message.

        Raises:
            OSError: The stream does not take it.
            TypeError: The message holds what JSON cannot, a numpy number for instance.
        """
        time = message.tick * TICK_NS
        self._writer.add_message(self._channels[type(message)], time, to_json(message), time)

    def flush(self) -> None:
        """Hand complete chunks to the system, so that they outlive this process."""
        self._stream.flush()

    def finish(self, dropped: Mapping[type[msgspec.Struct], int]) -> None:
        """Write the last chunk, what was dropped, and the index. Nothing can be added after it.

        Raises:
            OSError: The stream does not take it.
        """
        counts = {tag(kind): str(dropped.get(kind, 0)) for kind in self._channels}
        self._writer.add_metadata(END_METADATA, counts)
        self._writer.finish()  # type: ignore[no-untyped-call]
        self.flush()

    def _channel(self, kind: type[msgspec.Struct], topic: str) -> int:
        schema = json.dumps(viewer_schema(kind)).encode()
        schema_id = self._writer.register_schema(f"tvist.{tag(kind)}", SchemaEncoding.JSONSchema, schema)
        return self._writer.register_channel(topic, MessageEncoding.JSON, schema_id)
