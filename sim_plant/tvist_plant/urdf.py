"""Robots from URDF files: an open chain of revolute joints with masses and limits.

The file is checked here, so that messages name its elements; pinocchio then merges links that are fixed to
each other. Springs, drives, accelerations and payload, which a URDF lacks, follow from `tvist_plant.similar`.
The first joint's axis must be vertical; the base frame lies on it at the height of the URDF's root link.
"""

import math
from collections import Counter
from itertools import product
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np
import pinocchio as pin

from tvist_plant.model import Floats
from tvist_plant.robot_tables import MAX_JOINTS, RobotFileError
from tvist_plant.user_file import LONGEST_NAME, UserFileError, is_name, read_text, xml

TURNING = ("revolute", "continuous")
FLANGES = ("tool0", "flange")
"""Names of a link that marks the flange if it is fixed to the last joint; otherwise that joint's link is the flange."""
CONTINUOUS = 4.0 * math.pi  # position limit of a joint without end stops [rad]
UPRIGHT = 1e-6  # deviation of the first axis from the vertical that counts as rounding [-]
DEEPEST = 200
"""Largest number of joints from the base to a link, fixed ones included, because URDF parsers recurse."""
LARGEST = 1e7  # largest number, as in other robot files
_ORIGIN = {"xyz": (0.0, 0.0, 0.0), "rpy": (0.0, 0.0, 0.0)}
NUMBERS: dict[tuple[str, str], dict[str, tuple[float, ...]]] = {
    ("joint", "origin"): {**_ORIGIN},
    ("joint", "axis"): {"xyz": (1.0, 0.0, 0.0)},
    ("joint", "limit"): dict.fromkeys(("lower", "upper", "effort", "velocity"), (0.0,)),
    ("link", "inertial/origin"): {**_ORIGIN},
    ("link", "inertial/mass"): {"value": (0.0,)},
    ("link", "inertial/inertia"): dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), (0.0,)),
    ("link", "visual/origin"): {**_ORIGIN},
    ("link", "visual/geometry/mesh"): {"scale": (1.0, 1.0, 1.0)},
}
"""Attributes read from elements of joints and links, with their defaults."""


def read_urdf(path: str | Path) -> dict[str, Any]:
    """Read a URDF file as a robot file's content without springs and drives."""
    text = read_text(path, "robot file")
    try:
        root = xml(text.encode())
    except UserFileError as error:
        raise RobotFileError(str(error)) from error
    if root.tag != "robot":
        raise RobotFileError("it is no URDF: its outermost element must be <robot>; expand xacro first")
    links, joints = ({_named(one): one for one in root.findall(kind)} for kind in ("link", "joint"))
    names = Counter(f"{one.tag} {one.get('name')}" for one in root if one.tag in {"link", "joint"})
    if same := [name for name, count in names.items() if count > 1]:
        raise RobotFileError(f"there are two of {', '.join(same)}: give each a name of its own")
    _check_numbers(root)
    _check_tree(root, links)
    _check_joints(joints)
    model = _model(root)
    chain = [joints[name] for name in list(model.names)[1:]]
    _check_chain(model, chain)
    return _content(str(root.get("name") or Path(path).stem), Path(path), links, model, chain)


def _named(element: Element) -> str:
    name = element.get("name")
    if not name:
        raise RobotFileError(f"a <{element.tag}> has no name")
    if not is_name(name):
        raise RobotFileError(
            f"a <{element.tag}> has the name {name!r:.{LONGEST_NAME}}: "
            f"must be at most {LONGEST_NAME} printable characters"
        )
    return name


def _check_numbers(root: Element) -> None:
    """Check numbers of all elements that are read, and rewrite them in a form that every parser accepts."""
    for (kind, at), keys in NUMBERS.items():
        for element in root.findall(kind):
            for part, (key, default) in product(element.findall(at), keys.items()):
                _check_number(part, key, default, f"{kind} {element.get('name')}")
    for link in root.findall("link"):
        inertial = link.find("inertial")
        if inertial is not None and (inertial.find("mass") is None or inertial.find("inertia") is None):
            raise RobotFileError(f"link {link.get('name')}: <inertial> has no <mass> or no <inertia>")


def _check_number(element: Element, key: str, default: tuple[float, ...], here: str) -> None:
    text = element.get(key)
    try:
        found = default if text is None else [float(word) for word in text.split()]
    except ValueError:
        found = ()
    if len(found) != len(default) or not all(abs(number) <= LARGEST for number in found):
        raise RobotFileError(
            f"{here}: {key} is {text!r:.60}: must be {len(default)} numbers within ±{LARGEST:g}"
        )
    element.set(key, " ".join(map(repr, found)))


def _numbers(element: Element, key: str) -> Floats:
    return np.array([float(word) for word in str(element.get(key)).split()])


