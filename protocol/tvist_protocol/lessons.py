"""What a robot learns from its motions; the journal contains the lessons for replays."""

from msgspec import Struct

from tvist_protocol.values import Payload


class PayloadLesson(Struct, frozen=True, kw_only=True, tag_field="type", tag="payload"):
    """Payload that dynamics and modes must assume; the declared payload does not change."""

    payload: Payload
    """The payload."""
    why: str
    """Description of what was learnt."""
    beyond: bool = False
    """Whether the arm carries more than that, which is above its rating."""
