"""Maps of the first mode over the workspace: according to a calibration, and of the simulated arm."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from tvist_controller.api.line import CollisionModel, ModeSource, body, paper_payload
from tvist_lab.recordings import Floats
from tvist_lab.workspace import identified, workspace
from tvist_plant.description import RobotDescription
from tvist_plant.flexible_arm import FlexibleArm
from tvist_protocol.calibration import Calibration

QUANTITIES = {"f_d_hz": "f_d", "zeta": "zeta"}  # keys of the maps, with the words in their file names
POINTS = 41  # number of angles of each joint


@dataclass(frozen=True)
class WorkspaceMap:
    """Values on a grid over two joints; NaN where the arm would touch itself or the floor."""

    joints: tuple[int, int]  # indices of the joints along the grid's rows and columns
    names: tuple[str, str]
    angles: tuple[Floats, Floats]  # angles of these joints [rad], shapes (R,) and (C,)
    rest: tuple[float, ...]  # configuration of the other joints [rad], with zero for those of the grid
    identified: dict[str, Floats]  # values of the calibration by key of `QUANTITIES`, shape (R, C)
    true: dict[str, Floats]  # values of the simulated arm, likewise
    poses: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Named poses on the map, by their angles along rows and columns [rad]."""

    def error(self, key: str) -> Floats:
        """Return the deviation of the identified from the true values [%], shape (R, C)."""
        return np.asarray(100.0 * (self.identified[key] / self.true[key] - 1.0))


def workspace_map(
    description: RobotDescription, calibration: Calibration, mass: float, points: int = POINTS
) -> WorkspaceMap | None:
    """Compute f_d and ζ of the lowest mode on a grid over the first two joints that change the modes.

    The other joints are in the middle of the workspace; `mass` [kg] on the flange is carried and declared. If
    the calibration has a modal model, it is used instead of polynomials. None if the arm has one joint, or
    collides at every point. Raises EstimatorError if the calibration does not fit the arm.
    """
    if description.joints < 2:
        return None
    changing, whole = identified(description), workspace(description)
    count = min(len(whole.low), description.joints)
    moved = [joint for joint in range(count) if changing.high[joint] > changing.low[joint]]
    first, second = sorted([*moved, *(joint for joint in range(count) if joint not in moved)][:2])
    middle = np.zeros(description.joints)
    middle[:count] = np.mean([changing.low, changing.high], axis=0)[:count]
    middle[[first, second]] = 0.0
    angles = tuple(np.linspace(whole.low[joint], whole.high[joint], points) for joint in (first, second))

    payload = paper_payload(description, mass)
    source = ModeSource("polynomial" if calibration.modal is None else "modal", description, calibration)
    estimator = source.estimator(1, payload)
    arm = FlexibleArm(description, body(payload))
    collision = CollisionModel(description, body(payload))
    told, true = ({key: np.full((points, points), np.nan) for key in QUANTITIES} for _ in range(2))
    for row, column in np.ndindex(points, points):
        q = middle.copy()
        q[first], q[second] = angles[0][row], angles[1][column]
        if collision.meeting(q) is not None:
            continue
        f_d, zeta = estimator.settle(q)
        modes = arm.modes(q)
        for maps, mode in ((told, (f_d[0], zeta[0])), (true, (modes.f_d[0], modes.zeta[0]))):
            for key, value in zip(QUANTITIES, mode, strict=True):
                maps[key][row, column] = value
    if np.isnan(true["zeta"]).all():
        return None
    joints = description.robot.joints
    poses = {name: (q[first], q[second]) for name, q in description.poses.items()}
    return WorkspaceMap(
        joints=(first, second),
        names=(joints[first], joints[second]),
        angles=(angles[0], angles[1]),
        rest=tuple(middle.tolist()),
        identified=told,
        true=true,
        poses={
            name: at
            for name, at in poses.items()
            if all(grid[0] - 1e-6 <= angle <= grid[-1] + 1e-6 for grid, angle in zip(angles, at, strict=True))
        },
    )
