"""Translates programs saved by PolyScope to URScript, with PolyScope's labels."""

from collections.abc import Callable
from contextlib import nullcontext
from itertools import chain
from xml.etree.ElementTree import Element

from tvist_plant.user_file import UserFileError
from tvist_protocol.errors import short
from tvist_server.polyscope.contributed import EXTERNAL_CONTROL
from tvist_server.polyscope.expressions import UnknownPartError
from tvist_server.polyscope.installation import Installation, script_name
from tvist_server.polyscope.moves import TOWARDS
from tvist_server.polyscope.nodes import NONE, Choices, Nodes, children_of, inside
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
    references = References(tree)
    parts, functions = _parts(tree, references), _functions(tree, references)
    main = next((part for part in parts if part.tag == "MainProgram"), None)
    if main is None or not children_of(main):
        raise UserFileError("it has no program that can be read: save it in PolyScope as a script")
    numbers = {node: number for number, node in enumerate(chain.from_iterable(map(inside, parts)), 1)}
    given = installed(tree.get("installation") or "default")
    nodes = Nodes(references, given, numbers, choices)
    text = nodes.text
    for title, function in functions.items():
        with text.block(f"def {title}():"):
            text.label(function, title)
            nodes.children(function)
    if main.get("InitVariablesNode") == "true":
        for variable in tree.findall("./children/InitVariablesNode/variables/variable"):
            _initial(nodes, variable)
    for sequence in (part for part in parts if part.tag == "SpecialSequence"):
        text.label(sequence, "BeforeStart")
        nodes.children(sequence)
    for thread in (part for part in parts if part.tag == "Thread"):
        title = script_name(thread.get("name") or "Thread")
        text.label(thread, title)
        again = thread.get("runOnlyOnce") != "true" and _acts(thread, choices)
        with text.block(f"thread {title}():"), text.block("while (True):") if again else nullcontext():
            nodes.children(thread)
        text.line(f"threadId_{title} = run {title}()")
    again = main.get("runOnlyOnce") == "false" and _acts(main, choices)
    with text.block("while (True):") if again else nullcontext():
        text.label(main, "Robot Program")
        nodes.children(main)
    if nodes.missing:
        found = ", ".join(dict.fromkeys(map(short, nodes.missing)))
        raise UserFileError(f"PolyScope saved it with {found}, which cannot be simulated")
    if nodes.questions:
        raise UserFileError(f"it asks {'; '.join(dict.fromkeys(nodes.questions))}")
    start = ScriptText()
    start.line(*given.start(), *(f"global {at}={value}" for at, value in nodes.moves.waypoints.items()))
    start.line(*(_COUNTING.format(timer) for timer in nodes.timers))
    if nodes.moves.has_directions:
        start.line(TOWARDS)
    return program_text(name, f"{start}{text}")


def _initial(nodes: Nodes, variable: Element) -> None:
    try:
        name, value = nodes.expressions.variable(variable), nodes.expressions.text(variable)
    except UnknownPartError as error:
        nodes.missing.append(str(error))
        return
    if value:
        nodes.text.line(f"global {name}={value}")


def _parts(tree: Element, references: References) -> list[Element]:
    """Return the parts of a file in its order, as PolyScope numbers them: suppressed ones too."""
    listed = children_of(tree)
    shown = (one.find("suppressedNode") if one.tag == "SuppressedNode" else one for one in listed)
    return [part for part in dict.fromkeys(map(references.target, shown)) if part is not None]


def _functions(tree: Element, references: References) -> dict[str, Element]:
    """Return the sub-programs of a file by their names in scripts."""
    found: dict[str, Element] = {}
    for target in map(references.target, tree.findall("./children/SubProgram")):
        if target is None or not (name := target.get("name")):
            continue
        other = found.setdefault(script_name(name), target).get("name")
        if other != name:
            raise UserFileError(f"scripts have one name for its sub-programs {other} and {name}: rename one")
    return found


def _acts(node: Element, choices: Choices) -> bool:
    """Return whether a node does more than define functions; if not, a loop around it would never wait."""
    if node.tag in {"Comment", "Placeholder", "SubProgram", "SuppressedNode"} or choices.skips(node):
        return False
    if node.tag in {"MainProgram", "Thread", "Folder"}:
        return any(_acts(one, choices) for one in children_of(node))
    return node.tag != "Script" or not _only_defines(node.findtext("cachedContents") or "")


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
