"""The tables of a robot file: numbers with units, checked but not processed."""

import math
from collections.abc import Collection
from typing import Annotated, Any

import msgspec
from msgspec import Meta, Struct

from tvist_plant.user_file import UserFileError

Number = Annotated[float, Meta(ge=-1e7, le=1e7)]
Positive = Annotated[float, Meta(gt=0, le=1e7)]
NotNegative = Annotated[float, Meta(ge=0, le=1e7)]
Stiffness = Annotated[float, Meta(gt=0, le=1e12)]
Vector3 = tuple[Number, Number, Number]
Placement = tuple[Number, Number, Number, Number, Number, Number]
Tensor = tuple[NotNegative, Number, Number, NotNegative, Number, NotNegative]
"""Symmetric 3x3 matrix: xx xy xz yy yz zz."""

MAX_JOINTS = 7
DISTURBANCES = ("friction", "gear", "noise")
"""Disturbances unknown to a shaper: Coulomb friction, kinematic gear error, accelerometer noise."""
ORIGINS = ("published", "measured", "given", "assumed", "invented")  # kinds of sources in `provenance`
QUIET_STEP = 2.0 * math.pi / 2**23
"""Step of a 23-bit encoder [rad]; an arm at rest moves less while its drives settle."""


def matrix(tensor: Tensor) -> list[list[float]]:
    """Return the symmetric 3x3 matrix of a tensor."""
    xx, xy, xz, yy, yz, zz = tensor
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]


class DescriptionError(ValueError):
    """There is no such robot, or its file is invalid; the message states what is allowed."""


class RobotFileError(DescriptionError, UserFileError):
    """A robot file is invalid; the message names the file, the key, the value and what is allowed."""


