"""Planned motions of an arm under control: joint moves, lines, arcs and paths."""

from collections.abc import Iterable

import msgspec

from tvist_client.errors import ArgumentError
from tvist_client.leased import Leased
from tvist_client.motion import Motion
from tvist_client.values import entries, floats, number, optional_number, optional_pose, pose_of
from tvist_protocol.commands import MoveJ
from tvist_protocol.errors import quoted
from tvist_protocol.motions import (
    MAX_SEGMENTS,
    ArcSegment,
    JointSegment,
    LineSegment,
    MoveC,
    MoveL,
    MovePath,
    Orientation,
    ProcessSegment,
    Segment,
)


class Moves(Leased):
    """The part of `Arm` that makes planned motions, each from rest to rest.

    Poses are any sequence of six numbers: x y z [m] and rotation vector [rad] of the tool centre point, in the base
    frame or in `frame`. A turn of 1 rad counts as 0.25 m for speeds and accelerations of the tool.
    """

    async def move_j(
        self,
        q: Iterable[float],
        *,
        velocity: float = 1.5,
        acceleration: float = 2.0,
        jerk: float = 100.0,
        duration: float | None = None,
        wait: bool = True,
    ) -> Motion:
        """Move to a joint configuration, all joints in phase.

        Args:
            q: Target [rad].
            velocity: Largest velocity of any joint [rad/s].
            acceleration: Largest acceleration of any joint [rad/s²].
            jerk: Largest jerk of any joint [rad/s³].
            duration: Duration of the motion before shaping [s], instead of the three limits above; one too short for
                the arm takes longer.
            wait: Whether to wait for the end; in lockstep and free, time is stepped until then.

        Returns:
            The motion; `started` and `done` are ticks once they are known.

        Raises:
            MotionStoppedError: The motion ended before its target.
        """
        return await self._move(
            MoveJ(
                token=self.token,
                q=floats(q, "q"),
                velocity=number(velocity, "velocity"),
                acceleration=number(acceleration, "acceleration"),
                jerk=number(jerk, "jerk"),
                duration=optional_number(duration, "duration"),
            ),
            wait=wait,
        )

    async def move_l(
        self,
        pose: Iterable[float],
        *,
        frame: Iterable[float] | None = None,
        velocity: float = 0.25,
        acceleration: float = 1.2,
        jerk: float = 60.0,
        duration: float | None = None,
        wait: bool = True,
    ) -> Motion:
        """Move the tool centre point on a straight line, and turn it by the shortest way.

        Args:
            pose: Target of the tool centre point.
            frame: Frame in which `pose` is given, as a pose in the base frame; None for the base frame.
            velocity: Largest speed of the tool [m/s].
            acceleration: Largest acceleration of the tool [m/s²].
            jerk: Largest jerk of the tool [m/s³].
            duration: Duration of the motion before shaping [s], instead of the three limits above; one too short for
                the arm takes longer.
            wait: Whether to wait for the end; see `move_j`.

        Raises:
            RefusedError: The line passes a singular posture, a pose out of reach or an obstacle; the message says at
                which share of the way.
            MotionStoppedError: The motion ended before its target.
        """
        return await self._move(
            MoveL(
                token=self.token,
                pose=pose_of(pose, "pose"),
                frame=optional_pose(frame, "frame"),
                velocity=number(velocity, "velocity"),
                acceleration=number(acceleration, "acceleration"),
                jerk=number(jerk, "jerk"),
                duration=optional_number(duration, "duration"),
            ),
            wait=wait,
        )

    async def move_c(
        self,
        via: Iterable[float],
        pose: Iterable[float],
        *,
        frame: Iterable[float] | None = None,
        orientation: Orientation = "interpolated",
        velocity: float = 0.25,
        acceleration: float = 1.2,
        jerk: float = 60.0,
        wait: bool = True,
    ) -> Motion:
        """Move the tool centre point on the circular arc through the positions of `via` and `pose`.

        Args:
            via: A pose on the arc, of which only the position counts.
            pose: Target of the tool centre point.
            frame: Frame in which both are given, as a pose in the base frame; None for the base frame.
            orientation: `interpolated` turns the tool to the orientation of `pose` by the shortest way; `tangent` keeps
                its orientation relative to the arc's tangent, and ignores that of `pose`.
            velocity: Largest speed of the tool [m/s].
            acceleration: Largest acceleration of the tool along the arc [m/s²].
            jerk: Largest jerk of the tool [m/s³].
            wait: Whether to wait for the end; see `move_j`.

        Raises:
            RefusedError: There is no such arc, or the arm cannot follow it.
            MotionStoppedError: The motion ended before its target.
        """
        return await self._move(
            MoveC(
                token=self.token,
                via=pose_of(via, "via"),
                pose=pose_of(pose, "pose"),
                frame=optional_pose(frame, "frame"),
                orientation=orientation,
                velocity=number(velocity, "velocity"),
                acceleration=number(acceleration, "acceleration"),
                jerk=number(jerk, "jerk"),
            ),
            wait=wait,
        )

    async def move_path(
        self,
        segments: Iterable[Segment],
        *,
        frame: Iterable[float] | None = None,
        jerk: float = 60.0,
        wait: bool = True,
    ) -> Motion:
        """Move along a path of several parts, without stopping where they are blended.

        Args:
            segments: Parts of the path in their order, at most 500: `LineSegment`, `ArcSegment`, `ProcessSegment` and
                `JointSegment`, each of which begins where the previous one ends. A blend that does not fit is left
                out; an event of the kind `warning` and the code `blend_skipped` then says so.
            frame: Frame in which all poses are given, as a pose in the base frame; None for the base frame.
            jerk: Largest jerk of the tool [m/s³]; of the joints on joint segments, four times the number [rad/s³].
            wait: Whether to wait for the end; see `move_j`.

        Raises:
            RefusedError: The arm cannot follow the path; the field in the message names the part.
            MotionStoppedError: The motion ended before its target.
        """
        return await self._move(
            MovePath(
                token=self.token,
                segments=_segments(segments),
                frame=optional_pose(frame, "frame"),
                jerk=number(jerk, "jerk"),
            ),
            wait=wait,
        )

    async def _move(self, command: MoveJ | MoveL | MoveC | MovePath, *, wait: bool) -> Motion:
        motion = await self._begin(command)
        return await motion.wait() if wait else motion


