"""Options of `tvist run` that judge what programs did, and the files about that."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.output import say

if TYPE_CHECKING:
    from tvist_lab.programs.baseline import Run
    from tvist_lab.programs.expectations import Expectation
    from tvist_lab.programs.limits import Limits

UNITS = {"max_shake": "m/s²", "max_seconds": "s", "max_joint_speed": "rad/s", "max_tool_speed": "m/s",
         "max_force": "N"}  # fmt: skip
"""Units of the limits."""


def check_positive(name: str, value: float | None, unit: str = "s") -> None:
    """Refuse a number that is not finite and more than zero."""
    if value is not None and not 0.0 < value < math.inf:
        raise Failure(f"{name} is {value:g} {unit}: must be finite and more than 0", code=2)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class RunLimits:
    """What the runs must keep."""

    max_shake: float | None = None
    """Fail if the tool's acceleration after a stop exceeds this, in m/s², without gravity and from 10 ms until 0.3 s
    after the stop."""
    max_seconds: float | None = None
    """Fail if a program runs for longer than this, in s as the robot counts it; --timeout would end it."""
    max_joint_speed: float | None = None
    """Fail if a joint turns faster than this, in rad/s."""
    max_tool_speed: float | None = None
    """Fail if the tool centre point moves faster than this, in m/s."""
    max_force: float | None = None
    """Fail if the world of --world touches the arm with a larger force than this, in N."""
    expect: list[str] | None = None
    """BODY in AREA, repeatable: fail if this body of --world does not end in this area, which is a site of its file."""

    @property
    def given(self) -> dict[str, float]:
        """Those that were given, by their names."""
        found = {name: getattr(self, name) for name in UNITS}
        return {name: value for name, value in found.items() if value is not None}

    def checked(self) -> "Limits":
        """Return the limits.

        Raises:
            Failure: One is not finite and more than zero.
        """
        from tvist_lab.programs.limits import Limits

        for name, value in self.given.items():
            check_positive(name.replace("_", "-"), value, UNITS[name])
        return Limits(
            self.max_shake, self.max_seconds, self.max_joint_speed, self.max_tool_speed, self.max_force
        )

    def expected(self) -> "list[Expectation]":
        """Return what the runs are to leave behind.

        Raises:
            Failure: It is not said as BODY in AREA.
        """
        from tvist_lab.programs.expectations import Expectation, ExpectationError

        with told(ExpectationError, code=2):
            return [Expectation.of(text) for text in self.expect or ()]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class RunFiles:
    """What the runs are compared with and written to."""

    junit: Path | None = None
    """File to write the results to as JUnit XML, with a test case for each program."""
    baseline: Path | None = None
    """What an earlier --json of the same programs printed in lockstep: fail if times, stops, shake, speeds or warnings
    differ beyond rounding, and say which."""

    @property
    def given(self) -> list[Path]:
        """Those that were given."""
        return [file for file in (self.junit, self.baseline) if file is not None]

    def checked(self, programs: list[str], *, lockstep: bool) -> "Mapping[str, Run] | None":
        """Refuse what cannot be written, before anything runs.

        Args:
            programs: Names of the programs.
            lockstep: Whether they run in lockstep.

        Returns:
            The baseline's runs by the names of their programs; None if there is no baseline.

        Raises:
            Failure: A file cannot be written, or the baseline is none.
        """
        file = self.junit
        if file is not None and (file.is_dir() or not file.parent.is_dir()):
            why = "that is a folder" if file.is_dir() else f"there is no folder {file.parent}"
            raise Failure(f"junit is {file}: {why}", code=2)
        if self.baseline is None:
            return None
        if file is not None and file.absolute() == self.baseline.absolute():
            raise Failure("junit and baseline are the same file: give each its own", code=2)
        if not lockstep:
            raise Failure(
                "--baseline needs --lockstep, in which equal programs run alike to the last bit", code=2
            )
        from tvist_lab.programs.baseline import BaselineError, read_baseline

        with told(BaselineError, OSError, code=2):
            return read_baseline(self.baseline, programs)

    def write(self, results: Sequence[Mapping[str, Any]]) -> None:
        """Write the results.

        Args:
            results: What --json prints of each program.

        Raises:
            Failure: The file cannot be written.
        """
        if self.junit is None:
            return
        from tvist_lab.programs.junit import junit

        with told(OSError):
            self.junit.write_bytes(junit(results))
        say(f"the results are in {self.junit}")


NO_LIMITS, NO_FILES = RunLimits(), RunFiles()
"""Nothing was asked for."""
