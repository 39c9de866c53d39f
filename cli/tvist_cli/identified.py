"""Print the results of `tvist identify` as tables or as JSON."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tvist_cli.output import number, out, print_json, table
from tvist_lab.identification.calibrate import CalibrationResult, ModeErrors
from tvist_lab.identification.jogs import Jog, RingDownLogs
from tvist_lab.identification.payload import PayloadFound
from tvist_lab.identification.ring_downs import CONTRADICTS, unused
from tvist_lab.identification.servo_response import ServoResponse
from tvist_lab.identification.twin import Twin
from tvist_lab.identification.twin_file import said
from tvist_lab.recordings import Floats
from tvist_protocol.calibration import ModalParameter, Spread

Modes = Sequence[tuple[Spread | None, Spread | None]]  # deviations of f_d and ζ, the lowest mode first

DEVIATIONS = ("measured at m/s²", "f_d median %", "p90 %", "ζ median %", "p90 %")  # column heads of tables
FIGURES = ("f_d_percent", "f_d_p90_percent", "zeta_percent", "zeta_p90_percent")  # their keys in --json
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


def report(
    found: CalibrationResult,
    measured: RingDownLogs,
    output: Path,
    options: str,
    true: list[ModeErrors] | None,
    *,
    json: bool,
    more: Mapping[str, Any] | None = None,
) -> None:
    """Print the ring-downs' fit, its uncertainty, jogs that would improve it, and a command that uses it."""
    model, how = found.calibration.modal, found.calibration.provenance
    assert model is not None, "each calibration has springs and drives"
    crossed = list(zip(model.cross_validated_f_d_percent, model.cross_validated_zeta_percent, strict=True))
    judged: Modes = crossed if true is None else [(mode.f_d, mode.zeta) for mode in true]
    against = UNSEEN if true is None else "true modes, unseen poses"
    q, known = found.least_known
    servo = measured.servo
    if json:
        print_json(
            {
                "file": str(output),
                "configurations": how.configurations,
                "ring_downs": how.ring_downs,
                "rejected": how.rejected,
                "stops": len(found.stops),
                "used": found.used,
                "unused": unused(found.stops),
                "payloads_kg": [payload.mass for payload in model.payloads],
                "f_d_range_hz": how.measured_f_d_range,
                "zeta_range": how.measured_zeta_range,
                "residual_to_noise": model.residual_to_noise,
                "error_f_d_percent": _figures(judged[0])[0],
                "error_zeta_percent": _figures(judged[0])[2],
                "against": against,
                "modes": _modes(judged, found.amplitudes),
                "cross_validated": _modes(crossed, found.amplitudes),
                "parameters": model.parameters,
                "no_friction": measured.no_friction,
                "no_polynomial": found.no_polynomial,
                "known_percent": found.known_percent,
                "least_known": {
                    "q": q.tolist(),
                    "f_d_hz": float(known.f_d[0]),
                    "interval_percent": float(known.f_d_percent[0]),
                },
                "proposals": [
                    {"way": [at.tolist() for at in one.way], "q": one.q.tolist(), "commands": _moves(one)}
                    for one in found.proposals
                ],
                "robot_time_s": measured.seconds,
                "servo_lag_s": None if servo is None else servo.lag,
                "servo_gain": None if servo is None else servo.gain,
                "servo_delay_s": None if servo is None else servo.delay,
                **(more or {}),
            }
        )
        return
    masses = " and ".join(f"{payload.mass:g}" for payload in model.payloads)
    took = f", in {measured.seconds:.0f} s of the robot's time" if measured.seconds else ""
    out.print(
        f"{found.used} of {len(found.stops)} ring-downs with {masses} kg were used{took}; the fit leaves "
        f"{model.residual_to_noise:.2f} times the noise of {model.noise:.3f} m/s²"
    )
    for reason, count in unused(found.stops).items():
        out.print(f"  {count} not: {reason}{_wrong(found) if reason == CONTRADICTS else ''}")
    _springs(model.parameters)
    rows = _friction([parameter for parameter in model.parameters if parameter.quantity in FRICTION])
    if rows:
        table("friction, 95 % from – to", ("joint", *FRICTION.values()), rows)
    else:
        out.print(f"Without friction: {measured.no_friction}.")
    for title, errors in ((against, judged), *(() if true is None else ((UNSEEN, crossed),))):
        table(
            f"deviation of the modes from {title}",
            ("mode", *DEVIATIONS),
            [
                _row(str(place), amplitude, pair)
                for place, (amplitude, pair) in enumerate(zip(found.amplitudes, errors, strict=False), 1)
            ],
        )
    out.print(
        f"f_d of the lowest mode is known within 5 % in {found.known_percent:.0f} % of the workspace. It is known "
        f"least at {angles(q)}: {known.f_d[0]:.1f} Hz ± {known.f_d_percent[0]:.0f} %"
    )
    if found.no_polynomial:
        out.print(f"Without polynomials: {found.no_polynomial}.")
    else:
        left_out = (how.cross_validated_f_d_percent, how.cross_validated_zeta_percent)
        table(
            "deviation of the polynomials",
            ("from", *DEVIATIONS),
            [
                _row("their ring-downs", None, (how.residual_f_d_percent, how.residual_zeta_percent)),
                _row("those left out", None, left_out),
            ],
        )
    _lag(servo, positions=bool(more))
    if found.proposals:
        out.print(
            f"These {len(found.proposals)} jogs would tell most; record them, and identify from that recording:"
        )
    for one in found.proposals:
        for line in _moves(one):
            print(f"  {line}")  # each on one line, for copying
    out.print(f"written to {output}; use it with: tvist serve --calibration {output}{options}")


