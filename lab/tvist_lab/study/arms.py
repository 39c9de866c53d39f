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


@dataclass(frozen=True)
class ArmVariant:
    """One of the arms. The controller uses the unchanged description for all of them."""

    name: str
    """Name in JSON."""
    label: str
    """What distinguishes it, for people."""
    make: Callable[[RobotDescription, Payload, int], Placeable]
    """Creates a plant that provides the truth from description, carried payload and seed."""


def _imperfect(description: RobotDescription, carried: Payload, imperfections: Imperfections) -> FlexibleArm:
    return FlexibleArm(description, carried, imperfections=imperfections, substeps=SUBSTEPS)


def _calibrated(description: RobotDescription, carried: Payload, seed: int) -> FlexibleArm:  # noqa: ARG001
    return FlexibleArm(description, carried)


def _coulomb(description: RobotDescription, carried: Payload, seed: int) -> FlexibleArm:  # noqa: ARG001
    drives = replace(description.drives, friction_width=0.2 * description.drives.friction_width)
    return _imperfect(replace(description, drives=drives), carried, Imperfections())


def _stribeck(description: RobotDescription, carried: Payload, seed: int) -> FlexibleArm:  # noqa: ARG001
    drives = replace(description.drives, friction_width=0.3 * description.drives.friction_width)
    return _imperfect(replace(description, drives=drives), carried, Imperfections(breakaway=1.5))


def _hysteretic(description: RobotDescription, carried: Payload, seed: int) -> FlexibleArm:  # noqa: ARG001
    return _imperfect(description, carried, Imperfections(hysteresis=0.3))


def _piecewise(description: RobotDescription, carried: Payload, seed: int) -> FlexibleArm:  # noqa: ARG001
    return _imperfect(description, carried, Imperfections(soft=0.75))


def _scattered(description: RobotDescription, carried: Payload, seed: int) -> FlexibleArm:
    return FlexibleArm(softer_and_stiffer(description, SCATTER, [seed, 15]), carried)


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


def _blind(description: RobotDescription, carried: Payload, seed: int) -> FlexibleArm:
    return _imperfect(_unlike(description, seed), carried, Imperfections(base=YieldingBase()))


def _blind_mujoco(description: RobotDescription, carried: Payload, seed: int) -> MujocoArm:
    return MujocoArm(_unlike(description, seed), carried)


def _on_base(description: RobotDescription, carried: Payload, seed: int) -> FlexibleArm:  # noqa: ARG001
    return _imperfect(description, carried, Imperfections(base=YieldingBase()))


def _mujoco(description: RobotDescription, carried: Payload, seed: int) -> MujocoArm:  # noqa: ARG001
    return MujocoArm(description, carried)


ARMS = (
    ArmVariant("calibrated", "as described", _calibrated),
    ArmVariant("coulomb", "friction that changes sign within a fifth of the speed", _coulomb),
    ArmVariant("stribeck", "friction 50 % higher at breakaway", _stribeck),
    ArmVariant(
        "hysteresis",
        "gears with hysteresis: 30 % stiffer when turning back, 2 % of the torque lost",
        _hysteretic,
    ),
    ArmVariant("piecewise", "gears 25 % softer below a tenth of the torque", _piecewise),
    ArmVariant(
        "scattered",
        "stiffness and gains of every joint and link changed by 15 %, up or down at random",
        _scattered,
    ),
    ArmVariant("base", "a flexible base, 150 kN m/rad about two axes", _on_base),
    ArmVariant("mujoco", "simulated in MuJoCo, without gear error", _mujoco),
    ArmVariant(
        "blind",
        "unlike the description in every mass (7 %), centre of mass (10 mm per axis), stiffness and gain (15 %), with "
        "sharper friction, and bending in its base as well",
        _blind,
    ),
    ArmVariant(
        "blind_mujoco",
        "unlike the description in every mass, centre of mass, stiffness and gain, with sharper friction, in MuJoCo",
        _blind_mujoco,
    ),
)
"""The arms of ShaperBench."""
AS_DESCRIBED = ARMS[0]
"""The arm that is as the controller knows it."""


def scattered(share: float) -> ArmVariant:
    """Return an arm with each gear, link and velocity loop stiffer or softer by a share, at random."""
    if share == 0.0:
        return AS_DESCRIBED
    return ArmVariant(
        f"scattered_{100.0 * share:g}_percent",
        f"stiffness and gains off by {100.0 * share:g} %",
        partial(_off, share),
    )


def _off(share: float, description: RobotDescription, carried: Payload, seed: int) -> FlexibleArm:
    return FlexibleArm(softer_and_stiffer(description, share, [seed, 29]), carried)


def with_springs(factor: float) -> ArmVariant:
    """Return an arm all of whose springs are stiffer by a factor."""
    if factor == 1.0:
        return AS_DESCRIBED
    return ArmVariant(
        f"springs_{100.0 * (factor - 1.0):+g}_percent",
        f"springs {100.0 * (factor - 1.0):+g} %",
        partial(_sprung, factor),
    )


def _sprung(
    factor: float,
    description: RobotDescription,
    carried: Payload,
    seed: int,  # noqa: ARG001  this arm is not drawn
) -> FlexibleArm:
    return FlexibleArm(stiffer(description, factor), carried)


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
