"""Commands that let the arm give way to forces at the tool."""

from typing import Annotated, Literal

from msgspec import Meta

from tvist_protocol.client_message import Leased
from tvist_protocol.values import Fraction, Pose

Push = Annotated[float, Meta(ge=-1e4, le=1e4)]
Wrench = Annotated[tuple[Push, Push, Push, Push, Push, Push], "x y z rx ry rz"]
"""Force [N] and torque [N m]."""
Choices = Annotated[tuple[bool, bool, bool, bool, bool, bool], "x y z rx ry rz"]
"""Of the axes of a frame: three directions, then the turns about them."""
Limit = Annotated[float, Meta(ge=0, le=1e3)]
Limits = Annotated[tuple[Limit, Limit, Limit, Limit, Limit, Limit], "x y z rx ry rz"]
"""Of the same axes [m/s and rad/s, or m and rad]."""
Gain = Annotated[float, Meta(ge=0, le=2)]
FrameType = Literal[1, 2, 3]
"""Whether axes are turned, as URScript numbers it; see `ForceMode`."""


class ForceMode(Leased, frozen=True, kw_only=True, tag="force_mode"):
    """Give way along and about the compliant axes until a wrench is reached, until another command ends it.

    In the other axes the arm stands, or moves by `servo_j`, `speed_j` and `speed_l`. The command may be repeated with
    other fields; it is answered by `accepted` with the number of the motion.
    """

    compliant: Choices
    """Which axes of the frame give way."""
    wrench: Wrench
    """What the arm exerts on its environment in the compliant axes: force [N] and torque [N m]."""
    limits: Limits = (0.1, 0.1, 0.1, 0.5, 0.5, 0.5)
    """Speed limit of each compliant axis [m/s, rad/s]; largest deviation of each other one [m, rad], beyond which the
    robot makes a protective stop.
    """
    frame: Pose | None = None
    """The frame, as a pose in the base frame; null: the base frame."""
    frame_type: FrameType = 2
    """1: the frame is turned so that its y axis points from the tool to its origin; 2: it is used as it is; 3: it is
    turned so that its x axis is the tool's velocity projected into its x-y plane.
    """
    damping: Fraction = 0.005
    """How quickly the arm slows down where nothing touches it [-]; with 0 it keeps its speed."""
    gain: Gain = 1.0
    """Factor of the difference between wanted and felt wrench [-]; above 1 the arm may shake on hard surfaces."""


class Freedrive(Leased, frozen=True, kw_only=True, tag="freedrive"):
    """Let people move the arm by hand; answered as `force_mode` is."""

    free: Choices = (True,) * 6
    """Along and about which axes of the frame the arm can be moved."""
    frame: Pose | Literal["base", "tool"] = "base"
    """The frame: that of the base or of the tool, or a pose in the base frame."""


class EndForceMode(Leased, frozen=True, kw_only=True, tag="end_force_mode"):
    """End `force_mode` or `freedrive`: the arm comes to rest and holds its position."""


class ZeroFtsensor(Leased, frozen=True, kw_only=True, tag="zero_ftsensor"):
    """Take the present force and torque at the tool as zero."""


class SetExternalWrench(Leased, frozen=True, kw_only=True, tag="set_external_wrench"):
    """Tell what a force sensor of one's own measures; it counts once a program has called `ft_rtde_input_enable`.

    Force mode does not begin before the first value, and ends when none comes for 100 ms, unless a client steps time.
    """

    wrench: Wrench
    """Force [N] and torque [N m] in the directions of the flange frame, with the weight of what the sensor carries."""
