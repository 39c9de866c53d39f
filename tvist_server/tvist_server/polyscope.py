"""Programs that PolyScope has saved, as text in URScript.

A saved program is XML. Its nodes Script, Wait and External Control are understood; others would change what the program
does, so a program that has them is refused.
"""

from xml.etree import ElementTree as ET

from tvist_plant.user_file import UserFileError, xml

EXTERNAL_CONTROL = (
    'popup("Play this program from the machine that controls it.", title="External Control", blocking=True)'
)
"""Line that stands for a node External Control until the program is played; see `with_external_control`."""
_NODE = "com.fzi.externalcontrol.ExternalControlNode"
_HEADER_ENDS = "# HEADER_END"


class PolyscopeError(ValueError):
    """A program of PolyScope cannot be played; the message says why."""


def script_of(name: str, data: bytes) -> str:
    """Return the text of a program.

    Args:
        name: Name of the program.
        data: Its XML.

    Raises:
        PolyscopeError: It is not XML, or has nodes that are not understood.
    """
    try:
        main = xml(data).find("./children/MainProgram")
    except UserFileError as error:
        raise PolyscopeError(str(error)) from error
    nodes = [] if main is None else main.findall("./children/*")
    texts = [_text(node) for node in nodes]
    if main is None or not nodes or None in texts:
        found = ", ".join(node.tag for node in nodes) or "none"
        raise PolyscopeError(
            f"it is PolyScope's and has the nodes {found}: only Script, Wait for a time and External Control can be "
            "played; save it as a script"
        )
    body = "\n".join(text for text in texts if text is not None)
    if main.get("runOnlyOnce") == "false":
        body = f"while True:\n{body}\nend"
    return program(name, body)


def program(name: str, body: str) -> str:
    """Return a program with a body, named after a file."""
    title = "".join(letter if letter.isalnum() and letter.isascii() else "_" for letter in name)
    return f"def {title if title[:1].isalpha() else 'program'}():\n{body}\nend\n"


def with_external_control(text: str, sent: str) -> str:
    """Put the text that a client has sent in the place of the nodes External Control.

    Its header comes first in the program, since its functions may not stand inside a loop.

    Args:
        text: Text of the program.
        sent: Text that the client has sent: a header that ends with the line `# HEADER_END`, and the node's own part.
    """
    header, mark, part = sent.partition(_HEADER_ENDS)
    if not mark:
        header, part = "", sent
    first, _, rest = text.partition("\n")
    return f"{first}\n{header}{mark}\n{rest.replace(EXTERNAL_CONTROL, part)}"


def _text(node: ET.Element) -> str | None:
    """Text of a node; None if it is not understood."""
    if node.tag == "Contributed" and node.get("strategyClass") == _NODE:
        return EXTERNAL_CONTROL
    if node.tag == "Wait" and node.get("type") == "Sleep":
        return _sleep(node.findtext("waitTime"))
    if node.tag.lower() != "script":
        return None
    characters = [letter.get("character") or "" for letter in node.iterfind("./expression/ExpressionChar")]
    parts = ["".join(characters), node.findtext("cachedContents"), node.findtext("text"), node.text]
    text = next((part for part in parts if part), "")
    if not text.strip():
        raise PolyscopeError("it has a Script node without text: save the script itself")
    return text


def _sleep(seconds: str | None) -> str | None:
    try:
        return f"sleep({float(seconds or ''):g})"
    except ValueError:
        return None
