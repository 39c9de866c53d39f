"""Commands that make the arm compliant to forces at the tool."""

from typing import Annotated, Literal

from msgspec import Meta

from tvist_protocol.client_message import Leased
from tvist_protocol.values import Fraction, Pose

Push = Annotated[float, Meta(ge=-1e4, le=1e4)]
Wrench = Annotated[tuple[Push, Push, Push, Push, Push, Push], "x y z rx ry rz"]  # force [N] and torque [N m]
Choices = Annotated[tuple[bool, bool, bool, bool, bool, bool], "x y z rx ry rz"]
"""One value per axis of a frame: three directions, then the rotations about them."""
Limit = Annotated[float, Meta(ge=0, le=1e3)]
Limits = Annotated[tuple[Limit, Limit, Limit, Limit, Limit, Limit], "x y z rx ry rz"]
"""One limit per axis [m/s and rad/s, or m and rad]."""
Gain = Annotated[float, Meta(ge=0, le=2)]
FrameType = Literal[1, 2, 3]  # how the frame is rotated, as URScript numbers it; see `ForceMode`


class ForceMode(Leased, frozen=True, kw_only=True, tag="force_mode"):
    """Control forces along and about the compliant axes, until another command ends this.

    In the other axes the arm holds its position, or moves by `servo_j`, `speed_j` and `speed_l`. The command may be
    repeated with other fields; it is answered by `accepted` with the number of the motion.
    """

    compliant: Choices
    """Which axes of the frame are compliant."""
    wrench: Wrench
    """Force [N] and torque [N m] that the arm exerts on its environment in the compliant axes."""
    limits: Limits = (0.1, 0.1, 0.1, 0.5, 0.5, 0.5)
    """Speed limits of compliant axes [m/s, rad/s]; largest deviations of others [m, rad], else a protective stop."""
    frame: Pose | None = None
    """The frame, as a pose in the base frame; null: the base frame."""
    frame_type: FrameType = 2
    """1: the frame is rotated so that its y axis points from the tool to its origin; 2: it is used unchanged;
    3: it is rotated so that its x axis is the tool's velocity projected into its x-y plane."""
    damping: Fraction = 0.005
    """Damping of free motion, without contact [-]; with 0 the arm keeps its speed."""
    gain: Gain = 1.0
    """Gain of the difference between wanted and measured wrench [-]; above 1 the arm may shake on hard surfaces."""


class Freedrive(Leased, frozen=True, kw_only=True, tag="freedrive"):
    """Let people move the arm by hand; answered as `force_mode` is."""

    free: Choices = (True,) * 6
    """Axes of the frame along and about which the arm can be moved."""
    frame: Pose | Literal["base", "tool"] = "base"
    """The frame: that of the base or of the tool, or a pose in the base frame."""


class EndForceMode(Leased, frozen=True, kw_only=True, tag="end_force_mode"):
    """End `force_mode` or `freedrive`: the arm comes to rest and holds its position."""


class ZeroFtsensor(Leased, frozen=True, kw_only=True, tag="zero_ftsensor"):
    """Take the present force and torque at the tool as zero."""


class SetExternalWrench(Leased, frozen=True, kw_only=True, tag="set_external_wrench"):
    """Provide the measurement of an external force sensor, used once a program has called `ft_rtde_input_enable`.

    Force mode does not start before the first value, and ends if none comes for 100 ms, unless a client steps time.
    """

    wrench: Wrench
    """Force [N] and torque [N m] along the flange frame's axes, including the weight of what the sensor carries."""
