"""Profiles: sets of options for a purpose. An option that is given explicitly takes precedence over the profile's."""

from collections.abc import Mapping

from msgspec import Struct

from tvist_controller.kinematics.postures import is_of_ur_form
from tvist_plant.description import RobotDescription
from tvist_server.options import ProfileName

UR_START = (-1.60, -1.727, -2.203, -0.808, 1.595, -0.031)
"""Posture in which URSim starts a six-joint arm, away from all singular postures [rad]."""


class Profile(Struct, frozen=True, kw_only=True):
    """Options of `tvist serve` where none is given; the defaults are those of a robot without a profile."""

    payload: float | None = None
    """Mass of the disc on the flange, both declared and carried [kg]; None: the robot file's payload."""
    ur_start: bool = False
    """Whether an arm of UR's kind starts in URSim's posture instead of `Q1`."""
    shaper: str = "zv"
    """Initial shaper."""
    quiet: bool = False
    """Whether sensors have no noise."""
    floor: bool = True
    """Whether motions keep clear of the floor."""
    compensate_sag: bool = False
    """Whether the drives lead by the twist of the gears under gravity."""

    def start(self, description: RobotDescription) -> tuple[float, ...] | None:
        """Return the posture to start in [rad]; None for the robot file's `Q1`."""
        return UR_START if self.ur_start and is_of_ur_form(description) else None


PLAIN = Profile()
"""What holds without a profile."""
PROFILES: Mapping[ProfileName, Profile] = {
    "ursim": Profile(payload=0.0, ur_start=True, shaper="none", quiet=True, floor=False, compensate_sag=True),
    "real": Profile(ur_start=True),
}
"""The profiles by name: what UR's own simulator shows, and what it cannot."""
