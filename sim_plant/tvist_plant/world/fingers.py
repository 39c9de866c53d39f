"""Two fingers on the flange that close with limited force and hold by friction."""

import mujoco
import numpy as np
import pinocchio as pin

from tvist_plant.surroundings import Hand
from tvist_plant.world.contacts import ALL

PAD = (0.011, 0.004, 0.03)  # half lengths of a finger along x y z of the tool centre point [m]
BEYOND = 0.008  # length of a finger beyond the tool centre point [m]
MASS, DRIVE = 0.001, 0.5
"""A finger's own mass, the rest being part of the tool's, and its motor's inertia through the gear [kg]."""
STIFFNESS, DAMPING = 2e4, 200.0  # gains of the position controller of a finger [N/m, N s/m]
TOGETHER = 2e5  # stiffness of the linkage that centres the fingers [N/m]
FRICTION = (1.0, 0.01, 1e-4)  # friction of a finger: sliding [-], torsional and rolling [m]
SIDES = {"finger left": 1.0, "finger right": -1.0}  # bodies of the fingers and their sides


def add_fingers(spec: "mujoco.MjSpec", load: "mujoco.MjsBody", hand: Hand) -> None:
    """Add the open fingers of a hand to the body beyond the flange."""
    turn = np.roll(pin.Quaternion(hand.rotation).coeffs(), 1).tolist()
    for name, side in SIDES.items():
        half = hand.stroke / 2.0
        place = hand.position + hand.rotation @ np.array([0.0, side * (half + PAD[1]), BEYOND - PAD[2]])
        finger = load.add_body(name=name, pos=place.tolist(), quat=turn, mass=MASS, explicitinertial=True)
        finger.inertia = [1e-6, 1e-6, 1e-6]
        finger.add_joint(
            name=name,
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=[0.0, -side, 0.0],
            armature=DRIVE,
            damping=DAMPING,
        )
        finger.add_geom(
            name=name, type=mujoco.mjtGeom.mjGEOM_BOX, size=list(PAD), mass=0.0, condim=4, friction=list(FRICTION),
            rgba=[0.25, 0.25, 0.27, 1.0], contype=ALL, conaffinity=ALL,
        )  # fmt: skip
    linkage = spec.add_tendon(stiffness=TOGETHER, damping=DAMPING, springlength=[0.0, 0.0])
    for name, side in SIDES.items():
        linkage.wrap_joint(name, side)


class Fingers:
    """Position controller of the fingers in a compiled MuJoCo model."""

    def __init__(self, model: "mujoco.MjModel", hand: Hand) -> None:
        self._dofs = [int(model.joint(name).dofadr[0]) for name in SIDES]
        self._angles = [int(model.joint(name).qposadr[0]) for name in SIDES]
        self._stroke = hand.stroke
        self.open()

    def open(self) -> None:
        """Command the fingers open."""
        self.wanted, self.force = self._stroke, 0.0

    def opening(self, data: "mujoco.MjData") -> float:
        """Return the distance between the fingers [m]."""
        return float(self._stroke - sum(data.qpos[self._angles]))

    def drive(self, data: "mujoco.MjData") -> None:
        """Set the forces for the next step, limited and towards the wanted opening."""
        way = (self._stroke - self.wanted) / 2.0
        for angle, dof in zip(self._angles, self._dofs, strict=True):
            force = STIFFNESS * (way - data.qpos[angle])
            data.qfrc_applied[dof] = min(max(force, -self.force), self.force)
