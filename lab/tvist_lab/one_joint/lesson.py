"""The numbers of the lesson: the mode as the arm folds, and what motions leave that end at 30°, 90° and 150°."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from tvist_controller.api.line import body, default_calibration, estimator_of, load_calibration, paper_payload
from tvist_lab.metrics import RingDown, fit_ring_down, motions, peak_after_stop
from tvist_lab.one_joint.closed_form import FlexibleShoulder
from tvist_lab.recordings import Floats, Recording
from tvist_lab.study.line import ControlLine, point_to_point
from tvist_lab.study.shaping import Running, shape
from tvist_plant.description import Payload, RobotDescription, load
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD
from tvist_shaping import Estimator, Fixed, TvistFilter, shaper

ROBOT = "one-joint"
POSES = ("Q1", "Q2", "Q3")
"""Poses of the robot file whose elbow is at the angles of the paper's figure."""
DESIGN = "Q2"
"""Pose that the fixed shaper is designed for."""
STARTS = {"Q1": "Q3", "Q2": "Q3", "Q3": "Q1"}
"""Pose that ends a motion, to that at which its elbow begins."""
TURNS = tuple(np.radians([50.0, 60.0, 70.0, 80.0, 90.0]).tolist())
"""Angles by which the shoulder turns in the motions to each pose [rad]: one alone may happen to leave little."""
MASSES = (0.0, 1.0)
"""Payloads of the figure [kg]."""
ANGLES = tuple(np.radians(np.arange(0.0, 151.0, 10.0)).tolist())
"""Elbow angles at which the arm is plucked [rad]."""
WAYS = {
    "unshaped": "unshaped",
    "zv_fixed": "ZV, fixed",
    "tvist_closed_form": "TVIST-ZV, f_d(q) in closed form",
    "tvist_identified": "TVIST-ZV, f_d(q) as identified",
}
"""Ways to make a motion: in JSON, and for people."""
TORQUE = 2.0
"""Torque that twists the shoulder before it is let go [N m]."""
HELD = 1.0
"""Time for which it acts: the arm rests again before it is let go [s]."""
LISTENED = 1.0
"""Time that is recorded after that [s]."""
GRAVITY = (0.0, 0.0, 9.81)
"""What the accelerometer of an arm with vertical axes feels at rest [m/s²]."""


@dataclass(frozen=True)
class Plucked:
    """The mode at one angle of the elbow."""

    mass: float
    """Of the payload [kg]."""
    elbow: float
    """[rad]."""
    inertia: float
    """About the shoulder [kg m²]."""
    f_d: float
    """By the formula [Hz]."""
    zeta: float
    """[-]."""
    simulated_f_d: float
    """Fitted to the accelerometer after a pluck [Hz]."""
    simulated_zeta: float
    """[-]."""


@dataclass(frozen=True)
class PoseResult:
    """What the arm is at one of the three poses, and what motions leave that end there."""

    mode: Plucked
    peak: dict[str, float]
    """Way to the largest |α| after the stop, the mean of the motions [m/s²]."""
    delay: dict[str, float]
    """Way to how much longer the shaped motion lasts, the mean of the motions [s]."""

    def left(self, way: str) -> float:
        """What a way leaves of the unshaped vibration [%]."""
        return 100.0 * self.peak[way] / self.peak["unshaped"]


@dataclass(frozen=True)
class Lesson:
    """All of it."""

    description: RobotDescription
    curve: tuple[Plucked, ...]
    """Over `ANGLES`, with each of `MASSES`."""
    poses: dict[str, PoseResult]

    @property
    def worst_f_d(self) -> float:
        """Largest deviation of the simulated f_d from the formula [%]."""
        return max(100.0 * abs(one.simulated_f_d / one.f_d - 1.0) for one in self.curve)

    @property
    def worst_zeta(self) -> float:
        """Largest deviation of the simulated ζ from the formula [%]."""
        return max(100.0 * abs(one.simulated_zeta / one.zeta - 1.0) for one in self.curve)

    def as_dict(self) -> dict[str, Any]:
        """What `tvist lesson --json` prints."""
        return {
            "robot": self.description.robot.name,
            "curve": [asdict(one) for one in self.curve],
            "worst_f_d_percent": self.worst_f_d,
            "worst_zeta_percent": self.worst_zeta,
            "poses": {
                name: {
                    **asdict(result),
                    "left_percent": {way: result.left(way) for way in result.peak},
                }
                for name, result in self.poses.items()
            },
        }