def _lag(servo: ServoResponse | None, *, positions: bool) -> None:
    if servo is not None:
        low, high = (servo.lag * (1.0 + side * 1.96 * servo.errors[0]) for side in (-1.0, 1.0))
        out.print(
            f"The robot follows {1e3 * servo.lag:.1f} ms late ({1e3 * low:.1f} to {1e3 * high:.1f}), with a gain of "
            f"{servo.gain:.0f} 1/s², and {1e3 * servo.delay:.0f} ms more for the way there and back."
        )
    elif positions:
        out.print("The robot does not follow set-points as a servo with a lag does: nothing compensates it.")


def _wrong(found: CalibrationResult) -> str:
    """Return a text that names the stops that contradict the others."""
    names = [f"{stop.log}, motion {stop.motion}" for stop in found.stops if stop.reason == CONTRADICTS]
    return f" ({'; '.join(names)}). Was the payload the declared one, and was the arm free?"


def _moves(one: Jog) -> list[str]:
    """Return the commands for a proposed jog: the moves to its start, and the jog."""
    there = [f"tvist move {angles(at)} --shaper none" for at in one.way]
    limits = one.limits
    jog = (
        f"--velocity {limits.velocity:.4g} --acceleration {limits.acceleration:.4g} --jerk {limits.jerk:.4g}"
    )
    return [*there, f"tvist move {angles(one.q)} --shaper none {jog}"]


def angles(q: Floats) -> str:
    """Format angles as commands take them."""
    return ",".join(f"{angle:.3f}" for angle in q.tolist())


