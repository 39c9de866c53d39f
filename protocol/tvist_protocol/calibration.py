"""The result of an identification: content of a calibration file and of `set_estimator`'s `calibration`."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta, Struct

from tvist_protocol.content import checked, parse_json
from tvist_protocol.errors import ProtocolError
from tvist_protocol.values import Angle, DampingRatio, Frequency, Name, Payload, Seed

Coefficient = Annotated[float, Meta(ge=-1e6, le=1e6)]
Coefficients = Annotated[tuple[Coefficient, ...], Meta(min_length=1, max_length=2000)]
Percent = Annotated[float, Meta(ge=0, le=1e4)]


class _Part(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of all parts of a calibration, which refuses unknown keys."""


class PolynomialModel(_Part, frozen=True, kw_only=True):
    """Two multivariate polynomials in the joint angles, f_d(q) and ζ(q), of the lowest mode."""

    joints: Annotated[tuple[Annotated[int, Meta(ge=0, le=6)], ...], Meta(min_length=1, max_length=7)]
    """Indices of the joints that the frequency and damping depend on, 0 for the first."""
    basis: Literal["trigonometric"] = "trigonometric"
    """Trigonometric polynomials, which repeat with every turn."""
    degree: Annotated[int, Meta(ge=0, le=12)]  # highest total degree
    centre: Annotated[tuple[Angle, ...], Meta(min_length=1, max_length=7)] | None = None
    """Angles that are subtracted from the joint angles [rad]; null: zeros."""
    scale: None = None  # always null, no scaling; kept because recordings have it
    f_d_coefficients: Coefficients  # coefficients of f_d, one per term [Hz]
    zeta_coefficients: Coefficients  # coefficients of ζ, one per term [-]
    f_d_range: tuple[Frequency, Frequency]  # range to which values of f_d are clipped [Hz]
    zeta_range: tuple[DampingRatio, DampingRatio]  # range to which values of ζ are clipped [-]


class Spread(_Part, frozen=True, kw_only=True):
    """Absolute deviations of values from the model [%]."""

    median: Percent
    p90: Percent


Quantity = Literal[
    "gear_stiffness", "velocity_gain", "position_gain", "rotor_inertia", "damping_time", "bending_stiffness",
    "coulomb_friction", "breakaway", "stribeck_speed", "friction_width", "viscous_friction",
]  # fmt: skip
"""Units: `gear_stiffness` K_g [N m/rad], `velocity_gain` K_d [N m s/rad], `position_gain` K_p [1/s],
`rotor_inertia` B [kg m²], `damping_time` of a gear, damping over stiffness [s], `bending_stiffness` of a link
[N m/rad]; and a joint's friction [F_c + (F_s - F_c) exp(-(v/v_s)²)] tanh(v/w) + F_v v, with F_c [N m],
`breakaway` F_s/F_c [-], v_s [rad/s], w [rad/s], F_v [N m s/rad]."""
Status = Literal["identified", "not identifiable", "assumed"]
"""Whether the measurements determined a parameter, left it at its initial guess, or were not used for it."""
Parameter = Annotated[float, Meta(gt=0, le=1e9)]


class ModalParameter(_Part, frozen=True, kw_only=True):
    """A parameter of the arm's linear model, with the same value for every joint or link listed."""

    quantity: Quantity  # physical quantity
    joints: Annotated[tuple[Annotated[int, Meta(ge=0, le=6)], ...], Meta(min_length=1, max_length=7)]
    """Indices of the joints, or of the links for `bending_stiffness`, 0 for the first."""
    value: Parameter  # value in SI units
    deviation: Annotated[float, Meta(ge=0, le=10)]
    """Standard deviation of its logarithm, approximately its relative standard deviation; 0 if assumed [-]."""
    interval: tuple[Parameter, Parameter]  # 95 % confidence interval, assuming that the model is right
    status: Status  # origin of the value


class RingDownFit(_Part, frozen=True, kw_only=True):
    """One ring-down that the parameters were fitted to."""

    q: Annotated[tuple[Angle, ...], Meta(min_length=1, max_length=7)]  # configuration of the arm [rad]
    payload: Annotated[int, Meta(ge=0, le=99)]  # index of the payload that the arm carried, 0 for the first
    rms: Annotated[float, Meta(ge=0, le=1e4)]  # rms of the acceleration per axis [m/s²]
    residual_to_noise: Annotated[float, Meta(ge=0, le=1e4)]
    """rms of the residual of the fit, relative to that of the noise [-]."""