def lesson(progress: Callable[[], None] = lambda: None) -> Lesson:
    """Pluck the arm all over its range, then make the motions.

    Args:
        progress: Told of each pluck and each motion done; `COUNT` in all.
    """
    description = load(ROBOT)
    curve = []
    for mass in MASSES:
        for elbow in ANGLES:
            curve.append(plucked(description, mass, elbow))
            progress()
    return Lesson(
        description, tuple(curve), {name: _pose_result(description, name, progress) for name in POSES}
    )


COUNT = len(MASSES) * len(ANGLES) + len(POSES) * len(TURNS) * len(WAYS)
"""Plucks and motions."""


def plucked(description: RobotDescription, mass: float, elbow: float) -> Plucked:
    """Mode by the formula, and as the simulated arm rings.

    Args:
        description: The one-joint arm.
        mass: Of the payload [kg].
        elbow: Angle of the elbow [rad].
    """
    payload = body(paper_payload(description, mass))
    formula = FlexibleShoulder.of(description, payload)
    f_d, zeta = formula.mode(elbow)
    ring = pluck(description, payload, elbow)
    return Plucked(mass, elbow, formula.inertia(elbow), f_d, zeta, ring.f_d, ring.zeta)


def _pose_result(description: RobotDescription, name: str, progress: Callable[[], None]) -> PoseResult:
    target = np.array(description.poses[name])
    bend = target[1] - description.poses[STARTS[name]][1]
    peaks: dict[str, list[float]] = {way: [] for way in WAYS}
    durations: dict[str, list[float]] = {way: [] for way in WAYS}
    for number, turn in enumerate(TURNS):
        # Both joints turn the same way, so that their torques about the shoulder add.
        start = target - np.array([np.copysign(turn, bend), bend])
        for way in WAYS:
            recording = _recorded(description, way, start, target, seed=number)
            motion = motions(recording)[0]
            peaks[way].append(peak_after_stop(recording, motion))
            durations[way].append(motion.shaped_duration(recording))
            progress()
    usual = np.array(durations["unshaped"])
    return PoseResult(
        mode=plucked(description, description.payload.mass, float(target[1])),
        peak={way: float(np.mean(values)) for way, values in peaks.items()},
        delay={way: float(np.mean(np.array(values) - usual)) for way, values in durations.items()},
    )


def _recorded(description: RobotDescription, way: str, start: Floats, target: Floats, seed: int) -> Recording:
    """One motion by the control line, the arm with all its disturbances."""
    reference = point_to_point(start, target)
    shaped = reference
    if way != "unshaped":
        tvist = TvistFilter(shaper("zv"), _estimator(description, way), joints=description.joints)
        tvist.reset(start)
        shaped = shape(Running(tvist), reference, watched=False).q
    line = ControlLine(description, start, description.payload)
    return line.follow(reference, shaped).simulate(FlexibleArm(description, description.payload), seed)


def _estimator(description: RobotDescription, way: str) -> Estimator:
    """Where a way's filter learns the mode from."""
    formula = FlexibleShoulder.of(description, description.payload)
    if way == "zv_fixed":
        f_d, zeta = formula.mode(description.poses[DESIGN][1])
        return Fixed([f_d], [zeta])
    if way == "tvist_closed_form":
        return formula.estimator()
    name = default_calibration(description.robot.model)
    assert name is not None
    return estimator_of(load_calibration(name))


def pluck(description: RobotDescription, payload: Payload, elbow: float, seed: int = 0) -> RingDown:
    """Twist the shoulder, let it go, and fit a damped sine to what the accelerometer feels.

    The fit knows nothing of the arm: neither masses nor spring.

    Args:
        description: An arm with a shoulder and an elbow, about vertical axes.
        payload: What it carries.
        elbow: Angle of the elbow [rad].
        seed: Seed of sensor noise and gear errors.
    """
    plant = FlexibleArm(description, payload)
    still = DriveCommand(np.array([0.0, elbow]), np.zeros(2), np.zeros(2))
    plant.reset(still, seed=seed)
    plant.push(np.array([TORQUE, 0.0]))
    for _ in range(round(HELD / PERIOD)):
        plant.step(still)
    plant.push(np.zeros(2))
    felt: Floats = np.array([plant.step(still).accelerometer for _ in range(round(LISTENED / PERIOD))])
    return fit_ring_down(felt - GRAVITY, PERIOD)
