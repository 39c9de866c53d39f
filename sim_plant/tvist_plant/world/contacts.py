"""Contacts of a world: each pair of shapes is a spring and damper with friction.

MuJoCo's contact force, with a negative `solref` (-s, -b) and a constant impedance d, is

    f = (s r + b v) / [Â (1 - d) + A d]

at depth r and approach speed v, where A is the inverse effective mass of the contact and Â MuJoCo's estimate
at compile time. With d near 0 only Â remains, so s = k Â and b = c Â give a spring k [N/m] and a damper c [N
s/m] for any mass and lever. The force lags the position by a step h, so a body with A k h² above 4 would be
flung away; `check_masses` refuses it long before. Friction is at most μ f. Below that it yields `IMPRATIO`
times less than the contact, so a held part creeps by some micrometres a second.

Source: MuJoCo's documentation, "Computation", sections "Impedance", "Reference" and "Regularization".
"""

from collections.abc import Iterator, Sequence
from itertools import combinations

import mujoco
import numpy as np

from tvist_plant.world.scene_file import SceneError

PREFIX = "world/"  # prefix of the scene's names in the model, to keep them apart from the arm's
STIFFNESS = 1e5  # default stiffness of a contact [N/m]
DAMPING_RATIO = 0.3  # default damping ratio of a contact, for the mass that MuJoCo estimates [-]
IMPEDANCE = 2e-3  # d: fraction by which a contact's stiffness depends on the bodies [-]
IMPRATIO = 1e6  # stiffness of friction relative to the contact [-]
FACES = 4
"""Contact points of a box on a box or plane, which share the stiffness; other shapes touch at one point."""
GRIP = 500.0  # rate at which friction ends slip [1/s]
MOST_PAIRS = 4000  # largest number of shape pairs that can be checked in real time at steps of 0.25 ms
FIRMEST = 0.5  # largest A k h²; above, a contact would oscillate within few steps [-]

TURNS = 50.0
"""Ratio of inverse mass at a body's reach to that at its centre of mass, above which it is treated as only
turning [-]."""

_FLAT = {int(mujoco.mjtGeom.mjGEOM_BOX), int(mujoco.mjtGeom.mjGEOM_PLANE)}

ALL = 0x7FFFFFFF  # `contype` and `conaffinity` of arm and fingers, which touch every solid shape

Names = frozenset[str]
Contacts = Sequence[tuple[float | None, float | None]]
"""Stiffness [N/m] and damping [N s/m] of each pair of shapes; None where no shape defines them."""


def add_pairs(spec: "mujoco.MjSpec", model: "mujoco.MjModel", arm: Names) -> Contacts:
    """Add every pair of named shapes that may touch, not within the arm; `model` is `spec` compiled."""
    own = {frozenset((pair.geomname1, pair.geomname2)) for pair in spec.pairs}
    apart = {frozenset((one.bodyname1, one.bodyname2)) for one in spec.excludes}
    shapes = [one for one in spec.geoms if one.contype or one.conaffinity]
    given: list[tuple[float | None, float | None]] = [(None, None)] * len(spec.pairs)
    for first, second in _touching(shapes, model, arm, apart):
        if frozenset((first.name, second.name)) in own:
            continue
        pair = spec.add_pair(geomname1=first.name, geomname2=second.name)
        slide, twist, roll = np.maximum(first.friction, second.friction)
        pair.condim = max(first.condim, second.condim) if slide > 0.0 else 1
        pair.friction = [slide, slide, twist, roll, roll]
        pair.margin = max(first.margin, second.margin)
        pair.solimp = [IMPEDANCE, IMPEDANCE, 1e-3, 0.5, 2.0]
        given.append(_in_series(first, second))
        if len(given) > MOST_PAIRS:
            raise SceneError(
                f"more than {MOST_PAIRS} pairs of shapes may touch, too many for real time; "
                'give what is only seen contype="0" conaffinity="0"'
            )
    for one in spec.geoms:  # only shapes of the added pairs touch
        one.contype = one.conaffinity = 0
    return given


