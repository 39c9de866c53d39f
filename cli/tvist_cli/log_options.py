"""Options for reading logs, the same on every command that reads one."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from tvist_cli.failure import Misuse
from tvist_cli.offered import ROBOTS

if TYPE_CHECKING:
    from tvist_lab.recordings import Recording


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class LogOptions:
    """How to read logs."""

    columns: str | None = None
    """Name the columns of a CSV with unknown names, with {} for the number of a joint or axis and a unit
    after a colon: time=t:ms,q=joint_{}:deg,accelerometer=acc_{}:g; or give places counted from 1:
    time=1,q=2-7. Also qd, gyroscope, pose, target_q, target_qd."""
    imu: list[Path] | None = None
    """Read the log of a sensor at the tool that has its own clock, and align it with the robot's log:
    accelerometer and, better, gyroscope, in any format of a log. Repeatable: one for each robot's log."""
    imu_columns: str | None = None
    """Name the columns of --imu, as for --columns: time=t:ms,accelerometer=a{}:g,gyroscope=w{}:deg/s."""
    robot: Annotated[str | None, ROBOTS] = None
    """Use this robot as the one that moves the sensor of --imu: a name that comes with the package, or the
    path of a robot file [that of the log, or ur5e]."""

    def read(self, *files: Path, sensor: bool = False) -> "list[Recording]":
        """Read logs and join each with the log of its sensor; RecordingError or Misuse if a log does not fit.

        If `sensor` is true and `--imu` is not given, a log may be of an accelerometer alone.
        """
        from tvist_lab.recordings import read
        from tvist_lab.recordings.table import ROBOT, ROBOT_OR_SENSOR

        for name in ("imu_columns", "robot"):
            if self.imu is None and getattr(self, name) is not None:
                raise Misuse(f"--{name.replace('_', '-')} is about --imu: give --imu FILE too")
        if self.imu is not None and len(self.imu) != len(files):
            raise Misuse(f"{len(self.imu)} --imu for {len(files)} logs: give one for each")
        needs = ROBOT_OR_SENSOR if sensor and self.imu is None else ROBOT
        logs = [read(file, self.columns, needs) for file in files]
        if self.imu is None:
            return logs
        from tvist_lab.recordings.joined import joined

        return [
            joined(log, imu, self.imu_columns, self.robot) for log, imu in zip(logs, self.imu, strict=True)
        ]


AS_IT_IS = LogOptions()