class ModalModel(_Part, frozen=True, kw_only=True):
    """Stiffnesses and drive gains, which give the modes together with the arm's mass matrix for any payload."""

    parameters: Annotated[tuple[ModalParameter, ...], Meta(min_length=1, max_length=100)]
    """Each quantity once for every joint, and `bending_stiffness` for every flexible link, whose damping over
    stiffness is that of the joint before it. The five quantities of friction may be missing: then friction is
    unknown."""
    f_d_min: Frequency  # lowest damped frequency over the workspace, up to the rated payload [Hz]
    zeta_max: DampingRatio  # highest damping ratio over the workspace, up to the rated payload [-]
    payloads: Annotated[tuple[Payload, ...], Meta(min_length=1, max_length=100)]
    """Payloads that the arm carried."""
    ring_downs: Annotated[tuple[RingDownFit, ...], Meta(min_length=1, max_length=10_000)]
    """Ring-downs that were fitted."""
    noise: Annotated[float, Meta(gt=0, le=1e3)]  # rms of the accelerometer at rest, per axis [m/s²]
    residual_to_noise: Annotated[float, Meta(ge=0, le=1e4)]
    """rms of the residual of all ring-downs, relative to that of the noise: 1 is a perfect fit [-]."""
    cross_validated_f_d_percent: Annotated[tuple[Spread | None, ...], Meta(min_length=1, max_length=8)]
    """Deviation of each mode's frequency, the lowest mode first: fits without a configuration are compared
    with poles fitted only to that configuration's ring-downs; null if too few of these poles were certain."""
    cross_validated_zeta_percent: Annotated[tuple[Spread | None, ...], Meta(min_length=1, max_length=8)]
    """Deviation of each mode's damping ratio, computed in the same way."""


class Provenance(_Part, frozen=True, kw_only=True):
    """How a calibration was made: command, version, and the measurements that were kept and rejected."""

    command: Annotated[str, Meta(max_length=500)]  # command that made it
    version: Annotated[str, Meta(max_length=50)]  # version of the package
    seed: Seed | None  # seed of the choice of configurations and of the simulated arm; null for a real arm
    configurations: Annotated[int, Meta(ge=1, le=100_000)]  # number of configurations measured
    ring_downs: Annotated[int, Meta(ge=1, le=1_000_000)]  # total number of ring-downs measured
    rejected: Annotated[int, Meta(ge=0, le=1_000_000)]
    """Number of rejected configurations: the arm could not reach them, or no ring-down could be fitted."""
    measured_f_d_range: tuple[Frequency, Frequency]
    """Range of the measured damped frequency of the lowest mode [Hz]."""
    measured_zeta_range: tuple[DampingRatio, DampingRatio]
    """Range of the measured damping ratio of the lowest mode [-]."""
    residual_f_d_percent: Spread | None = None
    """Deviation of the polynomial for f_d from the measurements it was fitted to."""
    residual_zeta_percent: Spread | None = None
    """Deviation of the polynomial for ζ from the measurements it was fitted to."""
    cross_validated_f_d_percent: Spread | None = None
    """Deviation of the polynomial for f_d at configurations left out of the fit."""
    cross_validated_zeta_percent: Spread | None = None
    """Deviation of the polynomial for ζ at configurations left out of the fit."""
    arm: Annotated[str, Meta(max_length=64)] | None = None
    """Fingerprint of the arm it was measured on, as `info` has it; null: unknown."""


class Calibration(_Part, frozen=True, kw_only=True):
    """A calibration: robot, payload, models and origin; ValueError if it has no model, or half of a servo's lag."""

    name: Name  # name in `info`
    robot: Annotated[str, Meta(max_length=64)]  # model of the arm
    payload: Payload
    """Payload that the arm carried, the heaviest if there were several. The polynomials hold only for this payload."""
    polynomial: PolynomialModel | None = None
    """The lowest mode with that payload, for the estimator `polynomial`."""
    modal: ModalModel | None = None  # any mode with any payload, for the estimator `modal`
    servo_lag_s: Annotated[float, Meta(gt=0, le=1)] | None = None
    """Lag T of angles q behind set-points p, in a robot with q̈ = k (p - q - T q̇) [s]; null: unknown."""
    servo_gain: Annotated[float, Meta(gt=0, le=1e6)] | None = None
    """k of the same equation [1/s²]; null: unknown."""
    provenance: Provenance  # origin of the calibration

    def __post_init__(self) -> None:
        if self.polynomial is None and self.modal is None:
            raise ValueError("polynomial and modal are both missing: give at least one")
        if (self.servo_lag_s is None) != (self.servo_gain is None):
            raise ValueError("servo_lag_s and servo_gain belong together: give both or none")


class CalibrationError(ValueError):
    """A calibration is wrong: the message names the key, the value and what is allowed."""


def calibration_of(content: Mapping[str, Any]) -> Calibration:
    """Return the calibration in a map; ProtocolError, with `where` within `calibration`, if it is invalid."""
    try:
        return checked(content, Calibration)
    except ProtocolError as fault:
        where = f"calibration.{fault.where}".removesuffix(".")
        whole, why = "the content", fault.why
        why = f"calibration{why.removeprefix(whole)}" if why.startswith(whole) else f"calibration.{why}"
        raise ProtocolError(fault.code, where, why, fault.limit) from fault


def calibration_from_json(text: bytes) -> Calibration:
    """Return the calibration in the content of a file; CalibrationError if it is invalid."""
    try:
        return checked(parse_json(text), Calibration)
    except ProtocolError as error:
        raise CalibrationError(error.why) from error


def calibration_to_json(calibration: Calibration) -> bytes:
    """Return the content of a calibration file: indented JSON with a line feed at its end."""
    return msgspec.json.format(msgspec.json.encode(calibration), indent=2) + b"\n"
