"""Optional deviations of an arm from its description.

Friction of a motor turning at v decreases with speed (Stribeck; Canudas de Wit et al. 1995, without bristles):

    F(v) = [F_c + (F_s - F_c) exp(-(v/v_s)²)] tanh(v/w)

A gear twisted by δ transmits the torque

    K δ                                   as described,
    K₁ δ up to |δ| = δ₁, K beyond it      piecewise (makers of strain wave gears give K₁ < K),
    K δ + z                               with hysteresis, ż = r K δ̇ - |δ̇| z r K/z_max  (Dahl 1968);
    0 up to |δ| = b                       with backlash: the laws above then hold for the twist beyond b.

Near standstill, stiction holds a motor by a torque d in addition to F(v). This torque grows with the angle θ
like a spring until the motor breaks away (Dahl 1968; Stribeck 1902):

    dd/dθ = σ K (1 - d sgn(θ̇)/most),    most = (F_s + μ_s |τ_g|) exp(-(θ̇/v_s)²)

τ_g is the gear's torque, K its stiffness; this F_s and v_s are those of `stiction`.

A gear's damper also acts within its backlash, as oil and teeth do. A yielding base turns on springs about the
world's x and y axes and carries a ring with mass under the arm. A tilted arm leans in the world, and its
controller does not know that; the truth is given in the upright world.
"""

import numpy as np
import pinocchio as pin

from tvist_plant.model import FLANGE, FlexibleModel, flexible_model
from tvist_plant.robot_tables import Imperfections, Payload, RobotDescription, YieldingBase

__all__ = ["STICTION", "Imperfections", "YieldingBase", "imperfect_model", "on_base"]

STICTION = frozenset({"stiction", "stiction_load", "stiction_speed", "stiction_stiffness"})
"""Keys of the motors' stiction."""


def imperfect_model(
    description: RobotDescription, payload: Payload, imperfections: Imperfections
) -> FlexibleModel:
    """Model an arm: its links may twist and its base may yield or lean; ValueError if no link can twist."""
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
