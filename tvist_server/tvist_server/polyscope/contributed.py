"""Nodes that URCaps contribute: those of Robotiq's grippers use the cell's gripper."""

from xml.etree.ElementTree import Element

from tvist_server.polyscope.expressions import quoted
from tvist_server.polyscope.installation import numbers

_GRIPPER = "com.robotiq.urcap.gripper."
_FORCE = "com.robotiq.Robotiq_Force_Torque_Sensor."
EXTERNAL_CONTROL = (
    'popup("Play this program from the machine that controls it.", title="External Control", blocking=True)'
)
"""Placeholder of an External Control node until the program is played; see `with_external_control`."""

_LINES = {
    "com.fzi.externalcontrol.ExternalControlNode": [EXTERNAL_CONTROL],
    f"{_GRIPPER}GripperActivate": ["rq_activate_and_wait()"],
    f"{_FORCE}Zero FT Sensor": ["zero_ftsensor()", "sleep(0.1)"],
}
_FORCED = ("x", "y", "z", "mx", "my", "mz")  # directions of Robotiq's Force Control
_LIMITS = [0.1, 0.1, 0.1, 0.35, 0.35, 0.35]  # speeds or deviations that it allows here [m/s, rad/s, m, rad]
_BRANCHES = {
    f"{_GRIPPER}gripper_validation_{part}node": head
    for part, head in (("", ""), ("if_", "if"), ("else_", "else"))
}


def kind_of(node: Element) -> str:
    """Return the name of a contributed node and of its URCap, for messages and `--skip`."""
    words = [node.get("strategyURCapName"), node.get("strategyProgramNodeType") or node.get("strategyClass")]
    return ": ".join(word for word in words if word) or "a node without a type"


def lines_of(node: Element) -> list[str] | None:
    """Return a node's lines of URScript without its children's; None if the node cannot be translated."""
    kind = node.get("strategyClass") or ""
    if kind == "com.olisrobotics.teleop.TeleopNode":
        shown = quoted(_datum(node, "OperatorMessage", ""))
        return ["freedrive_mode()", f'popup({shown}, "Teleop", blocking=True)', "end_freedrive_mode()"]
    return _move_fingers(node) if kind == f"{_GRIPPER}GripperNode" else _LINES.get(kind)


def force_task(node: Element) -> str | None:
    """Return the call that begins Robotiq's Force Control, whose stiffness is unknown; None for other nodes."""
    if node.get("strategyClass") != f"{_FORCE}ForceNode":
        return None
    chosen = [int(_datum(node, f"ft_control_{way}", "") == "true") for way in _FORCED]
    wrench = [numbers(_datum(node, f"force_{way}", "0"), 1)[0] for way in _FORCED]
    return f"force_mode(tool_pose(), {chosen}, {wrench}, 2, {_LIMITS})"


def branch_of(node: Element) -> str | None:
    """Return the first line of a branch of Robotiq's Grip Check; "" for the whole, None for other nodes."""
    return _BRANCHES.get(node.get("strategyClass") or "")


def detection(node: Element) -> str:
    """Return the condition of a Grip Check."""
    found = "rq_is_object_detected()"
    return found if _datum(node, "ObjectDetectedKey", "true") == "true" else f"not({found})"


def _move_fingers(node: Element) -> list[str]:
    """Return the lines that move the fingers; 100 % become 255 counts, and halves are rounded up."""
    position, speed, force = (
        int(numbers(_datum(node, f"{name}InDouble", ""), 1)[0] * 255.0 / 100.0 + 0.5)
        for name in ("position", "speed", "force")
    )
    lines = [f"rq_set_pos({position})", f"rq_set_speed({speed})", f"rq_set_force({force})", "rq_go_to()"]
    return lines + (["rq_wait()"] if _datum(node, "blocking", "true") == "true" else [])


def _datum(node: Element, key: str, default: str) -> str:
    found = node.find(f"./dataModel/data[@key='{key}']")
    return default if found is None else found.get("value") or default
