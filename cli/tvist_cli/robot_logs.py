"""Read the logs from which a robot is identified, and find their robot file."""

from collections.abc import Sequence
from pathlib import Path

from tvist_cli.failure import Failure, failing_on
from tvist_cli.output import say
from tvist_controller.setup import paper_payload
from tvist_lab.identification.ring_downs import Log
from tvist_lab.recordings import RecordingError, read
from tvist_plant.description import DescriptionError, RobotDescription, load, robots


def robot_file(robot: str | None, models: set[str], what: str) -> RobotDescription:
    """Return the robot file of this name or path, or else the one that comes with the package for a model."""
    if robot is None:
        fitting = [name for name in robots() if load(name).robot.model in models]
        if len(models) != 1 or len(fitting) != 1:
            why = f"{what}: {' and '.join(sorted(models))}" if models else f"{what} not named"
            raise Failure(
                f"which robot file? {why}; give --robot, one of {', '.join(robots())} or a file", code=2
            )
        robot = fitting[0]
    with failing_on(DescriptionError, exit_code=2):
        return load(robot)


def robot_logs(
    files: Sequence[Path],
    robot: str | None,
    mass: float | None,
    columns: str | None,
    known: int | None = None,
) -> tuple[RobotDescription, list[Log]]:
    """Read logs; return the robot's description and the logs with their payloads."""
    with failing_on(RecordingError):
        recordings = [read(file, columns) for file in files]
    for file, recording in zip(files, recordings, strict=True):
        for note in recording.notes:
            say(f"{file}: {note}")
    models = {recording.info.model for recording in recordings[:known] if recording.info is not None}
    description = robot_file(robot, models, "the logs name")
    payload = None if mass is None else paper_payload(description, mass)
    return description, [Log(str(file), one, payload) for file, one in zip(files, recordings, strict=True)]
