"""Translates the nodes of a program saved by PolyScope to lines of URScript.

Supported nodes: Script, Wait for a time, Assignment of an expression, If and Else, Loop with a condition,
Move with Waypoints, Popup, Halt, Folder, Comment, External Control, and suppressed nodes.
"""

import re
from collections import Counter
from collections.abc import Iterator
from xml.etree import ElementTree as ET

from tvist_plant.user_file import is_name

EXTERNAL_CONTROL = (
    'popup("Play this program from the machine that controls it.", title="External Control", blocking=True)'
)
"""Placeholder of an External Control node until the program is played; see `with_external_control`."""
_EXTERNAL = "com.fzi.externalcontrol.ExternalControlNode"
_SIGNS = {"≟": "==", "≠": "!="}  # PolyScope's signs in expressions that URScript writes differently
_MOVES = {"MoveJ": "movej", "MoveL": "movel"}
_NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_STEP = re.compile(r"(\w+)(?:\[(\d{1,6})\])?")
_MOST_REFERENCES = 100  # longest chain of references; a file may contain endless ones
_LONGEST_REFERENCE = 1000
"""Longest reference [characters]: enough for the deepest element that a file may have."""


class Nodes:
    """Translates the nodes of one program, whose tree is `root`; `missing` lists what it cannot translate, in order."""

    def __init__(self, root: ET.Element) -> None:
        self.missing: list[str] = []
        self._parents: dict[ET.Element, ET.Element] = {}
        self._places: dict[tuple[ET.Element, str, int], ET.Element] = {}
        for parent in root.iter():
            count = Counter[str]()
            for child in parent:
                count[child.tag] += 1
                self._parents[child], self._places[parent, child.tag, count[child.tag]] = parent, child
        self._known: dict[ET.Element, str] = {}
        """Names of variables, so that each reference is resolved only once."""
        self._number = 0

    def lines(self, nodes: list[ET.Element]) -> Iterator[str]:
        """Translate sibling nodes."""
        for place, node in enumerate(nodes):
            yield from self._node(node, nodes[place + 1 : place + 2])

    def values(self, variables: list[ET.Element]) -> Iterator[str]:
        """Translate the initial values of variables."""
        for variable in variables:
            yield f"global {self._variable(variable)} = {self._expression(variable)}"

    def _node(self, node: ET.Element, after: list[ET.Element]) -> Iterator[str]:  # noqa: C901, PLR0912  one a kind
        kind = node.tag.lower(), node.get("type")
        match kind:
            case ("comment" | "suppressednode", _):
                return
            case ("folder", _):
                yield from self.lines(node.findall("./children/*"))
            case ("script", _):
                yield self._script(node)
            case ("wait", "Sleep"):
                yield f"sleep({self._number_in(node.findtext('waitTime'), node)})"
            case ("halt", _):
                yield from self._labelled("Halt", "halt")
            case ("popup", "Message"):
                halts = "\nhalt" if node.get("haltProgram") == "true" else ""
                text = (node.get("message") or "").replace('"', "'").replace("\n", " ")
                yield from self._labelled("Popup", f'popup("{text}", blocking=True){halts}')
            case ("assignment", _) if node.get("valueSource") == "Expression":
                name = self._variable(node.find("variable"))
                yield from self._labelled(name, f"global {name} = {self._expression(node)}")
            case ("if", "If"):
                yield f"if {self._expression(node)}:"
                yield from self.lines(node.findall("./children/*"))
                if not (after and after[0].tag == "If" and after[0].get("type") == "Else"):
                    yield "end"
            case ("if", "Else"):
                yield "else:"
                yield from self.lines(node.findall("./children/*"))
                yield "end"
            case ("loop", "While") if node.get("checkContinuously") == "false":
                yield f"while {self._expression(node)}:"
                yield from self.lines(node.findall("./children/*"))
                yield "end"
            case ("move", _):
                yield from self._move(node)
            case ("contributed", _) if node.get("strategyClass") == _EXTERNAL:
                yield EXTERNAL_CONTROL
            case _:
                self._miss(node)

    def _move(self, node: ET.Element) -> Iterator[str]:
        function = _MOVES.get(node.get("motionType") or "")
        if function is None or node.get("useActiveTCP") != "true" or node.get("optimoveEnabled") == "true":
            self._miss(node)
            return
        speed, acceleration = (self._number_in(node.get(name), node) for name in ("speed", "acceleration"))
        for point in node.findall("./children/*"):
            own = point.find("motionParameters")
            joints = point.find("./position/JointAngles")
            if point.tag != "Waypoint" or own is None or own.attrib or len(own):
                self._miss(point)
            elif point.get("type") == "Fixed" and joints is not None:
                angles = ", ".join(
                    self._number_in(one, point) for one in (joints.get("angles") or "").split(",")
                )
                yield from self._labelled(
                    point.get("name") or "Waypoint", f"{function}([{angles}], a={acceleration}, v={speed})"
                )
            elif point.get("type") == "Variable":
                name = self._variable(point.find("variable"))
                yield from self._labelled(name, f"{function}({name}, a={acceleration}, v={speed})")
            else:
                self._miss(point)

    def _script(self, node: ET.Element) -> str:
        line = self._expression(node) if node.find("expression") is not None else None
        parts = [line, node.findtext("cachedContents"), node.findtext("text"), node.text]
        text = next((part for part in parts if part), "")
        if not text.strip():
            self.missing.append("a Script without text")
        return text

    def _labelled(self, name: str, line: str) -> Iterator[str]:
        self._number += 1
        plain = name.replace("\n", " ").replace("#", " ")
        yield f'$ {self._number} "{plain}"'
        yield line

    def _expression(self, node: ET.Element) -> str:
        parts: list[str] = []
        for part in node.findall("./expression/*"):
            if part.tag == "ExpressionChar":
                character = part.get("character") or ""
                parts.append(_SIGNS.get(character, character))
            elif part.tag == "ExpressionToken":
                parts.append(part.get("token") or "")
            elif part.tag == "ExpressionVariable":
                parts.append(self._variable(part.find("ProgramVariable")))
            else:
                self._miss(part)
        return "".join(parts)

    def _variable(self, node: ET.Element | None) -> str:
        """Return the name of a variable, which may be a reference such as `../../Assignment[2]/variable`."""
        passed, found = list[ET.Element](), ""
        while node is not None and not found and len(passed) < _MOST_REFERENCES:
            passed.append(node)
            name, reference = node.get("name") or "", node.get("reference")
            found = self._known.get(node) or (name if is_name(name) and _NAME.fullmatch(name) else "")
            node = None if found or reference is None else self._referred(node, reference)
        if not found:
            self.missing.append("a variable without a name")
        self._known.update(dict.fromkeys(passed, found or "variable"))
        return found or "variable"

    def _referred(self, node: ET.Element, reference: str) -> ET.Element | None:
        found: ET.Element | None = node if len(reference) <= _LONGEST_REFERENCE else None
        for step in reference.split("/"):
            if found is None:
                return None
            if step == "..":
                found = self._parents.get(found)
                continue
            words = _STEP.fullmatch(step)
            found = None if words is None else self._places.get((found, words[1], int(words[2] or 1)))
        return found

    def _number_in(self, text: str | None, node: ET.Element) -> str:
        try:
            number = float(text or "")
            return repr(int(number) if number.is_integer() else number)
        except (ValueError, OverflowError):
            self._miss(node)
            return "0"

    def _miss(self, node: ET.Element) -> None:
        kind = node.get("type") or node.get("motionType") or node.get("valueSource")
        self.missing.append(node.tag if kind is None else f"{node.tag} ({kind})")
