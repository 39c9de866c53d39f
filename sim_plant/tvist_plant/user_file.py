"""Safe reading of users' files: endless devices, pipes, huge or deeply nested files cannot block or crash."""

import os
import re
import stat
import tomllib
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser

LARGEST = 4 << 20  # largest file size, a hundred times the largest useful one [bytes]
DEEPEST = 100
"""Deepest nesting of XML elements and TOML brackets, and most parts of a dotted TOML key, since the parser
takes quadratic time. TOML files need five levels."""
MOST_ELEMENTS = 50_000  # largest number of XML elements, six times that of the largest useful file
LONGEST_NAME = 100  # largest number of characters of a name
LONGEST_LINE = 500  # largest number of characters quoted from a file or a library's message


def named(error: BaseException, said: str | None = None) -> str:
    """Return an exception in one line: its type and its message, or `said` instead."""
    words = one_line(str(error) if said is None else said)
    return f"{type(error).__name__}: {words}" if words else type(error).__name__


def one_line(text: str) -> str:
    """Return a text in one printable line of limited length."""
    shown = " ".join(text.split())[:LONGEST_LINE]
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in shown)


class UserFileError(ValueError):
    """A file exists but has the wrong content; the message names the file and what was expected."""


def read_bytes(path: str | os.PathLike[str], what: str) -> bytes:
    """Read a file named by a user; `what` names its kind in messages, such as "robot file"."""
    # Opening a device may have effects, so check before; the file may be replaced meanwhile, so check again
    # afterwards. It may then be a pipe, so open without blocking.
    check_is_file(path, what)
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with open(descriptor, "rb") as stream:  # noqa: PTH123  a descriptor, not a path
        _check_kind(path, what, os.fstat(descriptor))
        content = stream.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise UserFileError(
            f"{what} {path} has more than {LARGEST >> 20} MiB, the largest size that is read: is it the right file?"
        )
    return content


def read_text(path: str | os.PathLike[str], what: str) -> str:
    """Read a text file named by a user."""
    try:
        return read_bytes(path, what).decode()
    except UnicodeDecodeError as error:
        raise UserFileError(
            f"{what} {path} is not text in UTF-8 ({error.reason} at byte {error.start})"
        ) from error


def read_toml(path: str | os.PathLike[str], what: str) -> dict[str, Any]:
    """Read a TOML file named by a user."""
    text = read_text(path, what)
    if _is_deeper(text, DEEPEST):
        raise UserFileError(f"{what} {path} is nested too deeply: at most {DEEPEST} levels are supported")
    return toml(text)


def toml(text: str) -> dict[str, Any]:
    """Parse TOML; raise only TOMLDecodeError."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except ValueError as error:
        raise tomllib.TOMLDecodeError("a number has too many digits") from error


def xml(data: bytes) -> Element:
    """Parse XML without a document type, whose entities could expand without end; raise UserFileError."""
    parser = XMLParser(target=_Tree())  # noqa: S314  see `_Tree`
    try:
        parser.feed(data)
        root: Element = parser.close()
    except UserFileError:
        raise
    except (ParseError, LookupError, ValueError) as error:  # the last two: unknown encoding
        raise UserFileError(f"it is not valid XML: {error}") from error
    return root


class _Tree(TreeBuilder):
    """Builder of XML elements that limits their depth and number."""

    depth = count = 0

    def start(self, tag: str, attrs: dict[str, str]) -> Element:
        self.depth, self.count = self.depth + 1, self.count + 1
        if self.count > MOST_ELEMENTS:
            raise UserFileError(f"it has too many elements: at most {MOST_ELEMENTS} are supported")
        if self.depth > DEEPEST:
            raise UserFileError(f"it is nested too deeply: at most {DEEPEST} levels are supported")
        return super().start(tag, attrs)

    def end(self, tag: str) -> Element:
        self.depth -= 1
        return super().end(tag)

    def doctype(self, *_: object) -> None:
        raise UserFileError("it has a document type, which it does not need: remove it")


def is_name(text: str) -> bool:
    """Return whether a text can be shown as a name: printable, and not too long."""
    return len(text) <= LONGEST_NAME and text.isprintable()


def check_is_file(path: str | os.PathLike[str], what: str) -> None:
    """Check that a path names a regular file."""
    _check_kind(path, what, Path(path).stat())


def _is_deeper(text: str, most: int) -> bool:
    """Return whether a TOML text has more than `most` levels of brackets or dots in a key."""
    depth = dots = 0
    for token in _TOKENS.finditer(text):
        match token[0]:
            case "[" | "{":
                depth, dots = depth + 1, 0
            case "]" | "}":
                depth, dots = depth - 1, 0
            case ".":
                dots += 1
            case "\n" | "," | "=":
                dots = 0
        if depth > most or dots > most:
            return True
    return False


_TOKENS = re.compile(
    r'"""(?:\\.|[^"\\]|"(?!""))*+(?:""")?'  # strings, which an invalid file may not terminate
    r"|'''(?:[^']|'(?!''))*+(?:''')?"
    r'|"(?:\\.|[^"\\\n])*+"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+"
    r"|[\[\]{}.,=\n]",
    re.DOTALL,
)
"""Tokens that affect the depth or hide such tokens; linear in the length of any text."""


def _check_kind(path: str | os.PathLike[str], what: str, status: os.stat_result) -> None:
    if stat.S_ISREG(status.st_mode):
        return
    kind = next((kind for is_kind, kind in _KINDS if is_kind(status.st_mode)), "something else")
    raise UserFileError(f"{what} {path} is {kind}, not a file")


_KINDS = (
    (stat.S_ISDIR, "a directory"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
)
