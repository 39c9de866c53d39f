"""`tvist identify`: a robot's vibration, its payload or its twin, from jogs, from a position interface or from logs."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from tvist_cli.connection import LOCAL, Connection
from tvist_cli.failure import Failure
from tvist_cli.figure_files import AS_USUAL, FigureOptions
from tvist_cli.offered import ROBOTS, SOURCES
from tvist_cli.output import default_output

ENDPOINT = re.compile(r"(tcp|tls|udp|quic|ws|unixsock-stream)/.+")
HEAVIEST = 100.0
"""Largest mass of a payload that is accepted [kg]."""


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
    look: FigureOptions = AS_USUAL,
    json: bool = False,
) -> None:
    """Fit springs and drives to how an arm rings and write a calibration; or weigh its payload, or fit a twin.

    A served robot, at tcp/HOST:PORT, sweeps slowly for its friction and makes a dozen jogs, chosen as those that tell
    most. Without a source, a robot is simulated in this process as fast as possible. A robot of UR's, at ur://ADDRESS,
    takes positions and tells its angles and the accelerometer of its tool: a plan of small moves is shown as a table
    and a picture, and nothing moves before you agree. Logs move nothing: the stops of everyday motions are used.

    Where 38 ring-downs or more with one payload cover the workspace, the calibration has the polynomials of the paper,
    too. The report says how sure each value is, at which amplitude the modes were measured, in how much of the
    workspace they are known, and which three jogs would tell most.

    --payload without a mass makes no calibration, but finds mass and centre of mass of the payload from the joint
    torques. --twin makes a robot file that tvist serve --robot runs: springs, dampers, gains, friction and payload are
    fitted until the simulated arm makes each motion of the logs as the robot did, which takes some minutes.

    Args:
        sources: Endpoint of a served robot, ur://ADDRESS[:PORT], or recordings and logs of a robot.
        at: Where a served robot is.
        output: File to write [calibration.json; with --twin robot.toml, if there is none yet].
        robot: Robot file, or name of one that comes with the package [in this process and for ur:// ur5e, else the one
            whose model the robot or the logs name].
        payload: Mass of the disc that the arm carries, in kg [what the robot or the logs say]; 0,5 makes a simulated
            arm carry one after the other [in this process: nothing and the robot file's]. Without a mass: weigh it.
        declare: With --payload: declare the payload that was found to the robot.
        ring_downs: Number of jogs.
        seed: Seed of the choice of jogs and, in this process, of noise and gear errors.
        yes: Move the robot at ur:// without asking.
        columns: Names of a CSV's columns if they are not RTDE's; see tvist log analyze.
        twin: Fit a robot file to logs. They need the robot's targets; ten motions are few, twenty with different loads
            are good.
        check: Log whose motions the twin has to predict and does not see, repeatable [each motion of the logs in turn,
            left out of the fit].
        figures: Folder to write figures to: what was measured against what fits without it tell and, in this process,
            maps of the lowest mode's frequency and damping over the workspace, identified against true.
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
        raise Failure("give one robot, or logs alone: one endpoint, one ur://ADDRESS, or files", code=2)
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
            raise Failure(f"{name} is for {what}", code=2)
    if not live and masses is not None and len(masses) > 1:
        raise Failure("payload is several masses: of logs, name the one that the arm carried", code=2)
    look.check(figures)
    if output is None:
        output = default_output(Path("robot.toml")) if twin else Path("calibration.json")
    if not output.absolute().parent.is_dir():  # said before half an hour of jogs
        raise Failure(f"output is {output}: its folder does not exist", code=2)
    from tvist_cli import identifying

    if files:
        identifying.from_logs(
            files, check or [], robot, masses, columns, output, figures, look, twin=twin, json=json
        )
        return
    source: Connection | str | None = places[0] if places else None
    if served or at != LOCAL:
        source = replace(at, endpoint=served[0]) if served else at
    place = identifying.Place(source, robot, masses, ring_downs, seed, sure=yes)
    if weigh:
        place.weigh(declare=declare, json=json)
    else:
        place.identify(output, figures, look, json=json)


def _masses_and_sources(
    payload: list[str] | None, sources: Sequence[str]
) -> tuple[tuple[float, ...] | None, list[str]]:
    """Separate masses and sources: --payload may have no value and then takes the sources that follow it."""
    masses, found = None, list(sources)
    for word in payload or []:
        try:
            given, masses = masses, tuple(float(part) for part in word.split(","))
        except ValueError:
            found.append(word)
            continue
        if given is not None:
            raise Failure(f"payload is given twice, {word} at last: separate masses by commas", code=2)
        if not all(0.0 <= mass <= HEAVIEST for mass in masses) or len(set(masses)) < len(masses):
            raise Failure(
                f"payload is {word}: must be different masses from 0 to {HEAVIEST:g} kg, separated by commas",
                code=2,
            )
    return masses, found