def set_contacts(model: "mujoco.MjModel", given: Contacts) -> None:
    """Set spring and damper of each pair of `add_pairs` for the present masses."""
    if given:
        _count_turning(model)
    for number, (stiffness, damping) in enumerate(given):
        if model.pair_solimp[number][0] != IMPEDANCE:
            continue  # keep the scene's own pairs
        if (inverse := _inverse_mass(model, number)) == 0.0:
            continue  # both shapes are immovable
        k = STIFFNESS if stiffness is None else stiffness
        c = 2.0 * DAMPING_RATIO * np.sqrt(k / inverse) if damping is None else damping
        kinds = {int(model.geom_type[geom]) for geom in (model.pair_geom1[number], model.pair_geom2[number])}
        points = FACES if kinds <= _FLAT else 1
        model.pair_solref[number] = np.array([-k * inverse, -c * inverse]) / points
        model.pair_solreffriction[number] = [0.0, -GRIP * IMPEDANCE]


def _count_turning(model: "mujoco.MjModel") -> None:
    """Set the inverse mass of bodies that can only turn about their centre of mass, from inertia and reach.

    MuJoCo's Â refers to the centre of mass, which such bodies do not move: Â would be zero or far too small.
    """
    for body in range(1, model.nbody):
        light, turning = model.body_invweight0[body]
        shapes = slice(first := model.body_geomadr[body], first + model.body_geomnum[body])
        away = np.linalg.norm(model.geom_pos[shapes] - model.body_ipos[body], axis=1)
        reach = np.max(away + model.geom_rbound[shapes], initial=0.0)
        if TURNS * light < turning * reach**2:
            model.body_invweight0[body, 0] = turning * reach**2


def check_masses(model: "mujoco.MjModel", timestep: float) -> None:
    """Check that no body is too light for the contact springs of shapes that it may touch."""
    for number in range(model.npair):
        inverse = _inverse_mass(model, number)
        if inverse == 0.0:
            continue
        k = -model.pair_solref[number][0] / inverse
        for geom in (model.pair_geom1[number], model.pair_geom2[number]):
            body = model.body_weldid[model.geom_bodyid[geom]]
            light, turning = model.body_invweight0[body]
            reach = min(float(model.geom_rbound[geom]), 1.0)
            if (value := (light + turning * reach**2) * k * timestep**2) > FIRMEST:
                name = model.body(body).name.removeprefix(PREFIX)
                raise SceneError(
                    f"{name} of {model.body_subtreemass[body]:.3g} kg is too light for a contact of {k:.3g} N/m, and "
                    f"would fly apart: give it {value / FIRMEST:.2g} times the mass, or its shapes a softer "
                    'solref="-N/m -N s/m"'
                )


def _inverse_mass(model: "mujoco.MjModel", pair: int) -> float:
    """Return MuJoCo's estimate of a pair's inverse effective mass, Â [1/kg]."""
    geoms = model.pair_geom1[pair], model.pair_geom2[pair]
    return float(sum(model.body_invweight0[model.geom_bodyid[geom]][0] for geom in geoms))


def _touching(
    shapes: Sequence["mujoco.MjsGeom"], model: "mujoco.MjModel", arm: Names, apart: set[frozenset[str]]
) -> Iterator[tuple["mujoco.MjsGeom", "mujoco.MjsGeom"]]:
    """Yield shape pairs by MuJoCo's rules: at least one moves, and bodies are neither equal nor adjacent."""
    fixed_to = model.body_weldid

    def before(body: int) -> int:
        return int(fixed_to[model.body_parentid[body]])

    for first, second in combinations(shapes, 2):
        one, other = (int(fixed_to[model.geom(shape.name).bodyid[0]]) for shape in (first, second))
        neighbours = one and other and (before(one) == other or before(other) == one)
        kept_apart = frozenset((first.parent.name, second.parent.name)) in apart
        if arm >= {first.name, second.name} or one == other or kept_apart or neighbours:
            continue
        if first.contype & second.conaffinity or second.contype & first.conaffinity:
            yield first, second


def _in_series(first: "mujoco.MjsGeom", second: "mujoco.MjsGeom") -> tuple[float | None, float | None]:
    """Return stiffness and damping of two shapes in series; None if neither defines them."""
    given = [-np.array(one.solref[:2]) for one in (first, second) if one.solref[0] < 0.0]
    if not given:
        return None, None
    if not all(np.isfinite(one).all() and one[1] >= 0.0 for one in given):
        raise SceneError(f'{first.name} or {second.name} has a solref that is not "-N/m -N s/m"')
    k, c = ([float(one[part]) for one in given] for part in (0, 1))
    return 1.0 / sum(1.0 / one for one in k), 0.0 if 0.0 in c else 1.0 / sum(1.0 / one for one in c)
