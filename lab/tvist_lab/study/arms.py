"""Arms that differ from what the controller knows: eight in one way each, two in all ways, and any by a share."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from msgspec.structs import replace

from tvist_lab.mujoco_arm import MujocoArm
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.imperfections import Imperfections, YieldingBase
from tvist_plant.plant import Placeable

SUBSTEPS = 8
"""Number of integrator steps per period for an arm with imperfections, which are integrated explicitly."""
SCATTER = 0.15
"""Relative deviation of each stiffness and gain from the description, with random sign [-]."""
MASS_SCATTER, COM_SCATTER = 0.07, 0.010
"""Relative deviation of each link's mass [-], and deviation of its centre of mass along each axis [m], where the
description is wrong about all of them; random signs.
"""


def _same(description: RobotDescription, seed: int) -> RobotDescription:  # noqa: ARG001  nothing is drawn
    return description


@dataclass(frozen=True)
class ArmVariant:
    """One of the arms. The controller uses the unchanged description for all of them."""

    name: str
    """Name in JSON."""
    label: str
    """What distinguishes it, for people."""
    truly: Callable[[RobotDescription, int], RobotDescription] = _same
    """Returns what it is like from the controller's description and a seed."""
    imperfections: Imperfections | None = None
    """What no description says; None for none."""
    in_mujoco: bool = False
    """Whether MuJoCo simulates it, without gear error."""

    def make(self, description: RobotDescription, carried: Payload, seed: int) -> Placeable:
        """Create a plant that provides the truth, from the controller's description, carried payload and seed."""
        arm = self.truly(description, seed)
        if self.in_mujoco:
            return MujocoArm(arm, carried)
        if self.imperfections is None:
            return FlexibleArm(arm, carried)
        return FlexibleArm(arm, carried, imperfections=self.imperfections, substeps=SUBSTEPS)


def _sharper(share: float, description: RobotDescription, seed: int) -> RobotDescription:  # noqa: ARG001  not drawn
    """Return an arm whose friction changes sign within a share of the speed."""
    drives = description.drives
    return replace(description, drives=replace(drives, friction_width=share * drives.friction_width))


def _off(share: float, number: int, description: RobotDescription, seed: int) -> RobotDescription:
    return softer_and_stiffer(description, share, [seed, number])


def _sprung(factor: float, description: RobotDescription, seed: int) -> RobotDescription:  # noqa: ARG001  not drawn
    return stiffer(description, factor)


def _unlike(description: RobotDescription, seed: int) -> RobotDescription:
    """Return an arm of which the description knows neither masses nor springs, gains and friction exactly."""
    random, links = np.random.default_rng([seed, 47]), description.links

    def signs(*shape: int) -> np.ndarray[Any, Any]:
        return random.choice([-1.0, 1.0], shape)

    heavier = 1.0 + MASS_SCATTER * signs(len(links.mass))
    masses = tuple((np.array(links.mass) * heavier).tolist())
    centres = tuple(map(tuple, (np.array(links.com) + COM_SCATTER * signs(len(links.mass), 3)).tolist()))
    inertias = tuple(
        tuple((factor * np.array(one)).tolist()) for factor, one in zip(heavier, links.inertia, strict=True)
    )
    drives = replace(description.drives, friction_width=0.5 * description.drives.friction_width)
    other = replace(links, mass=masses, com=centres, inertia=inertias)
    return softer_and_stiffer(replace(description, links=other, drives=drives), SCATTER, [seed, 15])


ARMS = (
    ArmVariant("calibrated", "as described"),
    ArmVariant(
        "coulomb",
        "friction that changes sign within a fifth of the speed",
        partial(_sharper, 0.2),
        Imperfections(),
    ),
    ArmVariant(
        "stribeck", "friction 50 % higher at breakaway", partial(_sharper, 0.3), Imperfections(breakaway=1.5)
    ),
    ArmVariant(
        "hysteresis",
        "gears with hysteresis: 30 % stiffer when turning back, 2 % of the torque lost",
        imperfections=Imperfections(hysteresis=0.3),
    ),
    ArmVariant(
        "piecewise", "gears 25 % softer below a tenth of the torque", imperfections=Imperfections(soft=0.75)
    ),
    ArmVariant(
        "scattered",
        "stiffness and gains of every joint and link changed by 15 %, up or down at random",
        partial(_off, SCATTER, 15),
    ),
    ArmVariant(
        "base",
        "a flexible base, 150 kN m/rad about two axes",
        imperfections=Imperfections(base=YieldingBase()),
    ),
    ArmVariant("mujoco", "simulated in MuJoCo, without gear error", in_mujoco=True),
    ArmVariant(
        "blind",
        "unlike the description in every mass (7 %), centre of mass (10 mm per axis), stiffness and gain (15 %), with "
        "sharper friction, and bending in its base as well",
        _unlike,
        Imperfections(base=YieldingBase()),
    ),
    ArmVariant(
        "blind_mujoco",
        "unlike the description in every mass, centre of mass, stiffness and gain, with sharper friction, in MuJoCo",
        _unlike,
        in_mujoco=True,
    ),
)
"""The arms of ShaperBench."""
AS_DESCRIBED = ARMS[0]
"""The arm that is as the controller knows it."""


def scattered(share: float) -> ArmVariant:
    """Return an arm with each gear, link and velocity loop stiffer or softer by a share, at random."""
    if share == 0.0:
        return AS_DESCRIBED
    percent = f"{100.0 * share:g}"
    return ArmVariant(
        f"scattered_{percent}_percent", f"stiffness and gains off by {percent} %", partial(_off, share, 29)
    )


def with_springs(factor: float) -> ArmVariant:
    """Return an arm all of whose springs are stiffer by a factor."""
    if factor == 1.0:
        return AS_DESCRIBED
    percent = f"{100.0 * (factor - 1.0):+g}"
    return ArmVariant(f"springs_{percent}_percent", f"springs {percent} %", partial(_sprung, factor))


def stiffer(description: RobotDescription, factor: float) -> RobotDescription:
    """Return an arm all of whose springs are stiffer by a factor; their damping stays the same."""
    drives, links = description.drives, description.link_flexibility
    return replace(
        description,
        drives=replace(drives, gear_stiffness=tuple(factor * value for value in drives.gear_stiffness)),
        link_flexibility=replace(links, stiffness=tuple(factor * value for value in links.stiffness)),
    )


def softer_and_stiffer(description: RobotDescription, share: float, seed: list[int]) -> RobotDescription:
    """Return an arm with each gear, link and gain of the drives' loops changed by a share, up or down at random."""
    random = np.random.default_rng(seed)

    def scattered(values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple((np.array(values) * random.choice([1.0 - share, 1.0 + share], len(values))).tolist())

    drives, links = description.drives, description.link_flexibility
    names = ("gear_stiffness", "velocity_gain", "position_gain")
    other = replace(drives, **{name: scattered(getattr(drives, name)) for name in names})
    bending = replace(links, stiffness=scattered(links.stiffness))
    return replace(description, drives=other, link_flexibility=bending)
