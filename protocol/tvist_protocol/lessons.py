"""What a robot learns from its motions; a lesson is part of its journal, so that a replay need not learn it again."""

from typing import Annotated

from msgspec import Meta, Struct

from tvist_protocol.values import Payload


class PayloadLesson(Struct, frozen=True, kw_only=True, tag_field="type", tag="payload"):
    """What the arm carries, as its dynamics and modes have to assume; the declared payload stays as it is."""

    payload: Payload
    """The payload."""
    why: str
    """What was learnt, in words."""
    beyond: bool = False
    """Whether the arm carries more than that, which is above its rating."""


Height = Annotated[float, Meta(ge=-10.0, le=10.0)]
"""Height of a bump of a correction, as its largest acceleration [rad/s^2]."""
Bumps = Annotated[tuple[tuple[Height, Height, Height], ...], Meta(max_length=10)]
"""A correction: the heights of ten bumps, one after the other, of each of the first three joints; empty for none."""


class MotionLesson(Struct, frozen=True, kw_only=True, tag_field="type", tag="motion"):
    """What the motors add to a motion whenever it is made again."""

    move: Annotated[str, Meta(pattern="^[0-9a-f]{16}$")]
    """What tells the motion from all others: a digest of its references and of what was believed of the arm."""
    begins: Annotated[int, Meta(ge=1, le=100_000)]
    """Number of the motion's tick before which the correction is zero."""
    bumps: Bumps
    """The correction."""
    why: str
    """What was learnt, in words; empty if nobody need be told."""


Lesson = PayloadLesson | MotionLesson
"""Anything that a robot learns."""
