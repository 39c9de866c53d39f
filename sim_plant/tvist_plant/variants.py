"""Plants by name: arms that differ from what their controller knows, each in one way or in many.

A controller uses the robot file for all of them. What is drawn is drawn from the seed of a case or of a robot.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import radians
from typing import Any, Final

import numpy as np
from msgspec import structs

from tvist_plant.flexible_arm import SUBSTEPS_IF_IMPERFECT, FlexibleArm
from tvist_plant.hidden import hidden, hidden_payload
from tvist_plant.imperfections import Imperfections, YieldingBase
from tvist_plant.plant import SimulatedArm
from tvist_plant.robot_tables import Payload, RobotDescription
from tvist_plant.similar import counterpart

SCATTER: Final = 0.15
"""Relative deviation of each stiffness and gain from the description, with random sign [-]."""
MASS_SCATTER, COM_SCATTER = 0.07, 0.010
"""Relative deviation of each link's mass [-], and deviation of its centre of mass along each axis [m], where the
description is wrong about all of them; random signs.
"""
TORSION: Final = 2e4
"""Stiffness of links that twist [N m/rad]."""
BACKLASH: Final = (5e-5, 1e-4, 1e-4, 2e-4, 2e-4, 2e-4)
"""Half of the width of the gears' backlash, by the joint of the UR5e that a joint is like [rad]."""
SPRINGS: Final = ("gear_stiffness",)
"""What is a spring among the parameters of the drives."""
LOOPS: Final = (*SPRINGS, "velocity_gain", "position_gain")
"""Springs and the gains of the loops."""


def _same(description: RobotDescription, seed: int) -> RobotDescription:  # noqa: ARG001  nothing is drawn
    return description


@dataclass(frozen=True)
class Variant:
    """One of the arms. The controller uses the unchanged description for all of them."""

    name: str
    """Name in JSON, and on the command line."""
    label: str
    """What distinguishes it, for people."""
    truly: Callable[[RobotDescription, int], RobotDescription] = _same
    """Returns what it is like from the controller's description and a seed."""
    imperfections: Imperfections | None = None
    """What no description says; None for none."""
    backlash: float = 0.0
    """Backlash of its gears, relative to `BACKLASH` [-]."""
    carries: Callable[[Payload], Payload] | None = None
    """Returns what it carries from what it is said to carry; None if that is true."""

    def make(self, description: RobotDescription, carried: Payload, seed: int) -> SimulatedArm:
        """Create the arm from the controller's description, the payload that it is said to carry, and a seed.

        Raises:
            ValueError: It cannot be this one, since none of its links bends.
        """
        arm, found = self.truly(description, seed), self.imperfections
        if self.backlash:
            joints = description.joints
            widths = (self.backlash * BACKLASH[counterpart(joint, joints)] for joint in range(joints))
            found = replace(found or Imperfections(), backlash=tuple(widths))
        substeps = None if found is None else SUBSTEPS_IF_IMPERFECT
        return FlexibleArm(arm, carried, imperfections=found, substeps=substeps, carries=self.carries)


def _heavier(payload: Payload) -> Payload:
    """Return a payload with a tenth more mass, whose centre is off by 15 mm sideways; nothing stays nothing."""
    if payload.mass == 0.0:
        return payload
    (x, y, z), (xx, xy, xz, yy, yz, zz) = payload.com, (1.1 * value for value in payload.inertia)
    return Payload(mass=1.1 * payload.mass, com=(x + 0.015, y, z), inertia=(xx, xy, xz, yy, yz, zz))


def _sharper(share: float, description: RobotDescription, seed: int) -> RobotDescription:  # noqa: ARG001  not drawn
    """Return an arm whose friction, never linear, changes sign within a share of the speed."""
    drives = description.drives
    return structs.replace(
        description,
        drives=structs.replace(drives, friction_width=share * drives.friction_width, linear_friction=False),
    )


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
    drives = structs.replace(description.drives, friction_width=0.5 * description.drives.friction_width)
    other = structs.replace(links, mass=masses, com=centres, inertia=inertias)
    return softer_and_stiffer(structs.replace(description, links=other, drives=drives), SCATTER, [seed, 15])


def _all_at_once(description: RobotDescription, seed: int) -> RobotDescription:
    """Return an arm with each spring softer or stiffer, and friction that changes sign in half the speed."""
    return softer_and_stiffer(_sharper(0.5, description, seed), SCATTER, [seed, 61], SPRINGS)


def _hidden(number: int, description: RobotDescription, seed: int) -> RobotDescription:  # noqa: ARG001  its own seed
    return hidden(description, number)


