"""Conversion of a robot description and payload to multibody models (pinocchio).

The *rigid* model is the one a controller knows: n joints and the declared payload. The *flexible* model is
the simulated arm: in the middle of each bending link it adds virtual revolute joints about y and z, and about
x if the link also twists. The link's mass is split into two equal lumps at com ± √(Iyy/m) along the link,
each with inertia Ixx/2 about every axis. Mass, centre of mass and Ixx are preserved; Iyy grows by Ixx (UR5e's
upper arm: by 0.015, to 0.349 kg m²), Izz becomes equal to it, and products vanish. Lumps without inertia
would put the fastest pole at -1.6e6 1/s, beyond any integrator at 500 Hz.
"""

import math
from dataclasses import dataclass

import msgspec
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from tvist_plant.robot_tables import LinkFlexibility, Payload, RobotDescription, matrix

FLANGE = "flange"

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


@dataclass(frozen=True)
class FlexibleModel:
    """The flexible model of an arm."""

    model: pin.Model
    """Model with at least N = n + 2 x (bending links) degrees of freedom, in the order of the chain."""
    joints: Integers  # indices of the n joints
    flexes: Integers  # indices of all virtual joints
    bending: Integers  # indices of the virtual joints about y and z of bending links
    flex_stiffness: Floats  # stiffness of each virtual joint [N m/rad]
    flex_damping: Floats  # damping of each virtual joint [N m s/rad]
    flange: int  # frame index of the flange
    bare: pin.Inertia  # body of the last joint, without payload

    def carry(self, payload: Payload) -> None:
        """Change the payload in place, as a new model takes half a tick; results are equal up to rounding."""
        place = self.model.frames[self.flange].placement
        self.model.inertias[self.model.njoints - 1] = (
            self.bare + place.act(payload_inertia(payload)) if payload.mass > 0.0 else self.bare
        )


def rigid_model(description: RobotDescription, payload: Payload) -> pin.Model:
    """Create the model with rigid joints and links: n degrees of freedom and a frame "flange"."""
    rigid = msgspec.structs.replace(description, link_flexibility=LinkFlexibility())
    return flexible_model(rigid, payload).model


def flexible_model(
    description: RobotDescription, payload: Payload, torsion: float | None = None
) -> FlexibleModel:
    """Create the model with bending links; `torsion` is their torsional stiffness about x [N m/rad]."""
    flexibility = description.link_flexibility
    stiffness_of = dict(zip(flexibility.links, flexibility.stiffness, strict=True))
    model = pin.Model()
    joints: list[int] = []
    flexes: list[int] = []
    bending: list[int] = []
    stiffness: list[float] = []
    parent, placement = 0, pin.SE3.Identity()
    for number, name in enumerate(description.robot.joints):
        parent = model.addJoint(parent, pin.JointModelRZ(), placement, name)
        joints.append(model.nv - 1)
        frame = link_frame(description, number)
        if number not in stiffness_of:
            links = description.links
            mass, com, tensor = links.mass[number], np.array(links.com[number]), links.inertia[number]
            model.appendBodyToJoint(parent, pin.Inertia(mass, com, np.array(matrix(tensor))), frame)
            placement = frame
            continue
        near, far = _lumps(description, number)
        model.appendBodyToJoint(parent, near, frame)
        half = np.array([description.kinematics.a[number] / 2, 0.0, description.kinematics.d[number]])
        middle = pin.SE3(np.eye(3), half)
        parent = model.addJoint(parent, pin.JointModelRY(), middle, f"{name}_bending_y")
        parent = model.addJoint(parent, pin.JointModelRZ(), pin.SE3.Identity(), f"{name}_bending_z")
        bending += [model.nv - 2, model.nv - 1]
        flexes += bending[-2:]
        stiffness += [stiffness_of[number]] * 2
        if torsion is not None:
            # A tube twists about its axis, which may be far from the line between the joint frames.
            _, y, z = frame.rotation @ np.array(description.links.com[number])
            axis = pin.SE3(np.eye(3), np.array([0.0, y, z]))
            parent = model.addJoint(parent, pin.JointModelRX(), axis, f"{name}_torsion")
            middle *= axis
            flexes.append(model.nv - 1)
            stiffness.append(torsion)
        placement = middle.inverse() * frame
        model.appendBodyToJoint(parent, far, placement)
    bare = pin.Inertia(model.inertias[parent])
    model.addFrame(pin.Frame(FLANGE, parent, 0, placement, pin.FrameType.OP_FRAME))
    if payload.mass > 0.0:
        model.appendBodyToJoint(parent, payload_inertia(payload), placement)
    return FlexibleModel(
        model=model,
        joints=np.array(joints),
        flexes=np.array(flexes, dtype=np.int64),
        bending=np.array(bending, dtype=np.int64),
        flex_stiffness=np.array(stiffness),
        flex_damping=np.array(stiffness) * flexibility.damping_time,
        flange=model.getFrameId(FLANGE),
        bare=bare,
    )


def holding_torque(model: pin.Model, q: Floats) -> Floats:
    """Return the torques that hold an arm against gravity, shape (n,) [N m]."""
    return np.asarray(pin.computeGeneralizedGravity(model, model.createData(), q))


def carries_weight(description: RobotDescription) -> bool:
    """Return whether gravity can load any joint; it cannot if all axes are vertical."""
    turns = [link_frame(description, number).rotation for number in range(description.joints - 1)]
    return any(np.hypot(turn[0, 2], turn[1, 2]) > 1e-9 for turn in turns)


def link_frame(description: RobotDescription, number: int) -> pin.SE3:
    """Return the frame at a link's end relative to its joint: Tz(d) Tx(a) Rx(alpha), or its placement."""
    kinematics = description.kinematics
    if kinematics.placement:
        x, y, z, *turn = kinematics.placement[number]
        return pin.SE3(rotation_of(*turn), np.array([x, y, z]))
    alpha = kinematics.alpha[number]
    rotation = np.array([[1, 0, 0], [0, np.cos(alpha), -np.sin(alpha)], [0, np.sin(alpha), np.cos(alpha)]])
    return pin.SE3(rotation, np.array([kinematics.a[number], 0.0, kinematics.d[number]]))


def rotation_of(roll: float, pitch: float, yaw: float) -> Floats:
    """Return the rotation matrix of URDF angles: about fixed x, then y, then z [rad], shape (3, 3)."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(angle), math.sin(angle)) for angle in (roll, pitch, yaw))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _lumps(description: RobotDescription, number: int) -> tuple[pin.Inertia, pin.Inertia]:
    """Return the two halves of a bending link, the one nearer to its joint first."""
    links = description.links
    mass, com, (xx, _, _, yy, _, _) = links.mass[number], np.array(links.com[number]), links.inertia[number]
    offset = np.array([np.sqrt(yy / mass), 0.0, 0.0])
    lumps = [pin.Inertia(mass / 2, com + sign * offset, np.eye(3) * xx / 2) for sign in (1.0, -1.0)]
    near, far = sorted(lumps, key=lambda lump: abs(description.kinematics.a[number] + lump.lever[0]))
    return near, far


def payload_inertia(payload: Payload) -> pin.Inertia:
    """Return a payload's inertia in the flange frame."""
    return pin.Inertia(payload.mass, np.array(payload.com), np.array(matrix(payload.inertia)))
