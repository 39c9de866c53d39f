"""The fenced blocks of a page."""

import re
import textwrap

FENCE = re.compile(
    r"^(?P<indent> *)```(?P<kind>\w*)\n(?P<text>.*?)^(?P=indent)```$", re.MULTILINE | re.DOTALL
)


def fences(text):
    """Return kind and text of each fenced block."""
    return [(match["kind"], textwrap.dedent(match["text"])) for match in FENCE.finditer(text)]