def _segments(segments: Iterable[Segment]) -> tuple[Segment, ...]:
    """Convert the numbers of all segments to floats.

    Raises:
        ArgumentError: One is not a segment, a value in it is not a number, or there are too few or too many.
    """
    listed = entries(segments, "segments", "segments")
    if not 1 <= len(listed) <= MAX_SEGMENTS:
        limit = 1 if not listed else MAX_SEGMENTS
        why = f"segments has {len(listed)} entries: must have from 1 to {MAX_SEGMENTS}"
        raise ArgumentError("segments", why, limit)
    return tuple(_segment(segment, f"segments[{place}]") for place, segment in enumerate(listed))


def _segment(segment: Segment, where: str) -> Segment:
    # Neither these types nor msgspec check what a segment is constructed with.
    match segment:
        case JointSegment():
            given = {"q": floats(segment.q, f"{where}.q")}
        case ArcSegment():
            given = {name: pose_of(getattr(segment, name), f"{where}.{name}") for name in ("via", "pose")}
        case LineSegment() | ProcessSegment():
            given = {"pose": pose_of(segment.pose, f"{where}.pose")}
        case _:
            kinds = "LineSegment, ArcSegment, ProcessSegment or JointSegment"
            raise ArgumentError(where, f"{where} is {quoted(segment)}: must be a {kinds}")
    numbers = {name: number(getattr(segment, name), f"{where}.{name}") for name in _NUMBERS}
    duration = getattr(segment, "duration", None)
    if duration is not None:
        numbers["duration"] = number(duration, f"{where}.duration")
    return msgspec.structs.replace(segment, **given, **numbers)


_NUMBERS = ("velocity", "acceleration", "blend")
"""Numbers that every segment has."""
