"""Records of a recording that may consist of two files, as one that keeps the last minutes does until it is closed."""

import re
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import islice
from os import fstat
from os.path import samestat
from pathlib import Path
from typing import IO

from mcap.records import Channel, McapRecord, Message, Metadata

from tvist_lab.recordings.mcap_records import DAMAGE, records
from tvist_protocol.channels import tag
from tvist_protocol.recorded import METADATA, RING, earlier_name
from tvist_protocol.stream import State

TOPIC = re.compile(r"tvist/(?P<robot>[^/]+)/(?P<kind>\w+)")
"""Topic of a robot's channel."""
BEFORE_METADATA = 3
"""Number of records at the beginning of a file among which is the metadata of a recording."""


@contextmanager
def opened(path: Path) -> Iterator[Sequence[IO[bytes]]]:
    """Open a recording, and before it the file with its older part if there is one.

    The newer file is opened first: if it takes the older one's place meanwhile, both are the same, and nothing between
    them is missed.

    Raises:
        OSError: A file cannot be opened.
    """
    with ExitStack() as stack:
        newer = stack.enter_context(path.open("rb"))
        earlier = path.with_name(earlier_name(path.name))
        if not _is_ring(newer) or not earlier.exists():
            yield (newer,)
            return
        older = stack.enter_context(earlier.open("rb"))
        yield (newer,) if samestat(fstat(newer.fileno()), fstat(older.fileno())) else (older, newer)


def ring_records(streams: Sequence[IO[bytes]]) -> Iterator[McapRecord]:
    """Yield the records of one file after those of the other.

    While both are joined, the older one also contains messages of the newer one: those up to its last state are left
    out of the newer one. A damage of the older file is raised when both have been read.
    """
    last, damage = -1, None
    for stream in streams[:-1]:
        channels: set[int] = set()
        try:
            for record in records(stream):
                match record:
                    case Message(channel_id=channel, log_time=time) if channel in channels:
                        last = time
                    case Channel(id=channel, topic=topic):
                        found = TOPIC.fullmatch(topic)
                        if found is not None and found["kind"] == tag(State):
                            channels.add(channel)
                yield record
        except DAMAGE as error:
            damage = error
    for record in records(streams[-1]):
        if not isinstance(record, Message) or record.log_time > last:
            yield record
    if damage is not None:
        raise damage


def _is_ring(stream: IO[bytes]) -> bool:
    try:
        first = list(islice(records(stream), BEFORE_METADATA))
    except DAMAGE:
        return False
    finally:
        stream.seek(0)
    return any(isinstance(r, Metadata) and r.name == METADATA and RING in r.metadata for r in first)
