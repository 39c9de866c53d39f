"""Bases of the messages from clients."""

from msgspec import Struct

from tvist_protocol.values import Token


class ClientMessage(
    Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="type", gc=False
):
    """Base of the messages from clients; an unknown field is refused as a mistake."""


class Leased(ClientMessage, frozen=True, kw_only=True):
    """Base of the messages that only the client in control may send."""

    token: Token
    """Token of the lease."""
