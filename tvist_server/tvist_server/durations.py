"""Durations as people write them: `90s`, `10min`, `2h`."""

import re

RATE = 500
"""Number of ticks in a second of simulation time."""
SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0}
"""Seconds in each unit."""
LONGEST = 1000.0 * 3600.0
"""Longest accepted duration [s]."""

_DURATION = re.compile(r"\s*(?P<number>\d+(\.\d+)?)\s*(?P<unit>s|min|h)\s*", re.IGNORECASE | re.ASCII)


def ticks_of(text: str, name: str) -> int:
    """Return the number of ticks of a duration.

    Args:
        text: Number and unit.
        name: Name of the value, for the message.

    Raises:
        ValueError: The text is no duration, or one that is too short or too long.
    """
    found = _DURATION.fullmatch(text)
    seconds = 0.0 if found is None else float(found["number"]) * SECONDS[found["unit"].lower()]
    if not 1.0 <= seconds <= LONGEST:
        raise ValueError(
            f"{name} is {text!r:.40}: must be a duration such as 90s, 10min or 2h, from 1s to 1000h"
        )
    return round(seconds * RATE)
