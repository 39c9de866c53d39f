"""Writes messages to an MCAP file, in the caller's thread. Equal messages make equal files."""

import json
from collections.abc import Mapping
from typing import IO, Any

import msgspec
from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import LIBRARY_IDENTIFIER, CompressionType, Writer

from tvist_protocol.channels import tag
from tvist_protocol.info import Info
from tvist_protocol.recorded import (
    BEHAVIOUR,
    END_METADATA,
    FORMAT,
    METADATA,
    THIS_BEHAVIOUR,
    TICK_NS,
    Recorded,
    to_json,
    viewer_schema,
)

CHUNK_SIZE = 64 * 1024
"""Bytes compressed at once: 70 states, 0.5 ms. A kill loses no more. The default, 1 MB, would stall ticks."""


def heading(info: Info, start: Mapping[str, Any]) -> dict[str, str]:
    """Return the metadata at the start of a recording; TypeError or ValueError if JSON cannot represent `start`."""
    return {
        "format": FORMAT,
        BEHAVIOUR: str(THIS_BEHAVIOUR),
        "info": msgspec.json.encode(info).decode(),
        "start": json.dumps(start, allow_nan=False, sort_keys=True),
    }


class RecordingWriter:
    """Writes one recording to a stream, which the caller closes; OSError if it cannot be written to."""

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
        stream.flush()

    def write(self, message: Recorded) -> None:
        """Add a message; raise TypeError if it has a value that JSON cannot represent, such as a numpy number."""
        time = message.tick * TICK_NS
        self._writer.add_message(self._channels[type(message)], time, to_json(message), time)

    def finish(self, dropped: Mapping[type[msgspec.Struct], int]) -> None:
        """Write the last chunk, the numbers of dropped messages and the index. Nothing can be added afterwards."""
        counts = {tag(kind): str(dropped.get(kind, 0)) for kind in self._channels}
        self._writer.add_metadata(END_METADATA, counts)
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._stream.flush()

    def _channel(self, kind: type[msgspec.Struct], topic: str) -> int:
        schema = json.dumps(viewer_schema(kind)).encode()
        schema_id = self._writer.register_schema(f"tvist.{tag(kind)}", SchemaEncoding.JSONSchema, schema)
        return self._writer.register_channel(topic, MessageEncoding.JSON, schema_id)