def _check_tree(root: Element, links: dict[str, Element]) -> None:
    """Check that the joints connect the links to one tree."""
    children: Counter[str] = Counter()
    after: dict[str, list[str]] = {}
    for joint in root.findall("joint"):
        here = f"joint {joint.get('name')}"
        parent, child = (joint.find(tag) for tag in ("parent", "child"))
        ends = [None if part is None else part.get("link") for part in (parent, child)]
        if not ends[0] or not ends[1]:
            raise RobotFileError(f"{here} has no parent or no child link")
        for link in ends:
            if link not in links:
                raise RobotFileError(f"{here}: there is no link {link!r:.{LONGEST_NAME}}")
        children[ends[1]] += 1
        after.setdefault(ends[0], []).append(ends[1])
    twice = next((name for name, count in children.items() if count > 1), None)
    if twice is not None:
        raise RobotFileError(f"link {twice} is the child of two joints: closed chains are not supported")
    row = [name for name in links if name not in children]
    if len(row) != 1:
        raise RobotFileError(f"{len(row)} links are no joint's child: exactly one must be, the base")
    count = 0
    for _ in range(DEEPEST + 1):
        count += len(row)
        row = [child for link in row for child in after.get(link, ())]
    if row:
        raise RobotFileError(
            f"link {row[0]} is more than {DEEPEST} joints from the base: make the chain shorter"
        )
    if count < len(links):
        raise RobotFileError("some joints lead round in a circle: closed chains are not supported")


def _check_joints(joints: dict[str, Element]) -> None:
    for name, joint in joints.items():
        here, kind, axis = f"joint {name}", str(joint.get("type")), joint.find("axis")
        if kind == "fixed":
            continue
        if kind not in TURNING:
            raise RobotFileError(f"{here} is {kind:.60}: must be {', '.join(TURNING)} or fixed")
        if axis is not None and not _numbers(axis, "xyz").any():
            raise RobotFileError(f"{here}: axis is 0 0 0: must have a direction")
        if joint.find("mimic") is not None:
            raise RobotFileError(f"{here} mimics another joint: only joints of their own are supported")
        if joint.find("limit") is None:
            raise RobotFileError(f"{here} has no <limit>: effort and velocity are needed")


def _model(root: Element) -> pin.Model:
    """Build pinocchio's model of the checked elements, without limits and unknown elements."""
    checked = Element("robot", {"name": "arm"})
    for kind, parts in (("link", {"inertial"}), ("joint", {"origin", "parent", "child", "axis"})):
        for element in root.findall(kind):
            turns = element.get("type") in TURNING
            copy = SubElement(checked, kind, {**element.attrib, **({"type": "continuous"} if turns else {})})
            copy.extend(part for part in element if part.tag in parts)
    try:
        return pin.buildModelFromXML(tostring(checked, encoding="unicode"))
    except (RuntimeError, ValueError) as error:
        raise RobotFileError(f"pinocchio cannot read it: {error}") from error


def _check_chain(model: pin.Model, chain: list[Element]) -> None:
    carriers = [f"link {joint.find('child').get('link')}" for joint in chain]  # type: ignore[union-attr]
    for number in range(model.njoints):
        after = [model.names[one] for one in range(1, model.njoints) if model.parents[one] == number]
        if len(after) > 1:
            at = carriers[number - 1] if number else "the base"
            raise RobotFileError(
                f"the chain branches after {at}, into the joints {', '.join(after)}: only one chain is "
                "supported; make the others fixed or remove them"
            )
    if not chain:
        raise RobotFileError("it has no joint that turns")
    if len(chain) > MAX_JOINTS:
        raise RobotFileError(f"more than {MAX_JOINTS} joints turn: 1 to {MAX_JOINTS} are supported")
    for carrier, inertia in zip(carriers, list(model.inertias)[1:], strict=True):
        if not inertia.mass > 0.0:
            raise RobotFileError(f"{carrier} has no <inertial> with a mass: a moving link needs one")


