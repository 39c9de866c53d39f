"""What is wrong with a script, without running it."""

from tvist_urscript.compiler import translate
from tvist_urscript.errors import ScriptError
from tvist_urscript.signatures import Signatures


def check(text: str, signatures: Signatures) -> list[ScriptError]:
    """Return the errors of a script in the order of the text, empty where it can run.

    Of a text that is no program it is one, the first token that does not fit; of a program all unknown names and all
    calls that do not fit their functions.
    """
    return translate(text, signatures)[1]
