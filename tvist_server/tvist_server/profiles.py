"""Profiles: sets of default options for a purpose. Explicit options take precedence."""

from collections.abc import Mapping

from msgspec import Struct

from tvist_controller.kinematics.postures import is_of_ur_form
from tvist_plant.description import RobotDescription
from tvist_server.options import ProfileName

UR_START = (-1.60, -1.727, -2.203, -0.808, 1.595, -0.031)
"""Posture in which URSim starts a six-joint arm, away from all singular postures [rad]."""


class Profile(Struct, frozen=True, kw_only=True):
    """Defaults for options of `tvist serve`; the fields' own defaults apply without a profile."""

    payload: float | None = None
    """Mass of the disc on the flange, both declared and carried [kg]; None: the robot file's payload."""
    ur_start: bool = False  # whether an arm with UR's geometry starts in URSim's posture instead of `Q1`
    shaper: str = "zv"
    quiet: bool = False  # whether sensors are free of noise
    floor: bool = True  # whether motions keep clear of the floor
    compensate_sag: bool = False  # whether the drives compensate the twist of the gears under gravity

    def start(self, description: RobotDescription) -> tuple[float, ...] | None:
        """Return the posture to start in [rad]; None: the robot file's `Q1`."""
        return UR_START if self.ur_start and is_of_ur_form(description) else None


PROFILES: Mapping[ProfileName | None, Profile] = {
    None: Profile(),
    "ursim": Profile(payload=0.0, ur_start=True, shaper="none", quiet=True, floor=False, compensate_sag=True),
    "real": Profile(ur_start=True),
}
"""Profiles by name: `ursim` behaves like UR's simulator, `real` like a real robot."""
