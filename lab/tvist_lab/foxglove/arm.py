"""The recorded arm as frames and bodies: the pose of each link on its predecessor, and its shape."""

from dataclasses import dataclass

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

_, Y, Z = np.eye(3)
BASE, PAYLOAD = "world", "payload"
THIN = 0.04  # radius of a link of unknown shape, relative to the arm's reach [-]


@dataclass(frozen=True)
class FoxgloveArm:
    """An arm of n joints; a link's frame is at its far end, the last one is the flange."""

    frames: tuple[str, ...]  # names of the frames: the base, and one for each link
    turns: Rotation  # rotation of each link's frame relative to its joint at angle 0, n of them
    shifts: Floats  # position of each link's frame in that of its joint, shape (n, 3) [m]
    bending: tuple[int, ...]  # links that bend in their middle, about y and then z
    bodies: tuple[Body, ...]  # bodies to draw, each in the frame of its link, or -1 for the base

    def steps(self, q: Floats, bends: Floats) -> tuple[Floats, Floats]:
        """Return each link's position, shape (T, n, 3) [m], and quaternion x y z w in the frame of the link before.

        `q` [rad] of the link side has shape (T, n); `bends` has two angles for each bending link.
        """
        places, quaternions = [], []
        for joint, (angle, shift) in enumerate(zip(q.T, self.shifts, strict=True)):
            turn = rest = _about(Z, angle)
            place = np.tile(shift, (len(q), 1))
            if joint in self.bending:
                about_y, about_z = bends[:, 2 * self.bending.index(joint) :][:, :2].T
                bend = _about(Y, about_y) * _about(Z, about_z)
                middle = shift * (0.5, 0.0, 1.0)  # half the link's length along x, its whole offset along z
                place, rest = middle + bend.apply(shift - middle), turn * bend
            places.append(turn.apply(place))
            quaternions.append((rest * self.turns[joint]).as_quat())
        return np.stack(places, axis=1), np.stack(quaternions, axis=1)


def _about(axis: Floats, angles: Floats) -> Rotation:
    return Rotation.from_rotvec(np.outer(angles, axis))


def arm_of(content: RecordingFile) -> FoxgloveArm:
    """Return the arm of a recording from its robot file, which servers record."""
    if "description" not in (content.start or {}):
        raise RecordingError(
            f"{content.path} does not say what its robot looks like: record it with tvist serve --record"
        )
    try:
        robot = checked((content.start or {})["description"], RobotDescription)
        check(robot)
    except (ProtocolError, UserFileError) as error:
        raise RecordingError(f"{content.path} holds a robot that cannot be drawn: {error}") from error
    if content.recording.joints != robot.joints:
        raise RecordingError(
            f"{content.path} holds states of {content.recording.joints} joints, not {robot.joints}"
        )
    links = [link_frame(robot, number) for number in range(robot.joints)]
    bodies = robot.collision.bodies or _sticks(robot, np.array([link.actInv(np.zeros(3)) for link in links]))
    if content.info is not None and content.info.payload.mass > 0.0:
        x, y, z = (2.0 * place for place in content.info.payload.com)
        radius = robot.collision.payload_radius
        bodies += (
            Body(name=PAYLOAD, link=robot.joints - 1, start=(0.0, 0.0, 0.0), end=(x, y, z), radius=radius),
        )
    return FoxgloveArm(
        frames=(BASE, *(f"{joint}_link" for joint in robot.robot.joints[:-1]), "flange"),
        turns=Rotation.from_matrix([link.rotation for link in links]),
        shifts=np.array([link.translation for link in links]),
        bending=tuple(sorted(robot.link_flexibility.links)),
        bodies=bodies,
    )


def _sticks(robot: RobotDescription, joints: Floats) -> tuple[Body, ...]:
    """Return a thin body from each joint to the end of its link, for a URDF arm of unknown shape."""
    radius = THIN * float(np.linalg.norm(joints, axis=1).sum())
    return tuple(
        Body(name=name, link=link, start=(x, y, z), end=(0.0, 0.0, 0.0), radius=radius)
        for link, (name, (x, y, z)) in enumerate(zip(robot.robot.joints, joints.tolist(), strict=True))
    )
