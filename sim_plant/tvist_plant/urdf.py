"""Robots from URDF files: an open chain of turning joints, its masses and its limits.

A URDF says nothing of springs, drives, accelerations or payload: these follow from the UR5e's by the rule of
`tvist_plant.similar`. Links that are fixed to each other become one. The base frame is where the first joint's axis
meets the height of the URDF's root link; that axis must be vertical.
"""

import math
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any, Final
from xml.etree.ElementTree import Element

import numpy as np
import numpy.typing as npt

from tvist_plant.robot_tables import MAX_JOINTS
from tvist_plant.urdf_elements import (
    TURNING,
    Body,
    Joint,
    UrdfError,
    angles,
    joint_of,
    mesh_file,
    named,
    numbers,
    origin_of,
    parsed,
)
from tvist_plant.user_file import LONGEST_NAME

Floats = npt.NDArray[np.float64]

FLANGES: Final = ("tool0", "flange")
"""Names of a link that stands for the flange, if it is fixed to the last joint; otherwise that joint's link does."""
CONTINUOUS: Final = 4.0 * math.pi
"""Largest distance from zero of a joint without end stops [rad]."""
UPRIGHT: Final = 1e-6
"""Deviation of the first axis from the vertical that still counts as rounding [-]."""


def read_urdf(path: str | Path) -> dict[str, Any]:
    """Read a URDF file as the content of a robot file without springs and drives.

    Raises:
        UrdfError: The file describes no arm that can be simulated.
        UserFileError: The file is not text, too large or nested too deeply.
        OSError: The file cannot be read.
    """
    where = f"robot file {path}"
    root = parsed(path, where)
    links = {named(link, where): link for link in root.findall("link")}
    joints = [joint_of(joint, where) for joint in root.findall("joint")]
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in links:
                raise UrdfError(f"{where}: joint {joint.name}: there is no link {link!r:.{LONGEST_NAME}}")
    base = _root(links, joints, where)
    tree = _Tree(base, joints)
    chain = _chain(base, tree, where)
    return _content(str(root.get("name") or Path(path).stem), Path(path), links, tree, chain, where)


class _Tree:
    """Joints by the links that they connect, found without looking at all of them."""

    def __init__(self, root: str, joints: list[Joint]) -> None:
        self.root = root
        self.to = {joint.child: joint for joint in joints}
        self.of: defaultdict[str, list[Joint]] = defaultdict(list)
        for joint in joints:
            self.of[joint.parent].append(joint)


def _root(links: dict[str, Element], joints: list[Joint], where: str) -> str:
    children = Counter(joint.child for joint in joints)
    twice = next((name for name, count in children.items() if count > 1), None)
    if twice is not None:
        raise UrdfError(f"{where}: link {twice} is the child of two joints: closed chains are not supported")
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise UrdfError(f"{where}: {len(roots)} links are no joint's child: exactly one must be, the base")
    return roots[0]


def _chain(root: str, tree: _Tree, where: str) -> list[Joint]:
    """Return the movable joints from the base on.

    Raises:
        UrdfError: The chain branches, has too many joints, or a joint is of a kind that is not supported.
    """
    chain: list[Joint] = []
    at: str | None = root
    while at is not None:
        ways = [joint for link in _rigid(at, tree) for joint in tree.of[link] if joint.kind != "fixed"]
        if len(ways) > 1:
            names = ", ".join(joint.name for joint in ways[:MAX_JOINTS])
            raise UrdfError(
                f"{where}: the chain branches after link {at}, into the joints {names}: only one chain is supported; "
                "make the others fixed or remove them"
            )
        at = None
        for joint in ways:
            if joint.kind not in TURNING:
                raise UrdfError(
                    f"{where}: joint {joint.name} is {joint.kind:.60}: must be {', '.join(TURNING)} or fixed"
                )
            chain.append(joint)
            at = joint.child
        if len(chain) > MAX_JOINTS:
            raise UrdfError(f"{where}: more than {MAX_JOINTS} joints turn: 1 to {MAX_JOINTS} are supported")
    if not chain:
        raise UrdfError(f"{where}: it has no joint that turns")
    return chain


def _rigid(link: str, tree: _Tree) -> dict[str, Floats]:
    """Return the links that are fixed to a link, itself included, with their frames in its frame."""
    found = {link: np.eye(4)}
    waiting = [link]
    while waiting:
        at = waiting.pop()
        for joint in tree.of[at]:
            if joint.kind == "fixed" and joint.child not in found:
                found[joint.child] = found[at] @ joint.placement
                waiting.append(joint.child)
    return found


