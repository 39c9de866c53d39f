"""The arm as a MuJoCo model: hinges, rotors, gears and bending links.

Bodies, virtual joints and lumps have the description's frames. A motor is a rotor of inertia B in a separate
body, and a gear is the spring of a fixed tendon between motor and joint. All that is beyond the flange hangs
on one body, so that a sensor there feels the wrench between the two.
"""

import mujoco
import numpy as np
import pinocchio as pin

from tvist_plant.description import Payload, RobotDescription, Tensor
from tvist_plant.model import FLANGE, Floats, Integers, link_frame
from tvist_plant.robot_tables import matrix

LOAD = "load"  # name of the body beyond the flange: the payload, and the fingers of a gripper


def hinges(description: RobotDescription, model: "mujoco.MjModel") -> tuple[Integers, Integers, Integers]:
    """Return the coordinate numbers of joints, motors and virtual joints (y and z of each bending link)."""
    numbers = range(description.joints)
    names = (
        [f"joint {number}" for number in numbers],
        [f"motor {number}" for number in numbers],
        [f"flex {number} {axis}" for number in description.link_flexibility.links for axis in "yz"],
    )
    joints, motors, flexes = (
        np.array([model.joint(one).dofadr[0] for one in row], np.int64) for row in names
    )
    return joints, motors, flexes


def link_name(description: RobotDescription, number: int) -> str:
    """Return the name of the body with a link's frame; -1 for the world."""
    return "world" if number < 0 else FLANGE if number == description.joints - 1 else f"link {number}"


def arm_spec(description: RobotDescription, payload: Payload, timestep: float) -> "mujoco.MjSpec":
    """Return an arm without contacts: hinges, a welded body per link frame, rotors outside the link chain."""
    kinematics, links, drives = description.kinematics, description.links, description.drives
    flexibility = description.link_flexibility
    stiffness_of = dict(zip(flexibility.links, flexibility.stiffness, strict=True))
    spec = mujoco.MjSpec()
    spec.option.timestep = timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.gravity = [0.0, 0.0, -9.81]
    # Keep a non-finite state, so that it is detected; by default MuJoCo would restart at zero.
    spec.option.disableflags = int(
        mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_AUTORESET
    )
    frame = spec.worldbody  # its joints are hinges, which is MuJoCo's default
    for number in range(description.joints):
        place = link_frame(description, number)
        turn = np.roll(pin.Quaternion(place.rotation).coeffs(), 1).tolist()  # MuJoCo has the scalar first
        body = frame.add_body()
        body.add_joint(name=f"joint {number}", axis=[0, 0, 1])
        if number in stiffness_of:
            a, d = kinematics.a[number], kinematics.d[number]
            x, y, z = links.com[number]
            away = float(np.sqrt(links.inertia[number][3] / links.mass[number]))
            # The two halves of the link in its frame, the one nearer to its joint first.
            near, far = sorted((x - away, x + away), key=lambda place: abs(place + a))
            lump, Ixx = links.mass[number] / 2, links.inertia[number][0]
            small = (Ixx / 2, 0.0, 0.0, Ixx / 2, 0.0, Ixx / 2)
            add_mass(body.add_body(pos=[a, 0, d], quat=turn), lump, (near, y, z), small)
            body = body.add_body(pos=[a / 2, 0, d])
            for axis, direction in (("y", [0, 1, 0]), ("z", [0, 0, 1])):
                body.add_joint(
                    name=f"flex {number} {axis}",
                    axis=direction,
                    stiffness=stiffness_of[number],
                    damping=stiffness_of[number] * flexibility.damping_time,
                )
            frame = body.add_body(name=link_name(description, number), pos=[a / 2, 0, 0], quat=turn)
            add_mass(frame, lump, (far, y, z), small)
        else:
            frame = body.add_body(
                name=link_name(description, number), pos=place.translation.tolist(), quat=turn
            )
            add_mass(frame, links.mass[number], links.com[number], links.inertia[number])
        B = drives.rotor_inertia[number]
        rotor = spec.worldbody.add_body()
        add_mass(rotor, 1.0, (0.0, 0.0, 0.0), (B, 0.0, 0.0, B, 0.0, B))
        rotor.add_joint(
            name=f"motor {number}",
            axis=[0, 0, 1],
            damping=drives.velocity_gain[number] + drives.coulomb_friction[number] / drives.friction_width,
        )
        gear = spec.add_tendon(
            stiffness=drives.gear_stiffness[number],
            damping=drives.gear_damping[number],
            springlength=[0.0, 0.0],
        )
        gear.wrap_joint(f"joint {number}", 1.0)
        gear.wrap_joint(f"motor {number}", -1.0)
    load = frame.add_body(name=LOAD, mass=payload.mass, ipos=list(payload.com), explicitinertial=True)
    load.inertia, load.iquat = principal(payload.inertia)
    return spec


def principal(inertia: Tensor) -> tuple[list[float], list[float]]:
    """Return principal moments, raised above zero as MuJoCo requires, and their axes as a quaternion."""
    moments, axes = np.linalg.eigh(matrix(inertia))
    if np.linalg.det(axes) < 0.0:
        axes = -axes
    return np.maximum(moments, 1e-9).tolist(), np.roll(pin.Quaternion(axes).coeffs(), 1).tolist()


def carry(model: "mujoco.MjModel", payload: Payload) -> None:
    """Set mass properties of the body beyond the flange to those of a payload."""
    load = model.body(LOAD).id
    model.body_mass[load], model.body_ipos[load] = payload.mass, payload.com
    model.body_inertia[load], model.body_iquat[load] = principal(payload.inertia)
    mujoco.mj_setConst(model, mujoco.MjData(model))


def settle(
    description: RobotDescription, model: "mujoco.MjModel", data: "mujoco.MjData", q: Floats
) -> Floats:
    """Set static equilibrium with the motors at q; return the joints' gravity torques, shape (n,) [N m]."""
    joints, motors, flexes = hinges(description, model)
    mujoco.mj_resetData(model, data)
    gravity = np.zeros(model.nv)
    for _ in range(20):
        data.qpos[joints] = q - gravity[joints] / description.drives.gear_stiffness
        data.qpos[flexes] = -gravity[flexes] / np.repeat(description.link_flexibility.stiffness, 2)
        data.qpos[motors] = q
        mujoco.mj_forward(model, data)
        gravity = data.qfrc_bias.copy()
    return np.asarray(gravity[joints])


def add_mass(body: "mujoco.MjsBody", mass: float, com: tuple[float, float, float], inertia: Tensor) -> None:
    """Set a body's mass, centre of mass and inertia about it (xx xy xz yy yz zz)."""
    xx, xy, xz, yy, yz, zz = inertia
    body.mass, body.ipos, body.fullinertia = mass, list(com), [xx, yy, zz, xy, xz, yz]
    body.explicitinertial = True
