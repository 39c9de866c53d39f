"""What every message of a client has in common."""

from msgspec import Struct


class ClientMessage(
    Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="type", gc=False
):
    """Base of what a client sends: an unknown field is a mistake there, and refused."""
