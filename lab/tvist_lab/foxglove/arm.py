"""The recorded arm as frames and bodies: where each link stands on its predecessor, and what is drawn on it."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tvist_lab.recordings import Floats, RecordingError
from tvist_lab.recordings.mcap_file import RecordingFile
from tvist_plant.description import RobotDescription
from tvist_plant.model import link_frame
from tvist_plant.robot_checks import check
from tvist_plant.robot_tables import Body
from tvist_plant.user_file import UserFileError
from tvist_protocol.content import checked
from tvist_protocol.errors import ProtocolError
from tvist_protocol.geometry import GEOMETRY_VERSION, Capsule, Geometry
from tvist_protocol.info import Info
from tvist_protocol.values import Payload

X, Y, Z = np.eye(3)
BASE, FLANGE = "world", "flange"
"""Names of the frames at both ends."""
PAYLOAD = "payload"
"""Name of the body that stands for the declared payload."""
THIN = 0.05
"""Radius of a link whose shape nobody knows, by the arm's reach [-]."""


@dataclass(frozen=True)
class Arm:
    """An arm of n joints; the frame of a link is at its far end, that of the last link is the flange."""

    joints: tuple[str, ...]
    """Names of the joints."""
    turns: Rotation
    """Rotation of each link's frame against its joint at angle 0, n of them."""
    shifts: Floats
    """Place of each link's frame in that of its joint, shape (n, 3) [m]."""
    bending: tuple[int, ...]
    """Links that bend, each in its middle, about y and then z."""
    bodies: tuple[Capsule | Body, ...]
    """What is drawn, each in the frame of its link, -1 for the base."""

    @property
    def frames(self) -> tuple[str, ...]:
        """Names of the frames: the base, and each link's."""
        return (BASE, *(f"{joint}_link" for joint in self.joints[:-1]), FLANGE)

    @property
    def reach(self) -> float:
        """Length of the stretched arm [m]."""
        return float(np.linalg.norm(self.shifts, axis=1).sum())

    def steps(self, q: Floats, bends: Floats) -> tuple[Floats, Floats]:
        """Return each link's frame in that of the link before.

        Args:
            q: Joint angles on the link side, shape (T, n) [rad].
            bends: Two angles per link that bends, shape (T, 2 · links) [rad].

        Returns:
            Places, shape (T, n, 3) [m], and quaternions x y z w, shape (T, n, 4).
        """
        places, quaternions = [], []
        for joint, (angle, shift) in enumerate(zip(q.T, self.shifts, strict=True)):
            turn = rest = _about(Z, angle)
            place = np.tile(shift, (len(q), 1))
            if joint in self.bending:
                about_y, about_z = bends[:, 2 * self.bending.index(joint) :][:, :2].T
                bend = _about(Y, about_y) * _about(Z, about_z)
                middle = shift * (0.5, 0.0, 1.0)  # half the link's length along x, its whole offset along z
                place = middle + bend.apply(shift - middle)
                rest = turn * bend
            places.append(turn.apply(place))
            quaternions.append((rest * self.turns[joint]).as_quat())
        return np.stack(places, axis=1), np.stack(quaternions, axis=1)


def _about(axis: Floats, angles: Floats) -> Rotation:
    return Rotation.from_rotvec(np.outer(angles, axis))


def arm_of(content: RecordingFile) -> Arm:
    """Return the arm of a recording, by its robot file or, in a client's recording, by what the robot told.

    Raises:
        RecordingError: The file contains neither, or what it contains does not fit together.
    """
    start, info = content.start or {}, content.info
    if "description" in start:
        try:
            description = checked(start["description"], RobotDescription)
            check(description, content.path)
        except (ProtocolError, UserFileError) as error:
            raise RecordingError(f"{content.path} holds a robot that cannot be drawn: {error}") from error
        links = [link_frame(description, number) for number in range(description.joints)]
        arm = Arm(
            joints=description.robot.joints,
            turns=Rotation.from_matrix([link.rotation for link in links]),
            shifts=np.array([link.translation for link in links]),
            bending=tuple(sorted(description.link_flexibility.links)),
            bodies=description.collision.bodies,
        )
        payload_radius = description.collision.payload_radius
    elif info is not None and info.geometry is not None:
        arm = _told(content.path, info, info.geometry)
        payload_radius = info.geometry.payload_radius
    else:
        raise RecordingError(
            f"{content.path} does not say what its robot looks like: record it with tvist serve --record"
        )
    if content.recording.joints != len(arm.joints):
        raise RecordingError(
            f"{content.path} has {content.recording.joints} joints in its states, {len(arm.joints)} in its robot"
        )
    carried = () if info is None else _payload(info.payload, len(arm.joints), payload_radius)
    return replace(arm, bodies=(*(arm.bodies or _sticks(arm)), *carried))


def _told(path: Path, info: Info, geometry: Geometry) -> Arm:
    joints = len(info.joints)
    named = {*geometry.bending, *(capsule.link for capsule in geometry.capsules if capsule.link != -1)}
    if (
        geometry.version != GEOMETRY_VERSION
        or not joints
        or not len(geometry.a) == len(geometry.d) == len(geometry.alpha) == joints
        or not named <= set(range(joints))
    ):
        raise RecordingError(f"{path} holds a geometry that is of another version or does not fit together")
    return Arm(
        joints=tuple(info.joints),
        turns=_about(X, np.array(geometry.alpha)),
        shifts=np.array([[a, 0.0, d] for a, d in zip(geometry.a, geometry.d, strict=True)]),
        bending=tuple(geometry.bending),
        bodies=tuple(geometry.capsules),
    )


def _payload(payload: Payload, joints: int, radius: float) -> tuple[Capsule, ...]:
    if payload.mass == 0.0:
        return ()
    x, y, z = (2.0 * place for place in payload.com)
    return (Capsule(name=PAYLOAD, link=joints - 1, start=(0.0, 0.0, 0.0), end=(x, y, z), radius=radius),)


def _sticks(arm: Arm) -> tuple[Body, ...]:
    """A thin body from each joint to the frame at the end of its link, for an arm from a URDF without shapes."""
    starts = arm.turns.inv().apply(-arm.shifts)
    return tuple(
        Body(
            name=name,
            link=link,
            start=(start[0], start[1], start[2]),
            end=(0.0, 0.0, 0.0),
            radius=THIN * arm.reach,
        )
        for link, (name, start) in enumerate(zip(arm.joints, starts, strict=True))
    )
