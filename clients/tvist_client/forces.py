"""Giving way to forces at the tool."""

from collections.abc import Iterable
from typing import Literal

from tvist_client.leased import Leased
from tvist_client.motion import Motion
from tvist_client.values import Six, entries, number, optional_pose, pose_of
from tvist_protocol.forces import Choices, EndForceMode, ForceMode, FrameType, Freedrive, ZeroFtsensor
from tvist_protocol.values import Pose


class Forces(Leased):
    """The part of `Arm` that lets it give way to forces."""

    async def force_mode(
        self,
        compliant: Iterable[bool],
        wrench: Iterable[float],
        *,
        limits: Iterable[float] = (0.1, 0.1, 0.1, 0.5, 0.5, 0.5),
        frame: Iterable[float] | None = None,
        frame_type: FrameType = 2,
        damping: float = 0.005,
        gain: float = 1.0,
    ) -> Motion:
        """Give way along and about the compliant axes of a frame until a wrench is reached.

        In the other axes the arm stands, or moves by `servo_j`, `speed_j` and `speed_l`. A further call changes what
        is to be reached; `end_force_mode`, any stop and the end of control end it.

        Args:
            compliant: Which axes give way: three directions of the frame, then the turns about them.
            wrench: What the arm exerts on its environment in these: force [N] and torque [N m].
            limits: Speed limit of each compliant axis [m/s, rad/s]; largest deviation of each other one [m, rad].
            frame: The frame, as a pose in the base frame; None for the base frame.
            frame_type: 1: the frame is turned so that its y axis points from the tool to its origin; 2: it stays; 3: it
                is turned so that its x axis is the tool's velocity projected into its x-y plane.
            damping: How quickly the arm slows down where nothing touches it, 0 to 1.
            gain: Factor of the difference between wanted and felt wrench, 0 to 2.
        """
        return await self._begin(
            ForceMode(
                token=self.token,
                compliant=_choices(compliant, "compliant"),
                wrench=_six(wrench, "wrench"),
                limits=_six(limits, "limits"),
                frame=optional_pose(frame, "frame"),
                frame_type=frame_type,
                damping=number(damping, "damping"),
                gain=number(gain, "gain"),
            )
        )

    async def freedrive(
        self, free: Iterable[bool] = (True,) * 6, frame: Iterable[float] | Literal["base", "tool"] = "base"
    ) -> Motion:
        """Let people move the arm by hand, until `end_force_mode`, a stop or the end of control.

        Args:
            free: Along which directions of the frame, and about which, it can be moved.
            frame: The frame: that of the base or of the tool, or a pose in the base frame.
        """
        chosen: Pose | Literal["base", "tool"]
        chosen = frame if frame == "base" or frame == "tool" else pose_of(frame, "frame")  # noqa: PLR1714  for mypy
        return await self._begin(Freedrive(token=self.token, free=_choices(free, "free"), frame=chosen))

    async def end_force_mode(self) -> None:
        """End `force_mode` or `freedrive`, and wait until the arm is at rest."""
        await self.robot.request(EndForceMode(token=self.token))
        await self.robot.rest()

    async def zero_ftsensor(self) -> None:
        """Take the present force and torque at the tool as zero."""
        await self.robot.request(ZeroFtsensor(token=self.token))


def _choices(values: Iterable[bool], where: str) -> Choices:
    a, b, c, d, e, f = (bool(one) for one in pose_of([float(one) for one in entries(values, where)], where))
    return a, b, c, d, e, f


def _six(values: Iterable[float], where: str) -> Six:
    return pose_of(values, where)
