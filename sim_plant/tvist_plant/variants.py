"""Plants by name: arms that differ from what their controller knows, each in one way or in many.

A controller uses the robot file for all of them. What is drawn is drawn from the seed of a case or of a robot.

A hidden robot is not quite its file, so that a controller stands before it as before a real one: each gear and link is
softer or stiffer, its dampers, loops, rotors and friction are others, and what it carries is not quite what it was said
to carry. All factors are uniform within 1 ± a share, and independent of each other.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import radians
from typing import Any, Final

import numpy as np
from msgspec import structs

from tvist_plant.flexible_arm import SUBSTEPS_IF_IMPERFECT, FlexibleArm
from tvist_plant.imperfections import Imperfections, YieldingBase
from tvist_plant.plant import SimulatedArm
from tvist_plant.robot_tables import Drives, LinkFlexibility, Payload, RobotDescription
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
DRIVES: Final = {
    "gear_stiffness": 0.2,
    "gear_damping": 0.2,
    "velocity_gain": 0.3,
    "rotor_inertia": 0.2,
    "coulomb_friction": 0.2,
    "friction_width": 0.2,
}
"""Largest relative deviation of each joint's drive of a hidden robot; the width is one for all joints [-]."""
LINKS: Final = {"stiffness": 0.2, "damping_time": 0.2}
"""Largest relative deviation of each of its links that bends; the time is one for all links [-]."""
MASS: Final = 0.15
"""Largest relative deviation of its carried mass from the declared one [-]."""
CENTRE: Final = 0.015
"""Largest deviation of its carried centre of mass along each axis of the flange [m]."""

HEAVIER: Final[Mapping[str, float | tuple[float, ...]]] = {
    "coulomb_friction": (1.21, 1.3, 1.02, 1.22, 1.29, 1.06),
    "stiction": (1.56, 1.49, 1.63, 2.32, 2.14, 2.04),
    "stiction_load": 1.85,
    "stiction_speed": 1.48,
    "stiction_stiffness": 0.79,
}
"""Friction of an arm that sticks more than its controller knows, over what that knows, drawn once: F_s and μ_s within
1.3 to 2.5, F_c within 1 to 1.4, v_s and σ within 0.7 to 1.5 [-].
"""

Factors = Callable[[float, tuple[int, ...]], Any]
"""Makes factors of a shape from a share."""


def _same(description: RobotDescription, _seed: int) -> RobotDescription:
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
    seed: int | None = None
    """Seed of its own, which then counts alone."""

    def make(self, description: RobotDescription, carried: Payload, seed: int) -> SimulatedArm:
        """Create the arm from the controller's description, the payload that it is said to carry, and a seed."""
        arm = self.truly(description, seed if self.seed is None else self.seed)
        found = self.imperfections
        if self.backlash:
            joints = description.joints
            widths = (self.backlash * BACKLASH[counterpart(joint, joints)] for joint in range(joints))
            found = replace(found or Imperfections(), backlash=tuple(widths))
        substeps = None if found is None else SUBSTEPS_IF_IMPERFECT
        return FlexibleArm(arm, carried, imperfections=found, substeps=substeps, carries=self.carries)


def _changed(
    description: RobotDescription, drives: Mapping[str, float], links: Mapping[str, float], factors: Factors
) -> RobotDescription:
    """Return an arm with parameters of its drives and its bending links multiplied by factors of their shares."""

    def changed(table: Drives | LinkFlexibility, shares: Mapping[str, float]) -> Any:
        own = {name: np.array(getattr(table, name)) for name in shares}
        new = {name: (value * factors(shares[name], value.shape)).tolist() for name, value in own.items()}
        return structs.replace(
            table, **{name: tuple(value) if isinstance(value, list) else value for name, value in new.items()}
        )

    return structs.replace(
        description,
        drives=changed(description.drives, drives),
        link_flexibility=changed(description.link_flexibility, links),
    )


def _signs(*seed: int) -> Factors:
    """Return what draws 1 plus or minus a share."""
    random = np.random.default_rng(seed)
    return lambda share, shape: random.choice([1.0 - share, 1.0 + share], shape)


