"""Optional deviations of an arm from its description.

Friction of a motor turning at v decreases with speed (Stribeck; Canudas de Wit et al. 1995, without bristles):

    F(v) = [F_c + (F_s - F_c) exp(-(v/v_s)²)] tanh(v/w)

A gear twisted by δ transmits the torque

    K δ                                   as described,
    K₁ δ up to |δ| = δ₁, K beyond it      piecewise (makers of strain wave gears give K₁ < K),
    K δ + z                               with hysteresis, ż = r K δ̇ - |δ̇| z r K/z_max  (Dahl 1968);
    0 up to |δ| = b                       with backlash: the laws above then hold for the twist beyond b.

Near standstill, stiction holds a motor by a torque d in addition to F(v). It grows with the angle θ like a spring until
it breaks away (Dahl 1968; Stribeck 1902):

    dd/dθ = σ K (1 - d sgn(θ̇)/most),    most = (F_s + μ_s |τ_g|) exp(-(θ̇/v_s)²)

τ_g is the gear's torque, K its stiffness; this F_s and v_s are those of `stiction`.

A gear's damper also acts within its backlash, as oil and teeth do. A yielding base stands on springs about the world's
x and y axes and carries a ring with mass under the arm. A tilted arm leans in the world without its controller's
knowledge; the truth is given in the upright world.
"""

import math
from dataclasses import dataclass, fields, replace

import msgspec
import numpy as np
import pinocchio as pin

from tvist_plant.model import FLANGE, FlexibleModel, flexible_model
from tvist_plant.robot_tables import Payload, RobotDescription

STICTION = frozenset({"stiction", "stiction_load", "stiction_speed", "stiction_stiffness"})
"""Keys of the motors' stiction."""
STEEPEST = math.pi / 6  # largest tilt of an arm [rad]


@dataclass(frozen=True)
class YieldingBase:
    """A base on springs; raise ValueError unless each value is positive (`damping_time` may be 0)."""

    stiffness: float = 1.5e5  # stiffness about each of the two axes [N m/rad]
    damping_time: float = 1e-3  # damping divided by stiffness [s]
    mass: float = 20.0  # mass of the ring under the arm [kg]
    radius: float = 0.25  # radius of the ring, for its inertia [m]

    def __post_init__(self) -> None:
        for name in ("stiffness", "mass", "radius"):
            _check(f"base.{name}", getattr(self, name), 0.0, math.inf, above=True)
        _check("base.damping_time", self.damping_time, 0.0, math.inf)


_RANGES = {
    "breakaway": (1.0, math.inf, False), "stribeck_speed": (0.0, math.inf, True),
    "rotor": (0.0, math.inf, True), "hysteresis": (0.0, math.inf, False),
    "hysteresis_torque": (0.0, math.inf, True), "soft": (0.0, 1.0, True),
    "soft_torque": (0.0, math.inf, False), "stiction": (0.0, math.inf, False),
    "stiction_load": (0.0, math.inf, False), "stiction_speed": (0.0, math.inf, True),
    "stiction_stiffness": (0.0, math.inf, True), "torsion": (0.0, math.inf, True),
    "backlash": (0.0, math.inf, False), "tilt": (-STEEPEST, STEEPEST, False),
}  # fmt: skip
"""Limits of each value, and whether the lower one is excluded."""


