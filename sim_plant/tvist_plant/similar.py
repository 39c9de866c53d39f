"""Springs and drives of an unmeasured arm: those of the UR5e, scaled by dynamic similarity.

The arm is treated as a scaled copy of the UR5e in the same gravity, with two ratios: τ, of a joint's largest
torque to that of the UR5e's joint, and λ, of the arm's stretched length to the UR5e's. A joint's torque holds
a weight m g L, so its inertia m L² grows as τ λ, and times grow as √λ (equal Froude number):

    stiffness, friction            K, k_l, F_c  ∝ τ          every gear twists by the same angle at its largest torque
    inertia of a rotor             B            ∝ τ λ
    damper of a gear, gain         D_g, K_d     ∝ τ √λ       every damping ratio stays the same
    gains of the loops             K_p, K_i     ∝ 1/√λ       as frequencies do
    widths of friction             w            ∝ 1/√λ       F_c/w is a damper
    time of a link's damping       d_l/k_l      ∝ √λ
    shares, and errors of gears                 are the same

The first joint corresponds to the UR5e's base, the last three to its wrist, the one before to its elbow, all
others to its shoulder. An arm with fewer than five joints corresponds to the UR5e's first ones.
"""

import math
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import resources
from typing import Any

import msgspec

from tvist_plant.robot_tables import ArmLimits, Kinematics, RobotDescription
from tvist_plant.user_file import toml

RULE = "assumed: the UR5e's, scaled by dynamic similarity to this arm's torques and length"
"""Provenance of the values computed here."""
WRIST = 3  # number of joints at the end that correspond to the UR5e's wrist
DIGITS = 4  # number of significant digits of scaled values

_POWERS = {
    "gear_stiffness": (1.0, 0.0),
    "coulomb_friction": (1.0, 0.0),
    "rotor_inertia": (1.0, 1.0),
    "gear_damping": (1.0, 0.5),
    "velocity_gain": (1.0, 0.5),
    "position_gain": (0.0, -0.5),
    "integral_gain": (0.0, -0.5),
    "friction_width": (0.0, -0.5),
    "friction_feedforward_width": (0.0, -0.5),
    "windup_feedforward": (0.0, 0.0),
}
"""Exponents of τ and λ for parameters of the drives; the others are the UR5e's."""


@cache
def _measured() -> RobotDescription:
    """Return the UR5e, whose springs and drives agree with measurements."""
    text = (resources.files("tvist_plant") / "robots" / "ur5e.toml").read_text(encoding="utf-8")
    return msgspec.convert(toml(text), RobotDescription)


def stretched(kinematics: Kinematics) -> float:
    """Return the length of all links after the first, stretched into one line [m]."""
    if kinematics.placement:
        return math.fsum(math.hypot(*link[:3]) for link in kinematics.placement[1:])
    return math.fsum(math.hypot(a, d) for a, d in zip(kinematics.a[1:], kinematics.d[1:], strict=False))


def counterpart(joint: int, joints: int) -> int:
    """Return the index of the UR5e's joint that corresponds to a joint of an arm with `joints` joints."""
    if joints < WRIST + 2:
        return joint
    if joint >= joints - WRIST:
        return joint - joints + 6
    return 0 if joint == 0 else 2 if joint == joints - WRIST - 1 else 1


