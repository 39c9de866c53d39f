"""A scene and the arm in it, as one model of MuJoCo."""

from dataclasses import dataclass

import mujoco
import numpy as np
import pinocchio as pin

from tvist_plant.description import Payload, RobotDescription
from tvist_plant.plant import Hand, Shape, Things
from tvist_plant.world.arm_form import LOAD, arm_spec, link_name
from tvist_plant.world.contacts import ALL, IMPRATIO, PREFIX, Contacts, add_pairs, check_masses, set_contacts
from tvist_plant.world.fingers import add_fingers
from tvist_plant.world.scene_file import SceneError, SceneFile

TOOL = "tool"
"""Name of the scene's body whose shapes are mounted on the flange."""
MOST_BODIES = 50
"""Largest number of bodies that move."""
_KINDS = {
    mujoco.mjtGeom.mjGEOM_PLANE: "plane",
    mujoco.mjtGeom.mjGEOM_SPHERE: "sphere",
    mujoco.mjtGeom.mjGEOM_CAPSULE: "capsule",
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: "ellipsoid",
    mujoco.mjtGeom.mjGEOM_CYLINDER: "cylinder",
    mujoco.mjtGeom.mjGEOM_BOX: "box",
}


@dataclass(frozen=True)
class World:
    """An arm in a scene."""

    model: "mujoco.MjModel"
    """Both, the arm first."""
    contacts: Contacts
    """Result of `add_pairs`, for `set_contacts`."""
    things: Things
    """What there is besides the arm."""
    bodies: tuple[int, ...]
    """Numbers of the bodies of `things`."""
    arm: tuple[int, ...]
    """Numbers of the arm's bodies, with what is mounted on it."""


def build(
    description: RobotDescription, payload: Payload, scene: SceneFile, timestep: float, hand: Hand | None
) -> World:
    """Put an arm with its payload, and maybe a gripper, into a scene, whose origin is the arm's base.

    The time step is that of MuJoCo's integrator [s].

    Raises:
        SceneError: The file is no scene, or no arm can stand in it.
    """
    spec = arm_spec(description, payload, timestep)
    option = spec.option
    option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    option.cone, option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, IMPRATIO
    content = mujoco.MjSpec.from_file(str(scene.path))
    tool = content.body(TOOL)
    tooled = tool is not None
    _name_all(spec, "arm ")
    load, before = spec.body(LOAD), {one.name for one in spec.bodies}
    if tooled:
        content.compiler.fusestatic = False  # else the tool would be part of the world
        _mount(tool, load, content.compile())
        content.delete(tool)
    if hand is not None:
        add_fingers(spec, load, hand)
    _add_capsules(spec, description, payload, hand, tooled=tooled)
    _name_all(content, "")
    arm, mounted = frozenset(one.name for one in spec.geoms), {one.name for one in spec.bodies}
    shown = (mounted - before) | ({LOAD} if tooled else set())
    spec.attach(content, frame=spec.worldbody.add_frame(), prefix=PREFIX)
    plain = spec.compile()
    given = add_pairs(spec, plain, arm)
    model = spec.compile()
    set_contacts(model, given)
    check_masses(model, timestep)
    names = [model.body(number).name for number in range(model.nbody)]
    bodies = tuple(
        number
        for number, name in enumerate(names)
        if (name not in mounted or name in shown) and model.body_weldid[number] and name
    )
    if len(bodies) > MOST_BODIES:
        raise SceneError(
            f"{len(bodies)} of its bodies move, too many for real time: must be at most {MOST_BODIES}"
        )
    own = tuple(number for number, name in enumerate(names) if name in mounted and number)
    return World(model, given, _things(scene.name, model, bodies, set(own) - set(bodies)), bodies, own)


def _mount(tool: "mujoco.MjsBody", load: "mujoco.MjsBody", alone: "mujoco.MjModel") -> None:
    """Mount the shapes of the scene's tool on the flange; their weight is the payload's.

    The load is the body beyond the flange. In `alone`, the scene compiled, poses and sizes are numbers
    however the file gives them.

    Raises:
        SceneError: It is more than shapes of primitive kinds.
    """
    if tool.joints or tool.bodies:
        raise SceneError(
            "the body 'tool', which is mounted on the flange, has joints or bodies: must have shapes only"
        )
    body = alone.body(tool.name)
    base, turn = np.zeros(3), np.zeros(4)
    for number, one in enumerate(tool.geoms):
        shape = alone.geom(body.geomadr[0] + number)
        if (kind := mujoco.mjtGeom(shape.type[0])) not in _KINDS:
            raise SceneError(f"shape {number} of the body 'tool' is a mesh: must be a primitive shape")
        mujoco.mju_mulPose(base, turn, body.pos, body.quat, shape.pos, shape.quat)
        made = load.add_geom(name=one.name or f"tool shape {number}", type=kind, size=shape.size, mass=0.0)
        made.pos, made.quat, made.rgba = base, turn, shape.rgba
        for name in ("friction", "condim", "solref", "margin", "contype", "conaffinity"):
            setattr(made, name, getattr(one, name))


