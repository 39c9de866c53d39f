"""Source of a filter's modes: creates an estimator for any payload and number of modes."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from tvist_controller.sources.calibrations import available, estimator_of, load, modal_estimator
from tvist_plant.description import RobotDescription, fingerprint
from tvist_protocol.calibration import Calibration
from tvist_protocol.values import Payload
from tvist_shaping.errors import EstimatorError
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.estimators.fixed import Fixed

SourceName = Literal["fixed", "polynomial", "modal"]


@dataclass(frozen=True)
class ModeSource:
    """A chosen estimator with its parameters."""

    name: SourceName
    """Name in messages."""
    description: RobotDescription
    """The robot."""
    calibration: Calibration | None = None
    """Calibration of `polynomial` and `modal`."""
    f_d: Sequence[float] = ()
    """Damped frequencies of `fixed` [Hz]."""
    zeta: Sequence[float] = ()
    """Damping ratios of `fixed` [-]."""

    @property
    def knows_payload(self) -> bool:
        """Whether the modes depend on the payload."""
        return self.name == "modal"

    @cached_property
    def fits_arm(self) -> bool | None:
        """Whether the calibration was measured on the robot file's arm; None if unknown."""
        measured = None if self.calibration is None else self.calibration.provenance.arm
        return None if measured is None else measured == fingerprint(self.description)

    @property
    def most(self) -> int:
        """Largest number of modes."""
        if self.name == "modal":
            return self.description.joints + 2 * len(self.description.link_flexibility.links)
        return len(self.f_d) if self.name == "fixed" else 1

    def estimator(self, modes: int, payload: Payload) -> Estimator:
        """Return an estimator of the lowest modes with a payload."""
        if modes > self.most:
            raise EstimatorError("modes", modes, f"at most {self.most}, which the estimator {self.name} has")
        if self.calibration is None:
            return Fixed(self.f_d[:modes], self.zeta[:modes])
        if self.name == "polynomial":
            return estimator_of(self.calibration)
        return modal_estimator(self.calibration, self.description, payload, modes)


def first_source(description: RobotDescription, calibration: Calibration | None) -> ModeSource:
    """Return a robot's initial source of modes; without calibration (before identification), fixed modes."""
    if calibration is None:
        return ModeSource("fixed", description, f_d=(10.0,), zeta=(0.2,))
    name: SourceName = "modal" if calibration.polynomial is None else "polynomial"
    return ModeSource(name, description, calibration)


def modal_source(description: RobotDescription, calibration: Calibration | None) -> ModeSource | None:
    """Return a robot's source `modal`, from its calibration or one of the package; None without either."""
    if calibration is None:
        return None
    for one in (calibration, *map(load, available())):
        if one.modal is not None and one.robot == description.robot.model:
            return ModeSource("modal", description, one)
    return None
