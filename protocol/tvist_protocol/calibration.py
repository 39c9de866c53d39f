"""What a robot was found to be: the content of a calibration file, and of `set_estimator`'s `calibration`."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta, Struct

from tvist_protocol.errors import ProtocolError
from tvist_protocol.explain import explain_refusal
from tvist_protocol.values import Angle, DampingRatio, Frequency, Name, Payload, Seed

Coefficient = Annotated[float, Meta(ge=-1e6, le=1e6)]
Coefficients = Annotated[tuple[Coefficient, ...], Meta(min_length=1, max_length=2000)]
Percent = Annotated[float, Meta(ge=0, le=1e4)]


class _Part(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Unknown keys are mistakes, and refused."""


class PolynomialModel(_Part, frozen=True, kw_only=True):
    """Two multivariate polynomials in the joint angles, f_d(q) and ζ(q), of the lowest mode."""

    joints: Annotated[tuple[Annotated[int, Meta(ge=0, le=6)], ...], Meta(min_length=1, max_length=7)]
    """Numbers of the joints they depend on, 0 the first."""
    basis: Literal["angles", "trigonometric"]
    """Monomials in the scaled angles, or trigonometric polynomials, which repeat with every turn."""
    degree: Annotated[int, Meta(ge=0, le=12)]
    """Highest total degree."""
    centre: Annotated[tuple[Angle, ...], Meta(min_length=1, max_length=7)] | None = None
    """Subtracted from the angles [rad]; null: zeros."""
    scale: (
        Annotated[tuple[Annotated[float, Meta(gt=0, le=1e3)], ...], Meta(min_length=1, max_length=7)] | None
    ) = None
    """Divides them [rad]; null: ones."""
    f_d_coefficients: Coefficients
    """One a term [Hz]."""
    zeta_coefficients: Coefficients
    """One a term [-]."""
    f_d_range: tuple[Frequency, Frequency]
    """Values are held within [Hz]."""
    zeta_range: tuple[DampingRatio, DampingRatio]
    """Values are held within [-]."""


class Spread(_Part, frozen=True, kw_only=True):
    """How far values lie from the model, by magnitude [%]."""

    median: Percent
    p90: Percent


class Provenance(_Part, frozen=True, kw_only=True):
    """How the calibration came about."""

    command: Annotated[str, Meta(max_length=500)]
    """The command that made it."""
    version: Annotated[str, Meta(max_length=50)]
    """Version of the package."""
    seed: Seed | None
    """Of the choice of configurations and of the simulated arm; null on a real one."""
    configurations: Annotated[int, Meta(ge=1, le=100_000)]
    """Configurations measured."""
    ring_downs: Annotated[int, Meta(ge=1, le=1_000_000)]
    """Ring-downs measured in all."""
    rejected: Annotated[int, Meta(ge=0, le=1_000_000)]
    """Further configurations that were tried: the arm could not reach them, or no ring-down could be fitted."""
    measured_f_d_range: tuple[Frequency, Frequency]
    """Span of damped frequencies measured over the workspace [Hz]."""
    measured_zeta_range: tuple[DampingRatio, DampingRatio]
    """Span of damping ratios measured [-]."""
    residual_f_d_percent: Spread
    """Of the fit."""
    residual_zeta_percent: Spread
    """Of the fit."""
    cross_validated_f_d_percent: Spread
    """Of configurations that a fit did not see."""
    cross_validated_zeta_percent: Spread
    """Of configurations that a fit did not see."""


class Calibration(_Part, frozen=True, kw_only=True):
    """A calibration: for which robot with which payload, the model, and where it comes from."""

    name: Name
    """What it is called in `info`."""
    robot: Annotated[str, Meta(max_length=64)]
    """Model of the arm."""
    payload: Payload
    """What the arm carried."""
    polynomial: PolynomialModel
    """The model."""
    provenance: Provenance
    """How it came about."""


class CalibrationError(ValueError):
    """A calibration is wrong: the message names the key, the value and what is allowed."""


def calibration_of(content: Mapping[str, Any]) -> Calibration:
    """Check a map, as `set_estimator` brings it.

    Raises:
        ProtocolError: A key is unknown, missing or out of range; `where` names it within `calibration`.
    """
    try:
        return msgspec.convert(content, Calibration)
    except msgspec.ValidationError as error:
        fault = explain_refusal(error, msgspec.msgpack.encode(content), {})
        where = f"calibration.{fault.where}".removesuffix(".")
        whole, why = "the message", fault.why
        why = f"calibration{why.removeprefix(whole)}" if why.startswith(whole) else f"calibration.{why}"
        raise ProtocolError(fault.code, where, why, fault.limit) from error


def calibration_from_json(text: bytes) -> Calibration:
    """Check a file's content.

    Raises:
        CalibrationError: It is no JSON, or a key is unknown, missing or out of range.
    """
    try:
        return msgspec.json.decode(text, type=Calibration)
    except msgspec.MsgspecError as error:
        raise CalibrationError(str(error)) from error


def calibration_to_json(calibration: Calibration) -> bytes:
    """A file's content, indented, ending in a line feed."""
    return msgspec.json.format(msgspec.json.encode(calibration), indent=2) + b"\n"