def _content(
    name: str, path: Path, links: dict[str, Element], model: pin.Model, chain: list[Element]
) -> dict[str, Any]:
    kind, names = pin.FrameType.BODY, [str(joint.get("name")) for joint in chain]
    frames = {
        link: model.frames[model.getFrameId(link, kind)] for link in links if model.existFrame(link, kind)
    }
    turns = [pin.SE3(_about_z(joint.find("axis")), np.zeros(3)) for joint in chain]
    ends = [place * turn for place, turn in zip(list(model.jointPlacements)[1:], turns, strict=True)]
    first = ends[0]
    if first.rotation[2, 2] < 1.0 - UPRIGHT:
        raise RobotFileError(f"the axis of joint {names[0]} must point straight up from the base")
    last = [frames[one] for one in FLANGES if one in frames and frames[one].parentJoint == len(chain)]
    ends.append(last[0].placement if last else pin.SE3.Identity())
    away = first.translation * [1.0, 1.0, 0.0]  # the base frame is on the first joint's axis
    into = [pin.SE3(np.eye(3), -away)]
    """From the base link and from each joint's frame to the frame of the robot file's link."""
    placements, bodies = [], []
    for number, turn in enumerate(turns):
        placement = turn.inverse() * ends[number + 1]
        into.append((turn * placement).inverse())
        bodies.append(into[-1].act(model.inertias[number + 1]))
        if number == 0:  # rotation about and shift along the first axis commute with the joint
            placement = pin.SE3(first.rotation, first.translation - away) * placement
        placements.append(_row(placement))
    meshes = [
        mesh
        for link, frame in sorted(frames.items(), key=lambda one: one[1].parentJoint)
        for mesh in _meshes(
            frame.parentJoint - 1, links[link], into[frame.parentJoint] * frame.placement, path
        )
    ]
    given = f"given: {path.name}"
    limits, notes = _limits(chain)
    return {
        "robot": {"name": path.stem, "model": name, "joints": names},
        "kinematics": {"placement": placements},
        "links": {
            "mass": [body.mass for body in bodies],
            "com": [body.lever.tolist() for body in bodies],
            "inertia": [body.inertia[np.triu_indices(3)].tolist() for body in bodies],
        },
        "limits": limits,
        "meshes": meshes,
        "provenance": {
            **dict.fromkeys(("kinematics", "links", "limits.velocity", "limits.torque"), given),
            "limits.position": f"assumed: {notes}" if notes else given,
        },
    }


def _row(placement: pin.SE3) -> list[float]:
    """Return a placement as in a robot file: x y z [m], roll pitch yaw [rad]."""
    return [*placement.translation.tolist(), *pin.rpy.matrixToRpy(placement.rotation).tolist()]


def _about_z(axis: Element | None) -> Floats:
    """Return a rotation whose z axis is the joint's axis, shape (3, 3)."""
    direction = np.array([1.0, 0.0, 0.0]) if axis is None else _numbers(axis, "xyz")
    z = direction / np.linalg.norm(direction)
    if np.array_equal(z, [0.0, 0.0, 1.0]):
        return np.eye(3)
    x = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return np.column_stack((x, np.cross(z, x), z))


def _meshes(number: int, link: Element, frame: pin.SE3, path: Path) -> list[dict[str, Any]]:
    """Return the meshes of a link; `frame` is the link's frame relative to the robot file's link `number`."""
    found = []
    for visual in link.findall("visual"):
        mesh, origin = visual.find("geometry/mesh"), visual.find("origin")
        if mesh is None or not mesh.get("filename"):
            continue
        at = pin.SE3.Identity()
        if origin is not None:
            at = pin.SE3(pin.rpy.rpyToMatrix(_numbers(origin, "rpy")), _numbers(origin, "xyz"))
        file = str(mesh_file(str(mesh.get("filename")), path))
        scale = _numbers(mesh, "scale").tolist()
        found.append({"link": number, "file": file, "placement": _row(frame * at), "scale": scale})
    return found


def mesh_file(name: str, urdf: Path) -> Path:
    """Return a mesh's path from `package://PACKAGE/...`, `file://...` or a path relative to the URDF."""
    folder = urdf.resolve().parent
    if not name.startswith("package://"):
        return folder / name.removeprefix("file://")
    inside = Path(name.removeprefix("package://"))
    # A URDF is in its own package, or in a neighbouring one.
    places = [
        above / part for above in (folder, *folder.parents) for part in (inside, Path(*inside.parts[1:]))
    ]
    return next((place for place in places if place.is_file()), folder / inside)


def _limits(chain: list[Element]) -> tuple[dict[str, list[float]], str]:
    """Return the table `limits`, and a text about assumed position limits."""
    limits: dict[str, list[float]] = {"position": [], "velocity": [], "torque": []}
    notes = []
    for joint in chain:
        name, limit = joint.get("name"), joint.find("limit")
        assert limit is not None
        low, high, effort, velocity = (
            float(_numbers(limit, key)[0]) for key in ("lower", "upper", "effort", "velocity")
        )
        for key, value in (("effort", effort), ("velocity", velocity)):
            if not value > 0.0:
                raise RobotFileError(f"joint {name}: <limit> has {key} {value:g}: must be more than 0")
        if joint.get("type") == "continuous":
            low, high = -CONTINUOUS, CONTINUOUS
        elif not low < high:
            raise RobotFileError(
                f"joint {name}: <limit> has lower {low:g} and upper {high:g}: lower must be less"
            )
        most = max(abs(low), abs(high))
        if low + high != 0.0:
            notes.append(f"{name} {low:g} to {high:g} rad in the URDF, here ±{most:g}")
        for values, value in zip(limits.values(), (most, velocity, effort), strict=True):
            values.append(value)
    return limits, "; ".join(notes)
