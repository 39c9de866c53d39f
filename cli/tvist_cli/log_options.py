"""Options about what a log holds, the same on every command that reads one."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.offered import ROBOTS

if TYPE_CHECKING:
    from tvist_lab.recordings import Recording


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class LogOptions:
    """How to read logs."""

    columns: str | None = None
    """Names of a CSV's columns if they are not known, with {} for the number of a joint or axis, and a unit after a
    colon: time=t:ms,q=joint_{}:deg,accelerometer=acc_{}:g; or places counted from 1: time=1,q=2-7. Also qd, gyroscope,
    pose, target_q, target_qd."""
    imu: list[Path] | None = None
    """Log of a sensor at the tool with a clock of its own, which is put on the robot's: accelerometer and, better,
    gyroscope, in any format of a log. Repeatable: one for each robot's log."""
    imu_columns: str | None = None
    """Names of the columns of --imu, as for --columns: time=t:ms,accelerometer=a{}:g,gyroscope=w{}:deg/s."""
    robot: Annotated[str | None, ROBOTS] = None
    """Robot that moves the sensor of --imu: name of one that comes with the package, or path of a robot file [that of
    the log, or ur5e]."""

    @property
    def given(self) -> bool:
        """Whether anything was asked for."""
        return self != AS_IT_IS

    def read(self, *files: Path, sensor: bool = False) -> "list[Recording]":
        """Read logs, each joined with its sensor's where there is one.

        Args:
            files: The logs.
            sensor: Whether one without `--imu` may be that of an accelerometer alone.

        Raises:
            Failure: An option has nothing to act on, the numbers of files differ, or a file cannot be read or joined.
        """
        from tvist_lab.recordings import RecordingError, read
        from tvist_lab.recordings.table import ROBOT, ROBOT_OR_SENSOR

        for name in ("imu_columns", "robot"):
            if self.imu is None and getattr(self, name) is not None:
                raise Failure(f"--{name.replace('_', '-')} is about --imu: give --imu FILE too", code=2)
        if self.imu is not None and len(self.imu) != len(files):
            raise Failure(f"{len(self.imu)} --imu for {len(files)} logs: give one for each", code=2)
        needs = ROBOT_OR_SENSOR if sensor and self.imu is None else ROBOT
        with told(RecordingError):
            logs = [read(file, self.columns, needs) for file in files]
            if self.imu is None:
                return logs
            from tvist_lab.recordings.joined import joined

            return [
                joined(log, imu, self.imu_columns, self.robot)
                for log, imu in zip(logs, self.imu, strict=True)
            ]


AS_IT_IS = LogOptions()
"""Nothing was asked for."""
