"""What every message of a client has in common."""

from msgspec import Struct

from tvist_protocol.values import Token


class ClientMessage(
    Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="type", gc=False
):
    """Base of what a client sends: an unknown field is a mistake there, and refused."""


class Leased(ClientMessage, frozen=True, kw_only=True):
    """Base of what only the client in control may send."""

    token: Token
    """Token of the lease."""
