"""Plants by name: arms that deviate, in one way or in many, from the robot file that their controller uses.

A hidden robot deviates in all parameters, as a real one would: each is multiplied by an independent factor,
uniform within 1 ± a share.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from math import radians
from typing import Any

import numpy as np
from msgspec import convert, structs

from tvist_plant.flexible_arm import SUBSTEPS_IF_IMPERFECT, FlexibleArm
from tvist_plant.imperfections import Imperfections, YieldingBase
from tvist_plant.plant import SimulatedArm
from tvist_plant.robot_tables import Drives, LinkFlexibility, Payload, RobotDescription
from tvist_plant.similar import counterpart

SCATTER = 0.15
"""Relative deviation of each stiffness and gain from the description, with random sign [-]."""
MASS_SCATTER, COM_SCATTER = 0.07, 0.010
"""Relative deviation of each link's mass [-] and deviation of its centre of mass per axis [m] in `blind`,
with random signs."""
TORSION = 2e4  # torsional stiffness of links that twist [N m/rad]
BACKLASH = (5e-5, 1e-4, 1e-4, 2e-4, 2e-4, 2e-4)
"""Half the backlash of each gear, by the corresponding joint of the UR5e [rad]."""
SPRINGS = ("gear_stiffness",)  # Stiffnesses among the drives' parameters
LOOPS = (*SPRINGS, "velocity_gain", "position_gain")  # springs and loop gains
DRIVES = {
    "gear_stiffness": 0.2,
    "gear_damping": 0.2,
    "velocity_gain": 0.3,
    "rotor_inertia": 0.2,
    "coulomb_friction": 0.2,
    "friction_width": 0.2,
}
"""Largest relative deviation per joint of a hidden robot's drives; the width is common to all joints [-]."""
LINKS = {"stiffness": 0.2, "damping_time": 0.2}
"""Largest relative deviation per bending link; the damping time is common to all links [-]."""
MASS = 0.15  # largest relative deviation of the carried mass from the declared one [-]
CENTRE = 0.015  # largest deviation of the carried centre of mass per flange axis [m]

HEAVIER: Mapping[str, float | tuple[float, ...]] = {
    "coulomb_friction": (1.21, 1.3, 1.02, 1.22, 1.29, 1.06),
    "stiction": (1.56, 1.49, 1.63, 2.32, 2.14, 2.04),
    "stiction_load": 1.85,
    "stiction_speed": 1.48,
    "stiction_stiffness": 0.79,
}
"""Factors for an arm with more friction than its controller knows, drawn once: F_s and μ_s within 1.3 to 2.5,
F_c within 1 to 1.4, v_s and σ within 0.7 to 1.5 [-]."""

Factors = Callable[[float, tuple[int, ...]], Any]  # function that returns factors for a share and a shape


def _same(description: RobotDescription, _seed: int) -> RobotDescription:
    return description


@dataclass(frozen=True)
class Variant:
    """A plant by name."""

    name: str  # name in JSON and on the command line
    label: str  # description for users
    truly: Callable[[RobotDescription, int], RobotDescription] = _same
    """Function that returns the true arm from the controller's description and a seed."""
    imperfections: Imperfections | None = None  # deviations that no description contains; None for none
    backlash: float = 0.0  # backlash of the gears, relative to `BACKLASH` [-]
    carries: Callable[[Payload], Payload] | None = None
    """Function that returns the carried payload from the declared one; None if they are equal."""
    seed: int | None = None  # fixed seed that overrides the given one

    def make(self, description: RobotDescription, carried: Payload, seed: int) -> SimulatedArm:
        """Create the arm from the controller's description, the declared payload and a seed."""
        arm = self.truly(description, seed if self.seed is None else self.seed)
        found = self.imperfections
        if self.backlash:
            joints = description.joints
            widths = (self.backlash * BACKLASH[counterpart(joint, joints)] for joint in range(joints))
            found = structs.replace(found or Imperfections(), backlash=tuple(widths))
        substeps = None if found is None else SUBSTEPS_IF_IMPERFECT
        return FlexibleArm(arm, carried, imperfections=found, substeps=substeps, carries=self.carries)


def _changed(
    description: RobotDescription, drives: Mapping[str, float], links: Mapping[str, float], factors: Factors
) -> RobotDescription:
    """Multiply parameters of drives and bending links by `factors(share, shape)`, with the given shares."""

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


def _off(
    share: float, number: int, description: RobotDescription, seed: int, names: tuple[str, ...] = LOOPS
) -> RobotDescription:
    """Change each gear, link and loop gain by a share, up or down at random."""
    random = np.random.default_rng((seed, number))
    return _changed(
        description, dict.fromkeys(names, share), {"stiffness": share},
        lambda share, shape: random.choice([1.0 - share, 1.0 + share], shape),
    )  # fmt: skip


