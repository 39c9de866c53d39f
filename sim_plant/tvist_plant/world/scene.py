"""A scene with the arm in it, as one MuJoCo model."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from tvist_plant.description import Payload, RobotDescription
from tvist_plant.surroundings import Hand, Shape, Things
from tvist_plant.world.arm_form import LOAD, arm_spec, link_name
from tvist_plant.world.contacts import ALL, IMPRATIO, PREFIX, Contacts, add_pairs, check_masses, set_contacts
from tvist_plant.world.fingers import add_fingers
from tvist_plant.world.scene_file import SceneError, SceneFile

TOOL = "tool"  # the scene's body whose shapes are mounted on the flange
MOST_BODIES = 50  # largest number of moving bodies
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
    """An arm, alone or in a scene."""

    model: "mujoco.MjModel"  # model of arm and scene, the arm first
    contacts: Contacts = ()  # result of `add_pairs`, for `set_contacts`
    things: Things | None = None  # the objects besides the arm
    bodies: tuple[int, ...] = ()  # numbers of the bodies of `things`
    arm: tuple[int, ...] = ()  # numbers of the bodies of the arm and of what is mounted on it


def build(
    description: RobotDescription, payload: Payload, scene: SceneFile, timestep: float, hand: Hand | None
) -> World:
    """Put an arm, its payload and a gripper, if any, into a scene with the arm's base at the origin."""
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
        content.compiler.fusestatic = False  # else the tool would merge with the world
        _mount(tool, load, content.compile())
        content.delete(tool)
    if hand is not None:
        add_fingers(spec, load, hand)
    _add_capsules(spec, description, payload, hand, tooled=tooled)
    _name_all(content, "")
    arm, mounted = frozenset(one.name for one in spec.geoms), {one.name for one in spec.bodies}
    shown = (mounted - before) | ({LOAD} if tooled else set())
    spec.attach(content, frame=spec.worldbody.add_frame(), prefix=PREFIX)
    given = add_pairs(spec, spec.compile(), arm)
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
    """Mount the scene's tool on the flange, without mass; `alone` is the compiled scene, with all numbers."""
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
    """Add the robot file's capsules without friction and, if the scene has no tool, one for the payload."""

    def add(
        body: "mujoco.MjsBody", name: str, start: Sequence[float], end: Sequence[float], radius: float
    ) -> None:
        ends = [
            *start,
            *end[:2],
            end[2] + (1e-6 if tuple(start) == tuple(end) else 0.0),
        ]  # MuJoCo's must differ
        body.add_geom(
            name=f"arm {name}", type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[radius, 0, 0], fromto=ends, mass=0.0,
            friction=[0, 0, 0], contype=ALL, conaffinity=ALL,
        )  # fmt: skip

    for one in description.collision.bodies:
        body = spec.worldbody if one.link < 0 else spec.body(link_name(description, one.link))
        add(body, one.name, one.start, one.end, one.radius)
    radius, end = description.collision.payload_radius, 2.0 * np.array(payload.com)
    if hand is not None:  # palm, up to the fingers' roots
        radius, end = min(radius, 0.04), hand.root - 0.04 * hand.direction
    if not tooled and description.collision.bodies and (payload.mass or hand is not None):
        add(spec.body(LOAD), "payload", (0.0, 0.0, 0.0), end.tolist(), radius)


def _name_all(spec: "mujoco.MjSpec", whose: str) -> None:
    for what, those in (("body", spec.bodies), ("shape", spec.geoms)):
        for number, one in enumerate(those):
            if not one.name:
                one.name = f"{whose}{what} {number}"


def _things(name: str, model: "mujoco.MjModel", bodies: tuple[int, ...], arm: set[int]) -> Things:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)

    def shape(one: Any, there: Any) -> Shape:
        """Return a shape in the frame of its moving body; without one, in the base frame."""
        place, turn, body = there.xpos, there.xmat.reshape(3, 3), int(one.bodyid[0])
        if body in bodies:
            place, turn = one.pos, pin.Quaternion(np.roll(one.quat, -1)).matrix()
        vector = (*place.tolist(), *pin.log3(turn).tolist())
        number = bodies.index(body) if body in bodies else None
        kind = _KINDS.get(mujoco.mjtGeom(one.type[0]), "")
        return Shape(kind, tuple(one.size.tolist()), vector, number, tuple(map(float, one.rgba)))

    geoms = [model.geom(number) for number in range(model.ngeom)]
    seen = [
        shape(one, data.geom(one.id))
        for one in geoms
        if int(one.bodyid[0]) not in arm and one.rgba[3] != 0.0 and not one.name.startswith("arm ")
    ]
    shapes = tuple(one for one in seen if one.kind)
    sites = [model.site(number) for number in range(model.nsite)]
    areas = {one.name.removeprefix(PREFIX): shape(one, data.site(one.id)) for one in sites if one.name}
    own = (model.body(body).name.removeprefix(PREFIX) for body in bodies)
    names = tuple(TOOL if one == LOAD else one for one in own)
    return Things(name, names, shapes, areas, len(seen) - len(shapes))