def _add_capsules(
    spec: "mujoco.MjSpec", description: RobotDescription, payload: Payload, hand: Hand | None, *, tooled: bool
) -> None:
    """Give the arm the capsules of its file, and one for the payload unless the scene has a tool.

    They have no friction of their own: what they touch has.
    """
    capsule = mujoco.mjtGeom.mjGEOM_CAPSULE
    for one in description.collision.bodies:
        body = spec.worldbody if one.link < 0 else spec.body(link_name(description, one.link))
        ends = _ends(one.start, one.end)
        body.add_geom(
            name=f"arm {one.name}",
            type=capsule,
            size=[one.radius, 0, 0],
            fromto=ends,
            mass=0.0,
            friction=[0, 0, 0],
            contype=ALL,
            conaffinity=ALL,
        )
    radius, end = description.collision.payload_radius, 2.0 * np.array(payload.com)
    if hand is not None:  # the palm, as far as the fingers' roots
        radius, end = min(radius, 0.04), hand.root - 0.04 * hand.direction
    if not tooled and description.collision.bodies and (payload.mass or hand is not None):
        ends = _ends((0.0, 0.0, 0.0), tuple(end.tolist()))
        spec.body(LOAD).add_geom(
            name="arm payload", type=capsule, size=[radius, 0, 0], fromto=ends, mass=0.0, friction=[0, 0, 0],
            contype=ALL, conaffinity=ALL,
        )  # fmt: skip


def _ends(start: tuple[float, ...], end: tuple[float, ...]) -> list[float]:
    """Both ends of a capsule, which MuJoCo wants to differ."""
    return [*start, *end[:2], end[2] + (1e-6 if start == end else 0.0)]


def _name_all(spec: "mujoco.MjSpec", whose: str) -> None:
    """Give names to what has none, so that pairs and messages can name it."""
    for what, those in (("body", spec.bodies), ("shape", spec.geoms)):
        for number, one in enumerate(those):
            if not one.name:
                one.name = f"{whose}{what} {number}"


def _things(name: str, model: "mujoco.MjModel", bodies: tuple[int, ...], arm: set[int]) -> Things:
    shapes, unseen = [], 0
    for number in range(model.ngeom):
        body = int(model.geom_bodyid[number])
        if body in arm or model.geom_rgba[number][3] == 0.0 or model.geom(number).name.startswith("arm "):
            continue
        kind = _KINDS.get(mujoco.mjtGeom(model.geom_type[number]))
        if kind is None:
            unseen += 1
            continue
        shapes.append(
            _shape(model, kind, body, bodies, model.geom_size[number], model.geom_pos[number], model.geom_quat[number],
                   model.geom_rgba[number])
        )  # fmt: skip
    areas = {
        model.site(number).name.removeprefix(PREFIX): _shape(
            model, _KINDS.get(mujoco.mjtGeom(model.site_type[number]), "box"), int(model.site_bodyid[number]), bodies,
            model.site_size[number], model.site_pos[number], model.site_quat[number], model.site_rgba[number],
        )
        for number in range(model.nsite) if model.site(number).name
    }  # fmt: skip
    own = (model.body(body).name.removeprefix(PREFIX) for body in bodies)
    names = tuple(TOOL if one == LOAD else one for one in own)
    return Things(name, names, tuple(shapes), areas, unseen)


def _shape(
    model: "mujoco.MjModel", kind: str, body: int, bodies: tuple[int, ...],
    size: np.ndarray, pos: np.ndarray, quat: np.ndarray, rgba: np.ndarray,
) -> Shape:  # fmt: skip
    """A shape in the frame of the moving body that carries it, or in that of the base."""
    place = pin.SE3(pin.Quaternion(np.roll(quat, -1)).matrix(), np.array(pos))
    while body and body not in bodies:
        turn = pin.Quaternion(np.roll(model.body_quat[body], -1)).matrix()
        place = pin.SE3(turn, np.array(model.body_pos[body])) * place
        body = int(model.body_parentid[body])
    vector = (*place.translation.tolist(), *pin.log3(place.rotation).tolist())
    number = bodies.index(body) if body else None
    return Shape(kind, tuple(size.tolist()), vector, number, tuple(map(float, rgba)))
