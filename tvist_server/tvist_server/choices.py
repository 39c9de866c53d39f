"""Shapers and estimators as clients name them."""

from tvist_protocol.calibration import Calibration, calibration_of
from tvist_protocol.commands import SetEstimator
from tvist_protocol.errors import ProtocolError
from tvist_server.calibrations import available, estimator_of, load
from tvist_server.refusal import RefusalError
from tvist_server.setup import Setup
from tvist_shaping.catalogue import SHAPERS, shaper
from tvist_shaping.errors import ShapingError, UnknownShaperError
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.filter import TvistFilter

ESTIMATORS = ("fixed", "polynomial")


def shapers() -> list[str]:
    """Names of the shapers."""
    return list(SHAPERS)


def choose_filter(name: str, estimator: Estimator, joints: int, *, where: str = "shaper") -> TvistFilter:
    """A filter with a shaper.

    Raises:
        RefusalError: There is no such shaper, or it does not go with the estimator.
    """
    try:
        return TvistFilter(shaper(name), estimator, joints=joints)
    except UnknownShaperError as error:
        raise RefusalError("unknown_shaper", where, str(error)) from error
    except ShapingError as error:
        raise RefusalError("out_of_range", where, str(error)) from error


def choose_estimator(command: SetEstimator, setup: Setup) -> tuple[Estimator, Calibration | None]:
    """The estimator that a command asks for, and its calibration where it has one.

    Raises:
        RefusalError: There is none of that name, or its parameters are wrong.
    """
    if command.name == "fixed":
        return _fixed(command), None
    if command.name != "polynomial":
        known = ", ".join(ESTIMATORS)
        raise RefusalError("unknown_estimator", "name", f"name is {command.name!r}: this server has {known}")
    for field in ("f_d", "zeta"):
        if getattr(command, field) is not None:
            why = f"{field} belongs to the estimator fixed, not to polynomial"
            raise RefusalError("out_of_range", field, why)
    calibration = _calibration(command, setup)
    if calibration.robot != setup.description.robot.model:
        why = f"calibration.robot is {calibration.robot!r}; this arm is a {setup.description.robot.model}"
        raise RefusalError("out_of_range", "calibration.robot", why)
    try:
        return estimator_of(calibration), calibration
    except ShapingError as error:
        raise RefusalError("out_of_range", "calibration", f"calibration: {error}") from error


def _fixed(command: SetEstimator) -> Fixed:
    for field in ("f_d", "zeta"):
        if getattr(command, field) is None:
            why = f"{field} is missing: the estimator fixed needs f_d and zeta"
            raise RefusalError("missing_field", field, why)
    if command.calibration is not None:
        why = "calibration belongs to the estimator polynomial, not to fixed"
        raise RefusalError("out_of_range", "calibration", why)
    f_d, zeta = command.f_d or (), command.zeta or ()
    if len(f_d) != 1:
        raise RefusalError("out_of_range", "f_d", f"f_d has {len(f_d)} modes; this version shapes 1", 1)
    try:
        return Fixed(f_d, zeta)
    except ShapingError as error:
        raise RefusalError("out_of_range", "zeta", str(error)) from error


def _calibration(command: SetEstimator, setup: Setup) -> Calibration:
    if isinstance(command.calibration, dict):
        try:
            return calibration_of(command.calibration)
        except ProtocolError as error:
            raise RefusalError(error.code, error.where, error.why, error.limit) from error
    own = setup.calibration
    if command.calibration is None or (own is not None and own.name == command.calibration):
        if own is None:
            why = "calibration is missing: this server was started without"
            raise RefusalError("missing_field", "calibration", why)
        return own
    if command.calibration not in available():
        known = ", ".join(available())
        why = f"calibration is {command.calibration!r}: there is {known}"
        raise RefusalError("unknown_calibration", "calibration", why)
    return load(command.calibration)
