"""Identification of a calibration from ring-downs across the workspace."""

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version

import numpy as np

from tvist_client.arm import Arm
from tvist_client.errors import ClientError
from tvist_client.robot import Robot
from tvist_controller.api.line import estimator_of
from tvist_lab.collect import collect
from tvist_lab.identification.fit import Fit, check_count, fit_polynomials, spread
from tvist_lab.identification.ring_downs import Jog, measure, or_none
from tvist_lab.recordings import Floats
from tvist_lab.workspace import identified
from tvist_protocol.calibration import Calibration, Provenance, Spread
from tvist_protocol.info import Info

CONFIGURATIONS = 160
REPEATS = 3
DEGREES = (4, 3, 2)
"""Degree of the polynomials in one, two or three joints; the fewer joints, the more configurations for each term."""
ANCHOR_WEIGHT = 6.0
"""Weight of a pose that the user names, relative to a configuration spread over the workspace [-]."""

ATTEMPTS = 3
"""Number of configurations tried for each one required, since some cannot be reached and some not be fitted."""

Progress = Callable[[], None]


class IdentificationError(ClientError):
    """The robot could not be identified; the message says what to do."""


@dataclass(frozen=True)
class MeasurementPlan:
    """Measurements to make."""

    configurations: int = CONFIGURATIONS
    """Required number of usable configurations, spread over the workspace."""
    anchors: tuple[tuple[float, ...], ...] = ()
    """Additional, more important configurations, in which the robot is going to work [rad]."""
    repeats: int = REPEATS
    """Number of jogs averaged at each configuration."""
    degree: int | None = None
    """Degree of the polynomials; None: that of `DEGREES` for the number of joints."""
    seed: int = 0
    """Seed of the spread of configurations."""
    jog: Jog = field(default_factory=Jog)


@dataclass(frozen=True)
class Identification:
    """A calibration and the data it was checked with."""

    calibration: Calibration
    q: Floats
    """Measured configurations, shape (N, n) [rad]."""
    f_d: Floats
    """Measured damped frequencies, shape (N,) [Hz]."""
    zeta: Floats
    """Measured damping ratios, shape (N,) [-]."""
    true_f_d: Floats | None
    """Damped frequency of the lowest true mode at each configuration, if the robot publishes the truth, shape (N,)
    [Hz].
    """
    true_zeta: Floats | None
    """Damping ratio of the lowest true mode, shape (N,) [-]."""
    against: str
    """Reference of the errors below: the truth, or measurements that a fit did not include."""
    error_f_d: Spread
    """Error of the calibration's f_d [%]."""
    error_zeta: Spread
    """Error of the calibration's ζ [%]."""
    anchors: int = 0
    """Number of named configurations, which come first."""

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
    """Identify a robot as in section 3.3 of the paper, as a client.

    Args:
        robot: The robot, on a network or in process.
        arm: Control of the robot.
        plan: What to measure.
        name: Name of the calibration.
        command: Command line that the user typed, for the calibration's provenance.
        progress: Called after each configuration.

    Raises:
        FitError: There are too few configurations, or too few of them were usable.
        IdentificationError: No ring-down was usable.
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
        ring = await or_none(measure(robot, arm, q, plan.jog, plan.repeats))
        if ring is None or not ring.ok:
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


async def _true_mode(robot: Robot) -> tuple[float, float] | None:
    """Return the lowest true mode, if the robot publishes it; wait at rest until it has been updated."""
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