def _off(
    share: float, number: int, description: RobotDescription, seed: int, names: tuple[str, ...] = LOOPS
) -> RobotDescription:
    """Return an arm with each gear, link and gain of the drives' loops changed by a share, up or down at random."""
    return _changed(description, dict.fromkeys(names, share), {"stiffness": share}, _signs(seed, number))


def stiffer(description: RobotDescription, factor: float) -> RobotDescription:
    """Return an arm all of whose springs are stiffer by a factor; their damping stays the same."""
    springs, links = dict.fromkeys(SPRINGS, factor), {"stiffness": factor}
    return _changed(description, springs, links, lambda factor, _: factor)


def _sprung(factor: float, description: RobotDescription, _seed: int) -> RobotDescription:
    return stiffer(description, factor)


def _sharper(share: float, description: RobotDescription, _seed: int) -> RobotDescription:
    """Return an arm whose friction, never linear, changes sign within a share of the speed."""
    drives = description.drives
    return structs.replace(
        description,
        drives=structs.replace(drives, friction_width=share * drives.friction_width, linear_friction=False),
    )


def rubbed(
    factors: Mapping[str, float | tuple[float, ...]], description: RobotDescription, _seed: int = 0
) -> RobotDescription:
    """Return an arm whose motors stick, with its friction multiplied by factors, such as `HEAVIER`."""
    own = {"coulomb_friction": description.drives.coulomb_friction, **description.imperfections}
    new = {name: (np.array(value) * factors.get(name, 1.0)).tolist() for name, value in own.items()}
    drives = structs.replace(description.drives, coulomb_friction=tuple(new.pop("coulomb_friction")))
    return structs.replace(description, drives=drives, imperfections=new)


def in_file(file: RobotDescription, _description: RobotDescription, _seed: int) -> RobotDescription:
    """Return an arm that is as a robot file says, whatever its controller knows."""
    return file


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
    return _off(SCATTER, 15, structs.replace(description, links=other, drives=drives), seed)


def _all_at_once(description: RobotDescription, seed: int) -> RobotDescription:
    """Return an arm with each spring softer or stiffer, and friction that changes sign in half the speed."""
    return _off(SCATTER, 61, _sharper(0.5, description, seed), seed, SPRINGS)


def hidden(description: RobotDescription, seed: int) -> RobotDescription:
    """Draw the robot behind a robot file, which is all that a controller knows, by a seed of at least 0.

    Its springs, dampers, loops, rotors and friction differ; kinematics, masses, limits and sensors are the
    file's.
    """
    random = np.random.default_rng([seed, 53])
    return _changed(
        description, DRIVES, LINKS, lambda share, shape: random.uniform(1.0 - share, 1.0 + share, shape)
    )


def _other_payload(payload: Payload, factor: float, aside: Any) -> Payload:
    """Return a payload with another mass, whose centre is elsewhere; nothing stays nothing."""
    if payload.mass == 0.0:
        return payload
    centre = tuple((np.array(payload.com) + aside).tolist())
    inertia = tuple(factor * value for value in payload.inertia)
    return Payload(mass=factor * payload.mass, com=centre, inertia=inertia)  # type: ignore[arg-type]


def hidden_payload(declared: Payload, seed: int) -> Payload:
    """Return what a hidden robot carries when somebody says that it carries a payload.

    The same seed, at least 0, gives the same error each time.
    """
    random = np.random.default_rng([seed, 59])
    factor = float(random.uniform(1.0 - MASS, 1.0 + MASS))
    return _other_payload(declared, factor, random.uniform(-CENTRE, CENTRE, 3))


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
        carries=partial(_other_payload, factor=1.1, aside=(0.015, 0.0, 0.0)),
    ),
    Variant("springs-30", "springs 30 % softer", partial(_sprung, 0.7)),
    Variant("springs+30", "springs 30 % stiffer", partial(_sprung, 1.3)),
)
VARIANTS: Final = {one.name: one for one in _ALL}
"""All plants by name."""


def variant(name: str) -> Variant:
    """Return a plant by its name: one of `VARIANTS`, or a hidden robot, `hidden-SEED`."""
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
        hidden,
        carries=partial(hidden_payload, seed=seed),
        seed=seed,
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
