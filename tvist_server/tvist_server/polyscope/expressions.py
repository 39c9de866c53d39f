"""Translates expressions of a program saved by PolyScope, and the names in them, to URScript."""

import re
from xml.etree.ElementTree import Element

from tvist_plant.user_file import LONGEST_NAME
from tvist_server.polyscope.installation import Installation, script_name
from tvist_server.polyscope.references import References

_SIGNS = {"≟": " == ", "≠": " != ", "≤": " <= ", "≥": " >= ", "×": "*", "÷": "/"}
_NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_PIN = re.compile(r'(\w+)\[(\d{1,3}|"[\w .-]+")\]')
_SHORT = {"digital_out": "DO", "config_out": "CO", "tool_out": "TO"}  # in labels of Set nodes
_NAMES = ("name", "featureName", "referencedName")  # attributes that name a variable or feature
_READ = {
    "digital_in": "get_standard_digital_in", "digital_out": "get_standard_digital_out",
    "config_in": "get_configurable_digital_in", "config_out": "get_configurable_digital_out",
    "tool_in": "get_tool_digital_in", "tool_out": "get_tool_digital_out",
    "analog_in": "get_standard_analog_in", "analog_out": "get_standard_analog_out",
    "tool_analog_in": "get_tool_analog_in",
    "gp_bool_in": "read_input_boolean_register", "gp_bool_out": "read_output_boolean_register",
    "gp_int_in": "read_input_integer_register", "gp_int_out": "read_output_integer_register",
    "gp_float_in": "read_input_float_register", "gp_float_out": "read_output_float_register",
    "modbus": "modbus_get_signal_status",
}  # fmt: skip
_WRITE = {
    "digital_out": "set_standard_digital_out", "config_out": "set_configurable_digital_out",
    "tool_out": "set_tool_digital_out", "analog_out": "set_standard_analog_out",
    "gp_bool_out": "write_output_boolean_register", "gp_int_out": "write_output_integer_register",
    "gp_float_out": "write_output_float_register",
}  # fmt: skip


class UnknownPartError(Exception):
    """Something that cannot be translated; the message says what it is."""


def quoted(text: str) -> str:
    """Return a text as URScript, in one line."""
    return f'"{" ".join(text.replace(chr(34), chr(39)).split())}"'


class Expressions:
    """Translates expressions and names of variables, inputs and outputs."""

    def __init__(self, references: References, installation: Installation) -> None:
        self._references, self._installation = references, installation

    def text(self, node: Element | None) -> str:
        """Return the expression of an element as URScript."""
        return "".join(script for script, _ in self._parts(node))

    def label(self, node: Element | None) -> str:
        """Return the expression of an element as PolyScope shows it."""
        return "".join(shown for _, shown in self._parts(node)).replace('"', "'")

    def _parts(self, node: Element | None) -> list[tuple[str, str]]:
        return [] if node is None else [self._part(part) for part in node.findall("./expression/*")]

    def _part(self, part: Element) -> tuple[str, str]:
        match part.tag:
            case "ExpressionChar":
                character = part.get("character") or ""
                character = character if character.isprintable() else " "
                return _SIGNS.get(character, character), character
            case "ExpressionToken":
                token = part.get("token") or ""
                return f" {token} ", token
            case "ExpressionVariable":
                name = self.variable(next(iter(part), None))
                return name, name
            case "ExpressionWaypoint":
                name = self.variable(part.find("Waypoint"))
                return f"{name}_p", name
            case "ExpressionIO":
                function, number, shown = self._pin(part.find("pin"), _READ)
                return f"{function}({number})", shown
        raise UnknownPartError(f"an expression with {part.tag}")

    def variable(self, node: Element | None) -> str:
        """Return the name of a variable, feature or waypoint."""
        target = self._references.target(node)
        name = "" if target is None else next(filter(None, map(target.get, _NAMES)), "")
        name = name if len(name) <= LONGEST_NAME else ""
        if not name or not _NAME.fullmatch(script_name(name)):
            raise UnknownPartError("a variable without a name")
        return script_name(name)

    def output(self, node: Element | None) -> tuple[str, str, str]:
        """Return the function that sets an output, its number, and its name."""
        function, number, name = self._pin(node, _WRITE)
        kind, bracket, rest = name.partition("[")
        return function, number, f"{_SHORT.get(kind, kind)}{bracket}{rest}"

    def input(self, node: Element | None) -> str:
        """Return the call that reads a signal."""
        function, number, _ = self._pin(node, _READ)
        return f"{function}({number})"

    def _pin(self, node: Element | None, functions: dict[str, str]) -> tuple[str, str, str]:
        target = self._references.target(node)
        name = "" if target is None else target.get("referencedName") or ""
        pins = self._installation.pins
        words = _PIN.fullmatch(pins.get(name, name))
        if words is None or words[1] not in functions:
            raise UnknownPartError(f"the signal {name or 'without a name'}")
        shown = next((one for one, pin in pins.items() if pin == words[0]), words[0])
        return functions[words[1]], words[2], shown
