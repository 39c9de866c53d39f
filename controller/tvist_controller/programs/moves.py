"""The commands that programs make of their moves."""

from tvist_protocol.commands import MoveJ
from tvist_protocol.motions import JointSegment, LineSegment, MoveL, MovePath, Segment

OWN_TOKEN = "program"  # noqa: S105  the lease was checked when the program was played
"""Token in the commands that a program makes, which are not sent to clients."""


def command_of(legs: list[Segment], *, goes_on: bool = False) -> MoveJ | MoveL | MovePath:
    """Return the command for moves that are blended into one motion: the simplest that does.

    Args:
        legs: The moves.
        goes_on: Whether further moves may come while the motion runs, which only a path has room for.
    """
    token = OWN_TOKEN
    match [] if goes_on else legs:
        case [JointSegment() as leg]:
            return MoveJ(
                token=token,
                q=leg.q,
                velocity=leg.velocity,
                acceleration=leg.acceleration,
                duration=leg.duration,
            )
        case [LineSegment() as leg]:
            return MoveL(
                token=token,
                pose=leg.pose,
                velocity=leg.velocity,
                acceleration=leg.acceleration,
                duration=leg.duration,
            )
    return MovePath(token=token, segments=tuple(legs))
