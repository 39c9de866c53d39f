"""What a robot was found to be: the content of a calibration file, and of `set_estimator`'s `calibration`."""

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


Quantity = Literal[
    "gear_stiffness", "velocity_gain", "position_gain", "rotor_inertia", "damping_time", "bending_stiffness"
]
"""K_g [N m/rad], K_d [N m s/rad], K_p [1/s], B [kg m²] of a joint and damping over stiffness of its gear [s];
stiffness of a link that bends [N m/rad]."""
Status = Literal["identified", "not identifiable", "assumed"]
"""Whether measurements narrowed a parameter down, left it where it was guessed, or were not asked."""
Parameter = Annotated[float, Meta(gt=0, le=1e9)]


class ModalParameter(_Part, frozen=True, kw_only=True):
    """A parameter of the arm's linear model, the same for every joint or link it names."""

    quantity: Quantity
    """What it is."""
    joints: Annotated[tuple[Annotated[int, Meta(ge=0, le=6)], ...], Meta(min_length=1, max_length=7)]
    """Numbers of the joints, 0 the first; of the links for `bending_stiffness`."""
    value: Parameter
    """In SI units."""
    deviation: Annotated[float, Meta(ge=0, le=10)]
    """Standard deviation of its logarithm, about that of its relative error; 0: assumed [-]."""
    interval: tuple[Parameter, Parameter]
    """Where it lies with 95 %, if the model holds."""
    status: Status
    """How it came about."""


class RingDownFit(_Part, frozen=True, kw_only=True):
    """One ring-down that parameters were fitted to."""

    q: Annotated[tuple[Angle, ...], Meta(min_length=1, max_length=7)]
    """Where the arm rang [rad]."""
    payload: Annotated[int, Meta(ge=0, le=99)]
    """Which of the payloads it carried, 0 the first."""
    rms: Annotated[float, Meta(ge=0, le=1e4)]
    """Of its acceleration, an axis [m/s²]."""
    residual_to_noise: Annotated[float, Meta(ge=0, le=1e4)]
    """rms of what the model leaves of it, over that of the noise [-]."""


class ModalModel(_Part, frozen=True, kw_only=True):
    """Stiffnesses and drive gains that make modes out of the arm's mass matrix with any payload."""

    parameters: Annotated[tuple[ModalParameter, ...], Meta(min_length=1, max_length=50)]
    """Each quantity once for every joint, and `bending_stiffness` for every link that bends, whose damping over
    stiffness is that of the joint before it."""
    f_d_min: Frequency
    """Lowest damped frequency over the workspace, up to the rated payload [Hz]."""
    zeta_max: DampingRatio
    """Highest damping ratio there [-]."""
    payloads: Annotated[tuple[Payload, ...], Meta(min_length=1, max_length=100)]
    """What the arm carried."""
    ring_downs: Annotated[tuple[RingDownFit, ...], Meta(min_length=1, max_length=10_000)]
    """What was fitted."""
    noise: Annotated[float, Meta(gt=0, le=1e3)]
    """rms of the accelerometer at rest, an axis [m/s²]."""
    residual_to_noise: Annotated[float, Meta(ge=0, le=1e4)]
    """rms of what the model leaves of all ring-downs, over that of the noise: 1 is a perfect fit [-]."""
    cross_validated_f_d_percent: Annotated[tuple[Spread | None, ...], Meta(min_length=1, max_length=8)]
    """One a mode, the lowest first: fits that did not see a configuration, against poles fitted to its ring-downs
    alone; null where too few of these were certain."""
    cross_validated_zeta_percent: Annotated[tuple[Spread | None, ...], Meta(min_length=1, max_length=8)]
    """Likewise."""


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
    """Span of the lowest mode's damped frequency where it was measured [Hz]."""
    measured_zeta_range: tuple[DampingRatio, DampingRatio]
    """Span of its damping ratio there [-]."""
    residual_f_d_percent: Spread | None = None
    """Of the fit of polynomials."""
    residual_zeta_percent: Spread | None = None
    """Of the fit of polynomials."""
    cross_validated_f_d_percent: Spread | None = None
    """Of configurations that a fit of polynomials did not see."""
    cross_validated_zeta_percent: Spread | None = None
    """Of configurations that a fit of polynomials did not see."""
    arm: Annotated[str, Meta(max_length=64)] | None = None
    """Fingerprint of the arm it was measured on, as `info` has it; null: unknown."""


class Calibration(_Part, frozen=True, kw_only=True):
    """A calibration: for which robot with which payload, the models, and where they come from.

    Raises:
        ValueError: It holds no model.
    """

    name: Name
    """What it is called in `info`."""
    robot: Annotated[str, Meta(max_length=64)]
    """Model of the arm."""
    payload: Payload
    """What the arm carried: polynomials hold for that alone. The heaviest, where there were several."""
    polynomial: PolynomialModel | None = None
    """The lowest mode with that payload, for the estimator `polynomial`."""
    modal: ModalModel | None = None
    """Any mode with any payload, for the estimator `modal`."""
    provenance: Provenance
    """How it came about."""

    def __post_init__(self) -> None:
        if self.polynomial is None and self.modal is None:
            raise ValueError("neither polynomial nor modal is there")


class CalibrationError(ValueError):
    """A calibration is wrong: the message names the key, the value and what is allowed."""


def calibration_of(content: Mapping[str, Any]) -> Calibration:
    """Check a map, as `set_estimator` brings it.

    Raises:
        ProtocolError: A key is unknown, missing or out of range; `where` names it within `calibration`.
    """
    try:
        return checked(content, Calibration)
    except ProtocolError as fault:
        where = f"calibration.{fault.where}".removesuffix(".")
        whole, why = "the content", fault.why
        why = f"calibration{why.removeprefix(whole)}" if why.startswith(whole) else f"calibration.{why}"
        raise ProtocolError(fault.code, where, why, fault.limit) from fault


def calibration_from_json(text: bytes) -> Calibration:
    """Check a file's content.

    Raises:
        CalibrationError: It is no JSON, or a key is unknown, missing or out of range.
    """
    try:
        return checked(parse_json(text), Calibration)
    except ProtocolError as error:
        raise CalibrationError(error.why) from error


def calibration_to_json(calibration: Calibration) -> bytes:
    """A file's content, indented, ending in a line feed."""
    return msgspec.json.format(msgspec.json.encode(calibration), indent=2) + b"\n"
