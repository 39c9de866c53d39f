"""Move nodes of PolyScope with their waypoints, circles and directions, as URScript."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from tvist_server.polyscope.expressions import Expressions, UnknownPartError
from tvist_server.polyscope.installation import Installation, numbers, pose, script_name
from tvist_server.polyscope.positions import joint_angles, tool_pose
from tvist_server.polyscope.references import References
from tvist_server.polyscope.script_text import ScriptText

DIRECTION = "gui.program.direction.MoveDirectionNode"
"""Tag of a motion in a direction until something happens."""
_FUNCTIONS = {"MoveJ": "movej", "MoveL": "movel", "MoveP": "movep"}
_BASE, _TOOL = "p[0.0,0.0,0.0,0.0,0.0,0.0]", "get_forward_kin()"
_FEATURES = {"Joint_0_name": ("Base", _BASE), "Joint_6_name": ("Tool", _TOOL)}
_GIVEN = re.compile("blend|acceleration|speed|time")  # what a waypoint may have of its own
_COMPARED = {"0": "<", "1": ">"}  # comparisons of analog inputs
_AXES = {
    f"{axis}{name}": (f"{axis}{sign}", [float(f"{sign}1") * (axis == other) + 0.0 for other in "XYZ"])
    for axis in "XYZ"
    for name, sign in (("Plus", "+"), ("Minus", "-"))
}
_BRAKING = "1.2"  # deceleration after a contact for which the program gives none [m/s^2]
_FAR = 1000.0  # length of a motion that only a contact or a signal ends [m]
TOWARDS = """def point_towards(feature, direction, distance):
  local axis = [direction[0], direction[1], direction[2]]
  if norm(axis) < 1e-6:
    return get_target_waypoint()
  end
  axis = normalize(axis)
  local ahead = pose_trans(feature, p[axis[0] * distance, axis[1] * distance, axis[2] * distance, 0, 0, 0])
  return pose_add(get_target_waypoint(), pose_sub(ahead, feature))
end"""
"""URScript function that motions in a direction call: a pose along a feature's axis from the last target."""


@dataclass(frozen=True)
class _Style:
    """How a Move node moves to its waypoints."""

    kind: str
    speed: str
    acceleration: str
    blend: float  # blend radius of MoveP [m]
    joints: bool  # whether its waypoints are postures, not poses
    tcp: str  # TCP to set before each motion; empty: the active TCP
    flange: bool  # whether waypoints are poses of the flange
    feature: Element | None
    ends: bool  # whether the last waypoint has no blend: nothing or another kind of Move to waypoints follows


