"""What a robot learns from its motions; a lesson is part of its journal, so that a replay need not learn it again."""

from msgspec import Struct

from tvist_protocol.values import Payload


class PayloadLesson(Struct, frozen=True, kw_only=True, tag_field="type", tag="payload"):
    """What the arm carries, as its dynamics and modes have to assume; the declared payload stays as it is."""

    payload: Payload
    """The payload."""
    why: str
    """What was learnt, in words."""
    beyond: bool = False
    """Whether the arm carries more than that, which is above its rating."""
