"""The arms of studies: those of `tvist_plant.variants`, and variants that MuJoCo simulates."""

from tvist_plant.description import Payload, RobotDescription
from tvist_plant.plant import SimulatedArm
from tvist_plant.variants import VARIANTS, Variant
from tvist_plant.world.mujoco_arm import MujocoArm

PERTURBED = ("stribeck", "hysteresis", "torsion", "base", "backlash", "combined")
"""Plants for judging robustness, besides wrong springs and payloads."""
JUDGED = ("calibrated", *PERTURBED, "springs-30", "springs+30")  # plants on which two methods are compared


class MujocoVariant(Variant):
    """An arm that MuJoCo simulates, without gear error."""

    def make(self, description: RobotDescription, carried: Payload, seed: int) -> SimulatedArm:
        """Create a plant that provides the truth; see `Variant.make`."""
        return MujocoArm(self.truly(description, seed), carried)


def _of(*names: str) -> tuple[Variant, ...]:
    return tuple(VARIANTS[name] for name in names)


ARMS: tuple[Variant, ...] = (
    *_of("calibrated", "coulomb", "stribeck", "hysteresis", "piecewise", "scattered", "base"),
    MujocoVariant("mujoco", "simulated in MuJoCo, without gear error"),
    *_of("blind"),
    MujocoVariant(
        "blind_mujoco",
        "unlike the description in every mass, centre of mass, stiffness and gain, with sharper friction, in MuJoCo",
        VARIANTS["blind"].truly,
    ),
    *_of("torsion", "backlash", "combined"),
)
"""The arms of ShaperBench."""