def _content(
    name: str, path: Path, links: dict[str, Element], tree: _Tree, chain: list[Joint], where: str
) -> dict[str, Any]:
    turns = [_about_z(joint.axis) for joint in chain]
    frames = [_in_previous(joint, tree) for joint in chain]
    first = frames[0] @ turns[0]
    if first[2, 2] < 1.0 - UPRIGHT:
        raise UrdfError(f"{where}: the axis of joint {chain[0].name} must point straight up from the base")
    placements, bodies = [], []
    intos: list[Floats] = []
    for number, joint in enumerate(chain):
        back = np.asarray(np.linalg.inv(turns[number]), dtype=np.float64)
        last = number == len(chain) - 1
        after = _flange(joint.child, tree) if last else frames[number + 1] @ turns[number + 1]
        placement: Floats = back @ after
        intos.append(np.linalg.inv(placement) @ back)
        bodies.append(_body(joint.child, links, tree, intos[-1], where))
        if number == 0:  # turning about the first axis and moving along it change places with the joint
            upright = first.copy()
            upright[:2, 3] = 0.0
            placement = upright @ placement
        placements.append([*placement[:3, 3].tolist(), *angles(placement[:3, :3])])
    away = np.eye(4)
    away[:2, 3] = -first[:2, 3]  # the base frame is on the first joint's axis
    shown = [(-1, tree.root, away), *((at, joint.child, intos[at]) for at, joint in enumerate(chain))]
    meshes = [
        mesh
        for at, link, into in shown
        for name, frame in _rigid(link, tree).items()
        for mesh in _meshes(at, links[name], into @ frame, path, f"{where}: link {name}")
    ]
    masses = [body.mass for body in bodies]
    centres = [body.about_centre() for body in bodies]
    given = f"given: {path.name}"
    limits, notes = _limits(chain, where)
    return {
        "robot": {"name": path.stem, "model": name, "joints": [joint.name for joint in chain]},
        "kinematics": {"placement": placements},
        "links": {
            "mass": masses,
            "com": [com.tolist() for com, _ in centres],
            "inertia": [tensor[np.triu_indices(3)].tolist() for _, tensor in centres],
        },
        "limits": limits,
        "meshes": meshes,
        "provenance": {
            "kinematics": given,
            "links": given,
            "limits.velocity": given,
            "limits.torque": given,
            "limits.position": f"assumed: {notes}" if notes else given,
        },
    }


def _about_z(axis: Floats) -> Floats:
    """Return a frame whose z axis is a joint's axis, 4x4."""
    z = axis / np.linalg.norm(axis)
    frame = np.eye(4)
    if np.array_equal(z, [0.0, 0.0, 1.0]):
        return frame
    x = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    frame[:3, :3] = np.column_stack((x, np.cross(z, x), z))
    return frame


def _in_previous(joint: Joint, tree: _Tree) -> Floats:
    """Return the frame of a joint in that of the link which the joint before it moves, or of the base."""
    placement, at = joint.placement, joint.parent
    while (before := tree.to.get(at)) is not None and before.kind == "fixed":
        placement, at = before.placement @ placement, before.parent
    return placement


def _flange(link: str, tree: _Tree) -> Floats:
    rigid = _rigid(link, tree)
    return next((rigid[name] for name in FLANGES if name in rigid), rigid[link])


def _meshes(number: int, link: Element, into: Floats, path: Path, here: str) -> list[dict[str, Any]]:
    """Return the meshes that show a link, whose frame is given in that of the link of a number."""
    found = []
    for visual in link.findall("visual"):
        mesh = visual.find("geometry/mesh")
        if mesh is not None and mesh.get("filename"):
            at = into @ origin_of(visual, here)
            found.append(
                {
                    "link": number,
                    "file": str(mesh_file(str(mesh.get("filename")), path)),
                    "placement": [*at[:3, 3].tolist(), *angles(at[:3, :3])],
                    "scale": numbers(mesh, "scale", (1.0, 1.0, 1.0), here).tolist(),
                }
            )
    return found


def _body(link: str, links: dict[str, Element], tree: _Tree, into: Floats, where: str) -> Body:
    """Return the bodies that a joint moves up to the next one, in the frame at their end."""
    whole = Body()
    for name, placement in _rigid(link, tree).items():
        inertial = links[name].find("inertial")
        if inertial is None:
            continue
        here = f"{where}: link {name}"
        mass, tensor = inertial.find("mass"), inertial.find("inertia")
        if mass is None or tensor is None:
            raise UrdfError(f"{here}: <inertial> has no <mass> or no <inertia>")
        value = float(numbers(mass, "value", (0.0,), here)[0])
        xx, xy, xz, yy, yz, zz = (
            float(numbers(tensor, key, (0.0,), here)[0]) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        )
        at = into @ placement @ origin_of(inertial, here)
        turn = at[:3, :3]
        matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        whole.add(value, at[:3, 3], turn @ matrix @ turn.T)
    if not whole.mass > 0.0:
        raise UrdfError(f"{where}: link {link} has no <inertial> with a mass: a moving link needs one")
    return whole


def _limits(chain: list[Joint], where: str) -> tuple[dict[str, Any], str]:
    """Return the table `limits`, and what was assumed about positions."""
    position, velocity, torque, notes = [], [], [], []
    for joint in chain:
        here = f"{where}: joint {joint.name}"
        if joint.limit is None:
            raise UrdfError(f"{here} has no <limit>: effort and velocity are needed")
        values = {
            key: float(numbers(joint.limit, key, (0.0,), here)[0])
            for key in ("lower", "upper", "effort", "velocity")
        }
        for key in ("effort", "velocity"):
            if not values[key] > 0.0:
                raise UrdfError(f"{here}: <limit> has {key} {values[key]:g}: must be more than 0")
        low, high = values["lower"], values["upper"]
        if joint.kind == "continuous":
            low, high = -CONTINUOUS, CONTINUOUS
        elif not low < high:
            raise UrdfError(f"{here}: <limit> has lower {low:g} and upper {high:g}: lower must be less")
        most = max(abs(low), abs(high))
        if low + high != 0.0:
            notes.append(f"{joint.name} {low:g} to {high:g} rad in the URDF, here ±{most:g}")
        position.append(most)
        velocity.append(values["velocity"])
        torque.append(values["effort"])
    return {"position": position, "velocity": velocity, "torque": torque}, "; ".join(notes)
