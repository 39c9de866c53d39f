"""Names of UR's robots."""

import re

_SERIES = re.compile(r"UR\d+", re.IGNORECASE)


def series(model: str) -> str | None:
    """Return the series of a model, without the `e`: "UR5" for "UR5e"; None if the robot is not UR's."""
    found = _SERIES.match(model)
    return found[0].upper() if found else None