class Moves:
    """Translates motions."""

    def __init__(
        self,
        text: ScriptText,
        expressions: Expressions,
        references: References,
        installation: Installation,
        following: dict[Element | None, Element | None],  # next node of each node
        children: Callable[[Element], None],  # translates the nodes inside a node
    ) -> None:
        self._text, self._expressions, self._references = text, expressions, references
        self._installation, self._following, self._children = installation, following, children
        self._styles: list[_Style] = []
        self._names: dict[str, str] = {}  # names of taught waypoints by their names in scripts
        self.waypoints: dict[str, str] = {}  # values of the variables that taught waypoints need
        self.has_directions = False

    def move(self, node: Element) -> None:
        """Translate a Move node."""
        kind, following = node.get("motionType") or "", self._following[node]
        if kind not in _FUNCTIONS or node.get("optimoveEnabled") == "true":
            raise UnknownPartError(f"Move ({kind or 'without a type'})")
        has_direction = following is not None and following.find(f"./children/{DIRECTION}") is not None
        speed, acceleration = _number(node.get("speed")), _number(node.get("acceleration"))
        tcp, active = node.find("tcp"), node.get("useActiveTCP") != "false"
        style = _Style(
            kind, speed, acceleration, numbers(node.get("blendRadius") or "0", 1)[0],
            node.get("positionType") == "JointAngles",
            "" if active or tcp is None else self.tcp(tcp), not active and tcp is None, node.find("feature"),
            following is None or (following.get("motionType") not in {None, "MoveP"} and not has_direction),
        )  # fmt: skip
        self._text.label(node, kind)
        self._styles.append(style)
        self._children(node)
        self._styles.pop()

    def tcp(self, node: Element) -> str:
        """Return the call that sets a TCP of the installation."""
        target = self._references.target(node)
        name = "" if target is None else target.get("referencedName") or ""
        if name not in self._installation.tcps:
            raise UnknownPartError(f"the TCP {name or 'without a name'} (not in its installation)")
        return f"set_tcp({pose(self._installation.tcps[name].offset)})"

    @property
    def _style(self) -> _Style:
        if not self._styles:
            raise UnknownPartError("a waypoint outside a Move")
        return self._styles[-1]

    # ------------------------------------------------------------------ waypoints

    def waypoint(self, node: Element) -> None:
        """Translate a Waypoint."""
        style, (place, near) = self._style, self._place(node)
        own = node.find("motionParameters")
        given = {"acceleration": style.acceleration, "speed": style.speed}
        if style.kind == "MoveP":
            given["blend"] = repr(self._blend(node))
        other = "cartesian" if style.kind == "MoveJ" else "joint"  # values for the other kind of motion
        for name, value in {} if own is None else own.attrib.items():
            if (found := _GIVEN.search(name.lower())) is None:
                raise UnknownPartError(f"a waypoint's {name}")
            if not name.startswith(other):
                given[found[0]] = _number(value)
        self._text.label(node, self._name(node))
        if style.tcp:
            self._text.line(style.tcp)
        if near and place != near:
            place = f"pose_trans({place}, get_tcp_offset())" if style.flange else place
            place = f"get_inverse_kin({place}, qnear={near})" if style.kind == "MoveJ" else place
        timing = f"t={given['time']}" if "time" in given else f"a={given['acceleration']}, v={given['speed']}"
        radius = f", r={given['blend']}" if "blend" in given else ""
        self._text.line(f"{_FUNCTIONS[style.kind]}({place}, {timing}{radius})")

    def _name(self, node: Element) -> str:
        if node.get("type") == "Variable":
            return self._expressions.variable(node.find("variable"))
        return node.get("name") or "Waypoint"

    def _place(self, node: Element) -> tuple[str, str]:
        """Return a waypoint's pose or posture in URScript, and a posture near the pose if taught, else ""."""
        shown, position = self._name(node), self._references.target(node.find("position"))
        name = script_name(shown)
        if position is not None and (other := self._names.setdefault(name, shown)) != shown:
            raise UnknownPartError(f"the waypoints {other} and {shown} (scripts have one name for both)")
        try:
            match node.get("type"):
                case "Variable":
                    return name, ""
                case "Fixed" if position is not None:
                    posture = f"{name}_q"
                    self.waypoints[posture] = str(list(joint_angles(position)))
                    if self._style.joints or position.find("Kinematics") is None:
                        return posture, posture
                    self.waypoints[f"{name}_p"] = pose(tool_pose(position))
                    return f"{name}_p", posture
                case "Relative" if position is not None:
                    begin = self._references.target(node.find("relativeFromPosition"))
                    if begin is not None:
                        for end, at in (("from", begin), ("to", position)):
                            self.waypoints[f"{name}_{end}_p"] = pose(tool_pose(at))
                        return f"pose_add(get_target_tcp_pose(), pose_sub({name}_to_p, {name}_from_p))", ""
        except ValueError as error:
            raise UnknownPartError(f"the waypoint {name}: {error}") from error
        raise UnknownPartError(f"a Waypoint ({node.get('type') or 'without a type'}) that is not taught")

    def circle(self, node: Element) -> None:
        """Translate a CircleMove: an arc through its first waypoint to its second."""
        style, points = self._style, node.findall("./children/Waypoint")
        if len(points) != 2:
            raise UnknownPartError("a CircleMove without two waypoints")
        self._text.label(node, "CircleMove")
        places = [self._place(point)[0] for point in points]
        for point in points:
            self._text.label(point, self._name(point))
        mode = ", mode=1" if node.get("OrientationMode") == "FIXED" else ""
        ends, radius = ", ".join(places), self._blend(node)
        self._text.line(f"movec({ends}, a={style.acceleration}, v={style.speed}, r={radius!r}{mode})")

    def _blend(self, node: Element) -> float:
        """Return the blend radius at a node of a MoveP [m]: 0 at the end of the motion."""
        return 0.0 if self._following[node] is None and self._style.ends else self._style.blend

    # ------------------------------------------------------------------ directions

    def direction(self, node: Element) -> None:
        """Translate motion in a direction: a thread moves the arm until an Until node's condition ends it."""
        style, text, number = self._style, self._text, self._text.numbers[node]
        feature = node.find("feature")
        shown, frame = self.feature(style.feature if feature is None else feature)
        axis, direction = self._axis(node)
        speed, acceleration = style.speed, style.acceleration
        if (own := node.get("toolParams")) is not None:
            speed, acceleration = map(repr, numbers(own, 2))
        ends = node.findall("./children/Until")
        ends.sort(key=lambda end: end.get("type") == "DISTANCE")  # PolyScope checks the distance last
        far, radius = repr(_FAR), ""
        for end in (one for one in ends if one.get("type") == "DISTANCE"):
            far, blend = _number(end.findtext("Distance")), end.find("motionParameters")
            if end.get("distanceNodeType") == "BLEND" and blend is not None:
                radius = f", r={_number(blend.get('blendRadius'))}"
        self.has_directions = True
        text.label(node, f"Direction: {shown} {axis}".rstrip(), f"global move_state_{number}=0")
        with text.block(f"thread move_{number}():"):
            text.line("enter_critical", f"move_state_{number} = 1")
            text.line(f"local ahead=point_towards({frame}, {direction}, {far})")
            text.line(f"movel(ahead, a={acceleration}, v={speed}{radius})")
            text.line(f"move_state_{number} = 2", "exit_critical")
        text.line(f"move_state_{number} = 0", f"move_handle_{number} = run move_{number}()")
        with text.block("while (True):"):
            for end in ends:
                self._until(end, number)
            text.line("sync()")

    def _axis(self, node: Element) -> tuple[str, str]:
        if (chosen := node.get("selectedDirection")) is None:
            return "", self._expressions.text(node)
        if chosen not in _AXES:
            raise UnknownPartError(f"a Direction ({chosen})")
        return _AXES[chosen][0], str(_AXES[chosen][1])

    def feature(self, node: Element | None) -> tuple[str, str]:
        """Return a feature's name and its pose as URScript."""
        target = self._references.target(node)
        if node is not None and target is None:
            raise UnknownPartError("a feature that is not in the file")
        name = "Joint_0_name" if target is None else target.get("referencedName") or ""
        if name in _FEATURES:
            return _FEATURES[name]
        if name not in self._installation.features:
            raise UnknownPartError(f"the feature {name or 'without a name'} (not in its installation)")
        return name, script_name(name)

    def _until(self, node: Element, number: int) -> None:
        text, kind = self._text, node.get("type") or ""
        stop = _number(node.get("decelerationAcceleration") or node.get("deceleration") or _BRAKING)
        halt = f"kill move_handle_{number}\nstopl({'3.0' if kind == 'IO' else stop})"
        match kind:
            case "DISTANCE":
                text.line("sleep(1.0E-10)")
                condition, halt = f"move_state_{number} > 1", f"join move_handle_{number}"
            case "TOOL_CONTACT_DETECTION":
                text.line("local towards=get_target_tcp_speed()")
                text.line("local steps_back=tool_contact(direction=towards)")
                condition = "steps_back > 0"
            case "IO":
                condition = self.input_is(node)
            case "EXPRESSION":
                condition = self._expressions.text(node)
            case _:
                raise UnknownPartError(f"Until ({kind or 'without a type'})")
        with text.block(f"if ({condition}):"):
            text.line(halt)
            if kind == "TOOL_CONTACT_DETECTION":
                self._retract(_number(node.get("retraction")), stop)
            text.label(node, f"Until ({kind.lower()})")
            if node.get("allowActions") == "true":
                self._children(node)
            text.line("break")

    def _retract(self, distance: str, acceleration: str) -> None:
        """Move back to where contact began, then `distance` against the motion."""
        self._text.line("local touched=get_forward_kin(get_actual_joint_positions_history(steps_back))")
        self._text.line("local back=[towards[0], towards[1], towards[2]]")
        with self._text.block("if (norm(back) > 1e-6):"):
            self._text.line("back = normalize(back)")
            away = ", ".join(f"back[{axis}] * {distance}" for axis in range(3))
            self._text.line(f"touched = pose_sub(touched, p[{away}, 0, 0, 0])")
        self._text.line(f"movel(touched, a={acceleration}, v=0.1)")

    def input_is(self, node: Element) -> str:
        """Return the condition that an input has the value given in a node."""
        call = self._expressions.input(node.find("pin"))
        wanted = node.get("digitalValue") or node.findtext("digitalValue") or ""
        if wanted in {"0", "1", "true", "false"}:
            return f"{call} == {wanted in {'1', 'true'}}"
        sign = _COMPARED.get(node.findtext("analogComparison") or "")
        if sign is None:
            raise UnknownPartError(f"{node.tag} for a signal without a value")
        return f"{call} {sign} {_number(node.findtext('analogValue'))}"


def _number(text: str | None) -> str:
    """Return a number as URScript; ValueError if it is none."""
    return repr(numbers(text, 1)[0])
