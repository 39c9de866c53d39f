"""From ring-downs all over the workspace to a calibration."""

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version

import numpy as np

from tvist_client.arm import Arm
from tvist_client.errors import ClientError
from tvist_client.robot import Robot
from tvist_controller.api import estimator_of
from tvist_lab.collect import collect
from tvist_lab.identification.fit import Fit, check_count, fit_polynomials, spread
from tvist_lab.identification.ring_downs import Jog, measure
from tvist_lab.metrics import RingDown
from tvist_lab.recordings import Floats
from tvist_lab.workspace import identified
from tvist_protocol.calibration import Calibration, Provenance, Spread
from tvist_protocol.errors import RefusedError
from tvist_protocol.info import Info

CONFIGURATIONS = 160
REPEATS = 3
DEGREES = (4, 3, 2)
"""Degree of the polynomials in one, two or three joints; the fewer joints, the more configurations for each term."""
ANCHOR_WEIGHT = 6.0
"""Weight of a pose the user names, against one of a configuration spread over the workspace [-]."""

ATTEMPTS = 3
"""Configurations tried for each that is wanted: some the arm cannot reach, some cannot be fitted."""

Progress = Callable[[], None]


class IdentificationError(ClientError):
    """The robot could not be identified; the sentence says what to do."""


@dataclass(frozen=True)
class MeasurementPlan:
    """What to measure."""

    configurations: int = CONFIGURATIONS
    """Usable configurations wanted, spread over the workspace."""
    anchors: tuple[tuple[float, ...], ...] = ()
    """Further ones that matter more, where the robot is going to work [rad]."""
    repeats: int = REPEATS
    """Jogs averaged at each."""
    degree: int | None = None
    """Degree of the polynomials; None: that of `DEGREES` for the arm's joints."""
    seed: int = 0
    """Seed of the spread of configurations."""
    jog: Jog = field(default_factory=Jog)


@dataclass(frozen=True)
class Identification:
    """A calibration and what it was checked against."""

    calibration: Calibration
    q: Floats
    """Configurations measured, shape (N, n) [rad]."""
    f_d: Floats
    """Measured, shape (N,) [Hz]."""
    zeta: Floats
    """Measured, shape (N,) [-]."""
    true_f_d: Floats | None
    """Lowest true mode at each, where the robot tells the truth, shape (N,) [Hz]."""
    true_zeta: Floats | None
    """[-]."""
    against: str
    """What the errors below are against: the truth, or measurements that a fit did not see."""
    error_f_d: Spread
    """Error of the calibration's f_d [%]."""
    error_zeta: Spread
    """Error of the calibration's ζ [%]."""
    anchors: int = 0
    """How many of the configurations, the first ones, were named."""

    def poses(self) -> list[dict[str, float]]:
        """Measured and estimated mode at each named pose."""
        estimator = estimator_of(self.calibration)
        rows = []
        for number in range(self.anchors):
            estimated_f_d, estimated_zeta = estimator.estimate(self.q[number])
            rows.append(
                {
                    "f_d_hz": float(self.f_d[number]),
                    "zeta": float(self.zeta[number]),
                    "estimated_f_d_hz": float(estimated_f_d[0]),
                    "estimated_zeta": float(estimated_zeta[0]),
                }
            )
        return rows


