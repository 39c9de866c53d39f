"""Writes the text of a script: indented blocks, and labels with the numbers of PolyScope's nodes."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType
from xml.etree.ElementTree import Element

from tvist_protocol.errors import short


class ScriptText:
    """Lines of URScript."""

    def __init__(self, numbers: Mapping[Element, int] = MappingProxyType({})) -> None:
        self.numbers = numbers  # PolyScope's numbers of the nodes
        self._lines: list[str] = []
        self._depth = 0

    def line(self, *lines: str) -> None:
        """Add lines at the present indentation; texts with line breaks become several lines."""
        indent = "  " * self._depth
        self._lines += [indent + part for line in lines for part in line.split("\n")]

    def label(self, node: Element, title: str, *lines: str) -> None:
        """Add the label of a node, then lines."""
        plain = "".join(c for c in title.replace('"', "'") if c.isprintable())
        plain = short(plain, 250)  # has fewer bytes than a text may have
        self.line(f'$ {self.numbers[node]} "{plain}"', *lines)

    @contextmanager
    def block(self, head: str, end: str = "end") -> Iterator[None]:
        """Add a block of lines added in the context; if `end` is empty, a following branch ends the block."""
        self.line(head)
        self._depth += 1
        yield
        self._depth -= 1
        if end:
            self.line(end)

    def __str__(self) -> str:
        return "".join(f"{line}\n" for line in self._lines)
