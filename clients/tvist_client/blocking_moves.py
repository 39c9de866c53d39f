"""Motions of the blocking client's arm: planned ones, and those that each command replaces."""

from collections.abc import Iterable

from tvist_client import arm as asynchronous_arm
from tvist_client.blocking_motion import Motion
from tvist_client.portal import Portal
from tvist_protocol.motions import Orientation, Segment


class Leased:
    """Base of the parts of `Arm`."""

    def __init__(self, portal: Portal, arm: asynchronous_arm.Arm) -> None:
        self._portal = portal
        self._arm = arm


class Moves(Leased):
    """The part of `Arm` that makes planned motions; see `tvist_client.moves.Moves` for the arguments."""

    def move_j(
        self,
        q: Iterable[float],
        *,
        velocity: float = 1.5,
        acceleration: float = 2.0,
        jerk: float = 100.0,
        duration: float | None = None,
        wait: bool = True,
    ) -> Motion:
        """Move to a joint configuration [rad]."""
        motion = self._portal.call(
            lambda: self._arm.move_j(
                q, velocity=velocity, acceleration=acceleration, jerk=jerk, duration=duration, wait=wait
            )
        )
        return Motion(self._portal, motion)

    def move_l(
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
        """Move the tool centre point on a straight line."""
        motion = self._portal.call(
            lambda: self._arm.move_l(
                pose,
                frame=frame,
                velocity=velocity,
                acceleration=acceleration,
                jerk=jerk,
                duration=duration,
                wait=wait,
            )
        )
        return Motion(self._portal, motion)

    def move_c(
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
        """Move the tool centre point on a circular arc."""
        motion = self._portal.call(
            lambda: self._arm.move_c(
                via,
                pose,
                frame=frame,
                orientation=orientation,
                velocity=velocity,
                acceleration=acceleration,
                jerk=jerk,
                wait=wait,
            )
        )
        return Motion(self._portal, motion)

    def move_path(
        self,
        segments: Iterable[Segment],
        *,
        frame: Iterable[float] | None = None,
        jerk: float = 60.0,
        wait: bool = True,
    ) -> Motion:
        """Move along a path of several parts, without stopping where they are blended."""
        motion = self._portal.call(lambda: self._arm.move_path(segments, frame=frame, jerk=jerk, wait=wait))
        return Motion(self._portal, motion)


class Guiding(Leased):
    """The part of `Arm` that guides it without a plan; see `tvist_client.guiding.Guiding` for the arguments."""

    def servo_j(
        self,
        q: Iterable[float],
        *,
        lookahead: float = 0.1,
        gain: float = 300.0,
        shaped: bool = False,
        duration: float | None = None,
    ) -> Motion:
        """Approach a posture [rad], and follow it if more come one after the other."""
        motion = self._portal.call(
            lambda: self._arm.servo_j(q, lookahead=lookahead, gain=gain, shaped=shaped, duration=duration)
        )
        return Motion(self._portal, motion)

    def speed_j(
        self,
        qd: Iterable[float],
        acceleration: float = 1.4,
        *,
        shaped: bool = False,
        duration: float | None = None,
    ) -> Motion:
        """Accelerate to velocities of the joints and keep them, also after `duration`."""
        motion = self._portal.call(
            lambda: self._arm.speed_j(qd, acceleration, shaped=shaped, duration=duration)
        )
        return Motion(self._portal, motion)

    def speed_l(
        self,
        xd: Iterable[float],
        acceleration: float = 1.2,
        *,
        angular_acceleration: float | None = None,
        shaped: bool = False,
        duration: float | None = None,
    ) -> Motion:
        """Accelerate to a velocity of the tool and keep it, also after `duration`."""
        motion = self._portal.call(
            lambda: self._arm.speed_l(
                xd,
                acceleration,
                angular_acceleration=angular_acceleration,
                shaped=shaped,
                duration=duration,
            )
        )
        return Motion(self._portal, motion)

    def stop_j(self, acceleration: float = 2.0) -> None:
        """Come to rest with a deceleration of the joints, and wait for that."""
        self._portal.call(lambda: self._arm.stop_j(acceleration))

    def stop_l(self, acceleration: float = 1.2, *, angular_acceleration: float | None = None) -> None:
        """Come to rest with a deceleration of the tool, and wait for that."""
        self._portal.call(lambda: self._arm.stop_l(acceleration, angular_acceleration=angular_acceleration))