AS_DESCRIBED: Final = Variant("calibrated", "as described")
"""The arm that is as the controller knows it."""
_ALL = (
    AS_DESCRIBED,
    Variant(
        "coulomb",
        "friction that changes sign within a fifth of the speed",
        partial(_sharper, 0.2),
        Imperfections(),
    ),
    Variant(
        "stribeck", "friction 50 % higher at breakaway", partial(_sharper, 0.3), Imperfections(breakaway=1.5)
    ),
    Variant(
        "hysteresis",
        "gears with hysteresis: 30 % stiffer when turning back, 2 % of the torque lost",
        imperfections=Imperfections(hysteresis=0.3),
    ),
    Variant(
        "piecewise", "gears 25 % softer below a tenth of the torque", imperfections=Imperfections(soft=0.75)
    ),
    Variant(
        "scattered",
        "stiffness and gains of every joint and link changed by 15 %, up or down at random",
        partial(_off, SCATTER, 15),
    ),
    Variant(
        "base",
        "a flexible base, 150 kN m/rad about two axes",
        imperfections=Imperfections(base=YieldingBase()),
    ),
    Variant(
        "blind",
        "unlike the description in every mass (7 %), centre of mass (10 mm per axis), stiffness and gain (15 %), with "
        "sharper friction, and bending in its base as well",
        _unlike,
        Imperfections(base=YieldingBase()),
    ),
    Variant("torsion", "links that twist, 20 kN m/rad each", imperfections=Imperfections(torsion=TORSION)),
    Variant(
        "backlash",
        "gears with backlash of ±0.05 mrad (base), ±0.1 mrad (large) and ±0.2 mrad (wrist)",
        backlash=1.0,
    ),
    Variant(
        "combined",
        "springs changed by 15 %, up or down at random, links that twist, half of the backlash, friction that changes "
        "sign within half of the speed, a tenth more mass 15 mm aside, and a floor that leans by 1°",
        _all_at_once,
        Imperfections(torsion=TORSION, tilt=radians(1.0)),
        backlash=0.5,
        carries=_heavier,
    ),
    Variant("springs-30", "springs 30 % softer", partial(_sprung, 0.7)),
    Variant("springs+30", "springs 30 % stiffer", partial(_sprung, 1.3)),
)
VARIANTS: Final = {one.name: one for one in _ALL}
"""All plants by name."""


def variant(name: str) -> Variant:
    """Return a plant by its name: one of `VARIANTS`, or a hidden robot, `hidden-SEED`.

    Raises:
        ValueError: There is none.
    """
    kind, dash, number = name.partition("-")
    if kind == "hidden" and dash and number.isascii() and number.isdigit() and len(number) < 19:
        return hidden_variant(int(number))
    if name not in VARIANTS:
        raise ValueError(f"plant is {name!r}: must be hidden-SEED or one of {', '.join(VARIANTS)}")
    return VARIANTS[name]


def hidden_variant(seed: int) -> Variant:
    """Return a hidden robot, see `hidden`; its draw depends on its own seed alone."""
    return Variant(
        f"hidden-{seed}",
        f"hidden: springs, dampers, loops, rotors, friction and payload drawn from {seed}",
        partial(_hidden, seed),
        carries=partial(hidden_payload, seed=seed),
    )


def scattered(share: float) -> Variant:
    """Return an arm with each gear, link and velocity loop stiffer or softer by a share, at random."""
    if share == 0.0:
        return AS_DESCRIBED
    percent = f"{100.0 * share:g}"
    return Variant(
        f"scattered_{percent}_percent", f"stiffness and gains off by {percent} %", partial(_off, share, 29)
    )


def with_springs(factor: float) -> Variant:
    """Return an arm all of whose springs are stiffer by a factor."""
    if factor == 1.0:
        return AS_DESCRIBED
    percent = f"{100.0 * (factor - 1.0):+g}"
    return Variant(f"springs_{percent}_percent", f"springs {percent} %", partial(_sprung, factor))


def stiffer(description: RobotDescription, factor: float) -> RobotDescription:
    """Return an arm all of whose springs are stiffer by a factor; their damping stays the same."""
    drives, links = description.drives, description.link_flexibility
    return structs.replace(
        description,
        drives=structs.replace(
            drives, gear_stiffness=tuple(factor * value for value in drives.gear_stiffness)
        ),
        link_flexibility=structs.replace(links, stiffness=tuple(factor * value for value in links.stiffness)),
    )


def softer_and_stiffer(
    description: RobotDescription, share: float, seed: list[int], names: tuple[str, ...] = LOOPS
) -> RobotDescription:
    """Return an arm with each gear, link and gain of the drives' loops changed by a share, up or down at random.

    The seed is that of the signs; the names say what is changed of the drives.
    """
    random = np.random.default_rng(seed)

    def scattered(values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple((np.array(values) * random.choice([1.0 - share, 1.0 + share], len(values))).tolist())

    drives, links = description.drives, description.link_flexibility
    other = structs.replace(drives, **{name: scattered(getattr(drives, name)) for name in names})
    bending = structs.replace(links, stiffness=scattered(links.stiffness))
    return structs.replace(description, drives=other, link_flexibility=bending)
