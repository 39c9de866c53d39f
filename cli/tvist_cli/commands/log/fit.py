"""`tvist log fit`: a robot file with which a simulated arm does what an arm did in logs."""

from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.failure import Failure, told
from tvist_cli.output import default_output, out, print_json, table, typed, waiting
from tvist_cli.robot_logs import robot_logs

if TYPE_CHECKING:
    from tvist_lab.identification.twin import Twin


def fit(
    *files: Path,
    output: Path | None = None,
    robot: str | None = None,
    payload: float | None = None,
    check: list[Path] | None = None,
    columns: str | None = None,
    json: bool = False,
) -> None:
    """Fit a twin to logs of a robot: a robot file that tvist serve --robot runs.

    Springs, dampers, the drives' gains, friction and payload are fitted until the simulated arm makes each motion of
    the logs as the robot did, which takes some minutes. The file says how well it predicts motions that it has not
    seen, and which values the logs do not tell.

    Args:
        files: Recordings of unshaped motions, or logs of another robot with its targets, in any format that tvist log
            analyze reads. Ten motions are few, twenty with different loads are good.
        output: Robot file to write or replace [robot.toml, if there is none yet].
        robot: Robot file to begin at, or name of a robot [the one whose model the logs name].
        payload: Mass of the disc on the flange that the robot was said to carry in kg [what the logs say].
        check: Log whose motions the twin has to predict and does not see, repeatable [each motion of the logs in turn,
            left out of the fit].
        columns: Names of a CSV's columns if they are not RTDE's, with {} for the number of a joint or axis, and a unit
            after a colon: time=t:ms,q=joint_{}:deg,accelerometer=acc_{}:g. Also qd, pose, target_q, target_qd.
        json: Print one JSON object.
    """
    if not files:
        raise Failure("fit needs at least one recording or log: tvist log fit run.mcap", code=2)
    output = default_output(Path("robot.toml")) if output is None else output
    if not output.absolute().parent.is_dir():  # said before minutes of simulations
        raise Failure(f"output is {output}: its folder does not exist", code=2)
    checks = check or []
    description, logs = robot_logs([*files, *checks], robot, payload, columns, len(files))
    from tvist_lab.identification.twin import fit_twin
    from tvist_lab.identification.twin_file import said, twin_file
    from tvist_lab.recordings import RecordingError

    with told(RecordingError, OSError), waiting("fitting") as step:
        twin = fit_twin(description, logs[: len(files)], logs[len(files) :], step)
        output.write_text(twin_file(twin, typed()), encoding="utf-8")
    if json:
        print_json(_figures(twin, output))
        return
    table(
        "what the twin has, beside the robot file",
        ("parameter", "joint or link", "robot file", "twin", "±", ""),
        _rows(twin),
    )
    for line in said(twin):
        out.print(line, markup=False)
    out.print(f"written to {output}; run it with: tvist serve --robot {output}", markup=False)


def _rows(twin: "Twin") -> list[tuple[str, ...]]:
    links = twin.robot.link_flexibility.links
    rows = []
    for entry, told_, deviation in zip(twin.parameters.entries, twin.told, twin.deviations, strict=True):
        if entry.table == "payload":
            continue
        before, after = (
            getattr(getattr(one, entry.table), entry.key) for one in (twin.parameters.description, twin.robot)
        )
        place = entry.places[0]
        values = [one[place] if isinstance(one, tuple) else one for one in (before, after)]
        where = links[place] if entry.table == "link_flexibility" else place
        name = "all" if len(entry.places) > 1 or entry.key == "damping_time" else str(where + 1)
        rows.append(
            (
                entry.key.replace("_", " "),
                name,
                *(f"{value:.4g}" for value in values),
                f"{100.0 * deviation:.0f} %",
                "" if told_ else "not told by the logs",
            )
        )
    return rows


def _figures(twin: "Twin", output: Path) -> dict[str, object]:
    from tvist_lab.identification.from_logs import unused

    carried = [
        twin.parameters.payload(twin.values, number) for number in range(len(twin.parameters.payloads))
    ]
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
            for said, found in zip(twin.parameters.payloads, carried, strict=True)
        ],
        "parameters": [
            {
                "table": entry.table, "key": entry.key, "places": entry.places, "deviation": float(deviation),
                "told": told_,
            }
            for entry, deviation, told_ in zip(
                twin.parameters.entries, twin.deviations, twin.told, strict=True
            )
        ],
    }  # fmt: skip
