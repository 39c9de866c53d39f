"""Keys and messages as an AsyncAPI 3.0 document: it describes the server."""

from collections.abc import Iterable
from typing import Any

from tvist_protocol.channels import CHANNELS, MESSAGES, Channel, tag
from tvist_protocol.schema import components
from tvist_protocol.values import CLIENT_NAME_PATTERN, PATTERN_MEANINGS, PROTOCOL_VERSION, ROBOT_NAME_PATTERN

_EMPTY = "no_payload"
_PARAMETERS = {
    "robot": {"description": f"Name of the robot: {PATTERN_MEANINGS[ROBOT_NAME_PATTERN]}."},
    "client": {"description": f"Name of the client: {PATTERN_MEANINGS[CLIENT_NAME_PATTERN]}."},
}


def asyncapi() -> dict[str, Any]:
    """Return the AsyncAPI document. Liveliness tokens carry no message, and have no operation in it."""
    roots, schemas = components(MESSAGES, "#/components/schemas/{name}")
    return {
        "asyncapi": "3.0.0",
        "info": {
            "title": "TVIST robot controller",
            "version": f"{PROTOCOL_VERSION}.0.0",
            "description": "MessagePack maps over Zenoh, SI units, radians. The prose is in README.md.",
            "license": {"name": "Apache-2.0"},
        },
        "defaultContentType": "application/msgpack",
        "servers": {
            "default": {
                "host": "127.0.0.1:7447",
                "protocol": "zenoh",
                "description": "Where `tvist serve` listens without options, over TCP.",
            }
        },
        "channels": {channel.name: _channel(channel) for channel in CHANNELS},
        "operations": {
            channel.name: _operation(channel) for channel in CHANNELS if channel.kind != "liveliness"
        },
        "components": {
            "messages": {
                tag(kind): {"name": tag(kind), "summary": _summary(kind), "payload": root}
                for kind, root in zip(MESSAGES, roots, strict=True)
            }
            | {_EMPTY: {"name": _EMPTY, "summary": "A query without payload."}},
            "schemas": schemas,
        },
    }


def _channel(channel: Channel) -> dict[str, Any]:
    names = (*_asked(channel), *map(tag, channel.answers))
    return {
        "address": channel.key,
        "description": channel.meaning,
        "parameters": {name: text for name, text in _PARAMETERS.items() if f"{{{name}}}" in channel.key},
        "messages": {name: {"$ref": f"#/components/messages/{name}"} for name in names},
    }


def _operation(channel: Channel) -> dict[str, Any]:
    operation: dict[str, Any] = {
        "action": "send" if channel.by == "server" else "receive",
        "channel": {"$ref": f"#/channels/{channel.name}"},
        "summary": channel.meaning,
        "messages": _of(channel, _asked(channel)),
    }
    if channel.kind == "queryable":
        operation["reply"] = {
            "channel": {"$ref": f"#/channels/{channel.name}"},
            "messages": _of(channel, map(tag, channel.answers)),
        }
    return operation


def _of(channel: Channel, names: Iterable[str]) -> list[dict[str, str]]:
    return [{"$ref": f"#/channels/{channel.name}/messages/{name}"} for name in names]


def _asked(channel: Channel) -> list[str]:
    if channel.kind == "queryable" and not channel.messages:
        return [_EMPTY]
    return [tag(kind) for kind in channel.messages]


def _summary(kind: type) -> str:
    return (kind.__doc__ or "").splitlines()[0]
