"""Limits of a run: what it must keep, and where things must end."""

import math
import re
from dataclasses import dataclass

UNITS = {"max_shake": "m/s²", "max_seconds": "s", "max_joint_speed": "rad/s", "max_tool_speed": "m/s",
         "max_force": "N"}  # fmt: skip
"""Units of the limits."""
EXPECTED = re.compile(r"\s*(?P<body>.+?) in (?P<area>.+)")
"""What `expect` may be."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What a run must keep and leave behind; None where there is no limit."""

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

    def check(self) -> None:
        """Refuse limits that nothing can keep.

        Raises:
            ValueError: One is not finite and more than 0, or what is expected is not BODY in AREA.
        """
        for name, unit in UNITS.items():
            value = getattr(self, name)
            if value is not None and not 0.0 < value < math.inf:
                option = name.replace("_", "-")
                raise ValueError(f"{option} is {value:g} {unit}: must be finite and more than 0")
        for text in self.expect or ():
            if EXPECTED.fullmatch(text) is None:
                raise ValueError(f"expect is {text!r}: must be BODY in AREA, such as 'box 1 in pallet'")
