"""`tvist identify`: find a robot's modes, payload or twin from jogs or logs."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from tvist_cli.connection import LOCAL, Connection
from tvist_cli.failure import Misuse
from tvist_cli.figure_files import DEFAULT_FIGURES, FigureOptions
from tvist_cli.offered import ROBOTS, SOURCES
from tvist_cli.output import default_output

ENDPOINT = re.compile(r"(tcp|tls|udp|quic|ws|unixsock-stream)/.+")
HEAVIEST = 100.0  # largest payload mass that the command accepts [kg]


def identify(
    *sources: Annotated[str, SOURCES],
    at: Connection = LOCAL,
    output: Path | None = None,
    robot: Annotated[str | None, ROBOTS] = None,
    payload: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    declare: bool = False,
    ring_downs: int = 12,
    seed: int = 0,
    yes: bool = False,
    columns: str | None = None,
    twin: bool = False,
    check: list[Path] | None = None,
    figures: Path | None = None,
    look: FigureOptions = DEFAULT_FIGURES,
    json: bool = False,
) -> None:
    """Fit springs and drives to an arm's ring-downs and write a calibration; or weigh its payload, or fit a twin.

    A served robot at tcp/HOST:PORT makes slow sweeps to measure friction, and a dozen jogs, chosen for the
    information they give. Without a source, a robot is simulated in this process as fast as possible. A UR
    robot at ur://ADDRESS takes positions and sends its joint angles and the accelerometer of its tool: the
    command first shows the planned small moves as a table and a picture, and asks before anything moves. With
    logs nothing moves: the command uses the stops of everyday motions.

    If 38 or more ring-downs with one payload cover the workspace, the calibration also has the polynomials of
    the paper. The report gives the uncertainty of each value, the amplitude at which the modes were measured,
    the part of the workspace in which they are known, and the three jogs that would add most.

    --payload without a mass writes no calibration; it finds the mass and centre of mass of the payload from
    the joint torques. --twin writes a robot file for tvist serve --robot: springs, dampers, gains, friction
    and payload are fitted until the simulated arm repeats each motion of the logs, which takes some minutes.

    Args:
        sources: Use this robot or these files: the endpoint of a served robot, ur://ADDRESS[:PORT], or
            recordings and logs of one robot.
        at: Where a served robot is.
        output: Write the result to this file [calibration.json; with --twin robot.toml, if there is none yet].
        robot: Start from this robot file, or the name of one that comes with the package [ur5e in this
            process and for ur://, else the model that the robot or the logs name].
        payload: Assume a disc of this mass in kg [as declared by the robot or the logs]; with 0,5 a simulated
            arm carries one after the other [nothing, then the payload of the robot file]. Without a mass:
            weigh the payload.
        declare: With --payload, declare the identified payload to the robot.
        ring_downs: Make this number of jogs.
        seed: Set the seed for the choice of jogs and, in this process, for noise and gear errors.
        yes: Move the robot at ur:// without asking.
        columns: Name the columns of a CSV whose names are not RTDE's; see tvist log analyze.
        twin: Fit a robot file to logs, which must contain the robot's targets. Ten motions are few; twenty
            with different loads are good.
        check: Predict the motions of this log with the twin and leave them out of the fit, repeatable [each
            motion of the logs is left out in turn].
        figures: Write figures to this folder: measured against predicted by fits without that ring-down and, in this
            process, maps of the lowest mode's frequency and damping over the workspace, identified against true.
        look: How to write the figures.
        json: Print one JSON object.
    """
    masses, found = _masses_and_sources(payload, sources)
    weigh = payload is not None and masses is None
    places = [one for one in found if one.startswith("ur://")]
    served = [one for one in found if ENDPOINT.fullmatch(one)]
    files = [Path(one) for one in found if one not in places and one not in served]
    elsewhere = at != LOCAL and bool(places or files)
    if len(places) + len(served) + bool(files) > 1 or elsewhere or (served and at.endpoint != LOCAL.endpoint):
        raise Misuse("give one robot, or logs alone: one endpoint, one ur://ADDRESS, or files")
    live = not files
    for name, given, needed, what in (
        ("columns", columns, files, "logs: name their files"),
        ("twin", twin, files, "logs: tvist identify --twin run.mcap"),
        ("check", check, twin, "--twin"),
        ("yes", yes, places, "a robot at ur://ADDRESS"),
        ("declare", declare, weigh and live, "--payload without a mass, of a robot"),
        ("figures", figures, not (weigh or twin), "a calibration"),
        ("ring-downs", ring_downs != 12, live and not weigh, "jogs"),
        ("payload without a mass", weigh, live and not places, "a served robot: name a mass"),
    ):
        if given and not needed:
            raise Misuse(f"{name} is for {what}")
    if not live and masses is not None and len(masses) > 1:
        raise Misuse("payload is several masses: give the one that the arm carried in the logs")
    look.check(figures)
    if output is None:
        output = default_output(Path("robot.toml")) if twin else Path("calibration.json")
    if not output.absolute().parent.is_dir():  # checked before the jogs, which take half an hour
        raise Misuse(f"output is {output}: its folder does not exist, make it first")
    from tvist_cli import identifying

    if files:
        identifying.from_logs(
            files, check or [], robot, masses, columns, output, figures, look, twin=twin, json=json
        )
        return
    source: Connection | str | None = places[0] if places else None
    if served or at != LOCAL:
        source = replace(at, endpoint=served[0]) if served else at
    place = identifying.MovableRobot(source, robot, masses, ring_downs, seed, sure=yes)
    if weigh:
        place.weigh(declare=declare, json=json)
    else:
        place.identify(output, figures, look, json=json)


def _masses_and_sources(
    payload: list[str] | None, sources: Sequence[str]
) -> tuple[tuple[float, ...] | None, list[str]]:
    """Separate masses and sources: a --payload without a value takes the sources that follow it."""
    masses, found = None, list(sources)
    for word in payload or []:
        try:
            given, masses = masses, tuple(float(part) for part in word.split(","))
        except ValueError:
            found.append(word)
            continue
        if given is not None:
            raise Misuse(f"payload is given twice, {word} at last: separate masses by commas")
        if not all(0.0 <= mass <= HEAVIEST for mass in masses) or len(set(masses)) < len(masses):
            raise Misuse(
                f"payload is {word}: must be different masses from 0 to {HEAVIEST:g} kg, separated by commas"
            )
    return masses, found
