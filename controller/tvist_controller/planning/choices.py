"""Choose shapers and estimators by the names that clients send."""

from tvist_controller.refusal import RefusalError
from tvist_controller.setup import Setup
from tvist_controller.sources.calibrations import available, load
from tvist_controller.sources.mode_source import ModeSource, modal_source
from tvist_protocol.calibration import Calibration, calibration_of
from tvist_protocol.commands import SetEstimator
from tvist_protocol.errors import ProtocolError
from tvist_protocol.values import Payload
from tvist_shaping.base import Filter
from tvist_shaping.errors import DesignError, EstimatorError, ShapingError, UnknownShaperError
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.named import BUILT_IN, Registry

ESTIMATORS = ("fixed", "polynomial", "modal")


def wanted_modes(name: str, modes: int, where: str, known: Registry = BUILT_IN) -> int:
    """Return the number of modes that a filter needs, of `modes` to suppress; its name comes from the field `where`.

    Raises:
        RefusalError: There is no such filter, or it has a fixed number of modes.
    """
    try:
        own = known.modes_of(name, modes)
    except UnknownShaperError as error:
        raise RefusalError("unknown_shaper", where, str(error)) from error
    except DesignError as error:
        raise RefusalError("out_of_range", where, str(error)) from error
    if modes not in {1, own}:
        why = f"modes is {modes}; the filter {name} always has {own}"
        raise RefusalError("out_of_range", "modes", why, own)
    return own


def make_estimator(source: ModeSource, modes: int, payload: Payload, where: str) -> Estimator:
    """Make the chosen estimator for a number of modes.

    Raises:
        RefusalError: The source provides fewer modes.
    """
    try:
        return source.estimator(modes, payload)
    except EstimatorError as error:
        raise RefusalError("out_of_range", where, str(error), source.most) from error


def choose_filter(
    name: str, estimator: Estimator, joints: int, *, where: str = "shaper", known: Registry = BUILT_IN
) -> Filter:
    """Make a filter by its name, which comes from the field `where`.

    Raises:
        RefusalError: There is no such shaper, or it does not work with the estimator.
    """
    try:
        return known.make_filter(name, estimator, joints=joints)
    except UnknownShaperError as error:
        raise RefusalError("unknown_shaper", where, str(error)) from error
    except ShapingError as error:
        raise RefusalError("out_of_range", where, str(error)) from error


def choose_source(command: SetEstimator, setup: Setup) -> ModeSource:
    """Return the source of modes for the estimator that a command asks for.

    Raises:
        RefusalError: There is no estimator of that name, or its parameters are invalid.
    """
    if command.name == "fixed":
        return _fixed(command, setup)
    if command.name not in ESTIMATORS:
        known = ", ".join(ESTIMATORS)
        raise RefusalError("unknown_estimator", "name", f"name is {command.name!r}: this server has {known}")
    for field in ("f_d", "zeta"):
        if getattr(command, field) is not None:
            why = f"{field} belongs to the estimator fixed, not to {command.name}"
            raise RefusalError("out_of_range", field, why)
    calibration = _calibration(command, setup)
    if calibration.robot != setup.description.robot.model:
        why = f"calibration.robot is {calibration.robot!r}; this arm is a {setup.description.robot.model}"
        raise RefusalError("out_of_range", "calibration.robot", why)
    source = ModeSource("modal" if command.name == "modal" else "polynomial", setup.description, calibration)
    try:
        source.estimator(1, setup.payload)
    except ShapingError as error:
        raise RefusalError("out_of_range", "calibration", f"calibration: {error}") from error
    return source


def _fixed(command: SetEstimator, setup: Setup) -> ModeSource:
    for field in ("f_d", "zeta"):
        if getattr(command, field) is None:
            why = f"{field} is missing: the estimator fixed needs f_d and zeta"
            raise RefusalError("missing_field", field, why)
    if command.calibration is not None:
        why = "calibration belongs to the estimators polynomial and modal, not to fixed"
        raise RefusalError("out_of_range", "calibration", why)
    f_d, zeta = command.f_d or (), command.zeta or ()
    try:
        Fixed(f_d, zeta)
    except ShapingError as error:
        raise RefusalError("out_of_range", "zeta", str(error)) from error
    return ModeSource("fixed", setup.description, f_d=f_d, zeta=zeta)


def _calibration(command: SetEstimator, setup: Setup) -> Calibration:
    if isinstance(command.calibration, dict):
        try:
            return calibration_of(command.calibration)
        except ProtocolError as error:
            raise RefusalError(error.code, error.where, error.why, error.limit) from error
    own = setup.calibration
    if command.calibration is None and command.name == "modal":
        found = modal_source(setup.description, own)
        if found is not None and found.calibration is not None:
            return found.calibration
    if command.calibration is None or (own is not None and own.name == command.calibration):
        if own is None:
            why = "calibration is missing: this server was started without one"
            raise RefusalError("missing_field", "calibration", why)
        return own
    if command.calibration not in available():
        known = ", ".join(available())
        why = f"calibration is {command.calibration!r}: must be one of {known}"
        raise RefusalError("unknown_calibration", "calibration", why)
    return load(command.calibration)
