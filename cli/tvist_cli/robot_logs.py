"""Read the logs that a robot is identified from, and find the robot file that they belong to."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.failure import Failure, told
from tvist_cli.output import say

if TYPE_CHECKING:
    from tvist_lab.identification.everyday_stops import Log
    from tvist_plant.description import RobotDescription

HEAVIEST = 100.0
"""Largest mass of a payload that is accepted [kg]."""


def robot_logs(
    files: Sequence[Path],
    robot: str | None,
    mass: float | None,
    columns: str | None,
    known: int | None = None,
) -> "tuple[RobotDescription, list[Log]]":
    """Return the robot's description, and the logs with what the arm carried."""
    from tvist_controller.setup import paper_payload
    from tvist_lab.identification.everyday_stops import Log
    from tvist_lab.recordings import RecordingError, read
    from tvist_plant.description import DescriptionError, load, robots

    if mass is not None and not 0.0 <= mass <= HEAVIEST:
        raise Failure(f"payload is {mass:g} kg: must be 0 to {HEAVIEST:g} kg", code=2)
    with told(RecordingError):
        recordings = [read(file, columns) for file in files]
    for file, recording in zip(files, recordings, strict=True):
        for note in recording.notes:
            say(f"{file}: {note}")
    if robot is None:
        models = {recording.info.model for recording in recordings[:known] if recording.info is not None}
        fitting = [name for name in robots() if load(name).robot.model in models]
        if len(models) != 1 or len(fitting) != 1:
            what = f"name {' and '.join(sorted(models))}" if models else "do not name their robot"
            raise Failure(f"the logs {what}: give --robot, one of {', '.join(robots())} or a file", code=2)
        robot = fitting[0]
    with told(DescriptionError, code=2):
        description = load(robot)
    payload = None if mass is None else paper_payload(description, mass)
    return description, [Log(str(file), one, payload) for file, one in zip(files, recordings, strict=True)]
