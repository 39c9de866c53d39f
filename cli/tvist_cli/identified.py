"""Print the results of `tvist identify` as tables or as JSON."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tvist_cli.output import out, print_json, table

if TYPE_CHECKING:
    from tvist_lab.identification.from_logs import FromLogs
    from tvist_lab.identification.identify import Identification
    from tvist_lab.identification.modal import ModalIdentification
    from tvist_lab.identification.payload import PayloadFound
    from tvist_lab.identification.proposals import Proposal
    from tvist_lab.recordings import Floats
    from tvist_protocol.calibration import ModalParameter, Spread

UNSEEN = "ring-downs at poses that were left out of the fit"
QUANTITIES = {
    "gear_stiffness": ("gear stiffness", "N m/rad"),
    "velocity_gain": ("velocity gain", "N m s/rad"),
    "position_gain": ("position gain", "1/s"),
    "rotor_inertia": ("rotor inertia", "kg m²"),
    "damping_time": ("damping over stiffness", "s"),
    "bending_stiffness": ("bending stiffness", "N m/rad"),
}
FRICTION = {
    "coulomb_friction": "Coulomb N m",
    "breakaway": "breakaway over it",
    "stribeck_speed": "declines over mrad/s",
    "friction_width": "changes sign over mrad/s",
    "viscous_friction": "viscous N m s/rad",
}


def report_polynomial(done: "Identification", output: Path, options: str, *, json: bool) -> None:
    """Print the deviations of a polynomial calibration, and how to serve with it.

    Args:
        done: The identification.
        output: File of the calibration.
        options: Options of `tvist serve` for the robot that was identified.
        json: Whether to print one JSON object.
    """
    how = done.calibration.provenance
    if json:
        print_json(
            {
                "file": str(output),
                "configurations": how.configurations,
                "ring_downs": how.ring_downs,
                "rejected": how.rejected,
                "f_d_range_hz": how.measured_f_d_range,
                "zeta_range": how.measured_zeta_range,
                "error_f_d_percent": done.error_f_d.median,
                "error_zeta_percent": done.error_zeta.median,
                "error_f_d_p90_percent": done.error_f_d.p90,
                "error_zeta_p90_percent": done.error_zeta.p90,
                "against": done.against,
                "cross_validated_f_d_percent": _median(how.cross_validated_f_d_percent),
                "cross_validated_zeta_percent": _median(how.cross_validated_zeta_percent),
                "poses": done.poses(),
            }
        )
        return
    low, high = how.measured_f_d_range
    out.print(
        f"{how.configurations} configurations, {how.ring_downs} ring-downs, {how.rejected} configurations rejected; "
        f"f_d spans {low:.1f} to {high:.1f} Hz over the workspace (paper: 6 to 15 Hz)"
    )
    table(
        "deviation of the calibration",
        ("against", "f_d median %", "p90 %", "ζ median %", "p90 %"),
        [
            _row("its own measurements", how.residual_f_d_percent, how.residual_zeta_percent),
            _row(
                "measurements left out of the fit",
                how.cross_validated_f_d_percent,
                how.cross_validated_zeta_percent,
            ),
            *([_row(done.against, done.error_f_d, done.error_zeta)] if done.true_f_d is not None else []),
        ],
    )
    out.print(f"written to {output}; use it with: tvist serve --calibration {output}{options}")


def report_modal(done: "ModalIdentification", output: Path, options: str, *, json: bool) -> None:
    """Print the parameters of a modal calibration and the deviations of its modes; see `report_polynomial`."""
    how, model = done.calibration.provenance, done.calibration.modal
    if model is None:
        raise TypeError("an identification of springs and drives has a modal model")
    crossed = list(zip(model.cross_validated_f_d_percent, model.cross_validated_zeta_percent, strict=True))
    true = [] if done.errors is None else [(mode.f_d, mode.zeta) for mode in done.errors]
    judged = true or crossed
    against = "true modes, unseen poses and payloads" if true else UNSEEN
    if json:
        print_json(
            {
                "file": str(output),
                "configurations": how.configurations,
                "ring_downs": how.ring_downs,
                "rejected": how.rejected,
                "payloads_kg": [payload.mass for payload in model.payloads],
                "f_d_range_hz": how.measured_f_d_range,
                "zeta_range": how.measured_zeta_range,
                "residual_to_noise": model.residual_to_noise,
                "error_f_d_percent": _median(judged[0][0]),
                "error_zeta_percent": _median(judged[0][1]),
                "against": against,
                "modes": [_errors(number, *pair) for number, pair in enumerate(judged, 1)],
                "cross_validated": [_errors(number, *pair) for number, pair in enumerate(crossed, 1)],
                "parameters": model.parameters,
                "no_friction": done.no_friction,
            }
        )
        return
    masses = " and ".join(f"{payload.mass:g}" for payload in model.payloads)
    out.print(
        f"{how.ring_downs} ring-downs in {how.configurations} configurations with {masses} kg; the fit leaves "
        f"{model.residual_to_noise:.2f} times the noise of {model.noise:.3f} m/s²"
    )
    _springs(model.parameters)
    rows = _friction([parameter for parameter in model.parameters if parameter.quantity in FRICTION])
    if rows:
        table("friction, 95 % from – to", ("joint", *FRICTION.values()), rows)
    table(
        f"deviation of the modes from {against}",
        ("mode", "f_d median %", "p90 %", "ζ median %", "p90 %"),
        [_row(str(number), *pair) for number, pair in enumerate(judged, 1)],
    )
    if true:
        table(
            f"the same from {UNSEEN}",
            ("mode", "f_d median %", "p90 %", "ζ median %", "p90 %"),
            [_row(str(number), *pair) for number, pair in enumerate(crossed, 1)],
        )
    if done.no_friction:
        out.print(f"Without friction: {done.no_friction}.")
    out.print(f"written to {output}; use it with: tvist serve --calibration {output}{options}")


def report_from_logs(
    done: "FromLogs", output: Path, options: str, *, json: bool, more: Mapping[str, Any] | None = None
) -> None:
    """Print what stops tell of springs and drives, and the moves that would tell more; see `report_polynomial`.

    Args:
        done: What was found.
        output: File of the calibration.
        options: Options of `tvist serve` for the robot that was identified.
        json: Whether to print one JSON object.
        more: What else that object contains.
    """
    model, how = done.calibration.modal, done.calibration.provenance
    if model is None:
        raise TypeError("an identification from logs has a modal model")
    crossed = list(zip(model.cross_validated_f_d_percent, model.cross_validated_zeta_percent, strict=True))
    q, known = done.least_known
    if json:
        print_json(
            {
                "file": str(output),
                "stops": len(done.stops),
                "used": done.used,
                "unused": done.unused,
                "payloads_kg": [payload.mass for payload in model.payloads],
                "f_d_range_hz": how.measured_f_d_range,
                "cross_validated": [_errors(number, *pair) for number, pair in enumerate(crossed, 1)],
                "parameters": model.parameters,
                "known_percent": done.known_percent,
                "least_known": {
                    "q": q.tolist(),
                    "f_d_hz": float(known.f_d[0]),
                    "interval_percent": float(known.f_d_percent[0]),
                },
                "no_polynomial": done.no_polynomial,
                "proposals": [
                    {"way": [at.tolist() for at in one.way], "q": one.q.tolist(), "commands": _moves(one)}
                    for one in done.proposals
                ],
                **(more or {}),
            }
        )
        return
    out.print(f"{done.used} of {len(done.stops)} stops were used", markup=False)
    for reason, count in done.unused.items():
        out.print(f"  {count} not: {reason}", markup=False)
    _springs(model.parameters)
    table(
        f"deviation of the modes from {UNSEEN}",
        ("mode", "f_d median %", "p90 %", "ζ median %", "p90 %"),
        [_row(str(number), *pair) for number, pair in enumerate(crossed, 1)],
    )
    out.print(
        f"f_d of the lowest mode is known within 5 % in {done.known_percent:.0f} % of the workspace. It is known least "
        f"at {angles(q)}: {known.f_d[0]:.1f} Hz ± {known.f_d_percent[0]:.0f} %",
        markup=False,
    )
    out.print(
        f"Without polynomials: {done.no_polynomial}." if done.no_polynomial else "Polynomials are in it, too."
    )
    if done.proposals:
        out.print(
            f"These {len(done.proposals)} moves would tell most; record them, and give that recording with --from too:"
        )
    for one in done.proposals:
        for line in _moves(one):
            print(f"  {line}")  # in one line, to be copied
    out.print(f"written to {output}; use it with: tvist serve --calibration {output}{options}")


def _moves(one: "Proposal") -> list[str]:
    """Commands that make a proposed move: to its start, and the jog."""
    there = [f"tvist move {angles(at)} --shaper none" for at in one.way]
    limits = one.limits
    jog = (
        f"--velocity {limits.velocity:.4g} --acceleration {limits.acceleration:.4g} --jerk {limits.jerk:.4g}"
    )
    return [*there, f"tvist move {angles(one.q)} --shaper none {jog}"]


def angles(q: "Floats") -> str:
    """Return angles as commands take them."""
    return ",".join(f"{angle:.3f}" for angle in q.tolist())


def report_payload(found: "PayloadFound", *, declared: bool, json: bool) -> None:
    """Print the identified mass and centre of mass."""
    payload = found.payload
    if json:
        print_json(
            {
                "mass_kg": payload.mass,
                "mass_deviation_kg": found.mass_deviation,
                "com_m": payload.com,
                "com_deviation_m": found.com_deviation,
                "mass_in_motion_kg": found.mass_in_motion,
                "mass_in_motion_deviation_kg": found.mass_in_motion_deviation,
                "declared_kg": found.declared.mass,
                "poses": found.poses,
                "set_payload": {"mass": payload.mass, "com": payload.com, "inertia": payload.inertia},
                "declared": declared,
            }
        )
        return
    table(
        f"payload identified from the joint torques in {found.poses} poses",
        ("", "found", "± (one standard deviation)", "declared before"),
        [
            (
                "mass [kg]",
                f"{payload.mass:.3f}",
                f"{found.mass_deviation:.3f}",
                f"{found.declared.mass:.3f}",
            ),
            *(
                (f"centre {axis} [mm]", f"{1e3 * c:.1f}", f"{1e3 * d:.1f}", f"{1e3 * before:.1f}")
                for axis, c, d, before in zip(
                    "xyz", payload.com, found.com_deviation, found.declared.com, strict=True
                )
            ),
        ],
    )
    out.print(
        f"A short motion gives {found.mass_in_motion:.2f} ± {found.mass_in_motion_deviation:.2f} kg. The inertia "
        "cannot be told apart from that of the rotors: the inertia of a steel ball is assumed."
    )
    what = f"mass={payload.mass:.3f}, com=({', '.join(f'{c:.4f}' for c in payload.com)})"
    inertia = ", ".join(f"{moment:.5f}" for moment in payload.inertia)
    out.print(
        "The payload has been declared."
        if declared
        else f"To declare it: set_payload {what}, inertia=({inertia})"
    )


def _springs(parameters: "Sequence[ModalParameter]") -> None:
    """Print springs and drives, and which of them the ring-downs do not tell."""
    own = [parameter for parameter in parameters if parameter.quantity in QUANTITIES]
    table(
        "springs and drives",
        ("parameter", "joints", "value", "95 % from", "to", "unit", ""),
        [_parameter(parameter) for parameter in own],
    )
    lost = [parameter for parameter in own if parameter.status == "not identifiable"]
    if lost:
        names = ", ".join(f"{QUANTITIES[p.quantity][0]} of {_joints(p)}" for p in lost)
        out.print(
            f"Not identifiable from these ring-downs: {names}. The vibration hardly depends on it; the initial guess "
            "is kept."
        )


def _median(spread: "Spread | None") -> float | None:
    return None if spread is None else spread.median


def _errors(number: int, f_d: "Spread | None", zeta: "Spread | None") -> dict[str, float | None]:
    return {
        "mode": number,
        "f_d_percent": _median(f_d),
        "f_d_p90_percent": None if f_d is None else f_d.p90,
        "zeta_percent": _median(zeta),
        "zeta_p90_percent": None if zeta is None else zeta.p90,
    }


def _row(name: str, f_d: "Spread | None", zeta: "Spread | None") -> tuple[str, ...]:
    figures = [f"{v:.1f}" for s in (f_d, zeta) if s is not None for v in (s.median, s.p90)]
    return (name, *(figures or ["–"] * 4))


def _parameter(parameter: "ModalParameter") -> tuple[str, ...]:
    name, unit = QUANTITIES[parameter.quantity]
    low, high = (f"{end:.4g}" for end in parameter.interval)
    sure = ("", "") if parameter.status == "assumed" else (low, high)
    said = "" if parameter.status == "identified" else parameter.status
    return (name, _joints(parameter), f"{parameter.value:.4g}", *sure, unit, said)


def _friction(parameters: "Sequence[ModalParameter]") -> list[tuple[str, ...]]:
    """Rows of the table of friction; a dash where it was not identifiable."""
    rows: dict[int, dict[str, str]] = {}
    for parameter in parameters:
        unit = 1e3 if FRICTION[parameter.quantity].endswith("mrad/s") else 1.0
        low, high = (f"{unit * end:.3g}" for end in parameter.interval)
        known = f"{low} – {high}" if parameter.status == "identified" else "–"
        rows.setdefault(parameter.joints[0], {})[parameter.quantity] = known
    return [(str(joint + 1), *(row[quantity] for quantity in FRICTION)) for joint, row in rows.items()]


def _joints(parameter: "ModalParameter") -> str:
    word = "link" if parameter.quantity == "bending_stiffness" else "joint"
    return f"{word} {', '.join(str(joint + 1) for joint in parameter.joints)}"
