"""Translates programs saved by PolyScope to URScript, with PolyScope's labels."""

from collections.abc import Callable
from contextlib import nullcontext
from itertools import chain
from xml.etree.ElementTree import Element

from tvist_plant.user_file import UserFileError
from tvist_protocol.errors import short
from tvist_server.polyscope.contributed import EXTERNAL_CONTROL
from tvist_server.polyscope.expressions import UnknownPartError, script_name
from tvist_server.polyscope.installation import Installation
from tvist_server.polyscope.moves import TOWARDS
from tvist_server.polyscope.nodes import NONE, Choices, Nodes, inside
from tvist_server.polyscope.references import References
from tvist_server.polyscope.script_text import ScriptText

_HEADER_ENDS = "# HEADER_END"
_COUNTING = """global {0}=0
global {0}_rate=0
thread Timer_{0}():
  while (True):
    {0} = {0} + {0}_rate * get_steptime()
    sync()
  end
end
run Timer_{0}()"""  # for a timer


def script_of(
    name: str, tree: Element, installed: Callable[[str], Installation], choices: Choices = NONE
) -> str:
    """Return the text of a program from the content of its file; UserFileError if nodes cannot be translated.

    `installed` returns the installation of a name.
    """
    root, main = tree.find("./children"), tree.find("./children/MainProgram")
    if root is None or main is None or main.find("./children/*") is None:
        raise UserFileError("it has no program that can be read: save it in PolyScope as a script")
    begin, before, threads = map(root.findall, ("./InitVariablesNode", "./SpecialSequence", "./Thread"))
    references = References(tree)
    functions = _functions(root, references)
    parts = (*begin, *before, main, *threads, *functions.values())
    numbers = {node: number for number, node in enumerate(chain.from_iterable(map(inside, parts)), 1)}
    given = installed(tree.get("installation") or "default")
    nodes = Nodes(references, given, numbers, choices)
    text = nodes.text
    for title, function in functions.items():
        with text.block(f"def {title}():"):
            text.label(function, title)
            nodes.children(function)
    if main.get("InitVariablesNode") == "true":
        for variable in root.findall("./InitVariablesNode/variables/variable"):
            _initial(nodes, variable)
    for sequence in before:
        text.label(sequence, "BeforeStart")
        nodes.children(sequence)
    for thread in threads:
        title = script_name(thread.get("name") or "Thread")
        text.label(thread, title)
        with text.block(f"thread {title}():"):
            _repeated(nodes, thread, again=thread.get("runOnlyOnce") != "true")
        text.line(f"threadId_{title} = run {title}()")
    again = main.get("runOnlyOnce") == "false" and _acts(main)
    _repeated(nodes, main, again=again, label="Robot Program")
    if nodes.missing:
        found = ", ".join(dict.fromkeys(map(short, nodes.missing)))
        raise UserFileError(f"PolyScope saved it with {found}, which cannot be simulated")
    start = ScriptText()
    start.line(*given.start(), *(f"global {at}={value}" for at, value in nodes.moves.waypoints.items()))
    start.line(*(_COUNTING.format(timer) for timer in nodes.timers))
    if nodes.moves.has_directions:
        start.line(TOWARDS)
    return program_text(name, f"{start}{text}")


def _repeated(nodes: Nodes, part: Element, *, again: bool, label: str = "") -> None:
    """Translate a main program (it has a label) or a thread; `again`: inside an endless loop."""
    with nodes.text.block("while (True):") if again else nullcontext():
        if label:
            nodes.text.label(part, label)
        nodes.children(part)


def _initial(nodes: Nodes, variable: Element) -> None:
    try:
        name, value = nodes.expressions.variable(variable), nodes.expressions.text(variable)
    except UnknownPartError as error:
        nodes.missing.append(str(error))
        return
    if value:
        nodes.text.line(f"global {name}={value}")


def _functions(root: Element, references: References) -> dict[str, Element]:
    """Return the sub-programs of a file by their names in scripts."""
    found: dict[str, Element] = {}
    for one in root.findall("./SubProgram"):
        target = references.target(one)
        if target is not None and target.get("name"):
            found[script_name(target.get("name") or "")] = target
    return found


def _acts(main: Element) -> bool:
    """Return whether a program does more than define functions; if not, a loop around it would never wait."""
    return any(
        node.tag not in {"Comment", "MainProgram", "Folder", "SuppressedNode"}
        and not (node.tag == "Script" and _only_defines(node.findtext("cachedContents") or ""))
        for node in inside(main)
    )


def _only_defines(text: str) -> bool:
    from tvist_urscript import tree
    from tvist_urscript.errors import ScriptError
    from tvist_urscript.parsing import parse

    try:
        return bool(text) and all(isinstance(one, tree.Function) for one in parse(f"{text}\n"))
    except ScriptError:  # compiling it reports the error
        return False


def program_text(name: str, body: str) -> str:
    """Return a program with a body, named after a file."""
    title = "".join(letter if letter.isalnum() and letter.isascii() else "_" for letter in name)
    lines = "\n".join(f"  {line}" if line else "" for line in body.rstrip("\n").split("\n"))
    return f"def {title if title[:1].isalpha() else 'program'}():\n{lines}\nend\n"


def with_external_control(text: str, sent: str) -> str:
    """Replace External Control nodes by a client's text; its functions go first: they cannot be in loops."""
    header, mark, part = sent.partition(_HEADER_ENDS)
    if not mark:
        header, part = "", sent
    first, _, rest = text.partition("\n")
    return f"{first}\n{header}{mark}\n{rest.replace(EXTERNAL_CONTROL, part)}"