def report_payload(found: PayloadFound, *, declared: bool, json: bool) -> None:
    """Print the identified mass and centre of mass."""
    payload = found.payload
    if json:
        print_json(
            {
                "mass_kg": payload.mass, "mass_deviation_kg": found.mass_deviation, "com_m": payload.com,
                "com_deviation_m": found.com_deviation, "mass_in_motion_kg": found.mass_in_motion,
                "mass_in_motion_deviation_kg": found.mass_in_motion_deviation,
                "declared_kg": found.declared.mass, "poses": found.poses,
                "set_payload": {"mass": payload.mass, "com": payload.com, "inertia": payload.inertia},
                "declared": declared,
            }
        )  # fmt: skip
        return
    table(
        f"payload identified from the joint torques in {found.poses} poses",
        ("", "found", "± (one standard deviation)", "declared before"),
        [
            ("mass [kg]", f"{payload.mass:.3f}", f"{found.mass_deviation:.3f}", f"{found.declared.mass:.3f}"),
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


def _springs(parameters: Sequence[ModalParameter]) -> None:
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


def _figures(spreads: Sequence[Spread | None]) -> list[float | None]:
    return [getattr(spread, name, None) for spread in spreads for name in ("median", "p90")]


def _modes(errors: Modes, amplitudes: Sequence[float | None]) -> list[dict[str, float | None]]:
    return [
        {"mode": place, "measured_at_m_s2": amplitude, **dict(zip(FIGURES, _figures(pair), strict=True))}
        for place, (amplitude, pair) in enumerate(zip(amplitudes, errors, strict=False), 1)
    ]


def _row(name: str, amplitude: float | None, spreads: Sequence[Spread | None]) -> tuple[str, ...]:
    return (name, number(amplitude, 2), *(number(value, 1) for value in _figures(spreads)))


def _parameter(parameter: ModalParameter) -> tuple[str, ...]:
    name, unit = QUANTITIES[parameter.quantity]
    low, high = (f"{end:.4g}" for end in parameter.interval)
    sure = ("", "") if parameter.status == "assumed" else (low, high)
    said = "" if parameter.status == "identified" else parameter.status
    return (name, _joints(parameter), f"{parameter.value:.4g}", *sure, unit, said)


def _friction(parameters: Sequence[ModalParameter]) -> list[tuple[str, ...]]:
    """Return the rows of the friction table, with a dash for what could not be identified."""
    rows: dict[int, dict[str, str]] = {}
    for parameter in parameters:
        unit = 1e3 if FRICTION[parameter.quantity].endswith("mrad/s") else 1.0
        low, high = (f"{unit * end:.3g}" for end in parameter.interval)
        known = f"{low} – {high}" if parameter.status == "identified" else "–"
        rows.setdefault(parameter.joints[0], {})[parameter.quantity] = known
    return [(str(joint + 1), *(row[quantity] for quantity in FRICTION)) for joint, row in rows.items()]


def _joints(parameter: ModalParameter) -> str:
    word = "link" if parameter.quantity == "bending_stiffness" else "joint"
    return f"{word} {', '.join(str(joint + 1) for joint in parameter.joints)}"


def report_twin(twin: Twin, output: Path, *, json: bool) -> None:
    """Print the twin's parameters beside those of the robot file, and how well the twin predicts."""
    if json:
        print_json(_twin_figures(twin, output))
        return
    table(
        "what the twin has, beside the robot file",
        ("parameter", "joint or link", "robot file", "twin", "±", ""),
        _twin_rows(twin),
    )
    for line in said(twin):
        out.print(line)
    out.print(f"written to {output}; run it with: tvist serve --robot {output}")


def _twin_rows(twin: Twin) -> list[tuple[str, ...]]:
    rows = []
    for entry, told, deviation in zip(twin.parameters.entries, twin.told, twin.deviations, strict=True):
        if entry.table == "payload":
            continue
        place, robots = entry.places[0], (twin.parameters.description, twin.robot)
        found = [getattr(getattr(robot, entry.table), entry.key) for robot in robots]
        values = [f"{one[place] if isinstance(one, tuple) else one:.4g}" for one in found]
        where = twin.robot.link_flexibility.links[place] if entry.table == "link_flexibility" else place
        name = "all" if len(entry.places) > 1 or entry.key == "damping_time" else str(where + 1)
        note = "" if told else "not determined by the logs"
        rows.append((entry.key.replace("_", " "), name, *values, f"{100.0 * deviation:.0f} %", note))
    return rows


def _twin_figures(twin: Twin, output: Path) -> dict[str, object]:
    fitted = twin.parameters
    carried = [fitted.payload(twin.values, place) for place in range(len(fitted.payloads))]
    return {
        "file": str(output),
        "motions": twin.motions,
        "left_out": unused(twin.others),
        "checked_by": "other logs" if twin.checked else "motions left out in turn",
        "residual_error_percent": twin.error_percent(0.5),
        "residual_error_p90_percent": twin.error_percent(0.9),
        "predicted": [
            {"log": one.log, "motion": one.motion, "measured_m_s2": one.measured, "twin_m_s2": one.twin}
            for one in twin.predictions
        ],
        "too_quiet_to_compare": twin.quiet,
        "payloads": [
            {"declared_kg": said.mass, "carried_kg": found.mass, "com_m": found.com}
            for said, found in zip(fitted.payloads, carried, strict=True)
        ],
        "parameters": [
            {
                "table": entry.table, "key": entry.key, "places": entry.places, "deviation": float(deviation),
                "told": told,
            }
            for entry, deviation, told in zip(fitted.entries, twin.deviations, twin.told, strict=True)
        ],
    }  # fmt: skip
