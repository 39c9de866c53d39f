"""The nodes of a program saved by PolyScope, as URScript."""

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import NoReturn
from xml.etree.ElementTree import Element

from tvist_server.polyscope import contributed
from tvist_server.polyscope.expressions import Expressions, UnknownPartError, script_name
from tvist_server.polyscope.installation import Installation, numbers
from tvist_server.polyscope.moves import DIRECTION, Moves
from tvist_server.polyscope.references import References
from tvist_server.polyscope.script_text import ScriptText

_OTHERS = "2147483647"  # case value of a Switch's default case
_POPUPS = {"Message": "False, False", "Warning": "True, False", "Error": "False, True"}


def children_of(node: Element) -> list[Element]:
    """Return the nodes inside a node."""
    return node.findall("./children/*")


def inside(node: Element) -> Iterator[Element]:
    """Yield a node and all nodes inside it, suppressed ones too, in the order of their numbers."""
    todo = [node]
    while todo:
        yield (one := todo.pop())
        hidden = one.find("suppressedNode")
        parts = children_of(one) if hidden is None else children_of(hidden)
        todo += reversed([part for part in parts if part.tag != "SubProgram"])


class Nodes:
    """Translates nodes into `text`; `missing` lists what it cannot translate, in order."""

    def __init__(
        self,
        references: References,
        installation: Installation,
        numbers_of: dict[Element, int],
        skip: frozenset[str] = frozenset(),
    ) -> None:
        self.text, self.missing = ScriptText(numbers_of), list[str]()
        self._references, self._skip = references, skip
        self._following: dict[Element | None, Element | None] = {}  # next node of each node
        self.expressions = Expressions(references, installation)
        self._switches, self._grip = 0, ""  # Switch nodes so far; condition of the present Grip Check
        self.moves = moves = Moves(
            self.text, self.expressions, references, installation, self._following, self.children
        )
        self._kinds: dict[str, Callable[[Element], object]] = {
            "Placeholder": lambda _: None, "SubProgram": lambda _: None,  # defined before the program
            "Halt": lambda node: self.text.label(node, "Halt", "halt"), "Folder": self._folder,
            "Comment": self._comment, "Script": self._script, "Wait": self._wait,
            "Popup": self._popup, "Assignment": self._assignment, "If": self._if, "Loop": self._loop,
            "Switch": self._switch, "Set": self._set, "Force": self._force, "CallSubProgram": self._call,
            "Contributed": self._contributed, "Move": moves.move, "Waypoint": moves.waypoint,
            "CircleMove": moves.circle, DIRECTION: moves.direction,
        }  # fmt: skip

    def children(self, node: Element) -> None:
        """Translate the nodes inside a node."""
        shown = [one for one in children_of(node) if one.tag != "SuppressedNode"]
        self._following.update(pairwise([*shown, None]))
        for one in shown:
            try:
                self._kinds.get(one.tag, _refuse)(one)
            except UnknownPartError as error:
                self.missing.append(str(error))
            except ValueError as error:
                self.missing.append(f"{one.tag} with {error}")

    def _branch(self, node: Element, head: str, title: str, *, more: bool) -> None:
        """Translate a branch; `more`: others follow. The label is before `if`, inside `elif` and `else`."""
        first = head.startswith("if ")
        if first:
            self.text.label(node, title)
        with self.text.block(head, "" if more else "end"):
            if not first:
                self.text.label(node, title)
            self.children(node)

    # ------------------------------------------------------------------ flow

    def _folder(self, node: Element) -> None:
        self.text.label(node, node.get("name") or "Folder")
        self.children(node)

    def _comment(self, node: Element) -> None:
        words = " ".join((node.get("comment") or "").split())
        self.text.label(node, f"'{words}'")

    def _script(self, node: Element) -> None:
        if node.find("./expression/*") is not None:
            self.text.label(node, self.expressions.label(node), self.expressions.text(node))
            return
        content = node.findtext("cachedContents") or node.findtext("text") or node.text or ""
        if not content.strip():
            raise UnknownPartError("a Script without text")
        file = (node.findtext("file") or "").rpartition("/")[2]
        self.text.label(node, f"Script: {file}", content.rstrip("\n"))

    def _wait(self, node: Element) -> None:
        match node.get("type"):
            case "Sleep":
                seconds = repr(numbers(node.findtext("waitTime"), 1)[0])
                self.text.label(node, f"Wait: {seconds}", f"sleep({seconds})")
                return
            case "Condition":
                shown, condition = self.expressions.label(node), self.expressions.text(node)
            case "DigitalInput":
                shown = condition = self.moves.input_is(node)
            case other:
                raise UnknownPartError(f"Wait ({other or 'without a type'})")
        self.text.label(node, f"Wait: {shown}")
        with self.text.block(f"while (not({condition})):"):
            self.text.line("sync()")

    def _popup(self, node: Element) -> None:
        if (kind := node.get("type") or "") not in _POPUPS:
            _refuse(node)
        message = " ".join((node.get("message") or "").replace('"', "'").split())
        call = f'popup("{message}", "{kind}", {_POPUPS[kind]}, blocking=True)'
        halt = ["halt"] if node.get("haltProgram") == "true" else []
        self.text.label(node, f"Popup: {message}", call, *halt)

    def _assignment(self, node: Element) -> None:
        name = self.expressions.variable(node.find("variable"))
        source = node.get("valueSource") or "Expression"
        if source != "Expression":
            raise UnknownPartError(f"Assignment ({source})")
        shown = f"{name}≔{self.expressions.label(node)}"
        self.text.label(node, shown, f"global {name}={self.expressions.text(node)}")

    def _if(self, node: Element) -> None:
        if node.get("checkContinuously") == "true":
            raise UnknownPartError("an If that checks its condition continuously")
        kind, condition = node.get("type") or "If", self.expressions.text(node)
        heads = {"If": f"if ({condition}):", "ElseIf": f"elif ({condition}):", "Else": "else:"}
        if kind not in heads:
            raise UnknownPartError(f"If ({kind})")
        following = self._following[node]
        more = following is not None and following.tag == "If" and following.get("type") != "If"
        title = f"{kind} {self.expressions.label(node)}"
        self._branch(node, heads[kind], title if kind == "If" else title.rstrip(), more=more)

    def _loop(self, node: Element) -> None:
        match node.get("type"):
            case "Forever":
                self.text.label(node, "Loop")
                with self.text.block("while (True):"):
                    self.children(node)
            case "Counting":
                count = int(numbers(node.get("count"), 1)[0])
                name = self.expressions.variable(node.find("loopVariable"))
                self.text.label(node, f"Loop {count} times", f"{name} = 0")
                with self.text.block(f"while ({name} < {count}):"):
                    self.children(node)
                    self.text.line(f"{name} = {name} + 1")
            case "While":
                self.text.label(node, f"Loop {self.expressions.label(node)}")
                self._while(node)
            case other:
                raise UnknownPartError(f"Loop ({other or 'without a type'})")

    def _while(self, node: Element) -> None:
        condition, number = self.expressions.text(node), self.text.numbers[node]
        if node.get("checkContinuously") != "true":
            with self.text.block(f"while ({condition}):"):
                self.children(node)
            return
        with self.text.block(f"thread Thread_while_{number}():"), self.text.block("while (True):"):
            self.children(node)
            self.text.line("sync()")
        with self.text.block(f"if ({condition}):"):
            self.text.line(f"global thread_handler_{number}=run Thread_while_{number}()")
            with self.text.block(f"while ({condition}):"):
                self.text.line("sync()")
            self.text.line(f"kill thread_handler_{number}")

    def _switch(self, node: Element) -> None:
        self._switches += 1
        name, shown = f"switch_{self._switches}", self.expressions.label(node)
        self.text.label(node, f"Switch {shown}", f"{name} = {self.expressions.text(node)}")
        cases = [case for case in children_of(node) if case.tag == "Case"]
        for place, case in enumerate(cases):
            value = case.get("caseValue") or ""
            if value == _OTHERS and place:
                head, title = "else:", "Default Case"
            else:
                number = int(numbers(value, 1)[0])
                head, title = f"{'elif' if place else 'if'} ({number} == {name}):", f"Case {number}"
            self._branch(case, head, title, more=case is not cases[-1])

    def _call(self, node: Element) -> None:
        target = self._references.target(node.find("subprogram"))
        name = "" if target is None else target.get("name") or ""
        if not name:
            raise UnknownPartError("a call of a sub-program that is not in the file")
        self.text.label(node, f"Call {script_name(name)}", f"{script_name(name)}()")

    # ------------------------------------------------------------------ robot

    def _set(self, node: Element) -> None:
        match node.get("type"):
            case "NoAction":
                self.text.label(node, "Set")
            case "DigitalOutput":
                function, number, shown = self.expressions.output(node.find("pin"))
                on = node.findtext("digitalValue") in {"1", "true"}
                title = f"Set {shown}={'On' if on else 'Off'}"
                self.text.label(node, title, f"{function}({number}, {on})")
            case other:
                raise UnknownPartError(f"Set ({other or 'without a type'})")

    def _force(self, node: Element) -> None:
        if node.get("type") != "Frame":
            _refuse(node)
        name, frame = self.moves.feature(node.find("feature"))
        parts = {
            tag: numbers(_value(node, tag), 6)
            for tag in ("selection", "wrench", "limitsForce", "limitsMotion")
        }
        chosen = [int(axis) for axis in parts["selection"]]
        limits = [
            force if axis else motion
            for axis, force, motion in zip(chosen, parts["limitsForce"], parts["limitsMotion"], strict=True)
        ]
        frame = "tool_pose()" if name == "Tool" else frame
        call = f"force_mode({frame}, {chosen}, {list(parts['wrench'])}, 2, {limits})"
        self.text.label(node, "Force", "sleep(0.02)", "zero_ftsensor()", call)
        self.children(node)
        self.text.line("end_force_mode()", "stopl(5.0)")

    def _contributed(self, node: Element) -> None:
        kind, following = contributed.kind_of(node), self._following[node]
        title = node.get("strategyProgramNodeType") or "URCap"
        if kind in self._skip or node.get("strategyURCapName") in self._skip:
            return
        if (lines := contributed.lines_of(node)) is not None:
            self.text.label(node, title, *lines)
        elif (branch := contributed.branch_of(node)) is None:
            raise UnknownPartError(kind)
        elif not branch:
            self._grip = contributed.detection(node)
            self.text.label(node, title)
            self.children(node)
        elif not self._grip:
            raise UnknownPartError(f"{kind} outside a Grip Check")
        else:
            head, shown = (f"if ({self._grip}):", f"If {self._grip}") if branch == "if" else ("else:", "Else")
            more = following is not None and contributed.branch_of(following) == "else"
            self._branch(node, head, shown, more=more)


def _value(node: Element, tag: str) -> str:
    found = node.find(tag)
    return "" if found is None else found.get("value") or ""


def _refuse(node: Element) -> NoReturn:
    kind = node.get("type")
    raise UnknownPartError(node.tag if kind is None else f"{node.tag} ({kind})")
