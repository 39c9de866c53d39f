"""Nodes that URCaps contribute: those of Robotiq's grippers use the cell's gripper."""

from xml.etree.ElementTree import Element

from tvist_server.polyscope.installation import numbers

_GRIPPER = "com.robotiq.urcap.gripper."
_FORCE = "com.robotiq.Robotiq_Force_Torque_Sensor."
EXTERNAL_CONTROL = (
    'popup("Play this program from the machine that controls it.", title="External Control", blocking=True)'
)
"""Placeholder of an External Control node until the program is played; see `with_external_control`."""


def kind_of(node: Element) -> str:
    """Return the name of a contributed node and of its URCap, for messages and `--skip`."""
    words = [node.get("strategyURCapName"), node.get("strategyProgramNodeType") or node.get("strategyClass")]
    return ": ".join(word for word in words if word) or "a node without a type"


def lines_of(node: Element) -> list[str] | None:
    """Return the lines of a node without children; None if it cannot be translated."""
    match node.get("strategyClass"):
        case "com.fzi.externalcontrol.ExternalControlNode":
            return [EXTERNAL_CONTROL]
        case name if name == f"{_GRIPPER}GripperActivate":
            return ["rq_activate_and_wait()"]
        case name if name == f"{_GRIPPER}GripperNode":
            return _move_fingers(node)
        case name if name == f"{_FORCE}Zero FT Sensor":
            return ["zero_ftsensor()", "sleep(0.1)"]
    return None


def branch_of(node: Element) -> str | None:
    """Return the head of the branch that a node of Robotiq's Grip Check is; empty for the node around its branches."""
    match (node.get("strategyClass") or "").removeprefix(_GRIPPER):
        case "gripper_validation_node":
            return ""
        case "gripper_validation_if_node":
            return "if"
        case "gripper_validation_else_node":
            return "else"
    return None


def detection(node: Element) -> str:
    """Return the condition of a Grip Check."""
    found = "rq_is_object_detected()"
    return found if _datum(node, "ObjectDetectedKey", "true") == "true" else f"not({found})"


def _move_fingers(node: Element) -> list[str]:
    """Return the lines that move the fingers: percentages are counts up to 255, rounded half up."""
    position, speed, force = (
        int(numbers(_datum(node, f"{name}InDouble", ""), 1)[0] * 255.0 / 100.0 + 0.5)
        for name in ("position", "speed", "force")
    )
    lines = [f"rq_set_pos({position})", f"rq_set_speed({speed})", f"rq_set_force({force})", "rq_go_to()"]
    return lines + (["rq_wait()"] if _datum(node, "blocking", "true") == "true" else [])


def _datum(node: Element, key: str, default: str) -> str:
    found = node.find(f"./dataModel/data[@key='{key}']")
    return default if found is None else found.get("value") or default