@dataclass(frozen=True)
class Imperfections:
    """Deviations from the description; the defaults add none. Raise ValueError if a value is out of range."""

    breakaway: float = 1.0  # f_s divided by F_c, at least 1 [-]
    stribeck_speed: float = 0.05  # v_s, above 0 [rad/s]
    rotor: float = 1.0
    """Rotor inertia divided by the description's, above 0; the feed-forward does not know it [-]."""
    hysteresis: float = 0.0  # r: relative stiffness added to a gear when its twist reverses, at least 0 [-]
    hysteresis_torque: float = 0.02  # z_max divided by the joint's torque limit, above 0 [-]
    soft: float = 1.0  # k₁ divided by K, above 0 and at most 1 [-]
    soft_torque: float = 0.1  # k₁ δ₁ divided by the joint's torque limit, at least 0 [-]
    stiction: tuple[float, ...] = ()
    """F_s of the torque d that holds each motor near standstill, at least 0; empty for none [N m]."""
    stiction_load: float = 0.0  # μ_s: increase of d per torque in the gear, at least 0 [-]
    stiction_speed: float = 0.03  # v_s: speed over which d decays, above 0 [rad/s]
    stiction_stiffness: float = 27.0
    """σ: stiffness of d before it breaks away, divided by the gear's, above 0 [-]."""
    base: YieldingBase | None = None  # the yielding base; None for a rigid one
    torsion: float | None = None
    """Torsional stiffness of each link that bends, above 0; None for rigid in torsion [N m/rad]."""
    backlash: tuple[float, ...] = ()  # b of each joint, half its backlash, at least 0; empty for none [rad]
    tilt: float = 0.0
    """Angle by which the arm leans about the world's x axis, at most 30 degrees either way [rad]."""

    def __post_init__(self) -> None:
        for name, (least, most, above) in _RANGES.items():
            value = getattr(self, name)
            if isinstance(value, tuple):
                for joint, one in enumerate(value):
                    _check(f"{name}[{joint}]", one, least, most, above=above)
            elif value is not None:
                _check(name, value, least, most, above=above)

    @classmethod
    def of(cls, description: RobotDescription, more: "Imperfections | None" = None) -> "Imperfections":
        """Return the robot file's imperfections, overridden by values of `more` other than the defaults."""
        own = msgspec.convert(description.imperfections, cls)
        if more is None:
            return own
        none, names = cls(), [one.name for one in fields(cls)]
        given = {name: getattr(more, name) for name in names if getattr(more, name) != getattr(none, name)}
        return replace(own, **given)


def imperfect_model(
    description: RobotDescription, payload: Payload, imperfections: Imperfections
) -> FlexibleModel:
    """Model an arm whose links may twist and base may yield or lean; raise ValueError if none can twist."""
    if imperfections.torsion is not None and not description.link_flexibility.links:
        raise ValueError(
            f"torsion is {imperfections.torsion:g} N m/rad, but no link of the {description.robot.model} bends: "
            "links that bend can twist"
        )
    arm = flexible_model(description, payload, imperfections.torsion)
    if imperfections.tilt != 0.0:
        slope = pin.SE3(pin.rpy.rpyToMatrix(imperfections.tilt, 0.0, 0.0), np.zeros(3))
        arm.model.jointPlacements[1] = slope * arm.model.jointPlacements[1]
    return arm if imperfections.base is None else on_base(arm, imperfections.base)


def on_base(arm: FlexibleModel, base: YieldingBase) -> FlexibleModel:
    """Put an arm on a base that yields about the world's x and y axes: two more virtual joints."""
    ground = pin.Model()
    inertia = pin.Inertia(base.mass, np.zeros(3), base.mass * base.radius**2 * np.eye(3) / 2.0)
    light = pin.Inertia(0.05 * base.mass, np.zeros(3), 0.05 * base.mass * base.radius**2 * np.eye(3) / 2.0)
    first = ground.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "base_x")
    ground.appendBodyToJoint(first, light, pin.SE3.Identity())
    second = ground.addJoint(first, pin.JointModelRY(), pin.SE3.Identity(), "base_y")
    ground.appendBodyToJoint(second, inertia, pin.SE3.Identity())
    foot = ground.addFrame(pin.Frame("foot", second, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    whole = pin.appendModel(ground, arm.model, foot, pin.SE3.Identity())
    place = np.array(
        [whole.idx_vs[whole.getJointId(arm.model.names[j + 1])] for j in range(arm.model.njoints - 1)]
    )
    return FlexibleModel(
        model=whole,
        joints=place[arm.joints],
        flexes=np.concatenate([[0, 1], place[arm.flexes]]).astype(np.int64),
        bending=place[arm.bending],
        flex_stiffness=np.concatenate([[base.stiffness] * 2, arm.flex_stiffness]),
        flex_damping=np.concatenate([[base.stiffness * base.damping_time] * 2, arm.flex_damping]),
        flange=whole.getFrameId(FLANGE),
        bare=arm.bare,
    )


def _check(name: str, value: float, least: float, most: float, *, above: bool = False) -> None:
    """Raise ValueError unless a value is finite and within its limits; `above` excludes the lower one."""
    if math.isfinite(value) and (least < value if above else least <= value) and value <= most:
        return
    limit = f"{'above' if above else 'at least'} {least:g}" + (
        f" and at most {most:g}" if most < math.inf else ""
    )
    raise ValueError(f"{name} is {value}: must be {limit}, and finite")
