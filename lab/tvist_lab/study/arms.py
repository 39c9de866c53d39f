"""The arms of studies: those of `tvist_plant.variants`, and the same in MuJoCo."""

from dataclasses import dataclass

from tvist_plant.description import Payload, RobotDescription
from tvist_plant.plant import SimulatedArm
from tvist_plant.variants import AS_DESCRIBED, VARIANTS, Variant, scattered, stiffer, with_springs
from tvist_plant.world.mujoco_arm import MujocoArm

__all__ = [
    "ARMS",
    "AS_DESCRIBED",
    "JUDGED",
    "PERTURBED",
    "ArmVariant",
    "scattered",
    "stiffer",
    "with_springs",
]

PERTURBED = ("stribeck", "hysteresis", "torsion", "base", "backlash", "combined")
"""Plants for judging robustness, besides wrong springs and payloads."""
JUDGED = ("calibrated", *PERTURBED, "springs-30", "springs+30")  # plants on which two methods are compared


@dataclass(frozen=True)
class ArmVariant(Variant):
    """One of the arms of a study."""

    in_mujoco: bool = False  # whether MuJoCo simulates it, without gear error

    def make(self, description: RobotDescription, carried: Payload, seed: int) -> SimulatedArm:
        """Create a plant that provides the truth; see `Variant.make`."""
        if self.in_mujoco:
            return MujocoArm(self.truly(description, seed), carried)
        return super().make(description, carried, seed)


def _of(*names: str) -> tuple[Variant, ...]:
    return tuple(VARIANTS[name] for name in names)


ARMS: tuple[Variant, ...] = (
    *_of("calibrated", "coulomb", "stribeck", "hysteresis", "piecewise", "scattered", "base"),
    ArmVariant("mujoco", "simulated in MuJoCo, without gear error", in_mujoco=True),
    *_of("blind"),
    ArmVariant(
        "blind_mujoco",
        "unlike the description in every mass, centre of mass, stiffness and gain, with sharper friction, in MuJoCo",
        VARIANTS["blind"].truly,
        in_mujoco=True,
    ),
    *_of("torsion", "backlash", "combined"),
)
"""The arms of ShaperBench."""