class _Table(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One table of the file, without unknown keys."""


class RobotNames(_Table, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Names of the robot and its parts."""

    name: str
    model: str
    joints: tuple[str, ...]
    """Names of the joints from the base to the flange; they define the number of joints."""


class Kinematics(_Table, frozen=True, forbid_unknown_fields=True, kw_only=True, omit_defaults=True):
    """The frame at the end of each link relative to its joint, which turns about z; one entry per joint.

    The next joint turns about z of this frame; the last one is the flange. Give either standard
    Denavit-Hartenberg parameters, Tz(d) Tx(a) Rx(alpha), or `placement`.
    """

    a: tuple[Number, ...] = ()  # link lengths [m]
    d: tuple[Number, ...] = ()  # link offsets [m]
    alpha: tuple[Number, ...] = ()  # link twists [rad]
    placement: tuple[Placement, ...] = ()
    """Position [m] and roll, pitch, yaw about fixed axes [rad]: x y z roll pitch yaw."""


class Links(_Table, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Mass properties of the rigid links, in the frame at the end of each link."""

    mass: tuple[Positive, ...]  # masses [kg]
    com: tuple[Vector3, ...]  # centres of mass [m]
    inertia: tuple[Tensor, ...]  # Inertias about the centres of mass [kg m^2]


class ArmLimits(_Table, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Limits of the controller; tuples have one entry per joint."""

    position: tuple[Positive, ...]  # largest distance from zero in either direction [rad]
    velocity: tuple[Positive, ...]  # velocity limits [rad/s]
    acceleration: tuple[Positive, ...]  # acceleration limits [rad/s^2]
    jerk: tuple[Positive, ...]  # jerk limits [rad/s^3]
    torque: tuple[Positive, ...]  # torque limits [N m]
    payload: NotNegative  # rated payload [kg]
    repeatability: Positive  # repeatability of the tool's position [m]


class Payload(_Table, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A rigid body on the flange."""

    mass: NotNegative = 0.0
    """Mass [kg]."""
    com: Vector3 = (0.0, 0.0, 0.0)
    """Centre of mass in the flange frame [m]."""
    inertia: Tensor = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Inertia about the centre of mass, flange axes [kg m^2]."""


class Drives(_Table, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Motors, strain wave gears and the drives' cascaded loops; tuples have one entry per joint."""

    gear_stiffness: tuple[Positive, ...]
    """Gear stiffness K_g [N m/rad]."""
    gear_damping: tuple[NotNegative, ...]
    """Gear damping D_g [N m s/rad]."""
    rotor_inertia: tuple[Positive, ...]
    """Rotor inertia B, reflected to the joint side [kg m^2]."""
    velocity_gain: tuple[NotNegative, ...]
    """Velocity gain K_d [N m s/rad]."""
    position_gain: tuple[NotNegative, ...]
    """Position gain K_p [1/s]."""
    integral_gain: tuple[NotNegative, ...]
    """Integral gain K_i [1/s]."""
    coulomb_friction: tuple[NotNegative, ...]
    """Coulomb friction F_c [N m]."""
    friction_width: Positive
    """Width w in F_c tanh(velocity/w) [rad/s]."""
    friction_feedforward: NotNegative
    """Fraction of F_c that is fed forward [-]."""
    friction_feedforward_width: Positive
    """Width of the fed-forward friction [rad/s]."""
    windup_feedforward: tuple[NotNegative, ...]
    """c_w, fraction of the gears' wind-up that is fed forward [-]."""
    gear_error_amplitude: NotNegative
    """Amplitude of the gears' kinematic error [rad]."""
    gear_error_waves: Positive
    """Waves of the kinematic error per turn of the joint [-]."""
    linear_friction: bool = False
    """Use linear friction, F_c/w times velocity, and feed all of it forward; the linear modes describe this plant."""


class LinkFlexibility(_Table, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Links that bend, each with two virtual elastic joints about y and z in its middle."""

    links: tuple[Annotated[int, Meta(ge=0, lt=MAX_JOINTS)], ...] = ()  # indices of the links, 0 for the first
    stiffness: tuple[Positive, ...] = ()  # stiffness for both axes, one entry per link [N m/rad]
    damping_time: NotNegative = 0.0  # damping divided by stiffness [s]


class Sensors(_Table, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Properties of the sensors."""

    accelerometer_noise: NotNegative = 0.0  # rms per axis [m/s^2]
    encoder_step: NotNegative = 0.0  # change of a joint angle that updates its reading [rad]
    force_noise: NotNegative = 1.2
    """rms per axis of the force of the flange sensor, which only an arm in a world has; a third of UR's
    published e-Series precision, 3.5 N [N]."""
    torque_noise: NotNegative = 0.07
    """rms per axis of the torque of the flange sensor; a third of 0.2 N m [N m]."""
    force_offset: NotNegative = 4.0
    """Largest constant force error per axis, drawn from the seed; UR's published accuracy [N]."""
    torque_offset: NotNegative = 0.3  # largest constant torque error per axis [N m]


class YieldingBase(_Table, frozen=True, forbid_unknown_fields=True, kw_only=True, omit_defaults=True):
    """A base on springs."""

    stiffness: Stiffness = 1.5e5  # stiffness about each of the two axes [N m/rad]
    damping_time: NotNegative = 1e-3  # damping divided by stiffness [s]
    mass: Positive = 20.0  # mass of the ring under the arm [kg]
    radius: Positive = 0.25  # radius of the ring, for its inertia [m]


class Imperfections(_Table, frozen=True, forbid_unknown_fields=True, kw_only=True, omit_defaults=True):
    """Deviations of the simulated arm from the other tables, see `imperfections`; the defaults add none."""

    breakaway: Annotated[float, Meta(ge=1, le=1e7)] = 1.0  # f_s divided by F_c [-]
    stribeck_speed: Positive = 0.05  # v_s [rad/s]
    rotor: Positive = 1.0  # rotor inertia divided by the drives', which the feed-forward does not know [-]
    hysteresis: NotNegative = 0.0  # r: relative stiffness added to a gear when its twist reverses [-]
    hysteresis_torque: Positive = 0.02  # z_max divided by the joint's torque limit [-]
    soft: Annotated[float, Meta(gt=0, le=1)] = 1.0  # k₁ divided by K [-]
    soft_torque: NotNegative = 0.1  # k₁ δ₁ divided by the joint's torque limit [-]
    stiction: tuple[NotNegative, ...] = ()
    """F_s of the torque d that holds each motor near standstill; empty for none [N m]."""
    stiction_load: NotNegative = 0.0  # μ_s: increase of d per torque in the gear [-]
    stiction_speed: Positive = 0.03  # v_s: speed over which d decays [rad/s]
    stiction_stiffness: Positive = 27.0  # σ: stiffness of d before it breaks away, divided by the gear's [-]
    base: YieldingBase | None = None  # the yielding base; None for a rigid one
    torsion: Stiffness | None = None
    """Torsional stiffness of each link that bends; None for rigid in torsion [N m/rad]."""
    backlash: tuple[NotNegative, ...] = ()  # b of each joint, half its backlash; empty for none [rad]
    tilt: Annotated[float, Meta(ge=-math.pi / 6, le=math.pi / 6)] = 0.0
    """Angle by which the arm leans about the world's x axis, at most 30 degrees either way [rad]."""

    def given(self) -> dict[str, Any]:
        """Return the values other than the defaults."""
        defaults, own = (msgspec.structs.asdict(one) for one in (type(self)(), self))
        return {name: value for name, value in own.items() if value != defaults[name]}


class Body(_Table, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A capsule that encloses a part of the arm."""

    name: str
    link: Annotated[int, Meta(ge=-1, lt=MAX_JOINTS)]
    """Index of the link in whose frame it is given; -1 for the world."""
    start: Vector3
    """One end of its axis [m]."""
    end: Vector3
    """The other end of its axis [m]."""
    radius: Positive
    """Radius [m]."""


class Collision(_Table, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Bodies of the arm and the floor, which must not collide; neighbours in the list may touch."""

    floor: Number = 0.0  # height of the floor, which the first two bodies may touch [m]
    has_floor: bool = True  # whether there is a floor
    payload_radius: Positive = 0.05
    """Radius of a capsule from the flange through the payload's centre to twice its distance [m]."""
    apart: tuple[tuple[str, str], ...] = ()  # further pairs that are not checked; "payload" is a valid name
    bodies: tuple[Body, ...] = ()  # bodies of the arm, from the base to the flange


class Mesh(_Table, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A mesh of a part of the arm, for drawing only."""

    link: Annotated[int, Meta(ge=-1)]  # index of the link in whose frame it is given; -1 for the base frame
    file: str  # path of the mesh file
    placement: Placement = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Position [m] and roll, pitch, yaw about fixed axes [rad]."""
    scale: Vector3 = (1.0, 1.0, 1.0)  # scale factors [-]


class RobotDescription(_Table, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Content of a robot file."""

    robot: RobotNames
    kinematics: Kinematics
    links: Links
    limits: ArmLimits
    payload: Payload
    drives: Drives
    link_flexibility: LinkFlexibility = LinkFlexibility()
    sensors: Sensors = Sensors()
    imperfections: Imperfections = Imperfections()
    """Those of the simulated arm; a controller knows only the stiction."""
    collision: Collision = Collision()
    meshes: tuple[Mesh, ...] = ()
    poses: dict[str, tuple[Number, ...]] = {}
    """Named joint positions [rad]."""
    provenance: dict[str, str] = {}
    """Source of a table or a key such as "links.inertia": one of `ORIGINS`, a colon, and the source."""

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.robot.joints)

    def quiet(self) -> "RobotDescription":
        """Return the arm with sensors whose readings are constant at rest."""
        return msgspec.structs.replace(
            self, sensors=Sensors(encoder_step=QUIET_STEP, force_noise=0.0, torque_noise=0.0)
        )

    def without_floor(self) -> "RobotDescription":
        """Return the arm without a floor."""
        replace = msgspec.structs.replace
        return replace(self, collision=replace(self.collision, has_floor=False))

    def clean(self) -> "RobotDescription":
        """Return the arm without noise and gear error, and with linear instead of Coulomb friction."""
        return self.disturbed_by(())

    def disturbed_by(self, kept: Collection[str]) -> "RobotDescription":
        """Return the arm with only these `DISTURBANCES`; unless "friction" is kept, friction is linear."""
        for name in kept:
            if name not in DISTURBANCES:
                raise DescriptionError(f"disturbance is {name!r}: must be one of {', '.join(DISTURBANCES)}")
        replace, drives, sensors = msgspec.structs.replace, self.drives, self.sensors
        if "friction" not in kept:
            drives = replace(drives, linear_friction=True)
        if "gear" not in kept:
            drives = replace(drives, gear_error_amplitude=0.0)
        if "noise" not in kept:
            sensors = replace(sensors, accelerometer_noise=0.0, force_noise=0.0, torque_noise=0.0)
        return replace(self, drives=drives, sensors=sensors)
