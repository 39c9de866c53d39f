"""The nodes of a program saved by PolyScope, as URScript."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NoReturn
from xml.etree.ElementTree import Element

from tvist_protocol.errors import short
from tvist_server.polyscope import contributed
from tvist_server.polyscope.expressions import Expressions, UnknownPartError, quoted
from tvist_server.polyscope.installation import Installation, numbers, script_name
from tvist_server.polyscope.moves import DIRECTION, Moves
from tvist_server.polyscope.references import References
from tvist_server.polyscope.script_text import ScriptText

_OTHERS = "2147483647"  # case value of a Switch's default case
_TIMED = {"Start": "_rate = 1", "Stop": "_rate = 0", "Reset": " = 0"}  # what a Timer does to its variables
_ANSWERS: dict[str, tuple[str, Callable[[str], str]]] = {
    "Boolean": ("{0}=true or {0}=false", lambda text: {"true": "True", "false": "False"}[text.lower()]),
    "Integer": ("{0}=NUMBER, a whole number", lambda text: str(int(text))),
    "Float": ("{0}=NUMBER", lambda text: repr(numbers(text, 1)[0])),
    "String": ("{0}=TEXT", quoted),
}  # forms of answers of each type, and their translations
_TASK = {"selection", "wrench", "limitsForce", "limitsMotion"}  # what a Force node has
_POPUPS = {"Message": "False, False", "Warning": "True, False", "Error": "False, True"}


@dataclass(frozen=True)
class Choices:
    """What a user decides about a translation."""

    skip: frozenset[str] = frozenset()  # URCaps, or `URCap: node`, whose nodes are left out
    answers: Mapping[str, str] = field(default_factory=dict)  # operator's answers by the variables they go to
    used: set[str] = field(default_factory=set)  # names of `answers` that questions have used

    def skips(self, node: Element) -> bool:
        """Return whether a node is of a URCap that is left out."""
        names = {contributed.kind_of(node), node.get("strategyURCapName")}
        return node.tag == "Contributed" and not self.skip.isdisjoint(names)


NONE = Choices()


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
    """Translates nodes into `text`; `missing` and `questions` list what it cannot translate or answer, in order."""

    def __init__(
        self,
        references: References,
        installation: Installation,
        numbers_of: dict[Element, int],
        choices: Choices = NONE,
    ) -> None:
        self.text, self.missing, self.questions = ScriptText(numbers_of), list[str](), list[str]()
        self.timers: dict[str, None] = {}  # names of timers
        self._references, self._choices, self._home = references, choices, installation.home
        self._flags: dict[Element | None, str] = {}  # flags of Ifs checked continuously, by the next nodes
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
            "Timer": self._timer, "SafeHome": self._safe_home, "Contributed": self._contributed,
            "Move": moves.move, "Waypoint": moves.waypoint, "CircleMove": moves.circle, DIRECTION: moves.direction,
        }  # fmt: skip

    def children(self, node: Element) -> None:
        """Translate the nodes inside a node."""
        shown = [one for one in children_of(node) if one.tag != "SuppressedNode"]
        end = node if node.tag == "Folder" else None  # what follows a folder follows its last node
        self._following.update(pairwise([*shown, end]))
        suppressed_too = pairwise([*children_of(node), end])  # next to a Move, suppressed nodes count
        self._following.update(
            (one, after) for one, after in suppressed_too if one is not None and one.tag == "Move"
        )
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
        self.text.label(node, f"'{words}'" if words else "Comment")

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
            case "DigitalInput" | "AnalogInput":
                shown = condition = self.moves.input_is(node)
            case other:
                raise UnknownPartError(f"Wait ({other or 'without a type'})")
        self.text.label(node, f"Wait: {shown}")
        with self.text.block(f"while (not({condition})):"):
            self.text.line("sync()")

    def _popup(self, node: Element) -> None:
        if (kind := node.get("type") or "") not in _POPUPS:
            _refuse(node)
        message, halt = node.get("message") or "", ["halt"] if node.get("haltProgram") == "true" else []
        said = quoted(message)
        if node.get("inputType") == "Variable":
            said = f'str_cat("", {self.expressions.variable(node.find("variable"))})'
        call = f'popup({said}, "{kind}", {_POPUPS[kind]}, blocking={not halt})'
        self.text.label(node, f"Popup: {message}" if message else "Popup", call, *halt)

    def _assignment(self, node: Element) -> None:
        name = self.expressions.variable(node.find("variable"))
        source = node.get("valueSource") or "Expression"
        if source == "Operator":
            message = node.get("message") or ""
            shown, value = f"'{message}'", self._answer(name, node.get("valueType") or "", message)
        elif source == "Expression":
            shown, value = self.expressions.label(node), self.expressions.text(node)
        else:
            raise UnknownPartError(f"Assignment ({source})")
        self.text.label(node, f"{name}≔{shown}", f"global {name}={value}")

    def _answer(self, name: str, kind: str, message: str) -> str:
        """Return the answer of the operator as URScript; add to `questions` if there is none."""
        if kind not in _ANSWERS:
            raise UnknownPartError(f"a question ({kind or 'without a type'})")
        form, translate = _ANSWERS[kind]
        asked = f'"{short(message)}"' if message else f"for {name}"
        if (given := self._choices.answers.get(name)) is not None:
            self._choices.used.add(name)
            try:
                return translate(given)
            except (KeyError, ValueError):
                asked += f", but {name}={short(given)} is no answer"
        self.questions.append(f"{asked}: give --answer {form.format(name)}")
        return ""

    def _if(self, node: Element) -> None:
        kind, condition = node.get("type") or "If", self.expressions.text(node)
        following, flag = self._following[node], self._flags.get(node)
        other = f"if ({flag} == 0):" if flag else "else:"
        heads = {"If": f"if ({condition}):", "ElseIf": f"elif ({condition}):", "Else": other}
        if kind not in heads or (flag and kind == "ElseIf"):
            raise UnknownPartError(f"If ({kind})")
        title = f"{kind} {self.expressions.label(node)}"
        if kind == "If" and node.get("checkContinuously") == "true":
            number = self.text.numbers[node]
            flag = self._flags[following] = f"thread_flag_{number}"  # whether the thread has ended by itself
            self.text.label(node, title, f"global {flag}=0")
            with self.text.block(f"thread Thread_if_{number}():"):
                self.children(node)
                self.text.line(f"{flag} = 1")
            self._run_while(number, "if", condition, f"{flag} == 0 and ({condition})")
            return
        more = following is not None and following.tag == "If" and following.get("type") != "If"
        self._branch(node, heads[kind], title if kind == "If" else title.rstrip(), more=more)

    def _run_while(self, number: int, kind: str, starts: str, lasts: str) -> None:
        handler = f"thread_handler_{number}"
        with self.text.block(f"if ({starts}):"):
            self.text.line(f"global {handler}=run Thread_{kind}_{number}()")
            with self.text.block(f"while ({lasts}):"):
                self.text.line("sync()")
            self.text.line(f"kill {handler}")

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
        self._run_while(number, "while", condition, condition)

    def _switch(self, node: Element) -> None:
        self._switches += 1
        name, shown = f"switch_{self._switches}", self.expressions.label(node)
        self.text.label(node, f"Switch {shown}", f"{name} = {self.expressions.text(node)}")
        cases = [case for case in children_of(node) if case.tag == "Case"]
        cases.sort(key=lambda case: case.get("caseValue") == _OTHERS)  # `else` must be the last branch
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
        if numbers(node.get("payload") or "0", 1)[0]:
            raise UnknownPartError("Set (with a payload)")
        kind, title, lines = node.get("type"), "Set", list[str]()
        if kind in {"DigitalOutput", "ExpressionOutput"}:
            function, number, name = self.expressions.output(node.find("pin"))
            on = node.findtext("digitalValue") in {"1", "true"}
            value, shown = str(on), "On" if on else "Off"
            if kind == "ExpressionOutput":
                value, shown = self.expressions.text(node), self.expressions.label(node)
            title, lines = f"Set {name}={shown}", [f"{function}({number}, {value})"]
        elif kind != "NoAction":
            raise UnknownPartError(f"Set ({kind or 'without a type'})")
        if (tcp := node.find("tcp")) is not None:
            lines.append(self.moves.tcp(tcp))
        self.text.label(node, title, *lines)

    def _timer(self, node: Element) -> None:
        name, action = self.expressions.variable(node.find("variable")), node.get("action") or ""
        if action not in _TIMED:
            raise UnknownPartError(f"Timer ({action or 'without an action'})")
        self.timers[name] = None
        self.text.label(node, f"{name}: {action}", name + _TIMED[action])

    def _safe_home(self, node: Element) -> None:
        if self._home is None or node.get("positionOptionType") != "SPEED_AND_ACCELERATION":
            raise UnknownPartError("SafeHome (without a position or speed)")
        speed, acceleration = (numbers(node.get(name), 1)[0] for name in ("speed", "acceleration"))
        self.text.label(node, "Home", f"movej({list(self._home)}, a={acceleration}, v={speed})")

    def _force(self, node: Element) -> None:
        if all(one.tag == "Placeholder" for one in children_of(node)):
            return
        parts = {part.tag: numbers(part.get("value"), 6) for part in node if part.get("value")}
        if node.get("type") not in {"Frame", "Simple"} or not parts.keys() >= _TASK:
            _refuse(node)
        name, frame = self.moves.feature(node.find("feature"))
        chosen = [int(axis) for axis in parts["selection"]]
        limits = [parts["limitsForce" if on else "limitsMotion"][axis] for axis, on in enumerate(chosen)]
        frame = "tool_pose()" if name == "Tool" else frame
        call = f"force_mode({frame}, {chosen}, {list(parts['wrench'])}, 2, {limits})"
        self._forced(node, "Force", "sleep(0.02)", "zero_ftsensor()", call)

    def _forced(self, node: Element, title: str, *start: str) -> None:
        self.text.label(node, title, *start)
        self.children(node)
        self.text.line("end_force_mode()", "stopl(5.0)")

    def _contributed(self, node: Element) -> None:
        kind, following = contributed.kind_of(node), self._following[node]
        title = node.get("strategyProgramNodeType") or "URCap"
        if self._choices.skips(node):
            return
        if (lines := contributed.lines_of(node)) is not None:
            self.text.label(node, title, *lines)
        elif (task := contributed.force_task(node)) is not None:
            self._forced(node, title, task)
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


def _refuse(node: Element) -> NoReturn:
    kind = node.get("type")
    raise UnknownPartError(node.tag if kind is None else f"{node.tag} ({kind})")
