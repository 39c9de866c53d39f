"""Translates programs saved by PolyScope (XML) to URScript; one with unknown nodes is refused."""

from tvist_plant.user_file import UserFileError, xml
from tvist_protocol.errors import short
from tvist_server.polyscope_nodes import EXTERNAL_CONTROL, Nodes

_HEADER_ENDS = "# HEADER_END"


def script_of(name: str, data: bytes) -> str:
    """Return the text of a program; raise UserFileError if it is not XML or has unknown nodes."""
    tree = xml(data)
    main = tree.find("./children/MainProgram")
    if main is None or main.find("./children/*") is None:
        raise UserFileError("it is PolyScope's and has no program: save it as a script")
    nodes, root = Nodes(tree), tree.find("./children")
    assert root is not None, "the main program was found in it"
    lines: list[str] = []
    if main.get("InitVariablesNode") == "true":
        lines += nodes.values(root.findall("./InitVariablesNode/variables/variable"))
    for thread in root.findall("./Thread"):
        title = _name(thread.get("name") or "thread")
        body = "\n".join(nodes.lines(thread.findall("./children/*")))
        lines += [f"thread {title}():", body if thread.get("runOnlyOnce") == "true" else _again(body), "end"]
    for before in root.findall("./SpecialSequence"):
        lines += nodes.lines(before.findall("./children/*"))
    lines += [f"run {_name(thread.get('name') or 'thread')}()" for thread in root.findall("./Thread")]
    body = "\n".join(nodes.lines(main.findall("./children/*")))
    if nodes.missing:
        found = short(", ".join(dict.fromkeys(nodes.missing)))
        raise UserFileError(f"it is PolyScope's and has {found}, which cannot be played; save it as a script")
    repeats = main.get("runOnlyOnce") == "false" and not _only_defines(body)
    lines.append(_again(body) if repeats else body)
    return program(name, "\n".join(lines))


def program(name: str, body: str) -> str:
    """Return a program with a body, named after a file."""
    title = "".join(letter if letter.isalnum() and letter.isascii() else "_" for letter in name)
    return f"def {title if title[:1].isalpha() else 'program'}():\n{body}\nend\n"


def with_external_control(text: str, sent: str) -> str:
    """Replace the External Control nodes by a client's text; its header goes first, as functions cannot be in loops."""
    header, mark, part = sent.partition(_HEADER_ENDS)
    if not mark:
        header, part = "", sent
    first, _, rest = text.partition("\n")
    return f"{first}\n{header}{mark}\n{rest.replace(EXTERNAL_CONTROL, part)}"


def _only_defines(body: str) -> bool:
    """Return whether a text contains only definitions: repeating it would compute for ever without any effect."""
    from tvist_urscript import tree
    from tvist_urscript.errors import ScriptError
    from tvist_urscript.parsing import parse

    try:
        statements = parse(f"{body}\n") if EXTERNAL_CONTROL not in body else [None]
        return all(isinstance(one, tree.Function) for one in statements)
    except ScriptError:  # compiling it reports the error
        return False


def _again(body: str) -> str:
    return f"while True:\n{body}\nend"


def _name(title: str) -> str:
    name = "".join(letter if letter.isalnum() and letter.isascii() else "_" for letter in title)
    return name if name[:1].isalpha() else f"program_{name}".rstrip("_")
