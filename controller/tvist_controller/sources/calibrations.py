"""Calibrations that come with the package, and estimators built from calibrations."""

from functools import cache
from importlib import resources
from pathlib import Path

from tvist_plant.user_file import UserFileError, read_bytes
from tvist_protocol.calibration import Calibration, CalibrationError, calibration_from_json
from tvist_protocol.values import Payload
from tvist_shaping.errors import EstimatorError
from tvist_shaping.estimators.polynomial import Polynomial

_FILES = resources.files(__package__)


def available() -> tuple[str, ...]:
    """Return the names of the calibrations that come with the package."""
    return tuple(
        sorted(file.name.removesuffix(".json") for file in _FILES.iterdir() if file.name.endswith(".json"))
    )


@cache
def default_for(model: str) -> str | None:
    """Name of the calibration that a robot uses unless another one is named; None if there is none.

    It is the first, by name, of those that come with the package, are for this model and have the paper's polynomials;
    if none has them, the first for this model.
    """
    own = [name for name in available() if load(name).robot == model]
    return next((name for name in own if load(name).polynomial is not None), own[0] if own else None)


def load(calibration: str | Path) -> Calibration:
    """Read and check a calibration.

    Args:
        calibration: Name of a calibration that comes with the package, or path of a file.

    Raises:
        CalibrationError: The calibration does not exist or is invalid; the message names the file and the key.
        UserFileError: The file is not text, too large or nested too deeply.
    """
    try:
        if isinstance(calibration, str) and calibration in available():
            content = (_FILES / f"{calibration}.json").read_bytes()
        else:
            content = read_bytes(calibration, "calibration")
        return calibration_from_json(content)
    except RecursionError:
        raise UserFileError(f"calibration {calibration} is nested too deeply") from None
    except OSError as error:
        known = ", ".join(available())
        raise CalibrationError(
            f"calibration {str(calibration)!r}: must be one of {known} or a readable file ({error.strerror})"
        ) from error
    except CalibrationError as error:
        raise CalibrationError(f"calibration {calibration}: {error}") from error


def estimator_of(calibration: Calibration) -> Polynomial:
    """Return the paper's estimator with a calibration's polynomials."""
    if calibration.polynomial is None:
        raise EstimatorError("polynomial", None, "there; this calibration is for the estimator modal alone")
    model = calibration.polynomial
    return Polynomial(
        joints=model.joints,
        degree=model.degree,
        centre=model.centre,
        f_d_coefficients=model.f_d_coefficients,
        zeta_coefficients=model.zeta_coefficients,
        f_d_range=model.f_d_range,
        zeta_range=model.zeta_range,
    )


def fits(calibration: Calibration, payload: Payload, estimator: str = "polynomial") -> bool:
    """Return whether a calibration is valid for a payload.

    A modal model is valid for any payload. Polynomials are valid for the payload they were made with, to within 2 %
    of its mass and 10 mm of its centre.
    """
    if estimator == "modal" or calibration.polynomial is None:
        return True
    made_with = calibration.payload
    if abs(payload.mass - made_with.mass) > 0.02 * max(made_with.mass, 1.0):
        return False
    if made_with.mass == 0.0:
        return True
    return max(abs(a - b) for a, b in zip(payload.com, made_with.com, strict=True)) <= 0.01