def stiffer(factor: float, description: RobotDescription, _seed: int = 0) -> RobotDescription:
    """Multiply all springs by a factor, without changing their damping."""
    springs, links = dict.fromkeys(SPRINGS, factor), {"stiffness": factor}
    return _changed(description, springs, links, lambda factor, _: factor)


def _sharper(share: float, description: RobotDescription, _seed: int) -> RobotDescription:
    """Multiply the speed range within which friction changes sign by `share`, and make friction nonlinear."""
    drives = description.drives
    return structs.replace(
        description,
        drives=structs.replace(drives, friction_width=share * drives.friction_width, linear_friction=False),
    )


def rubbed(
    factors: Mapping[str, float | tuple[float, ...]], description: RobotDescription, _seed: int = 0
) -> RobotDescription:
    """Return the arm with stiction, friction and other imperfections times factors such as `HEAVIER`."""
    own = {"coulomb_friction": description.drives.coulomb_friction, **description.imperfections.given()}
    new = {name: (np.array(value) * factors.get(name, 1.0)).tolist() for name, value in own.items()}
    drives = structs.replace(description.drives, coulomb_friction=tuple(new.pop("coulomb_friction")))
    return structs.replace(description, drives=drives, imperfections=convert(new, Imperfections))


def in_file(file: RobotDescription, _description: RobotDescription, _seed: int) -> RobotDescription:
    """Return the arm of a robot file, independent of the controller's description."""
    return file


def _unlike(description: RobotDescription, seed: int) -> RobotDescription:
    """Return an arm that deviates in masses, springs, gains and friction."""
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
    """Return an arm with scattered springs, and friction that changes sign within half the speed range."""
    return _off(SCATTER, 61, _sharper(0.5, description, seed), seed, SPRINGS)


def hidden(description: RobotDescription, seed: int) -> RobotDescription:
    """Draw the true robot behind a robot file: springs, dampers, loop gains, rotors and friction differ."""
    random = np.random.default_rng([seed, 53])
    return _changed(
        description, DRIVES, LINKS, lambda share, shape: random.uniform(1.0 - share, 1.0 + share, shape)
    )


def _other_payload(payload: Payload, factor: float, aside: Any) -> Payload:
    """Scale the mass and shift the centre of a payload; an empty payload stays empty."""
    if payload.mass == 0.0:
        return payload
    centre = tuple((np.array(payload.com) + aside).tolist())
    inertia = tuple(factor * value for value in payload.inertia)
    return Payload(mass=factor * payload.mass, com=centre, inertia=inertia)  # type: ignore[arg-type]


def hidden_payload(declared: Payload, seed: int) -> Payload:
    """Return what a hidden robot with this seed (at least 0) carries for a declared payload."""
    random = np.random.default_rng([seed, 59])
    factor = float(random.uniform(1.0 - MASS, 1.0 + MASS))
    return _other_payload(declared, factor, random.uniform(-CENTRE, CENTRE, 3))


AS_DESCRIBED = Variant("calibrated", "as described")  # the arm exactly as described
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
    Variant("springs-30", "springs 30 % softer", partial(stiffer, 0.7)),
    Variant("springs+30", "springs 30 % stiffer", partial(stiffer, 1.3)),
)
VARIANTS = {one.name: one for one in _ALL}


def variant(name: str) -> Variant:
    """Return the plant of this name: one of `VARIANTS`, or a hidden robot, `hidden-SEED`."""
    kind, dash, number = name.partition("-")
    if kind == "hidden" and dash and number.isascii() and number.isdigit() and len(number) < 19:
        return hidden_variant(int(number))
    if name not in VARIANTS:
        raise ValueError(f"plant is {name!r}: must be hidden-SEED or one of {', '.join(VARIANTS)}")
    return VARIANTS[name]


def hidden_variant(seed: int) -> Variant:
    """Return a hidden robot, see `hidden`, which depends only on its own seed."""
    return Variant(
        f"hidden-{seed}",
        f"hidden: springs, dampers, loops, rotors, friction and payload drawn from {seed}",
        hidden,
        carries=partial(hidden_payload, seed=seed),
        seed=seed,
    )


def scattered(share: float) -> Variant:
    """Return an arm with stiffness and gains (gears, links, loops) raised or lowered at random by a share."""
    if share == 0.0:
        return AS_DESCRIBED
    percent = f"{100.0 * share:g}"
    return Variant(
        f"scattered_{percent}_percent", f"stiffness and gains off by {percent} %", partial(_off, share, 29)
    )


def with_springs(factor: float) -> Variant:
    """Return an arm with all springs multiplied by a factor."""
    if factor == 1.0:
        return AS_DESCRIBED
    percent = f"{100.0 * (factor - 1.0):+g}"
    return Variant(f"springs_{percent}_percent", f"springs {percent} %", partial(stiffer, factor))