class Scale:
    """Ratios of an arm to the UR5e, from its links and largest joint torques, shape (n,) [N m]."""

    def __init__(self, kinematics: Kinematics, torque: Sequence[float]) -> None:
        measured = _measured()
        self.like = [counterpart(joint, len(torque)) for joint in range(len(torque))]
        """Index of the UR5e's corresponding joint, shape (n,)."""
        self.torque = [
            value / measured.limits.torque[like] for value, like in zip(torque, self.like, strict=True)
        ]
        """τ of each joint, shape (n,) [-]."""
        length = stretched(kinematics)
        self.length = length / stretched(measured.kinematics) if length > 0.0 else 1.0  # λ [-]
        self.time = math.sqrt(self.length)  # ratio of times, √λ [-]

    def drives(self) -> dict[str, Any]:
        """Return the table `drives` of the arm."""
        own = msgspec.structs.asdict(_measured().drives)
        for key, (of_torque, of_length) in _POWERS.items():
            value, grown = own[key], self.length**of_length
            own[key] = (
                [
                    _rounded(value[like] * torque**of_torque * grown)
                    for like, torque in zip(self.like, self.torque, strict=True)
                ]
                if isinstance(value, tuple)
                else _rounded(value * grown)
            )
        return own

    def link_flexibility(self, kinematics: Kinematics) -> dict[str, Any]:
        """Return the table `link_flexibility`: long links between first joint and wrist bend like the UR5e's.

        Only links with DH parameters bend. A link is long if it mainly extends along x; the first long link
        bends like the UR5e's upper arm, the others like its forearm.
        """
        own = _measured().link_flexibility
        joints = len(self.torque) if kinematics.a else 0
        long = [
            link
            for link in range(1, joints - WRIST)
            if abs(kinematics.a[link]) > abs(kinematics.d[link])
            and abs(kinematics.a[link]) > BENDING_LENGTH * self.length
        ]
        return {
            "links": long,
            "stiffness": [
                _rounded(own.stiffness[min(number, 1)] * self.torque[link])
                for number, link in enumerate(long)
            ],
            "damping_time": _rounded(own.damping_time * self.time),
        }


BENDING_LENGTH = 0.2  # length above which a link bends, in an arm as long as the UR5e [m]


def completed(content: Mapping[str, Any]) -> dict[str, Any]:
    """Add springs and drives to a robot file's content without them; leave invalid content to the checks."""
    whole = dict(content)
    if "drives" in whole:
        return whole
    try:
        kinematics = msgspec.convert(whole.get("kinematics"), Kinematics)
        limits = msgspec.convert(whole.get("limits"), ArmLimits)
    except msgspec.ValidationError:
        return whole
    if len(limits.torque) != max(len(kinematics.placement), min(len(kinematics.a), len(kinematics.d))):
        return whole
    scale = Scale(kinematics, limits.torque)
    whole["drives"] = scale.drives()
    whole.setdefault("link_flexibility", scale.link_flexibility(kinematics))
    provenance = whole.get("provenance", {})
    if isinstance(provenance, dict):
        whole["provenance"] = {"drives": RULE, "link_flexibility": RULE, **provenance}
    return whole


def with_limits(content: Mapping[str, Any]) -> dict[str, Any]:
    """Add what a URDF lacks to a robot file's content: further limits, payload, sensors and poses.

    The payload is the UR5e's, scaled to load the second joint equally; accelerations scale with the length.
    """
    known, given = _measured(), content["limits"]
    scale = Scale(msgspec.convert(content["kinematics"], Kinematics), given["torque"])
    joints = len(scale.torque)
    mass = float(f"{known.limits.payload * scale.torque[min(1, joints - 1)] / scale.length:.2g}")
    size = (mass / known.payload.mass) ** (1 / 3)
    limits = {
        **given,
        "acceleration": [_rounded(known.limits.acceleration[0] / scale.length)] * joints,
        "jerk": [_rounded(known.limits.jerk[0] / scale.length**1.5)] * joints,
        "payload": mass,
        "repeatability": _rounded(known.limits.repeatability * scale.length),
    }
    payload = {
        "mass": mass,
        "com": [_rounded(size * value) for value in known.payload.com],
        "inertia": [_rounded(size**5 * value) for value in known.payload.inertia],
    }
    guessed = {f"limits.{key}": RULE for key in ("acceleration", "jerk", "payload", "repeatability")}
    return {
        **content,
        "limits": limits,
        "payload": payload,
        "sensors": msgspec.structs.asdict(known.sensors),
        "poses": {
            name: [min(angle, 0.5 * limit) for limit in given["position"]] for name, angle in _POSES.items()
        },
        "provenance": {**content["provenance"], **guessed, "payload": RULE, "sensors": "assumed: the UR5e's"},
    }


_POSES = {"Q1": 0.0, "Q2": 0.5}  # poses of an arm from a URDF: one angle for all joints [rad]


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