async def identify(
    robot: Robot,
    arm: Arm,
    plan: MeasurementPlan,
    *,
    name: str,
    command: str,
    progress: Progress,
) -> Identification:
    """Identify a robot as section 3.3 of the paper does, as a client.

    Args:
        robot: The robot, on a network or in process.
        arm: Control of it.
        plan: What to measure.
        name: Name of the calibration.
        command: What the user typed, for the calibration's provenance.
        progress: Told of each configuration done.

    Raises:
        FitError: There are too few configurations, or too few of them could be used.
        IdentificationError: No ring-down at all could be used.
    """
    info = await robot.info()
    joints = tuple(j for j in (1, 2, 3) if j < len(info.joints)) or (0,)
    degree = DEGREES[len(joints) - 1] if plan.degree is None else plan.degree
    check_count(plan.configurations + len(plan.anchors), joints, degree)
    await arm.set_shaper("none")
    anchors = [np.array(anchor, dtype=float) for anchor in plan.anchors]
    region = identified(info.limits.position, plan.jog.length)
    spread_out = list(region.spread(ATTEMPTS * plan.configurations, len(info.joints), plan.seed))
    kept: list[Floats] = []
    values: list[tuple[float, float]] = []
    truths: list[tuple[float, float] | None] = []
    weights: list[float] = []
    rejected = 0
    for number, q in enumerate(anchors + spread_out):
        if len(kept) == len(anchors) + plan.configurations:
            break
        ring = await _ring_down(robot, arm, q, plan)
        if ring is None:
            rejected += 1
            continue
        kept.append(q)
        values.append((ring.f_d, ring.zeta))
        truths.append(await _true_mode(robot))
        weights.append(ANCHOR_WEIGHT if number < len(anchors) else 1.0)
        progress()
    if not kept:
        raise IdentificationError(
            "no ring-down could be fitted: check that the arm moves and that its accelerometer works"
        )
    named = sum(weight > 1.0 for weight in weights)
    f_d, zeta = np.array(values).T
    configurations = np.array(kept)
    fit = fit_polynomials(configurations, f_d, zeta, np.array(weights), joints=joints, degree=degree)
    calibration = _calibration(info, plan, fit, f_d, zeta, rejected, name=name, command=command)
    if any(truth is None for truth in truths):
        return Identification(
            calibration, configurations, f_d, zeta, None, None,
            "measurements that a fit did not see", fit.cross_validated_f_d, fit.cross_validated_zeta, named,
        )  # fmt: skip
    true_f_d, true_zeta = np.array(truths, dtype=float).T
    return Identification(
        calibration, configurations, f_d, zeta, true_f_d, true_zeta,
        "the arm's true lowest mode, by fits that did not see the configuration",
        spread(fit.unseen_f_d, true_f_d), spread(fit.unseen_zeta, true_zeta), named,
    )  # fmt: skip


async def _ring_down(robot: Robot, arm: Arm, q: Floats, plan: MeasurementPlan) -> RingDown | None:
    """What rings at a configuration; None where it cannot be reached or fitted."""
    try:
        ring = await measure(robot, arm, q, plan.jog, plan.repeats)
    except RefusedError as error:
        if error.reply.code != "collision":
            raise
        return None
    return ring if ring.ok else None


async def _true_mode(robot: Robot) -> tuple[float, float] | None:
    """The lowest true mode, where the robot tells it: at rest for longer than it takes to be computed anew."""
    with collect(robot) as collected:
        await robot.advance(60)
    return (collected.truths[-1].f_d[0], collected.truths[-1].zeta[0]) if collected.truths else None


def _calibration(
    info: Info,
    plan: MeasurementPlan,
    fit: Fit,
    f_d: Floats,
    zeta: Floats,
    rejected: int,
    *,
    name: str,
    command: str,
) -> Calibration:
    return Calibration(
        name=name,
        robot=info.model,
        payload=info.payload,
        polynomial=fit.model,
        provenance=Provenance(
            command=command,
            version=version("tvist"),
            seed=plan.seed,
            configurations=len(f_d),
            ring_downs=len(f_d) * plan.repeats,
            rejected=rejected,
            measured_f_d_range=(float(f_d.min()), float(f_d.max())),
            measured_zeta_range=(float(zeta.min()), float(zeta.max())),
            residual_f_d_percent=fit.residual_f_d,
            residual_zeta_percent=fit.residual_zeta,
            cross_validated_f_d_percent=fit.cross_validated_f_d,
            cross_validated_zeta_percent=fit.cross_validated_zeta,
            arm=info.arm,
        ),
    )
