"""Limits of a run, and where bodies must end."""

import math
import re
from dataclasses import dataclass

UNITS = {
    "max_shake": "m/s²",
    "max_seconds": "s",
    "max_joint_speed": "rad/s",
    "max_tool_speed": "m/s",
    "max_force": "N",
}
EXPECTED = re.compile(r"\s*(?P<body>.+?) in (?P<area>.+)")


@dataclass(frozen=True, kw_only=True)
class RunLimits:
    """Limits of a run and expected positions of bodies; None for no limit."""

    max_shake: float | None = None
    """Fail if the tool's acceleration without gravity exceeds this in m/s² from 10 ms until 0.3 s after a stop."""
    max_seconds: float | None = None
    """Fail if a program runs for longer than this in s on the robot's clock; --timeout would end it."""
    max_joint_speed: float | None = None  # fail if a joint turns faster than this in rad/s
    max_tool_speed: float | None = None  # fail if the tool centre point moves faster than this in m/s
    max_force: float | None = None
    """Fail if the world of --world touches the arm with a larger force than this in N."""
    expect: list[str] | None = None
    """Fail if a body of --world does not end in an area, a site of its file, given as BODY in AREA, repeatable."""

    def check(self) -> None:
        """Raise ValueError if a limit is not finite and above 0, or `expect` is not BODY in AREA."""
        for name, unit in UNITS.items():
            value = getattr(self, name)
            if value is not None and not 0.0 < value < math.inf:
                option = name.replace("_", "-")
                raise ValueError(f"{option} is {value:g} {unit}: must be finite and more than 0")
        for text in self.expect or ():
            if EXPECTED.fullmatch(text) is None:
                raise ValueError(f"expect is {text!r}: must be BODY in AREA, such as 'box 1 in pallet'")
