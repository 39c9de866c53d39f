"""Robots from URDF files: an open chain of turning joints, its masses and its limits.

The file is checked here, where messages name its elements, and read by pinocchio, which makes one body of links that
are fixed to each other. A URDF says nothing of springs, drives, accelerations or payload: these follow from the UR5e's
by the rule of `tvist_plant.similar`. The base frame is where the first joint's axis meets the height of the URDF's root
link; that axis must be vertical.
"""

import math
from collections import Counter
from itertools import product
from pathlib import Path
from typing import Any, Final, NamedTuple
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from tvist_plant.robot_tables import MAX_JOINTS, RobotFileError
from tvist_plant.user_file import LONGEST_NAME, UserFileError, is_name, read_text, xml

Floats = npt.NDArray[np.float64]

TURNING: Final = ("revolute", "continuous")
FLANGES: Final = ("tool0", "flange")
"""Names of a link that stands for the flange, if it is fixed to the last joint; otherwise that joint's link does."""
CONTINUOUS: Final = 4.0 * math.pi
"""Largest distance from zero of a joint without end stops [rad]."""
UPRIGHT: Final = 1e-6
"""Deviation of the first axis from the vertical that still counts as rounding [-]."""
DEEPEST: Final = 200
"""Largest number of joints from the base to a link, fixed ones included: parsers of URDF recurse along a chain."""
LARGEST: Final = 1e7
"""Largest number, as in other robot files."""
NUMBERS: Final = {
    "joint": {
        "origin": ("xyz", "rpy"), "axis": ("xyz",), "limit": ("lower", "upper", "effort", "velocity")
    },
    "link": {
        "inertial/origin": ("xyz", "rpy"), "inertial/mass": ("value",),
        "inertial/inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    },
}  # fmt: skip
"""Attributes that are read, by the elements of joints and links."""


class UrdfError(RobotFileError):
    """A URDF file describes no arm that can be simulated; the message names the link or joint."""


class _Joint(NamedTuple):
    """A joint that turns."""

    name: str
    kind: str
    child: str
    axis: Floats
    limit: Element


def read_urdf(path: str | Path) -> dict[str, Any]:
    """Read a URDF file as the content of a robot file without springs and drives.

    Raises:
        UrdfError: The file describes no arm that can be simulated.
        UserFileError: The file is not text, too large or nested too deeply.
        OSError: The file cannot be read.
    """
    where, text = f"robot file {path}", read_text(path, "robot file")
    try:
        root = xml(text.encode())
    except UserFileError as error:
        raise UrdfError(f"{where}: {error}") from error
    if root.tag != "robot":
        raise UrdfError(f"{where}: it is no URDF: its outermost element must be <robot>; expand xacro first")
    links = {_named(link, where): link for link in root.findall("link")}
    _check_numbers(root, where)
    _check_names(root, where)
    _check_tree(root, links, where)
    turning = {joint.name: joint for joint in _turning(root, where)}
    model = _model(root, where)
    chain = [turning[name] for name in list(model.names)[1:]]
    _check_chain(model, chain, where)
    return _content(str(root.get("name") or Path(path).stem), Path(path), links, model, chain, where)


def _named(element: Element, where: str) -> str:
    name = element.get("name")
    if not name:
        raise UrdfError(f"{where}: a <{element.tag}> has no name")
    if not is_name(name):
        raise UrdfError(
            f"{where}: a <{element.tag}> has the name {name!r:.{LONGEST_NAME}}: "
            f"must be at most {LONGEST_NAME} printable characters"
        )
    return name


def _check_names(root: Element, where: str) -> None:
    """Check that no two links or joints have the same name."""
    same = [
        f"{kind} {name}"
        for kind in ("link", "joint")
        for name, count in Counter(one.get("name") for one in root.findall(kind)).items()
        if count > 1
    ]
    if same:
        raise UrdfError(f"{where}: there are two of {', '.join(same)}: give each a name of its own")


def _check_tree(root: Element, links: dict[str, Element], where: str) -> None:
    """Check that joints make one tree of the links."""
    children: Counter[str] = Counter()
    after: dict[str, list[str]] = {}
    for joint in root.findall("joint"):
        here = f"{where}: joint {_named(joint, where)}"
        ends = [
            None if (part := joint.find(tag)) is None else part.get("link") for tag in ("parent", "child")
        ]
        if not ends[0] or not ends[1]:
            raise UrdfError(f"{here} has no parent or no child link")
        for link in ends:
            if link not in links:
                raise UrdfError(f"{here}: there is no link {link!r:.{LONGEST_NAME}}")
        children[ends[1]] += 1
        after.setdefault(ends[0], []).append(ends[1])
    twice = next((name for name, count in children.items() if count > 1), None)
    if twice is not None:
        raise UrdfError(f"{where}: link {twice} is the child of two joints: closed chains are not supported")
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise UrdfError(f"{where}: {len(roots)} links are no joint's child: exactly one must be, the base")
    row, count = roots, 0
    for _ in range(DEEPEST + 1):
        count += len(row)
        row = [child for link in row for child in after.get(link, ())]
    if row:
        raise UrdfError(
            f"{where}: link {row[0]} is more than {DEEPEST} joints from the base: make the chain shorter"
        )
    if count < len(links):
        raise UrdfError(f"{where}: some joints lead round in a circle: closed chains are not supported")


def _check_numbers(root: Element, where: str) -> None:
    """Check the numbers of all elements that are read, and write them as every parser reads them."""
    for kind, parts in NUMBERS.items():
        for element in root.findall(kind):
            here = f"{where}: {kind} {_named(element, where)}"
            for at, keys in parts.items():
                for part, key in product(element.findall(at), keys):
                    default = (0.0,) * (3 if key in {"xyz", "rpy"} else 1)
                    if at == "axis":
                        default = (1.0, 0.0, 0.0)
                    part.set(key, " ".join(map(repr, numbers(part, key, default, here).tolist())))
    for link in root.findall("link"):
        inertial = link.find("inertial")
        if inertial is not None and (inertial.find("mass") is None or inertial.find("inertia") is None):
            raise UrdfError(f"{where}: link {link.get('name')}: <inertial> has no <mass> or no <inertia>")


def numbers(element: Element, key: str, default: tuple[float, ...], here: str) -> Floats:
    """Return the numbers of an attribute, as many as its default has."""
    text = element.get(key)
    try:
        found = np.array(default if text is None else [float(word) for word in text.split()])
    except ValueError:
        found = np.zeros(0)
    if len(found) != len(default) or not (np.abs(found) <= LARGEST).all():
        raise UrdfError(f"{here}: {key} is {text!r:.60}: must be {len(default)} numbers within ±{LARGEST:g}")
    return found


def _turning(root: Element, where: str) -> list[_Joint]:
    """Return the joints that are not fixed, each of which must turn."""
    found = []
    for element in root.findall("joint"):
        name, kind = _named(element, where), str(element.get("type"))
        here = f"{where}: joint {name}"
        if kind == "fixed":
            continue
        if kind not in TURNING:
            raise UrdfError(f"{here} is {kind:.60}: must be {', '.join(TURNING)} or fixed")
        axis, child = element.find("axis"), element.find("child")
        direction = np.array([1.0, 0.0, 0.0])
        if axis is not None:
            direction = numbers(axis, "xyz", (1.0, 0.0, 0.0), here)
        if not np.linalg.norm(direction) > 0.0:
            raise UrdfError(f"{here}: axis is 0 0 0: must have a direction")
        if element.find("mimic") is not None:
            raise UrdfError(f"{here} mimics another joint: only joints of their own are supported")
        limit = element.find("limit")
        if limit is None:
            raise UrdfError(f"{here} has no <limit>: effort and velocity are needed")
        assert child is not None
        found.append(_Joint(name, kind, str(child.get("link")), direction, limit))
    return found


def _model(root: Element, where: str) -> pin.Model:
    """Return pinocchio's model of what was checked; other elements of a file, and limits, are not passed on."""
    checked = Element("robot", {"name": "arm"})
    for kind, parts in (("link", {"inertial"}), ("joint", {"origin", "parent", "child", "axis"})):
        for element in root.findall(kind):
            turns = element.get("type") in TURNING
            copy = SubElement(checked, kind, {**element.attrib, **({"type": "continuous"} if turns else {})})
            copy.extend(part for part in element if part.tag in parts)
    try:
        return pin.buildModelFromXML(tostring(checked, encoding="unicode"))
    except (RuntimeError, ValueError) as error:
        raise UrdfError(f"{where}: pinocchio cannot read it: {error}") from error


def _check_chain(model: pin.Model, chain: list[_Joint], where: str) -> None:
    """Check that no two joints follow the same one, and that all that moves has a mass."""
    for number in range(model.njoints):
        after = [model.names[one] for one in range(1, model.njoints) if model.parents[one] == number]
        if len(after) > 1:
            at = f"link {chain[number - 1].child}" if number else "the base"
            raise UrdfError(
                f"{where}: the chain branches after {at}, into the joints {', '.join(after)}: only one chain is "
                "supported; make the others fixed or remove them"
            )
    if not chain:
        raise UrdfError(f"{where}: it has no joint that turns")
    if len(chain) > MAX_JOINTS:
        raise UrdfError(f"{where}: more than {MAX_JOINTS} joints turn: 1 to {MAX_JOINTS} are supported")
    for joint, inertia in zip(chain, list(model.inertias)[1:], strict=True):
        if not inertia.mass > 0.0:
            raise UrdfError(
                f"{where}: link {joint.child} has no <inertial> with a mass: a moving link needs one"
            )


def _content(
    name: str, path: Path, links: dict[str, Element], model: pin.Model, chain: list[_Joint], where: str
) -> dict[str, Any]:
    kind = pin.FrameType.BODY
    frames = {
        link: model.frames[model.getFrameId(link, kind)] for link in links if model.existFrame(link, kind)
    }
    turns = [pin.SE3(_about_z(joint.axis), np.zeros(3)) for joint in chain]
    ends = [place * turn for place, turn in zip(list(model.jointPlacements)[1:], turns, strict=True)]
    first = ends[0]
    if first.rotation[2, 2] < 1.0 - UPRIGHT:
        raise UrdfError(f"{where}: the axis of joint {chain[0].name} must point straight up from the base")
    last = [frames[one] for one in FLANGES if one in frames and frames[one].parentJoint == len(chain)]
    ends.append(last[0].placement if last else pin.SE3.Identity())
    away = first.translation * [1.0, 1.0, 0.0]  # the base frame is on the first joint's axis
    into = [pin.SE3(np.eye(3), -away)]
    """From the base link and from each joint's frame into that of the robot file's link."""
    placements, bodies = [], []
    for number, turn in enumerate(turns):
        placement = turn.inverse() * ends[number + 1]
        into.append((turn * placement).inverse())
        bodies.append(into[-1].act(model.inertias[number + 1]))
        if number == 0:  # turning about the first axis and moving along it change places with the joint
            placement = pin.SE3(first.rotation, first.translation - away) * placement
        placements.append(_row(placement))
    meshes = [
        mesh
        for link, frame in sorted(frames.items(), key=lambda one: one[1].parentJoint)
        for mesh in _meshes(
            frame.parentJoint - 1,
            links[link],
            into[frame.parentJoint] * frame.placement,
            path,
            f"{where}: link {link}",
        )
    ]
    given = f"given: {path.name}"
    limits, notes = _limits(chain, where)
    return {
        "robot": {"name": path.stem, "model": name, "joints": [joint.name for joint in chain]},
        "kinematics": {"placement": placements},
        "links": {
            "mass": [body.mass for body in bodies],
            "com": [body.lever.tolist() for body in bodies],
            "inertia": [body.inertia[np.triu_indices(3)].tolist() for body in bodies],
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


def _row(placement: pin.SE3) -> list[float]:
    """Return a placement as a robot file gives it: x y z [m], roll pitch yaw [rad]."""
    return [*placement.translation.tolist(), *pin.rpy.matrixToRpy(placement.rotation).tolist()]


def _about_z(axis: Floats) -> Floats:
    """Return the rotation of a frame whose z axis is a joint's axis, shape (3, 3)."""
    z = axis / np.linalg.norm(axis)
    if np.array_equal(z, [0.0, 0.0, 1.0]):
        return np.eye(3)
    x = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return np.column_stack((x, np.cross(z, x), z))


def _meshes(number: int, link: Element, frame: pin.SE3, path: Path, here: str) -> list[dict[str, Any]]:
    """Return the meshes that show a link, whose frame is given in that of the link of a number."""
    found = []
    for visual in link.findall("visual"):
        mesh, origin = visual.find("geometry/mesh"), visual.find("origin")
        if mesh is not None and mesh.get("filename"):
            at = pin.SE3.Identity()
            if origin is not None:
                rpy, xyz = (numbers(origin, key, (0.0,) * 3, here) for key in ("rpy", "xyz"))
                at = pin.SE3(pin.rpy.rpyToMatrix(rpy), xyz)
            found.append(
                {
                    "link": number,
                    "file": str(mesh_file(str(mesh.get("filename")), path)),
                    "placement": _row(frame * at),
                    "scale": numbers(mesh, "scale", (1.0, 1.0, 1.0), here).tolist(),
                }
            )
    return found


def mesh_file(name: str, urdf: Path) -> Path:
    """Return where a mesh's file is, as far as that can be known without ROS: beside its package's folder.

    Its name in the URDF is `package://PACKAGE/...`, `file://...` or a path from the URDF's folder.
    """
    folder = urdf.resolve().parent
    if not name.startswith("package://"):
        return folder / name.removeprefix("file://")
    inside = Path(name.removeprefix("package://"))
    # A URDF stands somewhere in its package, or in one beside it.
    places = [
        above / part for above in (folder, *folder.parents) for part in (inside, Path(*inside.parts[1:]))
    ]
    return next((place for place in places if place.is_file()), folder / inside)


def _limits(chain: list[_Joint], where: str) -> tuple[dict[str, Any], str]:
    """Return the table `limits`, and what was assumed about positions."""
    position, velocity, torque, notes = [], [], [], []
    for joint in chain:
        here = f"{where}: joint {joint.name}"
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
