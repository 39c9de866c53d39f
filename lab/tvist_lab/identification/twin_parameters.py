"""Parameters of a robot file that are fitted to logs, and the robot file for their values."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from msgspec.structs import replace

from tvist_lab.identification.unknowns import ROTOR, SET, UNSURE, ball
from tvist_lab.recordings import Floats
from tvist_plant.description import RobotDescription
from tvist_protocol.values import Payload

EACH = {
    "gear_stiffness": UNSURE,
    "velocity_gain": UNSURE,
    "windup_feedforward": 0.5,
    "coulomb_friction": UNSURE,
    "rotor_inertia": ROTOR,
}
"""Standard deviations, before the fit, of the logarithms of parameters that are fitted for each drive [-]."""
TOGETHER = {"gear_damping": UNSURE, "position_gain": SET, "integral_gain": 0.5, "friction_width": 0.5}
"""Standard deviations, before the fit, of the logarithms of factors that all drives share [-]."""
LINKS = {"stiffness": UNSURE, "damping_time": UNSURE}
"""Standard deviations, before the fit, of the logarithms of parameters of bending links [-]."""
MASS = 0.1  # standard deviation of a carried mass from the declared one, relative to the rated payload [-]
CENTRE = 0.03  # standard deviation of each coordinate of the payload's centre of mass [m]
DIGITS = 9
FITTED_BELOW = 0.5  # a parameter counts as fitted if the logs reduce its deviation below this share [-]


@dataclass(frozen=True)
class TwinParameter:
    """A fitted number: a factor on a value of the robot file, or an addition to a value of a payload."""

    table: str  # `drives`, `link_flexibility` or `payload`
    key: str
    places: tuple[int, ...]
    """Joints, or places in the list of links, that share the number; for a payload: index and coordinate."""
    deviation: float  # standard deviation before the fit; of the logarithm for factors


class TwinParameters:
    """The robot file as a function of the fitted numbers, which are all zero for the file as it is.

    `payloads` are those that the arm was declared to carry.
    """

    def __init__(self, description: RobotDescription, payloads: Sequence[Payload]) -> None:
        self.description, self.payloads = description, tuple(payloads)
        every = tuple(range(description.joints))
        drives, links = description.drives, description.link_flexibility
        entries = [
            TwinParameter("drives", key, (joint,), deviation)
            for key, deviation in EACH.items()
            for joint in every
            if getattr(drives, key)[joint] > 0.0
        ]
        entries += [TwinParameter("drives", key, every, deviation) for key, deviation in TOGETHER.items()]
        if links.links:
            entries += [
                TwinParameter("link_flexibility", "stiffness", (place,), LINKS["stiffness"])
                for place in range(len(links.links))
            ]
            entries.append(TwinParameter("link_flexibility", "damping_time", (0,), LINKS["damping_time"]))
        for number, payload in enumerate(self.payloads):
            entries.append(TwinParameter("payload", "mass", (number, 0), MASS * description.limits.payload))
            if payload.mass > 0.0:
                entries += [TwinParameter("payload", "com", (number, axis), CENTRE) for axis in range(3)]
        self.entries = tuple(entries)
        self.deviation: Floats = np.array([entry.deviation for entry in entries])
        """Standard deviations before the fit, shape (P,)."""

    def index(self, table: str, key: str, place: int) -> int | None:
        """Return the index of a fitted number; None if it is not fitted."""
        found = (
            number
            for number, entry in enumerate(self.entries)
            if entry.table == table and entry.key == key and place in entry.places
        )
        return next(found, None)

    def payload(self, values: Floats, number: int) -> Payload:
        """Return the payload carried, by these values, when the payload of this index was declared."""
        said = self.payloads[number]
        added = dict.fromkeys((("mass", 0), *(("com", axis) for axis in range(3))), 0.0)
        for entry, value in zip(self.entries, values, strict=True):
            if entry.table == "payload" and entry.places[0] == number:
                added[entry.key, entry.places[1]] = float(value)
        mass = max(said.mass + added["mass", 0], 0.0)
        x, y, z = (said.com[axis] + added["com", axis] for axis in range(3))
        inertia = ball(mass) if said.mass == 0.0 else _times(said.inertia, mass / said.mass)
        return Payload(mass=mass, com=(x, y, z), inertia=inertia)

    def robot(self, values: Floats, payload: int = 0) -> RobotDescription:
        """Return the robot file, with the payload of this index."""
        # The wind-up feed-forward is scaled such that a controller with the fitted gears moves the motors
        # ahead by as much as the robot's own controller did with the original gears.
        factors: dict[tuple[str, str], Floats] = {}
        size = max(self.description.joints, len(self.description.link_flexibility.links), 1)
        for entry, value in zip(self.entries, values, strict=True):
            if entry.table != "payload":
                own = factors.setdefault((entry.table, entry.key), np.ones(size))
                own[[*entry.places]] = np.exp(value)
        factors["drives", "windup_feedforward"] = (
            factors.get(("drives", "windup_feedforward"), np.ones(size)) * factors["drives", "gear_stiffness"]
        )
        tables: dict[str, dict[str, Any]] = {}
        for (table, key), own in factors.items():
            value = getattr(getattr(self.description, table), key)
            tables.setdefault(table, {})[key] = _times(value, own)
        drives = replace(self.description.drives, **tables.get("drives", {}))
        links = replace(self.description.link_flexibility, **tables.get("link_flexibility", {}))
        carried = msgspec.convert(
            msgspec.to_builtins(self.payload(values, payload)), type(self.description.payload)
        )
        return replace(self.description, drives=drives, link_flexibility=links, payload=carried)


def _times(value: Any, factors: Any) -> Any:
    """Return a number or a tuple, each entry times its factor."""
    if isinstance(value, tuple):
        own = np.broadcast_to(factors, np.shape(factors) or (len(value),))[: len(value)]
        return tuple(_rounded(one) for one in (np.array(value) * own).tolist())
    return _rounded(float(value * np.ravel(factors)[0]))


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
